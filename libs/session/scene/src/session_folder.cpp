#include "osteo/session/scene/session_folder.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/recording/haptic_settings.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/approval.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;

std::string relative_to(const fs::path& target, const fs::path& folder) {
  return fs::proximate(fs::absolute(target), fs::absolute(folder)).string();
}

ordered_json quantiles(const Histogram& h) {
  return {
      {"p50", h.quantile_us(0.5)}, {"p99", h.quantile_us(0.99)}, {"p99.9", h.quantile_us(0.999)}, {"max", h.max_us()}};
}

}  // namespace

SessionFolder create_session_folder(const fs::path& wanted, const fs::path& case_folder, const fs::path& resumed_from,
                                    const std::string& guided, double resumed_at_s) {
  SessionFolder s{wanted, case_folder, resumed_from, {}, resumed_at_s, guided};
  if (wanted.empty()) {
    for (int n = 1;; ++n) {
      s.folder = case_folder / "sessions" / std::to_string(n);
      if (!fs::exists(s.folder)) break;
    }
  } else if (fs::exists(wanted) && !(fs::is_directory(wanted) && fs::is_empty(wanted))) {
    throw Error(ExitCode::cannot_write, "'" + wanted.string() + "' exists already",
                "give another name; a session is never overwritten");
  }
  std::error_code ec;
  fs::create_directories(s.folder, ec);
  if (ec)
    throw Error(ExitCode::cannot_write, "cannot make the folder '" + s.folder.string() + "': " + ec.message(),
                "choose a folder that you may write to");
  ordered_json j{{"osteotome_session_folder", 1}, {"case", relative_to(case_folder, s.folder)}};
  if (!resumed_from.empty()) j["resumed_from"] = relative_to(resumed_from, s.folder);
  if (resumed_at_s > 0) j["resumed_at_s"] = resumed_at_s;
  if (!guided.empty()) j["guided"] = guided;
  try {
    const ApprovalNow now = approval_of(case_folder);
    s.approval = now.words();
    j["approval"] = ordered_json::parse(approval_json(now).dump());
    j["approval"]["words"] = s.approval;
  } catch (const Error&) {
    // A session on what is no case, as tests have them: nothing is known of it.
  }
  write_file(s.folder / "session.json", j.dump(2) + "\n");
  return s;
}

SessionFolder open_session_folder(const fs::path& folder, const fs::path& case_folder) {
  require_readable(folder);
  const fs::path file = folder / "session.json";
  if (!fs::exists(file))
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is not a session: it has no session.json");
  // Also of "SESSION/", as a shell completes it: the folder has its name.
  SessionFolder s{folder.has_filename() ? folder : folder.parent_path(), case_folder, {}, {}, 0, {}};
  try {
    const auto j = ordered_json::parse(read_text(file));
    if (s.case_folder.empty()) s.case_folder = folder / j.at("case").get<std::string>();
    if (j.contains("approval")) s.approval = j["approval"].at("words").get<std::string>();
    if (j.contains("resumed_at_s")) s.resumed_at_s = j["resumed_at_s"].get<double>();
    if (j.contains("guided")) s.guided = j["guided"].get<std::string>();
    if (j.contains("resumed_from")) s.resumed_from = folder / j["resumed_from"].get<std::string>();
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::corrupt, "'" + file.string() + "' is damaged: " + json_complaint(e));
  }
  return s;
}

World world_of(const Case& the_case, const Anatomy& anatomy) {
  World world(to_bricks(the_case.bone), anatomy.hardness);
  if (const auto region = the_case.files.find("region"); region != the_case.files.end())
    world.add_region(to_bricks(load_grid(region->second)), anatomy.region_hardness);
  return world;
}

std::vector<SessionBefore> sessions_before(const SessionFolder& session) {
  std::vector<SessionBefore> chain;
  // Folders are compared as what they are, whatever way leads to them.
  const auto place = [](const fs::path& folder) { return fs::weakly_canonical(folder); };
  std::set<fs::path> seen{place(session.folder)};
  for (SessionFolder s = session; !s.resumed_from.empty();) {
    const double until_s = s.resumed_at_s;
    const fs::path from = s.folder;
    s = open_session_folder(s.resumed_from, s.case_folder);
    if (!seen.insert(place(s.folder)).second)
      throw Error(ExitCode::corrupt,
                  "the sessions resume from each other in a circle: '" + from.string() + "' leads back to '" +
                      s.folder.string() + "'",
                  "correct \"resumed_from\" in '" + (from / "session.json").string() +
                      "', or take it out if that began with the case");
    chain.push_back({s, until_s});
  }
  std::reverse(chain.begin(), chain.end());
  return chain;
}

