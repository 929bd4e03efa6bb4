#include "session_header.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "osteo/core/base/error.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;

// Kernels of contact from here on differ in the guard, and in how a slot holds a saw: GuardParams::law is less by one.
constexpr int kFirstRepeatedContact = 2;

const char* const kRoles[] = {"input", "result", "machine"};

ordered_json record_json(const RecordTable& table) {
  ordered_json fields = ordered_json::array();
  for (const RecordField& f : table.fields)
    fields.push_back({{"name", f.name},
                      {"type", name_of(f.type)},
                      {"unit", f.unit},
                      {"role", kRoles[static_cast<std::size_t>(f.role)]},
                      {"meaning", f.meaning}});
  return {{"part", table.part}, {"fields", fields}};
}

// Fields under their names, as text where JSON has no number for them.
ordered_json fields_json(const std::vector<FieldRef>& fields) {
  ordered_json j;
  for (const FieldRef& f : fields) j[std::string(f.doc.name)] = f.to_text();
  return j;
}

ordered_json haptics_json(const HapticSetup& h) {
  HapticSetup copy = h;
  ordered_json j;
  j["params"] = fields_json(fields_of<HapticsParams>(copy.params));
  j["devices"] = ordered_json::array();  // of each hand
  for (std::size_t hand = 0; hand < h.hands(); ++hand) {
    const DeviceTraits& d = h.device_of(hand);
    j["devices"].push_back({{"damping_n_s_per_m", d.damping_n_s_per_m},
                            {"delay_s", d.delay_s},
                            {"encoder_mm", d.encoder_mm},
                            {"max_force_n", d.max_force_n},
                            {"max_stiffness_n_per_mm", d.max_stiffness_n_per_mm}});
  }
  j["tool_methods"] = ordered_json::array();
  for (const auto& [tool, method] : h.tool_methods) j["tool_methods"].push_back({tool, static_cast<int>(method)});
  j["hardness"] = h.hardness.value_or(false);
  j["hardness_law"] = h.hardness_json;
  j["structures"] = h.structures;
  if (!h.opened.empty()) j["opened"] = h.opened;
  j["vibration"] = h.vibration_json;
  if (!h.texture_json.empty()) j["texture"] = h.texture_json;
  j["curve"] = ordered_json::array();
  for (const Vec3 p : h.curve) j["curve"].push_back({p.x, p.y, p.z});
  const auto& c = h.curve_params;
  j["curve_params"] = {c.stiffness_n_per_mm, c.max_force_n, c.arc_penalty, c.engage_mm, c.release_mm};
  return j;
}

// What this build does not know goes into `unknown`; `tools`: what the file's instruments are here.
HapticSetup setup_of(const ordered_json& j, const NamedNumbers& tools, std::vector<std::string>& unknown) {
  HapticSetup h;
  const auto fields = fields_of<HapticsParams>(h.params);
  for (const auto& [key, value] : j.at("params").items()) {
    const FieldRef* const field = find_field(fields, key);
    try {
      if (field == nullptr)
        unknown.push_back(key);
      else
        field->from_text(value.get<std::string>());
    } catch (const Error&) {
      unknown.push_back(key + " = " + value.get<std::string>());
    }
  }
  for (const auto& d : j.at("devices"))
    h.more_devices.push_back({d.at("damping_n_s_per_m"), d.at("delay_s"), d.at("encoder_mm"), d.at("max_force_n"),
                              d.at("max_stiffness_n_per_mm")});
  if (!h.more_devices.empty()) {
    h.device = h.more_devices.front();
    h.more_devices.erase(h.more_devices.begin());
  }
  for (const auto& t : j.at("tool_methods")) {
    const int method = t.at(1);
    if (method < 0 || method >= static_cast<int>(EnumNames<ContactMethod>::values.size()))
      unknown.push_back("method of contact " + std::to_string(method));
    else
      // Of an instrument that is none here no record can be read.
      if (const int here = tools.here_or_none(t.at(0)); here >= 0)
        h.tool_methods[here] = static_cast<ContactMethod>(method);
  }
  h.hardness = j.at("hardness").get<bool>();
  h.hardness_json = j.at("hardness_law");
  h.structures = j.at("structures");
  h.opened = j.value("opened", std::vector<std::string>{});
  h.vibration_json = j.at("vibration");
  h.texture_json = j.value("texture", "");
  for (const auto& p : j.at("curve")) h.curve.push_back({p.at(0), p.at(1), p.at(2)});
  const auto& c = j.at("curve_params");
  h.curve_params = {c.at(0), c.at(1), c.at(2), c.at(3), c.at(4)};
  return h;
}

