// osteo export: a session as files that others read.
#include <ostream>

#include "commands/export.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/export.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

cli::CommandInfo ExportCommand::info() {
  return {"export",
          "a session for other programs: CSV, HDF5 or MCAP",
          "By the ending: .csv for spreadsheets (actions and notes in files of their own, out-actions.csv and "
          "out-notes.csv), .h5 for MATLAB, "
          "Python and R (columns under /ticks, /actions, /gaps, /notes), .mcap for Foxglove and ROS tools. One row a "
          "tick: pose, force, "
          "torque, removal, flags, how late the machine was; notes are where the camera was, marks, choices. Of a "
          "damaged session all that is "
          "whole is written, and the exit code is 4.",
          {{"session", "a session folder, or a stream (.oss) by itself"},
           {"output", "file that ends in .csv, .h5 or .mcap"}},
          "osteo export SESSION ticks.csv"};
}

int ExportCommand::run(const Params&, cli::Invocation& io) {
  const fs::path given = io.arguments[0];
  const SessionReader session(given.extension() == ".oss" ? given : open_session_folder(given).stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const fs::path out = io.arguments[1];
  for (const fs::path& file : export_files(out)) {
    if (fs::exists(file) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + file.string() + "' exists already", "--force replaces it");
  }
  export_session(session, out, io.context);
  io.end_progress();
  for (const std::string& line : losses(outline)) io.err << "session: " << line << '\n';
  for (const std::string& line : outline.newer) io.err << "session: of a later version, left out: " << line << '\n';
  if (!io.common.quiet) {
    io.err << outline.tick_records << " ticks written to";
    for (const fs::path& file : export_files(out)) io.err << ' ' << file.string();
    io.err << (outline.end ? "" : " (the session was cut short)") << '\n';
  }
  return outline.damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
