#include "work_done.h"

#include <algorithm>
#include <cstdio>

#include "osteo/simulation/bone/instrument.h"
#include "state_facts.h"

namespace osteo::inline app {
namespace {

template <class... A>
std::string text_of(const char* format, A... a) {
  char out[160];
  std::snprintf(out, sizeof out, format, a...);
  return out;
}

}  // namespace

void WorkDone::action(const SceneAction& action) {
  if (static_cast<ActionKind>(action.kind) == ActionKind::saw) ++cuts_;
  if (static_cast<ActionKind>(action.kind) == ActionKind::undo) ++undone_;
}

void WorkDone::tick(const TickRecord& record, std::span<const VoxelChange>) {
  if (record.speed_rpm <= 0 && record.removed_mm3 <= 0) return;
  ByTool& tool = by_tool_[record.device.tool];
  if (record.speed_rpm > 0) ++tool.ticks_turning;
  tool.removed_mm3 += static_cast<double>(record.removed_mm3);
}

void SessionFacts::add_cut(const std::string& structure, const std::string& by, double mm3) {
  auto at = std::find_if(structures.begin(), structures.end(), [&](const Structure& s) { return s.name == structure; });
  if (at == structures.end()) at = structures.insert(structures.end(), {structure});
  at->cut_mm3[by] += mm3;
}

std::string kept_text(const std::filesystem::path& folder) {
  std::error_code ec;
  return std::filesystem::exists(folder, ec) ? "What was recorded is kept: " + folder.string()
                                             : "Nothing of it is kept: " + folder.string() + " was deleted or moved";
}

EndFacts end_facts(const SessionFacts& session, const WorkDone& work) {
  EndFacts out;
  const auto add = [&](std::string what, std::string value, Nearness nearness = Nearness::unknown) {
    out.lines.push_back({std::move(what), std::move(value), nearness});
  };
  add("time", clock_text(session.seconds));
  if (session.score) add("score", *session.score);
  add("bone drilled away", text_of("%.1f mm³", session.removed_mm3));
  for (const auto& [tool, done] : work.by_tool()) {
    add("    " + instrument_of(tool).name, text_of("%.1f mm³ in ", done.removed_mm3) +
                                               clock_text(static_cast<double>(done.ticks_turning) / session.rate_hz));
  }
  if (work.undone() > 0) add("taken back", text_of("%zu", work.undone()));
  if (work.cuts() > 0 || session.sawn_mm3 > 0) add("saw cuts", text_of("%zu, %.1f mm³", work.cuts(), session.sawn_mm3));
  if (session.tissue_mm3 > 0) add("soft tissue cut off", text_of("%.1f mm³", session.tissue_mm3));
  if (session.bodies > 1) add("fragments of bone", text_of("%zu", session.bodies));
  for (const std::string& p : session.plates) add("plate", p);
  if (session.has_structures && session.structures.empty()) add("critical structures", "none came near", Nearness::far);
  for (const SessionFacts::Structure& s : session.structures) {
    std::string drilled;  // by a tool that turns: said where its time is
    bool met = false;
    for (const auto& [by, mm3] : s.cut_mm3) {
      const std::string volume = text_of("%.2g mm³ of it", mm3);
      if (by == "burr" || by == "hand saw") {
        if (mm3 > 0) drilled += ", " + volume + (by == "burr" ? "" : " by the saw");
        continue;
      }
      met = true;
      if (mm3 <= 0) {
        add(s.name, "contact with the " + by, Nearness::close);
      } else {
        add(s.name,
            "INJURED: " + (by == "saw" ? "cut through by the saw, " : "the " + by + " went through it, ") + volume,
            Nearness::touched);
      }
    }
    if (s.injured_s > 0) {
      add(s.name, text_of("INJURED: touched by the rotating burr for %.2f s", s.injured_s) + drilled,
          Nearness::touched);
    } else if (s.touched_s > 0) {
      add(s.name, text_of("touched for %.2f s, drill off", s.touched_s), Nearness::close);
    } else if (!met) {
      add(s.name, text_of("never nearer than %.1f mm", s.least_clearance_mm),
          s.least_clearance_mm < StateFacts::kNearMm ? Nearness::near : Nearness::far);
    }
  }
  out.summary = clock_text(session.seconds) + text_of(" min, %.0f mm³ of bone", session.removed_mm3);
  if (session.score) out.summary += ", " + *session.score;
  out.warnings = session.warnings;
  out.folder = session.folder;
  out.past = session.past;
  return out;
}

}  // namespace osteo::inline app
