// Stages as functions, files that are loaded and saved. What is made from declarations is made in osteo/__init__.py.
#include <algorithm>
#include <mutex>
#include <span>

#include "arrays.h"
#include "osteo/app/stages/registry.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::python {
namespace {

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
  throw WrongType("'" + port.name + "' takes " + kinds_text(port.kinds) + " or a path, not " +
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

std::string python_words(std::string_view text) {
  const auto name_char = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; };
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (text.substr(i).starts_with("'osteo ")) {
      const std::size_t end = std::min(text.find('\'', i + 1), text.size() - 1) + 1;
      out += text.substr(i, end - i);
      i = end;
      continue;
    }
    const bool begins = i == 0 || (!name_char(text[i - 1]) && text[i - 1] != '<');
    if (!begins || !text.substr(i).starts_with("--") || i + 2 >= text.size() || text[i + 2] < 'a' ||
        text[i + 2] > 'z') {
      out += text[i++];
      continue;
    }
    std::size_t end = i + 2;
    while (end < text.size() && name_char(text[end])) ++end;
    std::string name(text.substr(i + 2, end - i - 2));
    const bool off = name.starts_with("no-");
    if (off) name.erase(0, 3);
    std::ranges::replace(name, '-', '_');
    out += name + (off ? "=False" : "");
    i = end;
  }
  return out;
}

void set_value(const FieldRef& f, const py::handle& value) {
  const std::string name(f.doc.name);
  const auto wrong = [&](const char* what) {
    throw WrongType(name + " takes " + what + ", not " + std::string(py::repr(value)));
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

void save(const py::object& value, const std::string& path, bool force) {
  if (!force && fs::exists(path))
    throw Error(ExitCode::cannot_write, "'" + path + "' exists already",
                "choose another name, or force=True replaces it");
  Data data;
  if (py::isinstance<py::array>(value)) {
    const py::array rgb = value.cast<py::array>();
    if (!py::isinstance<py::array_t<std::uint8_t>>(rgb) || rgb.ndim() != 3 || rgb.shape(2) != 3 || rgb.size() == 0 ||
        !(rgb.flags() & py::array::c_style))
      throw WrongType("a picture is a C-contiguous array of uint8, (rows, columns, 3)");
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
      throw WrongType("there is nothing to save in " + std::string(py::repr(value)));
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
    const FieldRef* const field = find_field(fields, wanted);
    if (field == nullptr) throw Error(ExitCode::usage, "stage '" + name + "' has no parameter '" + wanted + "'");
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
    warnings.emplace_back(python_words(text));
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

void add_stages(py::module_& m) {
  m.def("python_words", &python_words);
  m.def("load", &load);
  m.def("save", &save);
  m.def("declarations", &declarations);
  m.def("old_names", [] {
    const auto of = [](std::span<const OldName> names) {
      py::dict d;
      for (const OldName& n : names) d[py::str(std::string(n.old))] = std::string(n.current);
      return d;
    };
    return py::make_tuple(of(old_command_names()), of(old_field_names()));
  });
  m.def("run", &run);
}

}  // namespace osteo::python
