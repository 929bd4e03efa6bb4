// The Python module osteo._osteo: its parts and its errors.
#include "arrays.h"
#include "osteo/imaging/pipeline/pipeline.h"

PYBIND11_MODULE(_osteo, m) {
  using namespace osteo::python;
  // numpy first: without it nothing here can be used.
  py::module_::import("numpy");
  add_values(m);
  m.attr("__version__") = OSTEO_VERSION;
  m.def("program_version", [] { return std::string(osteo::program_version()); });
  add_stages(m);
  add_sessions(m);
  add_rehearsal(m);

  // An error as the programs know it: message, exit code, advice. Those of arguments are also Python's own.
  const auto error_class = [&m](const char* name, py::object bases) {
    const auto c = py::reinterpret_steal<py::object>(
        PyErr_NewException((std::string("osteo.") + name).c_str(), bases.ptr(), nullptr));
    m.attr(name) = c;
    return c;
  };
  const auto builtin = [](PyObject* type) { return py::reinterpret_borrow<py::object>(type); };
  static const py::object error = error_class("Error", builtin(PyExc_RuntimeError));
  static const py::object wrong_value = error_class("WrongValue", py::make_tuple(error, builtin(PyExc_ValueError)));
  static const py::object wrong_type = error_class("WrongType", py::make_tuple(error, builtin(PyExc_TypeError)));
  py::register_exception_translator([](std::exception_ptr p) {
    const auto raise = [](const py::object& type, const osteo::Error& e) {
      const std::string advice = python_words(e.advice());
      const py::object value = type(python_words(e.what()) + (advice.empty() ? "" : ". " + advice));
      value.attr("code") = static_cast<int>(e.code());
      value.attr("advice") = advice;
      PyErr_SetObject(type.ptr(), value.ptr());
    };
    try {
      if (p) std::rethrow_exception(p);
    } catch (const WrongType& e) {
      raise(wrong_type, e);
    } catch (const WrongValue& e) {
      raise(wrong_value, e);
    } catch (const osteo::Error& e) {
      raise(e.code() == osteo::ExitCode::usage ? wrong_value : error, e);
    }
  });
}
