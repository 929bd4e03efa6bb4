// edit: a case corrected by hand, in a window or from a file.
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "audit_case.h"
#include "commands/edit.h"
#include "commands/prepare.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/shell.h"
#include "osteo/session/scene/case.h"
#include "window_program.h"

namespace osteo {

cli::CommandInfo EditCommand::info() {
  return {
      "edit",
      "correct the bone and the structures of a case by hand",
      "Opens a window with three slices and the bone in 3D: threshold, components, box, filling, smoothing, brush and "
      "eraser, structures, with "
      "undo. Saving writes edits.json into the case, which holds what was done and no voxel of the scan, and makes "
      "the case's bone again "
      "from it; prepare keeps it from then on. With --apply the same without a window, from a file. The scan is "
      "never changed.",
      {{"case", "a folder made by prepare"}},
      "osteo edit CASE"};
}

int EditCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[0];
  if (!output_exists(folder / "manifest.json")) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is not a prepared case: it has no manifest.json",
                "make one with: osteo prepare CT -o " + shell_path(folder));
  }
  if (!p.apply.empty()) {
    for (const char* const name : {"width", "height", "scale", "state_file"}) {
      if (io.given.contains(name))
        throw Error(ExitCode::usage, "--apply opens no window, so --" + std::string(name) + " does nothing");
    }
    // As prepare does it, with one thing changed.
    PrepareCommand::Params prepare;
    prepare.out = folder.string();
    prepare.edits = p.apply;
    cli::Invocation call = io;
    call.given = {"out", "edits"};
    call.arguments.clear();
    if (!p.scan.empty()) call.arguments.push_back(p.scan);
    return PrepareCommand::run(prepare, call);
  }
  audit_case(AuditTrail(), AuditEvent::Kind::open, folder, io.context);
  std::vector<std::string> args{window_program("osteo-edit", "use --apply edits.json"), folder.string()};
  EditFlags flags = p, defaults;
  const auto usual = fields_of<EditFlags>(defaults), given = fields_of<EditFlags>(flags);
  add_changed_flags(args, given, usual, io);
  if (io.common.threads != 0) args.push_back("--threads=" + std::to_string(io.common.threads));
  become(std::move(args), io);
}

}  // namespace osteo
