// What the sources of the module share: memory of ours as numpy and back, without copies.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/frame.h"

namespace osteo::python {

namespace py = pybind11;

/// An argument of a type that is not taken: in Python also a TypeError. What asks for what there is not (exit code
/// usage) and WrongValue are also a ValueError.
struct WrongType : Error {
  explicit WrongType(const std::string& what, std::string advice = {})
      : Error(ExitCode::usage, what, std::move(advice)) {}
};
struct WrongValue : Error {
  explicit WrongValue(const Error& e) : Error(e) {}
};

/// A text of the programs as a script of Python reads it: --spacing-mm is spacing_mm, --no-fill is fill=False. Commands
/// in quotes ('osteo info FILE') are left.
[[nodiscard]] std::string python_words(std::string_view text);

/// Memory of numpy for as long as a value of ours needs it. The last owner may be any thread.
template <class T>
std::shared_ptr<const T[]> borrowed(const py::array& array) {
  auto* const object = array.inc_ref().ptr();
  return {static_cast<const T*>(array.data()), [object](const T*) {
            const py::gil_scoped_acquire gil;
            Py_DECREF(object);
          }};
}

/// Memory of ours, of values of type T, as a numpy array of this type that keeps it alive. No copy. Not to be written,
/// unless `writable`.
template <class T, class Owner>
py::array view_as(const py::dtype& type, Owner owner, const T* data, std::vector<py::ssize_t> shape,
                  bool writable = false) {
  const py::capsule keep(new Owner(std::move(owner)), [](void* p) { delete static_cast<Owner*>(p); });
  // Strides are ours: pybind11 before 2.12 reads the size of an item where numpy 2 has something else.
  std::vector<py::ssize_t> strides(shape.size());
  auto step = static_cast<py::ssize_t>(sizeof(T));
  for (std::size_t a = shape.size(); a-- > 0; step *= shape[a]) strides[a] = step;
  py::array array(type, std::move(shape), std::move(strides), data, keep);
  if (!writable) py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
template <class T, class Owner>
py::array view(Owner owner, const T* data, std::vector<py::ssize_t> shape, bool writable = false) {
  return view_as(py::dtype::of<T>(), std::move(owner), data, std::move(shape), writable);
}
/// A vector as an array of one axis, of records of this type; it becomes the array's.
template <class T>
py::array records(const py::dtype& type, std::vector<T>&& all) {
  auto owner = std::make_shared<const std::vector<T>>(std::move(all));
  const T* const data = owner->data();
  const auto n = static_cast<py::ssize_t>(owner->size());
  return view_as(type, std::move(owner), data, {n});
}

inline Vec3 vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}
inline std::array<double, 3> triple(Vec3 v) {
  return {v.x, v.y, v.z};
}

/// The value of a parameter: a flag, number, text or list; of a choice its name.
inline py::object value_of(const FieldRef& f) {
  return std::visit(
      [](const auto& t) -> py::object {
        if constexpr (std::is_same_v<std::decay_t<decltype(t)>, FieldRef::Choice>)
          return py::str(std::string(t.names[static_cast<std::size_t>(*t.index)]));
        else
          return py::cast(*t);
      },
      f.target);
}
/// Sets a parameter from an object of Python. Error(usage) that names it.
void set_value(const FieldRef& f, const py::handle& value);
/// A text as JSON makes it: numbers, texts, lists, dicts.
inline py::object from_json(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

/// TickRecord, in the order of its memory; triples are one field of three.
[[nodiscard]] py::dtype tick_dtype();
/// SceneAction.
[[nodiscard]] py::dtype action_dtype();

void add_values(py::module_& m);
void add_stages(py::module_& m);
void add_sessions(py::module_& m);
void add_rehearsal(py::module_& m);

}  // namespace osteo::python
