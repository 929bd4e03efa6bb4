// osteo replay: a session run again, and the proof that it comes out the same.
#include <cmath>
#include <ostream>

#include "commands/replay.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo {

cli::CommandInfo ReplayCommand::info() {
  return {"replay",
          "run a session again and prove that it comes out the same",
          "Feeds the recorded poses to the same servo on the case's bone and compares every tick, the bone and the "
          "surface bit for bit; "
          "also applies the recorded "
          "voxel changes and compares that. Exit code 7 when anything differs, 8 when ticks were not recorded (what "
          "comes before is repeated, "
          "the rest taken from the recorded changes), 4 when the file is damaged.",
          {{"session", "a session folder"}},
          "osteo replay SESSION",
          false,
          {},
          {"surface_out", "bone_out"}};
}

int ReplayCommand::run(const Params& p, cli::Invocation& io) {
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const Case the_case = load_case(folder.case_folder);
  HapticSetup setup = outline.header.haptics;
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  const ReplayResult r = replay(session, world_at_begin(folder, the_case, anatomy, io.context), anatomy, io.context);
  if (!p.surface_out.empty()) {
    if (fs::exists(p.surface_out) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + p.surface_out + "' exists already", "--force replaces it");
    save_surface(surface_of(*r.world, io.context), p.surface_out);
  }
  if (!p.bone_out.empty()) {
    if (fs::exists(p.bone_out) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + p.bone_out + "' exists already", "--force replaces it");
    save_grid(to_sparse(r.world->bodies().front().body->bone, "density"), p.bone_out);
  }
  io.end_progress();
  Json j{{"ticks", r.ticks},         {"ticks_repeated", r.ticks_repeated},
         {"actions", r.actions},     {"identical", r.identical},
         {"complete", r.complete},   {"losses", r.losses},
         {"bone_hash", r.bone_hash}, {"surface_hash", r.surface_hash},
         {"dust_hash", r.dust_hash}, {"removed_mm3", r.removed_mm3},
         {"seconds", r.seconds}};
  if (anatomy.structures)
    j["structures"] = Json::parse(structures_json(r.structures, *anatomy.structures, outline.header.rate_hz)).value();
  if (!folder.approval.empty()) j["approval"] = folder.approval;
  if (!r.difference.empty()) j["difference"] = r.difference;
  if (r.difference_since_s) j["same_until_s"] = *r.difference_since_s;
  if (io.common.json) io.out << j.dump(2) << '\n';
  // Losses are told even when quiet: they are no talk.
  for (const std::string& line : r.losses) io.err << "session: " << line << '\n';
  if (const std::string words = simulated_text(session); !words.empty() && !io.common.quiet)
    io.err << "session: " << words << '\n';
  for (const std::string& line : outline.newer) io.err << "session: of a later version, left out: " << line << '\n';
  if (!folder.approval.empty() && !io.common.quiet) io.err << "case, when it was recorded: " << folder.approval << '\n';
  const bool whole = outline.gaps.empty();
  if (!whole) {
    io.err << "only the first " << r.ticks_repeated << " of " << r.ticks << " ticks could be run again; "
           << (outline.bone_known_until() ? "bone behind the first loss is not known"
                                          : "behind them the recorded changes give the bone")
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << "replayed " << r.ticks_repeated << " ticks and " << r.actions << " actions in "
           << format_number(std::round(r.seconds * 100) / 100)
           << " s: " << (r.identical ? "bit for bit the same" : "DIFFERENT, " + r.difference)
           << (r.complete ? "" : " (the session was cut short: its end is not recorded)") << '\n'
           << "bone " << r.bone_hash << "  surface " << r.surface_hash << '\n';
  }
  if (outline.damaged()) return static_cast<int>(ExitCode::corrupt);
  if (!r.identical) return static_cast<int>(ExitCode::failed);
  return whole ? 0 : static_cast<int>(ExitCode::partial);
}

}  // namespace osteo