ordered_json instruments_json() {
  ordered_json j = ordered_json::array();
  const auto shape = [](const RoundCone& c) -> ordered_json {
    return {{"start_mm", c.start_mm},
            {"length_mm", c.length_mm},
            {"start_radius_mm", c.start_radius_mm},
            {"end_radius_mm", c.end_radius_mm}};
  };
  for (const Instrument& i : instrument_library()) {
    ordered_json one{{"name", i.name},
                     {"kind", EnumNames<InstrumentKind>::values[static_cast<std::size_t>(i.kind)]},
                     {"head", shape(i.head)},
                     {"shaft", shape(i.shaft)}};
    if (const Burr* const b = i.cutter()) {
      one["burr"] = {{"kind", row_of(b->kind).name},
                     {"shape", EnumNames<BurrShape>::values[static_cast<std::size_t>(b->shape)]},
                     {"diameter_mm", b->diameter_mm},
                     {"rate_mm3_per_s_per_n", b->rate_mm3_per_s_per_n},
                     {"falloff_mm3_per_s_per_n_per_rad", b->falloff_mm3_per_s_per_n_per_rad}};
      if (i.kind == InstrumentKind::saw) one["speed_share"] = i.speed_share;
    } else if (i.rate > 0) {
      one["rate"] = i.rate;
      one["reach_mm"] = i.reach_mm;
    }
    j.push_back(one);
  }
  return j;
}

ordered_json plates_json() {
  ordered_json j = ordered_json::array();
  for (const PlateModel& p : plate_library()) {
    ordered_json holes = ordered_json::array();
    for (const Vec3 h : p.holes_mm) holes.push_back({h.x, h.y, h.z});
    j.push_back({{"name", p.name},
                 {"about", p.about},
                 {"thickness_mm", p.thickness_mm},
                 {"screw_mm", p.screw_mm},
                 {"most_opening_mm", p.most_opening_mm},
                 {"holes_mm", holes}});
  }
  return j;
}

template <class T>
std::vector<std::string> names_of(const std::vector<T>& library) {
  std::vector<std::string> names;
  for (const T& one : library) names.push_back(one.name);
  return names;
}
std::vector<std::string> names_in(const ordered_json& list) {
  std::vector<std::string> names;
  for (const auto& one : list) names.push_back(one.at("name"));
  return names;
}

// Suction tubes have another name in sessions of 0.1.
std::vector<std::string> instruments_in(const ordered_json& list) {
  std::vector<std::string> names = names_in(list);
  constexpr std::string_view kOld = "sucker ", kNow = "suction tube ";
  for (std::string& n : names) {
    if (n.starts_with(kOld)) n.replace(0, kOld.size(), kNow);
  }
  return names;
}

FieldType type_of(const std::string& text, const std::string& name) {
  for (const FieldType t : {FieldType::u8, FieldType::u32, FieldType::u64, FieldType::f32, FieldType::f64}) {
    if (name_of(t) == text) return t;
  }
  throw Error(ExitCode::corrupt, name + " has numbers of a type ('" + text + "') that this version does not know",
              "it was recorded by a later one; use that");
}

void say_not_replayable(SessionOutline& o, const std::string& why) {
  o.not_replayable += (o.not_replayable.empty() ? "" : "; ") + why;
}

