// Values of Osteotome as objects of Python: volumes, grids, surfaces, tetrahedra, by their own memory.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "arrays.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/pipeline/formats.h"

namespace osteo::python {
namespace {

using Rows = std::array<std::array<double, 3>, 3>;

template <class T>
std::string name_of() {
  return py::str(py::dtype::of<T>());
}

/// Takes the voxels of `array` as they lie. Another type or order of memory is rejected: a copy is the caller's to
/// make.
template <class T, class V>
V volume_of(const py::array& array, std::array<double, 3> spacing_mm, std::array<double, 3> origin_mm, Rows direction) {
  const std::string name = name_of<T>();
  const auto refused = [&] {
    return WrongType("voxels must be an aligned, C-contiguous array of " + name + " with three axes (z, y, x)",
                     "numpy.ascontiguousarray(voxels, dtype='" + name + "') makes one");
  };
  if (!py::isinstance<py::array_t<T>>(array)) throw refused();
  if (array.ndim() != 3 || !(array.flags() & py::array::c_style) ||
      !(array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_))
    throw WrongValue(refused());
  V v;
  for (int i = 0; i < 3; ++i) v.frame.dims[static_cast<std::size_t>(i)] = static_cast<int>(array.shape(2 - i));
  v.frame.spacing_mm = vec(spacing_mm);
  v.frame.origin_mm = vec(origin_mm);
  for (std::size_t c = 0; c < 3; ++c) v.frame.direction.column[c] = {direction[0][c], direction[1][c], direction[2][c]};
  try {
    require_valid(v.frame);
  } catch (const Error& e) {
    throw WrongValue(e);
  }
  v.voxels = borrowed<T>(array);
  return v;
}

// DLPack 1.0: the only form that can say that memory may not be written.
// https://dmlc.github.io/dlpack/latest/c_api.html
struct DlTensor {
  void* data;
  std::int32_t device_type, device_id;
  std::int32_t ndim;
  std::uint8_t code, bits;
  std::uint16_t lanes;
  std::int64_t *shape, *strides;
  std::uint64_t byte_offset;
};
struct DlManagedVersioned {
  std::uint32_t major, minor;
  void* context;
  void (*deleter)(DlManagedVersioned*);
  std::uint64_t flags;
  DlTensor tensor;
};
template <class T>
struct DlOwner {
  DlManagedVersioned managed{};
  std::shared_ptr<const T[]> voxels;
  std::array<std::int64_t, 3> shape{}, strides{};
};

// Whoever takes the capsule renames it; only one that nobody took is freed with it.
constexpr const char* kDlName = "dltensor_versioned";

template <class T, class V>
py::capsule dlpack_of(const V& v) {
  auto* const owner = new DlOwner<T>;
  owner->voxels = v.voxels;
  const auto& d = v.frame.dims;
  owner->shape = {d[2], d[1], d[0]};
  owner->strides = {std::int64_t{d[1]} * d[0], d[0], 1};
  constexpr std::uint8_t kInt = 0, kUnsigned = 1, kFloat = 2;
  const std::uint8_t code = std::is_floating_point_v<T> ? kFloat : std::is_signed_v<T> ? kInt : kUnsigned;
  constexpr std::int32_t kCpu = 1;
  constexpr std::uint64_t kReadOnly = 1;
  owner->managed = {1,
                    0,
                    owner,
                    [](DlManagedVersioned* m) { delete static_cast<DlOwner<T>*>(m->context); },
                    kReadOnly,
                    {const_cast<T*>(v.voxels.get()), kCpu, 0, 3, code, 8 * sizeof(T), 1, owner->shape.data(),
                     owner->strides.data(), 0}};
  return py::capsule(&owner->managed, kDlName, [](PyObject* capsule) {
    if (PyCapsule_IsValid(capsule, kDlName) == 0) return;
    auto* const m = static_cast<DlManagedVersioned*>(PyCapsule_GetPointer(capsule, kDlName));
    m->deleter(m);
  });
}

std::string triple_text(Vec3 v) {
  return "(" + format_number(v.x) + ", " + format_number(v.y) + ", " + format_number(v.z) + ")";
}
std::string placed_text(const Frame& f) {
  return "shape (" + std::to_string(f.dims[2]) + ", " + std::to_string(f.dims[1]) + ", " + std::to_string(f.dims[0]) +
         "), spacing_mm " + triple_text(f.spacing_mm) + ", origin_mm " + triple_text(f.origin_mm);
}

// What nobody can write needs no copy.
template <class C, class... Of>
void copies_are_itself(py::class_<C, Of...>& c) {
  c.def("__copy__", [](const py::object& self) { return self; });
  c.def(
      "__deepcopy__", [](const py::object& self, const py::dict&) { return self; }, py::arg("memo"));
}
// numpy would make an array of one object of it.
template <class C, class... Of>
void no_array(py::class_<C, Of...>& c, const char* instead) {
  c.def("__array__",
        [instead](const py::object&, const py::args&, const py::kwargs&) -> py::object { throw WrongType(instead); });
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
  c.def("__repr__", [name](const V& v) {
    return std::string("<osteo.") + name + ": " + name_of<T>() + ", " + placed_text(v.frame) + ">";
  });
  c.def(
      "__array__",
      [](const py::object& self, const py::object& dtype, const py::object& copy) -> py::object {
        const py::object voxels = self.attr("voxels");
        const bool other = !dtype.is_none() && !py::dtype::from_args(dtype).equal(voxels.attr("dtype"));
        if (other && !copy.is_none() && !copy.cast<bool>())
          throw WrongValue(Error(ExitCode::usage, "voxels of another type are a copy, and copy=False wants none"));
        if (other) return voxels.attr("astype")(dtype);
        return !copy.is_none() && copy.cast<bool>() ? voxels.attr("copy")() : voxels;
      },
      py::arg("dtype") = py::none(), py::arg("copy") = py::none(),
      "The voxels: read-only and no copy, unless another type or copy=True is asked for");
  c.def("__dlpack_device__", [](const V&) { return py::make_tuple(1, 0); });
  c.def(
      "__dlpack__",
      [](const py::object& self, const py::object& stream, const py::object& max_version, const py::object& dl_device,
         const py::object& copy) -> py::object {
        if (!stream.is_none()) throw WrongValue(Error(ExitCode::usage, "voxels are in main memory and have no stream"));
        if (!dl_device.is_none() && !dl_device.equal(py::make_tuple(1, 0)))
          throw py::buffer_error("voxels are in main memory, and are not sent to another device");
        const bool copied = !copy.is_none() && copy.cast<bool>();
        if (!copied && !max_version.is_none() && py::cast<py::tuple>(max_version)[0].cast<int>() >= 1)
          return dlpack_of<T>(self.cast<const V&>());
        // Before version 1 nothing says that memory may not be written, so others get memory of their own.
        if (!copy.is_none() && !copied)
          throw py::buffer_error(
              "only DLPack 1.0 can say that voxels may not be written; without copy=False they are "
              "copied");
        return self.attr("voxels").attr("copy")().attr("__dlpack__")();
      },
      py::kw_only(), py::arg("stream") = py::none(), py::arg("max_version") = py::none(),
      py::arg("dl_device") = py::none(), py::arg("copy") = py::none(),
      "Read-only and no copy by DLPack 1.0 (max_version), else a copy");
  const auto parts = [](const py::object& self, const py::object& voxels) {
    return py::make_tuple(voxels, self.attr("spacing_mm"), self.attr("origin_mm"), self.attr("direction"));
  };
  c.def("__reduce__", [parts](const py::object& self) {
    return py::make_tuple(py::type::of(self), parts(self, self.attr("voxels")));
  });
  // The array it was made of is somebody else's: a deep copy has voxels of its own.
  c.def("__copy__", [](const V& v) { return v; });
  c.def(
      "__deepcopy__",
      [parts](const py::object& self, const py::dict&) {
        return py::type::of(self)(*parts(self, self.attr("voxels").attr("copy")()));
      },
      py::arg("memo"));
  return c;
}

// Rows of three from numpy. Copied: a mesh owns its points.
template <class T>
std::vector<std::array<T, 3>> rows_of(const py::array& array, const char* what) {
  const std::string name = name_of<T>();
  const auto refused = [&] {
    return WrongType(std::string(what) + " must be a C-contiguous array of " + name + ", (n, 3)",
                     "numpy.ascontiguousarray(" + std::string(what) + ", dtype='" + name + "') makes one");
  };
  if (!py::isinstance<py::array_t<T>>(array)) throw refused();
  if (array.ndim() != 2 || array.shape(1) != 3 || !(array.flags() & py::array::c_style)) throw WrongValue(refused());
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

// A grid as the bytes of its .vdb file, by way of a file: nothing else writes and reads all that a grid holds.
constexpr const char* kPassingFile = "grid.vdb";
py::tuple packed_grid(const SparseGrid& g) {
  std::vector<std::byte> bytes;
  {
    const py::gil_scoped_release free;
    const TemporaryFolder folder;
    save_data(Data(g), folder.path() / kPassingFile);
    bytes = read_file(folder.path() / kPassingFile);
  }
  return py::make_tuple(py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}
SparseGrid unpacked_grid(const py::tuple& state) {
  const std::string bytes = state[0].cast<std::string>();
  const py::gil_scoped_release free;
  const TemporaryFolder folder;
  write_file(folder.path() / kPassingFile, bytes);
  return std::get<SparseGrid>(load_data(folder.path() / kPassingFile, std::array{DataKind::grid}));
}

std::shared_ptr<TetMesh> unpacked_tets(const py::tuple& state) {
  auto mesh = std::make_shared<TetMesh>();
  const auto take = [](const py::handle& from, auto& into) {
    using Of = typename std::decay_t<decltype(into)>::value_type;
    const std::string bytes = from.cast<std::string>();
    into.resize(bytes.size() / sizeof(Of));
    std::memcpy(into.data(), bytes.data(), into.size() * sizeof(Of));
  };
  take(state[0], mesh->points_mm);
  take(state[1], mesh->tets);
  take(state[2], mesh->values);
  mesh->values_name = state[3].cast<std::string>();
  return mesh;
}
py::tuple packed_tets(const std::shared_ptr<TetMesh>& mesh) {
  const auto bytes = [](const auto& of) {
    return py::bytes(reinterpret_cast<const char*>(of.data()), of.size() * sizeof(*of.data()));
  };
  return py::make_tuple(bytes(mesh->points_mm), bytes(mesh->tets), bytes(mesh->values), mesh->values_name);
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

}  // namespace

void add_values(py::module_& m) {
  volume<std::int16_t, Image>(
      m, "Image",
      "CT in Hounsfield units. Shares the memory of the array it is made of, which must not change afterwards");
  volume<std::uint8_t, Labels>(
      m, "Labels",
      "Label map, 0 is background. Shares the memory of the array it is made of, which must not change afterwards");

  volume<float, Volume<float>>(m, "Field",
                               "Densities, or other numbers, in a box. Shares the memory of the array it is "
                               "made of, which must not change afterwards");

  py::class_<SparseGrid> grid(m, "Grid", "Sparse grid: what differs from its background is stored");
  grid.def(py::init(&grid_of), py::arg("voxels"), py::arg("spacing_mm") = std::array<double, 3>{1, 1, 1},
           py::arg("origin_mm") = std::array<double, 3>{0, 0, 0},
           py::arg("direction") = Rows{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, py::arg("background") = 0.0,
           py::arg("name") = "density", "Of float32 voxels (z, y, x)");
  grid.def("dense", &dense_of, py::arg("lo") = std::array<int, 3>{0, 0, 0}, py::arg("shape") = py::none(),
           "The box of voxels from lo on, both (z, y, x), as a Field; without a shape up to the end of the grid. What "
           "is not stored is "
           "background");
  frame_members(grid);
  copies_are_itself(grid);
  no_array(grid, "a grid is sparse and no array: dense() makes a Field of it, or of a part");
  grid.def("__repr__", [](const SparseGrid& g) {
    return "<osteo.Grid '" + g.name + "': " + placed_text(g.frame) + ", " + std::to_string(g.active_voxels) +
           " voxels stored>";
  });
  grid.def(py::pickle(&packed_grid, &unpacked_grid));
  grid.def_property_readonly("name", [](const SparseGrid& g) { return g.name; });
  grid.def_property_readonly("background", [](const SparseGrid& g) { return g.background; });
  grid.def_property_readonly("active_voxels", [](const SparseGrid& g) { return g.active_voxels; });

  using Mesh = std::shared_ptr<TriMesh>;
  py::class_<TriMesh, Mesh> surface(m, "Surface", "Triangles in LPS millimetres");
  copies_are_itself(surface);
  no_array(surface, "a surface is no array: it has points_mm, triangles and normals");
  surface.def("__repr__", [](const Mesh& s) {
    return "<osteo.Surface: " + std::to_string(s->points_mm.size()) + " points, " +
           std::to_string(s->triangles.size()) + " triangles" + (s->normals.empty() ? "" : ", normals") + ">";
  });
  surface.def("__reduce__", [](const py::object& self) {
    const py::object normals = self.attr("normals");
    return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("points_mm"), self.attr("triangles"),
                                                             py::len(normals) == 0 ? py::none() : normals));
  });
  surface
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
  using Tetrahedra = std::shared_ptr<TetMesh>;
  py::class_<TetMesh, Tetrahedra> tets(m, "Tets", "Tetrahedra in LPS millimetres");
  copies_are_itself(tets);
  no_array(tets, "a mesh is no array: it has points_mm and tets");
  tets.def("__repr__", [](const Tetrahedra& t) {
    return "<osteo.Tets: " + std::to_string(t->points_mm.size()) + " points, " + std::to_string(t->tets.size()) +
           " tetrahedra>";
  });
  tets.def(py::pickle(&packed_tets, &unpacked_tets));
  tets.def_property_readonly("points_mm",
                             [](const Tetrahedra& t) {
                               return view<float>(t, reinterpret_cast<const float*>(t->points_mm.data()),
                                                  {static_cast<py::ssize_t>(t->points_mm.size()), 3});
                             })
      .def_property_readonly("tets", [](const Tetrahedra& t) {
        return view<std::uint32_t>(t, reinterpret_cast<const std::uint32_t*>(t->tets.data()),
                                   {static_cast<py::ssize_t>(t->tets.size()), 4});
      });
  m.def("shared_with_vtk", &shared_with_vtk);
}

}  // namespace osteo::python
