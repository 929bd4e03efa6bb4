// Sessions as numpy sees them: their records as they lie in memory.
#include <algorithm>
#include <map>

#include "arrays.h"
#include "osteo/session/recording/records.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::python {
namespace {

struct Column {
  std::string name;
  std::string format;
  std::size_t offset;
};

// Names of fields that are a coordinate, and what all of them together are called.
struct Together {
  std::string_view first, name;
  std::size_t n;
};
constexpr Together kTogether[] = {{"x_mm", "position_mm", 3},
                                  {"axis_x", "axis", 3},
                                  {"force_x_n", "force_n", 3},
                                  {"torque_x_n_mm", "torque_n_mm", 3},
                                  {"shown_offset_x_mm", "shown_offset_mm", 3},
                                  {"value_0", "values", 12}};

std::string format_of(FieldType type) {
  switch (type) {
    case FieldType::u8:
      return "u1";
    case FieldType::u32:
      return "<u4";
    case FieldType::u64:
      return "<u8";
    case FieldType::f32:
      return "<f4";
    case FieldType::f64:
      return "<f8";
  }
  return {};
}

std::vector<Column> columns_of(const RecordTable& table) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < table.fields.size(); ++i) {
    const RecordField& f = table.fields[i];
    const auto* const together =
        std::find_if(std::begin(kTogether), std::end(kTogether), [&](const Together& t) { return t.first == f.name; });
    if (together == std::end(kTogether)) {
      columns.push_back({std::string(f.name), format_of(f.type), f.offset});
    } else {
      columns.push_back(
          {std::string(together->name), "(" + std::to_string(together->n) + ",)" + format_of(f.type), f.offset});
      i += together->n - 1;
    }
  }
  return columns;
}

// In the order of memory, without which numpy could not save it.
py::dtype dtype_of(std::vector<Column> columns, std::size_t bytes) {
  std::sort(columns.begin(), columns.end(), [](const Column& a, const Column& b) { return a.offset < b.offset; });
  py::list names, formats, offsets;
  for (const Column& c : columns) {
    names.append(c.name);
    formats.append(c.format);
    offsets.append(c.offset);
  }
  const py::dict spec(py::arg("names") = names, py::arg("formats") = formats, py::arg("offsets") = offsets,
                      py::arg("itemsize") = bytes);
  return py::module_::import("numpy").attr("dtype")(spec);
}

py::dict header_of(const SessionOutline& s) {
  const SessionHeader& h = s.header;
  HapticsParams params = h.haptics.params;
  py::dict settings;
  for (const FieldRef& f : fields_of<HapticsParams>(params)) settings[py::str(std::string(f.doc.name))] = value_of(f);
  py::list fields;
  for (const RecordField* f : s.tick_fields) fields.append(std::string(f->name));
  py::list tools;
  for (const std::string& t : s.tools) tools.append(t);
  py::dict actions;
  for (const auto& row : action_table()) actions[py::int_(static_cast<unsigned>(row.kind))] = std::string(row.name);
  return py::dict(
      py::arg("program_version") = h.program_version, py::arg("bone_hash") = h.bone_hash,
      py::arg("rate_hz") = h.rate_hz,
      py::arg("kernels") = py::dict(py::arg("burrs") = h.kernels.burrs, py::arg("contact") = h.kernels.contact,
                                    py::arg("scene") = h.kernels.scene),
      py::arg("hands") = h.haptics.hands(), py::arg("dust") = h.dust, py::arg("settings") = settings,
      py::arg("structures") = h.haptics.structures, py::arg("fields") = fields, py::arg("tools") = tools,
      py::arg("actions") = actions, py::arg("not_replayable") = s.not_replayable);
}

py::dict session(const std::string& path, bool keep_damaged) {
  Session s;
  {
    const py::gil_scoped_release free;
    s = read_session(path, keep_damaged ? Damage::keep : Damage::refuse);
  }
  py::dict out;
  out["header"] = header_of(s);
  out["losses"] = losses(s);
  out["end"] = py::none();
  if (s.end)
    out["end"] = py::dict(py::arg("ticks") = s.end->ticks, py::arg("bone_hash") = s.end->bone_hash,
                          py::arg("surface_hash") = s.end->surface_hash, py::arg("removed_mm3") = s.end->removed_mm3,
                          py::arg("ticks_lost") = s.end->ticks_lost, py::arg("notes_lost") = s.end->notes_lost);
  py::list notes;
  for (const Note& n : s.notes) {
    py::object value;
    try {
      value = from_json(n.json);
    } catch (py::error_already_set& e) {
      if (!e.matches(PyExc_ValueError)) throw;
      value = py::str(n.json);  // what is no JSON is kept as a text
    }
    notes.append(py::dict(py::arg("tick") = n.tick, py::arg("kind") = n.kind, py::arg("value") = value));
  }
  out["notes"] = notes;
  static_assert(sizeof(RecordedAction) == sizeof(SceneAction) + sizeof(std::uint64_t));
  std::vector<Column> action = columns_of(action_record_table());
  action.push_back({"changes_before", "<u8", offsetof(RecordedAction, changes_before)});
  out["ticks"] = records(tick_dtype(), std::move(s.ticks));
  out["changes"] = records(dtype_of(columns_of(change_table()), sizeof(VoxelChange)), std::move(s.changes));
  out["actions"] = records(dtype_of(action, sizeof(RecordedAction)), std::move(s.actions));
  return out;
}

}  // namespace

py::dtype tick_dtype() {
  return dtype_of(columns_of(tick_table()), sizeof(TickRecord));
}

py::dtype action_dtype() {
  return dtype_of(columns_of(action_record_table()), sizeof(SceneAction));
}

void add_sessions(py::module_& m) {
  m.def("session", &session);
  m.def("tick_dtype", &tick_dtype);
  m.def("action_dtype", &action_dtype);
}

}  // namespace osteo::python