namespace {

// An open session, and the scene at its beginning as it was recorded on it.
SessionReader begin_of(const SessionFolder& session, const World& world, const Context& context) {
  SessionReader recorded(session.stream());
  const std::string name = "the session '" + session.folder.string() + "'";
  if (world.hash() != recorded.header().bone_hash) {
    throw Error(ExitCode::corrupt, name + " was recorded on another bone than its case holds now",
                "give the case it was recorded on, unchanged");
  }
  for (const std::string& line : losses(recorded.outline())) context.warn(name + ": " + line);
  for (const std::string& line : recorded.outline().newer)
    context.warn(name + " is of a later version: left out " + line);
  return recorded;
}

World until_time(const SessionFolder& session, double t_s, World world, const Context& context) {
  const SessionReader recorded = begin_of(session, world, context);
  const double rate_hz = recorded.header().rate_hz;
  const auto tick = static_cast<std::uint64_t>(std::llround(t_s * rate_hz));
  if (const std::uint64_t reached = apply_recorded_until(recorded, world, tick); reached < tick)
    throw Error(ExitCode::usage,
                "the session '" + session.folder.string() + "' lasts " +
                    format_number(static_cast<double>(reached) / rate_hz) + " s, not " + format_number(t_s) + " s",
                "ask for a time within it, or for none: its end");
  return world;
}

World until_end(const SessionFolder& session, World world, const Context& context) {
  const SessionReader recorded = begin_of(session, world, context);
  const SessionOutline& o = recorded.outline();
  const auto lost = std::find_if(o.gaps.begin(), o.gaps.end(), [](const Gap& g) { return g.bone_lost; });
  if (lost == o.gaps.end()) {
    apply_recorded(recorded, world);
    if (o.end && !o.end->bone_hash.empty() && world.hash() != o.end->bone_hash) {
      throw Error(ExitCode::corrupt,
                  "the changes recorded in '" + session.folder.string() + "' do not give the bone it ended with");
    }
    return world;
  }
  // All bone was written once more at the end, if the session came to one.
  World before = world.copy();
  try {
    apply_recorded(recorded, world);
    if (o.end && world.hash() == o.end->bone_hash) return world;
  } catch (const Error&) {
    // It changes voxels of pieces that came to be while nothing was recorded.
  }
  context.warn("the session '" + session.folder.string() + "': what it did from tick " +
               std::to_string(lost->first_tick) + " on cannot be used; the bone is the one before");
  apply_recorded_until(recorded, before, lost->first_tick);
  return before;
}

}  // namespace

World world_at_begin(const SessionFolder& session, const Case& the_case, const Anatomy& anatomy,
                     const Context& context) {
  // Looked through before any of them is read, and one after the other: as long a chain as the disk holds.
  const std::vector<SessionBefore> chain = sessions_before(session);
  World world = world_of(the_case, anatomy);
  for (const SessionBefore& before : chain) {
    world = before.until_s > 0 ? until_time(before.session, before.until_s, std::move(world), context)
                               : until_end(before.session, std::move(world), context);
  }
  return world;
}

World world_at(const SessionFolder& session, double t_s, const Case& the_case, const Anatomy& anatomy,
               const Context& context) {
  return until_time(session, t_s, world_at_begin(session, the_case, anatomy, context), context);
}

World world_at_end(const SessionFolder& session, const Case& the_case, const Anatomy& anatomy, const Context& context) {
  return until_end(session, world_at_begin(session, the_case, anatomy, context), context);
}

void apply_haptic_settings(const fs::path& case_folder, const fs::path& file, HapticSetup& setup) {
  if (!file.empty()) {
    load_haptic_settings(file, setup);
  } else if (fs::exists(case_folder / "haptics.json")) {
    load_haptic_settings(case_folder / "haptics.json", setup);
  }
}

