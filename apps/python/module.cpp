// The Python module osteo._osteo: values and stages. Everything that is made from declarations is made in osteo/__init__.py.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <mutex>

#include "osteo/pipeline/formats.h"
#include "osteo/stages/registry.h"

namespace py = pybind11;

namespace {

using osteo::Data;
using osteo::DataKind;

/// Memory of numpy for as long as a value of ours needs it. The last owner may be any thread.
template <class T>
std::shared_ptr<const T[]> borrowed(const py::array& array) {
  auto* const object = array.inc_ref().ptr();
  return {static_cast<const T*>(array.data()), [object](const T*) {
            const py::gil_scoped_acquire gil;
            Py_DECREF(object);
          }};
}

/// Memory of ours as a numpy array that cannot be written and keeps it alive. No copy.
template <class T, class Owner>
py::array view(Owner owner, const T* data, std::vector<py::ssize_t> shape) {
  const py::capsule keep(new Owner(std::move(owner)), [](void* p) { delete static_cast<Owner*>(p); });
  py::array array(py::dtype::of<T>(), std::move(shape), data, keep);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

osteo::Vec3 vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}
std::array<double, 3> triple(osteo::Vec3 v) {
  return {v.x, v.y, v.z};
}
using Rows = std::array<std::array<double, 3>, 3>;

/// Takes the voxels of `array` as they lie. Another type or order of memory is refused: a copy is the caller's to make.
template <class T, class V>
V volume_of(const py::array& array, std::array<double, 3> spacing_mm, std::array<double, 3> origin_mm, Rows direction) {
  if (!py::isinstance<py::array_t<T>>(array) || array.ndim() != 3 || !(array.flags() & py::array::c_style) ||
      !(array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_)) {
    const std::string name = py::str(py::dtype::of<T>());
    throw osteo::Error(osteo::ExitCode::usage, "voxels must be an aligned, C-contiguous array of " + name + " with three axes (z, y, x)",
                       "numpy.ascontiguousarray(voxels, dtype='" + name + "') makes one");
  }
  V v;
  for (int i = 0; i < 3; ++i) v.frame.dims[static_cast<std::size_t>(i)] = static_cast<int>(array.shape(2 - i));
  v.frame.spacing_mm = vec(spacing_mm);
  v.frame.origin_mm = vec(origin_mm);
  for (std::size_t c = 0; c < 3; ++c) v.frame.direction.column[c] = {direction[0][c], direction[1][c], direction[2][c]};
  osteo::require_valid(v.frame);
  v.voxels = borrowed<T>(array);
  return v;
}

template <class C>
void frame_members(C& c) {
  using V = typename C::type;
  c.def_property_readonly(
      "spacing_mm", [](const V& v) { return triple(v.frame.spacing_mm); }, "Edges of a voxel, x, y, z");
  c.def_property_readonly(
      "origin_mm", [](const V& v) { return triple(v.frame.origin_mm); }, "Centre of the first voxel, LPS");
  c.def_property_readonly(
      "direction",
      [](const V& v) {
        Rows r{};
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) r[i][j] = v.frame.direction.column[j][i];
        return r;
      },
      "Rows of the matrix whose columns are where the axes of the grid point");
  c.def_property_readonly(
      "shape",
      [](const V& v) {
        return std::array<int, 3>{v.frame.dims[2], v.frame.dims[1], v.frame.dims[0]};
      },
      "z, y, x");
}

