// The Python module osteo._osteo: values and stages. Everything that is made from declarations is made in
// osteo/__init__.py.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include "arrays.h"
#include "osteo/app/stages/registry.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::python {
namespace {

using Rows = std::array<std::array<double, 3>, 3>;

/// Takes the voxels of `array` as they lie. Another type or order of memory is refused: a copy is the caller's to make.
template <class T, class V>
V volume_of(const py::array& array, std::array<double, 3> spacing_mm, std::array<double, 3> origin_mm, Rows direction) {
  if (!py::isinstance<py::array_t<T>>(array) || array.ndim() != 3 || !(array.flags() & py::array::c_style) ||
      !(array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_)) {
    const std::string name = py::str(py::dtype::of<T>());
    throw Error(ExitCode::usage,
                "voxels must be an aligned, C-contiguous array of " + name + " with three axes (z, y, x)",
                "numpy.ascontiguousarray(voxels, dtype='" + name + "') makes one");
  }
  V v;
  for (int i = 0; i < 3; ++i) v.frame.dims[static_cast<std::size_t>(i)] = static_cast<int>(array.shape(2 - i));
  v.frame.spacing_mm = vec(spacing_mm);
  v.frame.origin_mm = vec(origin_mm);
  for (std::size_t c = 0; c < 3; ++c) v.frame.direction.column[c] = {direction[0][c], direction[1][c], direction[2][c]};
  require_valid(v.frame);
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
py::class_<V> volume(py::module_& m, const char* name, const char* doc) {
  py::class_<V> c(m, name, doc);
  c.def(py::init(&volume_of<T, V>), py::arg("voxels"), py::arg("spacing_mm") = std::array<double, 3>{1, 1, 1},
        py::arg("origin_mm") = std::array<double, 3>{0, 0, 0},
        py::arg("direction") = Rows{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
  c.def_property_readonly(
      "voxels",
      [](const V& v) {
        return view<T>(v.voxels, v.voxels.get(), {v.frame.dims[2], v.frame.dims[1], v.frame.dims[0]});
      },
      "(z, y, x), read-only, the value's own memory");
  frame_members(c);
  return c;
}

// Rows of three from numpy. Copied: a mesh owns its points.
template <class T>
std::vector<std::array<T, 3>> rows_of(const py::array& array, const char* what) {
  if (!py::isinstance<py::array_t<T>>(array) || array.ndim() != 2 || array.shape(1) != 3 ||
      !(array.flags() & py::array::c_style)) {
    const std::string name = py::str(py::dtype::of<T>());
    throw Error(ExitCode::usage, std::string(what) + " must be a C-contiguous array of " + name + ", (n, 3)",
                "numpy.ascontiguousarray(" + std::string(what) + ", dtype='" + name + "') makes one");
  }
  const auto* const first = reinterpret_cast<const std::array<T, 3>*>(array.data());
  return {first, first + array.shape(0)};
}

std::shared_ptr<TriMesh> mesh_of(const py::array& points_mm, const py::array& triangles, const py::object& normals) {
  auto mesh = std::make_shared<TriMesh>();
  mesh->points_mm = rows_of<float>(points_mm, "points_mm");
  mesh->triangles = rows_of<std::uint32_t>(triangles, "triangles");
  if (!normals.is_none()) mesh->normals = rows_of<float>(normals.cast<py::array>(), "normals");
  if (!mesh->normals.empty() && mesh->normals.size() != mesh->points_mm.size())
    throw Error(
        ExitCode::usage,
        std::to_string(mesh->normals.size()) + " normals for " + std::to_string(mesh->points_mm.size()) + " points",
        "give one for each, or none");
  for (std::size_t i = 0; i < mesh->points_mm.size(); ++i) {
    for (const float x : mesh->points_mm[i])
      if (!std::isfinite(x)) throw Error(ExitCode::usage, "point " + std::to_string(i) + " is not finite");
  }
  for (std::size_t i = 0; i < mesh->triangles.size(); ++i) {
    for (const std::uint32_t p : mesh->triangles[i])
      if (p >= mesh->points_mm.size())
        throw Error(ExitCode::usage, "triangle " + std::to_string(i) + " names point " + std::to_string(p) + " of " +
                                         std::to_string(mesh->points_mm.size()));
  }
  return mesh;
}

Volume<float> dense_of(const SparseGrid& g, std::array<int, 3> lo, std::optional<std::array<int, 3>> shape) {
  const py::gil_scoped_release free;
  const std::array<int, 3> n =
      shape ? std::array<int, 3>{(*shape)[2], (*shape)[1], (*shape)[0]}
            : std::array<int, 3>{g.frame.dims[0] - lo[2], g.frame.dims[1] - lo[1], g.frame.dims[2] - lo[0]};
  return to_dense(g, {lo[2], lo[1], lo[0]}, n);
}

SparseGrid grid_of(const py::array& voxels, std::array<double, 3> spacing_mm, std::array<double, 3> origin_mm,
                   Rows direction, double background, const std::string& name) {
  const auto v = volume_of<float, Volume<float>>(voxels, spacing_mm, origin_mm, direction);
  const py::gil_scoped_release free;
  return to_sparse(v, name, background);
}

// Memory of a value for VTK, whose arrays take none that may not be written; nobody writes it.
py::object shared_with_vtk(const py::object& value) {
  if (py::isinstance<Labels>(value)) {
    const Labels v = value.cast<Labels>();
    return view<std::uint8_t>(v.voxels, v.voxels.get(), {static_cast<py::ssize_t>(v.frame.voxel_count())}, true);
  }
  if (py::isinstance<Image>(value)) {
    const Image v = value.cast<Image>();
    return view<std::int16_t>(v.voxels, v.voxels.get(), {static_cast<py::ssize_t>(v.frame.voxel_count())}, true);
  }
  if (py::isinstance<Volume<float>>(value)) {
    const auto v = value.cast<Volume<float>>();
    return view<float>(v.voxels, v.voxels.get(), {static_cast<py::ssize_t>(v.frame.voxel_count())}, true);
  }
  const auto s = value.cast<std::shared_ptr<TriMesh>>();
  const auto rows = [&](const auto& of, auto element) -> py::object {
    using T = decltype(element);
    if (of.empty()) return py::none();
    return view<T>(s, reinterpret_cast<const T*>(of.data()), {static_cast<py::ssize_t>(of.size()), 3}, true);
  };
  return py::make_tuple(rows(s->points_mm, float{}), rows(s->triangles, std::uint32_t{}), rows(s->normals, float{}));
}

Data data_of(const py::handle& h, const Port& port) {
  if (h.is_none()) return {};
  if (py::isinstance<Labels>(h)) return h.cast<Labels>();
  if (py::isinstance<Image>(h)) return h.cast<Image>();
  if (py::isinstance<SparseGrid>(h)) return h.cast<SparseGrid>();
  if (py::isinstance<TriMesh>(h)) return Surface(h.cast<std::shared_ptr<TriMesh>>());
  if (py::isinstance<TetMesh>(h)) return Tets(h.cast<std::shared_ptr<TetMesh>>());
  if (py::isinstance<py::dict>(h) && std::ranges::find(port.kinds, DataKind::document) != port.kinds.end())
    return Document{py::module_::import("json").attr("dumps")(h).cast<std::string>()};
  if (py::hasattr(h, "__fspath__") || py::isinstance<py::str>(h)) {
    const std::string path = py::str(py::module_::import("os").attr("fspath")(h));
    return load_data(path, port.kinds);
  }
  throw Error(ExitCode::usage, "'" + port.name + "' takes " + kinds_text(port.kinds) + " or a path, not " +
                                   std::string(py::str(py::type::handle_of(h).attr("__name__"))));
}

py::object object_of(const Data& data) {
  switch (kind_of(data)) {
    case DataKind::none:
      return py::none();
    case DataKind::source:
      return py::module_::import("pathlib").attr("Path")(std::get<Source>(data).path.string());
    case DataKind::image:
      return py::cast(std::get<Image>(data));
    case DataKind::labels:
      return py::cast(std::get<Labels>(data));
    case DataKind::grid:
      return py::cast(std::get<SparseGrid>(data));
    // Python sees nothing of these that can be written.
    case DataKind::surface:
      return py::cast(std::const_pointer_cast<TriMesh>(std::get<Surface>(data)));
    case DataKind::tets:
      return py::cast(std::const_pointer_cast<TetMesh>(std::get<Tets>(data)));
    case DataKind::picture: {
      const auto picture = std::make_shared<Picture>(std::get<Picture>(data));
      return view<std::uint8_t>(picture, picture->rgb.data(), {picture->height, picture->width, 3});
    }
    case DataKind::document: {
      // An .inp, .svg or .vtu is a text.
      const std::string& text = std::get<Document>(data).json;
      const std::size_t first = text.find_first_not_of(" \t\r\n");
      if (first == std::string::npos || (text[first] != '{' && text[first] != '[')) return py::str(text);
      return py::module_::import("json").attr("loads")(text);
    }
  }
  return py::none();
}

}  // namespace

void set_value(const FieldRef& f, const py::handle& value) {
  const std::string name(f.doc.name);
  const auto wrong = [&](const char* what) {
    throw Error(ExitCode::usage, name + " takes " + what + ", not " + std::string(py::repr(value)));
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

namespace {

py::object load(const std::string& path, const std::string& kind) {
  std::vector<DataKind> accepted;
  for (const DataKind k : {DataKind::image, DataKind::labels, DataKind::grid, DataKind::surface, DataKind::tets,
                           DataKind::picture, DataKind::document}) {
    // A file of voxels does not say which of the two it is.
    if (kind.empty() ? k != DataKind::labels : kind == kind_name(k)) accepted.push_back(k);
  }
  if (accepted.empty())
    throw Error(ExitCode::usage, "there is no kind '" + kind + "'",
                "one of image, labels, grid, surface, tets, picture, document");
  Data data;
  {
    const py::gil_scoped_release free;
    data = load_data(path, accepted);
  }
  return object_of(data);
}

void save(const py::object& value, const std::string& path) {
  Data data;
  if (py::isinstance<py::array>(value)) {
    const py::array rgb = value.cast<py::array>();
    if (!py::isinstance<py::array_t<std::uint8_t>>(rgb) || rgb.ndim() != 3 || rgb.shape(2) != 3 || rgb.size() == 0 ||
        !(rgb.flags() & py::array::c_style))
      throw Error(ExitCode::usage, "a picture is a C-contiguous array of uint8, (rows, columns, 3)");
    Picture picture;
    picture.height = static_cast<int>(rgb.shape(0));
    picture.width = static_cast<int>(rgb.shape(1));
    const auto* const first = static_cast<const std::uint8_t*>(rgb.data());
    picture.rgb.assign(first, first + rgb.size());
    data = std::move(picture);
  } else {
    static const Port any{
        "value", {DataKind::image, DataKind::labels, DataKind::grid, DataKind::surface, DataKind::tets}, "", false};
    if (py::isinstance<py::str>(value) || value.is_none())
      throw Error(ExitCode::usage, "there is nothing to save in " + std::string(py::repr(value)));
    data = data_of(value, any);
  }
  require_savable(kind_of(data), path);
  const py::gil_scoped_release free;
  save_data(data, path);
}

py::list declarations() {
  py::list all;
  const Registry registry = osteo_stages();
  const auto ports = [](const std::vector<Port>& from) {
    py::list out;
    for (const Port& p : from) {
      py::list kinds;
      for (const DataKind k : p.kinds) kinds.append(std::string(kind_name(k)));
      out.append(py::dict(py::arg("name") = p.name, py::arg("kinds") = kinds, py::arg("help") = p.help,
                          py::arg("optional") = p.optional));
    }
    return out;
  };
  for (const std::string& name : registry.names()) {
    const auto stage = registry.make(name);
    const StageInfo& info = stage->info();
    py::list fields;
    for (const FieldRef& f : stage->fields()) {
      py::list choices;
      if (const auto* c = std::get_if<FieldRef::Choice>(&f.target))
        for (const auto& n : c->names) choices.append(std::string(n));
      fields.append(py::dict(py::arg("name") = std::string(f.doc.name), py::arg("help") = std::string(f.doc.help),
                             py::arg("unit") = std::string(f.doc.unit), py::arg("lo") = f.doc.lo,
                             py::arg("hi") = f.doc.hi, py::arg("kind") = std::string(f.kind()),
                             py::arg("choices") = choices, py::arg("default") = value_of(f)));
    }
    all.append(py::dict(py::arg("name") = info.name, py::arg("synopsis") = info.synopsis,
                        py::arg("description") = info.description, py::arg("inputs") = ports(info.inputs),
                        py::arg("outputs") = ports(info.outputs), py::arg("fields") = fields));
  }
  return all;
}

/// Outputs in the order of their ports, the report, warnings.
py::tuple run(const std::string& name, const py::sequence& inputs, const py::dict& params, int threads,
              std::uint64_t seed) {
  static const Registry registry = osteo_stages();
  const auto stage = registry.make(name);
  const auto fields = stage->fields();
  for (const auto& [key, value] : params) {
    const std::string wanted = py::str(key);
    const auto field =
        std::find_if(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == wanted; });
    if (field == fields.end()) throw Error(ExitCode::usage, "stage '" + name + "' has no parameter '" + wanted + "'");
    set_value(*field, value);
  }
  Context context;
  context.threads = threads;
  context.seed = seed;
  std::mutex mutex;
  std::vector<std::string> warnings;
  context.on_log([&](LogLevel level, std::string_view text) {
    if (level != LogLevel::warning) return;
    const std::lock_guard lock(mutex);
    warnings.emplace_back(text);
  });
  std::vector<Data> in;
  for (std::size_t i = 0; i < stage->info().inputs.size(); ++i)
    in.push_back(data_of(inputs[i], stage->info().inputs[i]));
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
}  // namespace osteo::python

PYBIND11_MODULE(_osteo, m) {
  using namespace osteo::python;
  // numpy first: without it nothing here can be used.
  py::module_::import("numpy");
  volume<std::int16_t, osteo::Image>(
      m, "Image",
      "CT in Hounsfield units. Shares the memory of the array it is made of, which must not change afterwards");
  volume<std::uint8_t, osteo::Labels>(
      m, "Labels",
      "Label map, 0 is background. Shares the memory of the array it is made of, which must not change afterwards");

  volume<float, osteo::Volume<float>>(m, "Field",
                                      "Densities, or other numbers, in a box. Shares the memory of the array it is "
                                      "made of, which must not change afterwards");

  py::class_<osteo::SparseGrid> grid(m, "Grid", "Sparse grid: what differs from its background is stored");
  grid.def(py::init(&grid_of), py::arg("voxels"), py::arg("spacing_mm") = std::array<double, 3>{1, 1, 1},
           py::arg("origin_mm") = std::array<double, 3>{0, 0, 0},
           py::arg("direction") = Rows{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, py::arg("background") = 0.0,
           py::arg("name") = "density", "Of float32 voxels (z, y, x)");
  grid.def("dense", &dense_of, py::arg("lo") = std::array<int, 3>{0, 0, 0}, py::arg("shape") = py::none(),
           "The box of voxels from lo on, both (z, y, x), as a Field; without a shape up to the end of the grid. What "
           "is not stored is "
           "background");
  frame_members(grid);
  grid.def_property_readonly("name", [](const osteo::SparseGrid& g) { return g.name; });
  grid.def_property_readonly("background", [](const osteo::SparseGrid& g) { return g.background; });
  grid.def_property_readonly("active_voxels", [](const osteo::SparseGrid& g) { return g.active_voxels; });

  using Mesh = std::shared_ptr<osteo::TriMesh>;
  py::class_<osteo::TriMesh, Mesh>(m, "Surface", "Triangles in LPS millimetres")
      .def(py::init(&mesh_of), py::arg("points_mm"), py::arg("triangles"), py::arg("normals") = py::none(),
           "Of float32 points and uint32 triangles, counter-clockwise seen from outside; copied")
      .def_property_readonly("points_mm",
                             [](const Mesh& s) {
                               return view<float>(s, reinterpret_cast<const float*>(s->points_mm.data()),
                                                  {static_cast<py::ssize_t>(s->points_mm.size()), 3});
                             })
      .def_property_readonly("normals",
                             [](const Mesh& s) {
                               return view<float>(s, reinterpret_cast<const float*>(s->normals.data()),
                                                  {static_cast<py::ssize_t>(s->normals.size()), 3});
                             })
      .def_property_readonly("triangles", [](const Mesh& s) {
        return view<std::uint32_t>(s, reinterpret_cast<const std::uint32_t*>(s->triangles.data()),
                                   {static_cast<py::ssize_t>(s->triangles.size()), 3});
      });
  using Tetrahedra = std::shared_ptr<osteo::TetMesh>;
  py::class_<osteo::TetMesh, Tetrahedra>(m, "Tets", "Tetrahedra in LPS millimetres")
      .def_property_readonly("points_mm",
                             [](const Tetrahedra& t) {
                               return view<float>(t, reinterpret_cast<const float*>(t->points_mm.data()),
                                                  {static_cast<py::ssize_t>(t->points_mm.size()), 3});
                             })
      .def_property_readonly("tets", [](const Tetrahedra& t) {
        return view<std::uint32_t>(t, reinterpret_cast<const std::uint32_t*>(t->tets.data()),
                                   {static_cast<py::ssize_t>(t->tets.size()), 4});
      });

  m.attr("__version__") = OSTEO_VERSION;
  m.def("program_version", [] { return std::string(osteo::program_version()); });
  m.def("load", &load);
  m.def("save", &save);
  m.def("shared_with_vtk", &shared_with_vtk);
  add_sessions(m);
  add_rehearsal(m);
  m.def("declarations", &declarations);
  m.def("run", &run);

  // An error as the programs know it: message, exit code, advice.
  static const py::object error =
      py::reinterpret_borrow<py::object>(PyErr_NewException("osteo.Error", PyExc_RuntimeError, nullptr));
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