Anatomy anatomy_of(const Case& the_case, HapticSetup& setup, const Context& context) {
  Anatomy anatomy;
  const auto hu = the_case.files.find("hu");
  if (!setup.hardness) {
    setup.hardness = hu != the_case.files.end();
    if (!*setup.hardness) context.warn("the case keeps no HU: all its bone will resist the burr alike");
  }
  if (*setup.hardness) {
    if (hu == the_case.files.end()) {
      throw Error(ExitCode::no_input, "the case keeps no HU, so that the hardness of its bone is not known",
                  "set \"hardness\" to false, or prepare the case with its hu.vdb");
    }
    if (setup.hardness_json.empty()) setup.hardness_json = default_hardness_json();
    const HardnessLaw law = parse_hardness(setup.hardness_json, "the law of hardness");
    const SparseGrid values = load_grid(hu->second);
    anatomy.hardness = std::make_shared<const Hardness>(to_bricks(the_case.bone), values, law);
    if (const auto region = the_case.files.find("region"); region != the_case.files.end())
      anatomy.region_hardness = std::make_shared<const Hardness>(to_bricks(load_grid(region->second)), values, law);
  }
  setup.structures.clear();
  if (const auto file = the_case.files.find("structures"); file != the_case.files.end()) {
    const auto volume = load_volume(file->second, context);
    const auto* const labels = std::get_if<Labels>(&volume);
    // Of structures that were all deleted by hand an empty map is left.
    const auto any = [](std::uint8_t v) { return v != 0; };
    if (labels != nullptr && std::any_of(labels->span().begin(), labels->span().end(), any)) {
      anatomy.structures = std::make_shared<const StructureMap>(*labels, 8, context, setup.opened);
      setup.structures = anatomy.structures->hash();
    }
  }
  return anatomy;
}

namespace {

ordered_json hardness_of(const Anatomy& anatomy) {
  if (!anatomy.hardness) return nullptr;
  HardnessLaw law = anatomy.hardness->law();
  ordered_json j;
  for (const FieldRef& f : fields_of<HardnessLaw>(law)) j[std::string(f.doc.name)] = ordered_json::parse(f.to_text());
  return j;
}

ordered_json structures_of(const std::map<std::uint32_t, StructureEvents>& structures, const StructureMap& map,
                           double rate_hz) {
  ordered_json j = ordered_json::array();
  for (const auto& [value, e] : structures) {
    j.push_back({{"name", map.name_of(static_cast<std::uint8_t>(value))},
                 {"value", value},
                 {"least_clearance_mm", e.least_clearance_mm},
                 {"touched_s", static_cast<double>(e.ticks_touched) / rate_hz},
                 {"injured_s", static_cast<double>(e.ticks_injured) / rate_hz}});
  }
  return j;
}

}  // namespace

std::string hardness_json(const Anatomy& anatomy) {
  return hardness_of(anatomy).dump();
}

std::string reported_hardness(const Anatomy& anatomy) {
  if (!anatomy.hardness) return "all bone resists the burr alike";
  const HardnessLaw& law = anatomy.hardness->law();
  const double half = law.zero_hu + (law.cortical_hu - law.zero_hu) / 2;
  return "bone resists the burr by its HU: " + format_number(law.cortical_hu) + " HU as 1, " + format_number(half) +
         " HU as " + format_number(std::round(100 * law.at(half)) / 100) +
         R"(; {"osteotome_haptics": 1, "hardness": false} in --settings turns that off)";
}

std::string structures_json(const std::map<std::uint32_t, StructureEvents>& structures, const StructureMap& map,
                            double rate_hz) {
  return structures_of(structures, map, rate_hz).dump();
}

