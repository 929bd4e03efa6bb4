#include "work_done.h"

#include <algorithm>
#include <cstdio>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/instrument.h"
#include "state_facts.h"

namespace osteo::inline app {
namespace {

template <class... A>
std::string text_of(const char* format, A... a) {
  char out[160];
  std::snprintf(out, sizeof out, format, a...);
  return shown_figures(out);
}

// Of what does not turn: "saw", "shaft", "plate screws".
std::string cut_text(const std::string& by, double mm3) {
  const std::initializer_list<Place> places{{"tool", tr(by)}, {"mm3", text_of("%.2g", mm3)}};
  if (mm3 <= 0) return filled(tr("contact with the {tool}"), places);
  if (by == "saw") return filled(tr("INJURED: cut through by the saw, {mm3} mm³ of it"), places);
  return filled(tr("INJURED: the {tool} went through it, {mm3} mm³ of it"), places);
}

std::string injured_text(double seconds, double by_burr_mm3, double by_saw_mm3) {
  const std::initializer_list<Place> places{
      {"time", shown_number(seconds, 2)}, {"mm3", text_of("%.2g", by_burr_mm3)}, {"sawn", text_of("%.2g", by_saw_mm3)}};
  if (by_burr_mm3 > 0 && by_saw_mm3 > 0)
    return filled(
        tr("INJURED: touched by the rotating burr for {time} s, {mm3} mm³ of it, {sawn} mm³ of it by the saw"), places);
  if (by_burr_mm3 > 0) return filled(tr("INJURED: touched by the rotating burr for {time} s, {mm3} mm³ of it"), places);
  if (by_saw_mm3 > 0)
    return filled(tr("INJURED: touched by the rotating burr for {time} s, {sawn} mm³ of it by the saw"), places);
  return filled(tr("INJURED: touched by the rotating burr for {time} s"), places);
}

}  // namespace

void WorkDone::action(const SceneAction& action) {
  if (static_cast<ActionKind>(action.kind) == ActionKind::saw) ++cuts_;
  if (static_cast<ActionKind>(action.kind) == ActionKind::undo) ++undone_;
}

void WorkDone::tick(const TickRecord& record, std::span<const VoxelChange>) {
  int nearness = 0;
  if ((record.flags & kStructureInjured) != 0) {
    nearness = 3;
  } else if ((record.flags & kStructureTouched) != 0) {
    nearness = 2;
  } else if (record.structure != 0 && static_cast<double>(record.clearance_mm) < StateFacts::kNearMm) {
    nearness = 1;
  }
  Was& was = was_[std::min<std::size_t>(record.hand, was_.size() - 1)];
  const int before = was.structure == record.structure ? was.nearness : 0;
  if (nearness > before) {  // what it was already is one time with it
    const std::lock_guard lock(mutex_);
    Harm& harm = harm_[static_cast<std::uint8_t>(record.structure)];
    if (before < 1) ++harm.near;
    if (before < 2 && nearness >= 2) ++harm.contacts;
    if (nearness == 3) ++harm.violations;
  }
  was = {record.structure, nearness};
  if (record.speed_rpm <= 0 && record.removed_mm3 <= 0) return;
  ByTool& tool = by_tool_[record.device.tool];
  if (record.speed_rpm > 0) ++tool.ticks_turning;
  tool.removed_mm3 += static_cast<double>(record.removed_mm3);
}

std::map<std::uint8_t, WorkDone::Harm> WorkDone::harm() const {
  const std::lock_guard lock(mutex_);
  return harm_;
}

void SessionFacts::add_cut(const std::string& structure, const std::string& by, double mm3) {
  auto at = std::find_if(structures.begin(), structures.end(), [&](const Structure& s) { return s.name == structure; });
  if (at == structures.end()) at = structures.insert(structures.end(), {structure});
  at->cut_mm3[by] += mm3;
}

std::string kept_text(const std::filesystem::path& folder) {
  std::error_code ec;
  return std::filesystem::exists(folder, ec)
             ? filled(tr("What was recorded is kept: {folder}"), {{"folder", folder.string()}})
             : filled(tr("Nothing of it is kept: {folder} was deleted or moved"), {{"folder", folder.string()}});
}

EndFacts end_facts(const SessionFacts& session, const WorkDone& work) {
  EndFacts out;
  const auto add = [&](std::string what, std::string value, Nearness nearness = Nearness::unknown) {
    out.lines.push_back({std::move(what), std::move(value), nearness});
  };
  add(tr("time"), clock_text(session.seconds));
  if (session.score) add(tr("score"), *session.score);
  add(tr("bone drilled away"), text_of("%.1f mm³", session.removed_mm3));
  for (const auto& [tool, done] : work.by_tool()) {
    add("    " + tr_sized(instrument_of(tool).name),
        filled(tr("{mm3} mm³ in {time}"),
               {{"mm3", shown_number(done.removed_mm3, 1)},
                {"time", clock_text(static_cast<double>(done.ticks_turning) / session.rate_hz)}}));
  }
  if (work.undone() > 0) add(tr("taken back"), text_of("%zu", work.undone()));
  if (work.cuts() > 0 || session.sawn_mm3 > 0)
    add(tr("saw cuts"), text_of("%zu, %.1f mm³", work.cuts(), session.sawn_mm3));
  if (session.tissue_mm3 > 0) add(tr("soft tissue cut off"), text_of("%.1f mm³", session.tissue_mm3));
  if (session.bodies > 1) add(tr("fragments of bone"), text_of("%zu", session.bodies));
  for (const std::string& p : session.plates) add(tr("plate"), p);
  if (session.has_structures && session.structures.empty())
    add(tr("critical structures"), tr("none came near"), Nearness::far);
  for (const SessionFacts::Structure& s : session.structures) {
    double by_burr_mm3 = 0, by_hand_saw_mm3 = 0;  // by a tool that turns: said where its time is
    bool met = false;
    for (const auto& [by, mm3] : s.cut_mm3) {
      if (by == "burr" || by == "hand saw") {
        (by == "burr" ? by_burr_mm3 : by_hand_saw_mm3) += std::max(0.0, mm3);
        continue;
      }
      met = true;
      add(tr(s.name), cut_text(by, mm3), mm3 <= 0 ? Nearness::close : Nearness::touched);
    }
    if (s.injured_s > 0) {
      add(tr(s.name), injured_text(s.injured_s, by_burr_mm3, by_hand_saw_mm3), Nearness::touched);
    } else if (s.touched_s > 0) {
      add(tr(s.name), filled(tr("touched for {time} s, drill off"), {{"time", shown_number(s.touched_s, 2)}}),
          Nearness::close);
    } else if (!met) {
      add(tr(s.name), filled(tr("never nearer than {mm} mm"), {{"mm", shown_number(s.least_clearance_mm, 1)}}),
          s.least_clearance_mm < StateFacts::kNearMm ? Nearness::near : Nearness::far);
    }
  }
  const double bone_mm3 = session.removed_mm3 + session.sawn_mm3;
  out.summary = filled(tr("{time} min, {mm3} mm³ of bone"),
                       {{"time", clock_text(session.seconds)}, {"mm3", shown_number(bone_mm3, bone_mm3 < 10 ? 1 : 0)}});
  if (session.score) out.summary += ", " + *session.score;
  out.warnings = session.warnings;
  out.folder = session.folder;
  out.past = session.past;
  return out;
}

}  // namespace osteo::inline app