FileTable table_of(const std::string& kind, const ordered_json& j, const std::string& name, SessionOutline& o) {
  FileTable t;
  t.part = j.at("part");
  t.text = j.value("text", false);
  if (t.text) {
    t.bytes = 1;
    if (t.part != kNotesPart) o.newer.push_back("records of a kind '" + kind + "'");
    return t;
  }
  const RecordTable* ours = nullptr;
  for (const RecordTable* const known : {&tick_table(), &change_table(), &action_record_table()}) {
    if (known->part == t.part && known->name == kind) ours = known;
  }
  if (ours == nullptr) o.newer.push_back("records of a kind '" + kind + "'");
  std::vector<const RecordField*> found;
  for (const auto& f : j.at("fields")) {
    FileField field{type_of(f.at("type"), name), nullptr};
    t.bytes += size_of(field.type);
    const std::string field_name = f.at("name");
    if (ours != nullptr) {
      const auto at = std::find_if(ours->fields.begin(), ours->fields.end(),
                                   [&](const RecordField& r) { return r.name == field_name; });
      if (at != ours->fields.end()) {
        field.ours = &*at;
        found.push_back(field.ours);
      } else {
        o.newer.push_back("the field '" + field_name + "' of each " + kind);
        if (f.value("role", "result") == "input")
          say_not_replayable(o, "its servo was fed with '" + field_name + "' too");
      }
    }
    t.fields.push_back(field);
  }
  if (t.bytes == 0) throw Error(ExitCode::corrupt, name + " has records without fields");
  if (ours == nullptr) return t;
  for (const RecordField& f : ours->fields) {
    // Sessions of before 2026-12 do not have it, and were made when all actions were the first hand's in a replay.
    if (ours == &action_record_table() && f.name == "hand") continue;
    if (f.role == FieldRole::input && std::find(found.begin(), found.end(), &f) == found.end())
      say_not_replayable(o, "it does not tell '" + std::string(f.name) + "' of each " + kind);
  }
  if (ours == &tick_table()) o.tick_fields = found;
  return t;
}

}  // namespace

NamedNumbers::NamedNumbers(std::string what, std::vector<std::string> names, const std::vector<std::string>& here)
    : what_(std::move(what)), names_(std::move(names)) {
  for (std::size_t n = 0; n < names_.size(); ++n) {
    const auto at = std::find(here.begin(), here.end(), names_[n]);
    here_.push_back(at == here.end() ? -1 : static_cast<int>(at - here.begin()));
    all_known_ = all_known_ && here_.back() >= 0;
    same_ = same_ && (here_.back() < 0 || here_.back() == static_cast<int>(n));
  }
  // A number behind the last is the last: where that is another one here, numbers are not their own.
  same_ = same_ && (names_.empty() || names_.size() == here.size());
}

int NamedNumbers::here_or_none(std::uint32_t number) const {
  if (here_.empty()) return static_cast<int>(number);
  return here_[std::min<std::size_t>(number, here_.size() - 1)];
}

std::uint32_t NamedNumbers::operator()(std::uint32_t number, const std::string& file) const {
  if (here_.empty() || (same_ && all_known_)) return number;
  const int here = here_or_none(number);
  if (here < 0)
    throw Error(ExitCode::corrupt,
                file + " was recorded with the " + what_ + " '" +
                    names_[std::min<std::size_t>(number, names_.size() - 1)] + "', which this version does not know",
                "a later version may have recorded it; use that");
  return static_cast<std::uint32_t>(here);
}

std::string header_json(const SessionHeader& h) {
  ordered_json j;
  j["osteotome_session"] = kSessionFormat;
  j["program"] = h.program_version;
  j["bone_hash"] = h.bone_hash;
  j["rate_hz"] = h.rate_hz;
  j["hands"] = h.haptics.hands();
  j["dust"] = h.dust;
  j["heat"] = h.heat;
  j["dust_model"] = h.dust_model;  // dust may begin later
  // Where an older session goes on under its own settings, it is reported by them.
  const int law = h.haptics.params.guard.law, contact = law == GuardParams{}.law ? h.kernels.contact : law + 1;
  j["kernels"] = {{"burrs", h.kernels.burrs}, {"contact", contact}, {"scene", h.kernels.scene}};
  for (const RecordTable* const t : {&tick_table(), &change_table(), &action_record_table()})
    j["records"][std::string(t->name)] = record_json(*t);
  j["records"]["note"] = {{"part", kNotesPart}, {"text", true}, {"meaning", "a line of JSON each: tick, kind, value"}};
  for (std::uint32_t kind = 1; name_of(static_cast<ActionKind>(kind)) != "?"; ++kind)
    j["actions"][std::to_string(kind)] = name_of(static_cast<ActionKind>(kind));
  j["instruments"] = instruments_json();
  j["plates"] = plates_json();
  j["haptics"] = haptics_json(h.haptics);
  return j.dump();
}