template <class T, class V>
void volume(py::module_& m, const char* name, const char* doc) {
  py::class_<V> c(m, name, doc);
  c.def(py::init(&volume_of<T, V>), py::arg("voxels"), py::arg("spacing_mm") = std::array<double, 3>{1, 1, 1},
        py::arg("origin_mm") = std::array<double, 3>{0, 0, 0}, py::arg("direction") = Rows{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
  c.def_property_readonly(
      "voxels",
      [](const V& v) {
        return view<T>(v.voxels, v.voxels.get(), {v.frame.dims[2], v.frame.dims[1], v.frame.dims[0]});
      },
      "(z, y, x), read-only, the value's own memory");
  frame_members(c);
}

Data data_of(const py::handle& h, const osteo::Port& port) {
  if (h.is_none()) return {};
  if (py::isinstance<osteo::Labels>(h)) return h.cast<osteo::Labels>();
  if (py::isinstance<osteo::Image>(h)) return h.cast<osteo::Image>();
  if (py::isinstance<osteo::SparseGrid>(h)) return h.cast<osteo::SparseGrid>();
  if (py::isinstance<osteo::TriMesh>(h)) return osteo::Surface(h.cast<std::shared_ptr<osteo::TriMesh>>());
  if (py::isinstance<osteo::TetMesh>(h)) return osteo::Tets(h.cast<std::shared_ptr<osteo::TetMesh>>());
  if (py::hasattr(h, "__fspath__") || py::isinstance<py::str>(h)) {
    const std::string path = py::str(py::module_::import("os").attr("fspath")(h));
    return osteo::load_data(path, port.kinds);
  }
  throw osteo::Error(osteo::ExitCode::usage, "'" + port.name + "' takes " + osteo::kinds_text(port.kinds) + " or a path, not " +
                                                 std::string(py::str(py::type::handle_of(h).attr("__name__"))));
}

py::object object_of(const Data& data) {
  switch (osteo::kind_of(data)) {
    case DataKind::none:
      return py::none();
    case DataKind::source:
      return py::module_::import("pathlib").attr("Path")(std::get<osteo::Source>(data).path.string());
    case DataKind::image:
      return py::cast(std::get<osteo::Image>(data));
    case DataKind::labels:
      return py::cast(std::get<osteo::Labels>(data));
    case DataKind::grid:
      return py::cast(std::get<osteo::SparseGrid>(data));
    // Python sees nothing of these that can be written.
    case DataKind::surface:
      return py::cast(std::const_pointer_cast<osteo::TriMesh>(std::get<osteo::Surface>(data)));
    case DataKind::tets:
      return py::cast(std::const_pointer_cast<osteo::TetMesh>(std::get<osteo::Tets>(data)));
    case DataKind::picture: {
      const auto picture = std::make_shared<osteo::Picture>(std::get<osteo::Picture>(data));
      return view<std::uint8_t>(picture, picture->rgb.data(), {picture->height, picture->width, 3});
    }
    case DataKind::document:
      return py::module_::import("json").attr("loads")(std::get<osteo::Document>(data).json);
  }
  return py::none();
}

py::object default_of(const osteo::FieldRef& f) {
  return std::visit(
      [](const auto& t) -> py::object {
        if constexpr (std::is_same_v<std::decay_t<decltype(t)>, osteo::FieldRef::Choice>)
          return py::str(std::string(t.names[static_cast<std::size_t>(*t.index)]));
        else
          return py::cast(*t);
      },
      f.target);
}

void set(const osteo::FieldRef& f, const py::handle& value) {
  const std::string name(f.doc.name);
  const auto wrong = [&](const char* what) {
    throw osteo::Error(osteo::ExitCode::usage, name + " takes " + what + ", not " + std::string(py::repr(value)));
  };
  if (auto* const* flag = std::get_if<bool*>(&f.target)) {
    if (!py::isinstance<py::bool_>(value)) wrong("True or False");
    **flag = value.cast<bool>();
  } else if (auto* const* text = std::get_if<std::string*>(&f.target)) {
    if (!py::isinstance<py::str>(value)) wrong("a text");
    **text = value.cast<std::string>();
  } else if (py::isinstance<py::bool_>(value)) {
    wrong("no flag");
  } else if (!py::isinstance<py::str>(value) && py::isinstance<py::iterable>(value)) {
    std::string joined;
    for (const auto& v : value) joined += (joined.empty() ? "" : ",") + std::string(py::str(v));
    f.from_text(joined, name);
  } else {
    f.from_text(std::string(py::str(value)), name);
  }
}

py::list declarations() {
  py::list all;
  const osteo::Registry registry = osteo::osteo_stages();
  const auto ports = [](const std::vector<osteo::Port>& from) {
    py::list out;
    for (const osteo::Port& p : from) {
      py::list kinds;
      for (const DataKind k : p.kinds) kinds.append(std::string(osteo::kind_name(k)));
      out.append(py::dict(py::arg("name") = p.name, py::arg("kinds") = kinds, py::arg("help") = p.help, py::arg("optional") = p.optional));
    }
    return out;
  };
  for (const std::string& name : registry.names()) {
    const auto stage = registry.make(name);
    const osteo::StageInfo& info = stage->info();
    py::list fields;
    for (const osteo::FieldRef& f : stage->fields()) {
      py::list choices;
      if (const auto* c = std::get_if<osteo::FieldRef::Choice>(&f.target))
        for (const auto& n : c->names) choices.append(std::string(n));
      fields.append(py::dict(py::arg("name") = std::string(f.doc.name), py::arg("help") = std::string(f.doc.help),
                             py::arg("unit") = std::string(f.doc.unit), py::arg("lo") = f.doc.lo, py::arg("hi") = f.doc.hi,
                             py::arg("kind") = std::string(f.kind()), py::arg("choices") = choices, py::arg("default") = default_of(f)));
    }
    all.append(py::dict(py::arg("name") = info.name, py::arg("synopsis") = info.synopsis, py::arg("description") = info.description,
                        py::arg("inputs") = ports(info.inputs), py::arg("outputs") = ports(info.outputs), py::arg("fields") = fields));
  }
  return all;
}

/// Outputs in the order of their ports, the report, warnings.
py::tuple run(const std::string& name, const py::sequence& inputs, const py::dict& params, int threads, std::uint64_t seed) {
  static const osteo::Registry registry = osteo::osteo_stages();
  const auto stage = registry.make(name);
  const auto fields = stage->fields();
  for (const auto& [key, value] : params) {
    const std::string wanted = py::str(key);
    const auto field = std::find_if(fields.begin(), fields.end(), [&](const osteo::FieldRef& f) { return f.doc.name == wanted; });
    if (field == fields.end()) throw osteo::Error(osteo::ExitCode::usage, "stage '" + name + "' has no parameter '" + wanted + "'");
    set(*field, value);
  }
  osteo::Context context;
  context.threads = threads;
  context.seed = seed;
  std::mutex mutex;
  std::vector<std::string> warnings;
  context.on_log([&](osteo::LogLevel level, std::string_view text) {
    if (level != osteo::LogLevel::warning) return;
    const std::lock_guard lock(mutex);
    warnings.emplace_back(text);
  });
  std::vector<Data> in;
  for (std::size_t i = 0; i < stage->info().inputs.size(); ++i) in.push_back(data_of(inputs[i], stage->info().inputs[i]));
  std::vector<Data> out;
  {
    const py::gil_scoped_release free;
    out = stage->run(in, context);
    in.clear();
  }
  py::list values;
  for (const Data& d : out) values.append(object_of(d));
  py::dict report;
  for (const auto& [key, value] : context.take_report()) report[py::str(key)] = py::cast(value);
  return py::make_tuple(values, report, warnings);
}

}  // namespace

PYBIND11_MODULE(_osteo, m) {
  // numpy first: without it nothing here can be used.
  py::module_::import("numpy");
  volume<std::int16_t, osteo::Image>(
      m, "Image", "CT in Hounsfield units. Shares the memory of the array it is made of, which must not change afterwards");
  volume<std::uint8_t, osteo::Labels>(
      m, "Labels", "Label map, 0 is background. Shares the memory of the array it is made of, which must not change afterwards");

  py::class_<osteo::SparseGrid> grid(m, "Grid", "Sparse grid of a stage");
  frame_members(grid);
  grid.def_property_readonly("name", [](const osteo::SparseGrid& g) { return g.name; });
  grid.def_property_readonly("background", [](const osteo::SparseGrid& g) { return g.background; });
  grid.def_property_readonly("active_voxels", [](const osteo::SparseGrid& g) { return g.active_voxels; });

  using Mesh = std::shared_ptr<osteo::TriMesh>;
  py::class_<osteo::TriMesh, Mesh>(m, "Surface", "Triangles in LPS millimetres")
      .def_property_readonly(
          "points_mm",
          [](const Mesh& s) {
            return view<float>(s, reinterpret_cast<const float*>(s->points_mm.data()), {static_cast<py::ssize_t>(s->points_mm.size()), 3});
          })
      .def_property_readonly(
          "normals",
          [](const Mesh& s) {
            return view<float>(s, reinterpret_cast<const float*>(s->normals.data()), {static_cast<py::ssize_t>(s->normals.size()), 3});
          })
      .def_property_readonly("triangles", [](const Mesh& s) {
        return view<std::uint32_t>(s, reinterpret_cast<const std::uint32_t*>(s->triangles.data()),
                                   {static_cast<py::ssize_t>(s->triangles.size()), 3});
      });
  using Tetrahedra = std::shared_ptr<osteo::TetMesh>;
  py::class_<osteo::TetMesh, Tetrahedra>(m, "Tets", "Tetrahedra in LPS millimetres")
      .def_property_readonly(
          "points_mm",
          [](const Tetrahedra& t) {
            return view<float>(t, reinterpret_cast<const float*>(t->points_mm.data()), {static_cast<py::ssize_t>(t->points_mm.size()), 3});
          })
      .def_property_readonly("tets", [](const Tetrahedra& t) {
        return view<std::uint32_t>(t, reinterpret_cast<const std::uint32_t*>(t->tets.data()),
                                   {static_cast<py::ssize_t>(t->tets.size()), 4});
      });

  m.def("declarations", &declarations);
  m.def("run", &run);

  // An error as the programs know it: message, exit code, advice.
  static const py::object error = py::reinterpret_borrow<py::object>(PyErr_NewException("osteo.Error", PyExc_RuntimeError, nullptr));
  m.attr("Error") = error;
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const osteo::Error& e) {
      const py::object value = error(std::string(e.what()) + (e.advice().empty() ? "" : ". " + e.advice()));
      value.attr("code") = static_cast<int>(e.code());
      value.attr("advice") = e.advice();
      PyErr_SetObject(error.ptr(), value.ptr());
    }
  });
}