std::string write_summary(const SessionFolder& session, const RehearsalSummary& s, double rate_hz,
                          const std::string& burr, const Anatomy& anatomy) {
  ordered_json j;
  j["osteotome_session_summary"] = 1;
  j["ticks"] = s.ticks;
  j["rate_hz"] = rate_hz;
  j["burr"] = burr;
  j["removed_mm3"] = s.removed_mm3;
  if (!session.guided.empty()) j["guided"] = session.guided;
  j["hardness"] = hardness_of(anatomy);
  if (s.sawn_mm3 > 0) j["sawn_mm3"] = s.sawn_mm3;
  if (s.crumbs_mm3 > 0) j["crumbs_mm3"] = s.crumbs_mm3;
  j["gone_mm3"] = s.gone_mm3;
  if (s.tissue_mm3 > 0) j["tissue_cut_off_mm3"] = s.tissue_mm3;
  for (const SoftTissue::Facts& f : s.tissue) j["tissue"].push_back({{"name", f.name}, {"cut_off_mm3", f.cut_off_mm3}});
  if (s.bodies > 1) j["bodies"] = s.bodies;
  for (const Fixture& f : s.fixtures) {
    j["plates"].push_back({{"plate", plate_library()[f.plate].name}, {"number", f.id}, {"opening_mm", f.opening_mm}});
  }
  j["bone_hash"] = s.bone_hash;
  j["surface_hash"] = s.surface_hash;
  j["session_bytes"] = s.session_bytes;
  // Of all readers; each by itself where there is something to tell.
  j["ticks_lost_by_readers"] = s.ticks_not_recorded + s.ticks_not_followed;
  if (!s.gaps.empty() || s.ticks_not_recorded > 0) {
    j["ticks_not_recorded"] = s.ticks_not_recorded;
    for (const RecordingGap& g : s.gaps)
      j["gaps"].push_back({{"first_tick", g.first_tick}, {"ticks", g.ticks}, {"bone_changes_lost", g.bone_lost}});
  }
  if (s.notes_not_recorded > 0) j["notes_not_recorded"] = s.notes_not_recorded;
  if (s.ticks_not_followed > 0) j["ticks_not_followed"] = s.ticks_not_followed;
  if (s.interrupted) j["interrupted"] = true;
  if (s.unusable_poses > 0) j["pose_unusable_s"] = static_cast<double>(s.unusable_poses) / rate_hz;
  // What was asked for and not done, or not so.
  for (const ActionNote& n : s.notes) {
    j[n.done ? "actions_done_otherwise" : "actions_refused"].push_back({{"tick", n.tick},
                                                                        {"t_s", static_cast<double>(n.tick) / rate_hz},
                                                                        {"action", name_of(n.kind)},
                                                                        {"why", n.why},
                                                                        {"times", n.times}});
  }
  if (!s.warnings.empty()) j["warnings"] = s.warnings;
  if (!s.pieces.empty()) {
    j["fragments"] = ordered_json::array();
    for (const auto& p : s.pieces) {
      j["fragments"].push_back(
          {{"volume_mm3", p.mass * s.voxel_mm3}, {"centre_mm", {p.centre_mm.x, p.centre_mm.y, p.centre_mm.z}}});
    }
  }
  if (s.dust) {
    j["dust_mm3"] = {{"made", s.dust->added_mm3},
                     {"lying", s.dust->present_mm3},
                     {"in_slurry", s.dust->slurry_mm3},
                     {"sucked_off", s.dust->sucked_mm3},
                     {"fallen_out_of_reach", s.dust->fallen_mm3}};
    if (s.dust->poured_mm3 > 0)
      j["water_mm3"] = {{"poured", s.dust->poured_mm3},
                        {"standing", s.dust->water_mm3},
                        {"sucked_off", s.dust->water_sucked_mm3},
                        {"dried", s.dust->dried_mm3},
                        {"run_off", s.dust->run_off_mm3}};
  }
  if (anatomy.structures) {
    j["structures"] = structures_of(s.structures, *anatomy.structures, rate_hz);
    for (std::size_t n = 0; n < anatomy.structures->values().size(); ++n)
      if (anatomy.structures->opened(n))
        j["structures_opened"].push_back(anatomy.structures->name_of(anatomy.structures->values()[n]));
  }
  for (const StructureCutEvent& e : s.structure_cuts) {
    if (!anatomy.structures) break;
    j["structures_cut"].push_back({{"name", anatomy.structures->name_of(e.cut.structure)},
                                   {"value", e.cut.structure},
                                   {"by", name_of(e.by)},
                                   {"hand", e.hand},
                                   {"tick", e.tick},
                                   {"t_s", static_cast<double>(e.tick) / rate_hz},
                                   {"mm3", e.cut.mm3},
                                   {"at_mm", {e.cut.at_mm.x, e.cut.at_mm.y, e.cut.at_mm.z}}});
  }
  if (s.loop) {
    const LoopStats& l = *s.loop;
    j["loop"] = {{"work_us", quantiles(l.work)},
                 {"wake_up_lateness_us", quantiles(l.lateness)},
                 {"missed_by_work", l.missed_by_work},
                 {"missed_by_machine", l.missed_by_machine},
                 {"realtime_priority", l.realtime_granted},
                 {"realtime_refusal", l.realtime_refusal},
                 {"memory_locked", l.memory_locked}};
  }
  const std::string text = j.dump(2) + "\n";
  write_file(session.summary(), text);
  return text;
}

}  // namespace osteo::inline session