void read_header(std::string_view text, const std::string& name, SessionOutline& o, std::vector<FileTable>& tables,
                 FileNumbers& numbers) {
  const auto j = ordered_json::parse(text);
  if (!j.contains("osteotome_session")) throw Error(ExitCode::corrupt, name + " is not a session of this program");
  SessionHeader& h = o.header;
  h.program_version = j.at("program");
  if (j["osteotome_session"] != kSessionFormat) {
    throw Error(ExitCode::corrupt,
                name + " is a session of format " + j["osteotome_session"].dump() + ", recorded by " +
                    h.program_version + "; this version reads format " + std::to_string(kSessionFormat),
                "use the version it was recorded with, which can also export it");
  }
  h.bone_hash = j.at("bone_hash");
  h.rate_hz = j.at("rate_hz");
  h.dust = j.value("dust", false);
  h.heat = j.value("heat", false);
  h.dust_model = j.value("dust_model", 1);
  if (!(h.rate_hz > 0)) throw Error(ExitCode::corrupt, name + " gives no rate");
  const auto& k = j.at("kernels");
  h.kernels = {k.at("burrs"), k.at("contact"), k.at("scene")};
  Kernels repeated = h.kernels;
  const bool older_guard = h.kernels.contact >= kFirstRepeatedContact && h.kernels.contact < Kernels{}.contact;
  if (older_guard) repeated.contact = Kernels{}.contact;
  if (repeated != Kernels{})
    say_not_replayable(o, "burrs, contact or scene of " + h.program_version + " give other bits than this version's");
  for (const auto& [kind, record] : j.at("records").items()) tables.push_back(table_of(kind, record, name, o));
  const auto has = [&](std::uint32_t part) {
    return std::any_of(tables.begin(), tables.end(), [&](const FileTable& t) { return t.part == part; });
  };
  for (const RecordTable* const t : {&tick_table(), &change_table(), &action_record_table()}) {
    if (!has(t->part)) throw Error(ExitCode::corrupt, name + " does not describe its records");
    for (const FileTable& f : tables) {
      // What nothing can be read without.
      const auto named = [&](std::size_t n) {
        return std::any_of(f.fields.begin(), f.fields.end(),
                           [&](const FileField& x) { return x.ours == &t->fields[n]; });
      };
      if (f.part == t->part && !(named(0) && (t != &change_table() || named(1))))
        throw Error(ExitCode::corrupt, name + " lacks '" + std::string(t->fields[0].name) + "' in its records");
    }
  }
  for (const auto& [kind, action] : j.at("actions").items())
    o.action_names[static_cast<std::uint32_t>(std::stoul(kind))] = action;
  o.tools = names_of(instrument_library());
  o.plates = names_of(plate_library());
  numbers.tools = NamedNumbers("instrument", instruments_in(j.at("instruments")), o.tools);
  numbers.plates = NamedNumbers("plate", names_in(j.value("plates", ordered_json::array())), o.plates);
  o.numbered_alike = numbers.tools.same() && numbers.plates.same();
  std::vector<std::string> unknown;
  h.haptics = setup_of(j.at("haptics"), numbers.tools, unknown);
  if (j.at("hands") != h.haptics.hands())
    throw Error(ExitCode::corrupt, name + " does not tell of a device for each hand");
  if (h.haptics.hands() > kMaxHands) say_not_replayable(o, "it has " + std::to_string(h.haptics.hands()) + " hands");
  if (older_guard) h.haptics.params.guard.law = h.kernels.contact - 1;
  for (const auto& [setting, value] : j.at("haptics").at("params").items()) o.setting_names.push_back(setting);
  for (const std::string& u : unknown) {
    o.newer.push_back("the setting '" + u + "'");
    say_not_replayable(o, "this version has no setting '" + u + "'");
  }
}

}  // namespace osteo::inline session
