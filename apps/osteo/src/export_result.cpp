// osteo export-result: where a session left pieces and plates, for whoever operates.
#include <ostream>

#include "commands/export_result.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo {

cli::CommandInfo ExportResultCommand::info() {
  return {"export-result",
          "where a session left fragments and plates: transforms, STL, gaps between plate and bone",
          "Writes plan.json, an STL of each piece and plate where it is, and for each plate how far bone lies below "
          "its underside; a picture "
          "too. With --at-s the state at that time.",
          {{"session", "a session folder"}},
          "osteo export-result SESSION -o plan"};
}

int ExportResultCommand::run(const Params& p, cli::Invocation& io) {
  const SessionFolder session = open_session_folder(io.arguments[0], p.case_folder);
  const Case the_case = load_case(session.case_folder);
  const World world = p.at_s < 0 ? world_at_end(session, the_case, {}, io.context)
                                 : world_at(session, p.at_s, the_case, {}, io.context);
  const fs::path folder = p.out.empty() ? session.folder / "plan" : fs::path(p.out);
  SceneReaders readers(world, {}, 1000, io.context);
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  for (const auto& q : surface_of(world, io.context).points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(q[a]));
      hi[a] = std::max(hi[a], static_cast<double>(q[a]));
    }
  }
  const WorldPicture view{(lo + hi) * 0.5, 0.36 * length(hi - lo), normalized({0.8, -0.6, 0.2}), 1100, 850};
  const auto picture = draw_world(world, readers, nullptr, view);
  std::string text;
  write_folder_atomically(folder, {}, [&](const fs::path& whole) {
    text = write_result(world, whole, io.context);
    save_picture(picture, whole / "plan.png");
  });
  io.end_progress();
  if (io.common.json) io.out << text;
  if (!io.common.quiet)
    io.err << world.bodies().size() << (world.bodies().size() == 1 ? " fragment and " : " fragments and ")
           << world.fixtures().size() << (world.fixtures().size() == 1 ? " plate: " : " plates: ") << folder.string()
           << '\n';
  return 0;
}

}  // namespace osteo
