// osteo console: the nerve monitor in a window of its own.
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "commands/console.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/network/wire/server.h"

namespace osteo {

cli::CommandInfo ConsoleCommand::info() {
  return {
      "console",
      "the nerve monitor's console, over the network",
      "A window that shows the nerve monitor of a rehearsal elsewhere, which streams by OpenIGTLink (--stream igtl:PORT, or osteo stream): "
      "sweep of the channels, answers to pulses, events, gain of each channel, freeze, sound and alarm. It only listens, but for the "
      "stimulator, where it is "
      "given the code of a rehearsal that lets it. It looks for the "
      "server until it is there, and again when it went.",
      {{"server", "PORT, for this machine, or HOST:PORT"}},
      "osteo console 18944"};
}

int ConsoleCommand::run(const Params& p, cli::Invocation& io) {
  static_cast<void>(wire_address(io.arguments[0]));
  // The window is a program of its own, so that servers need neither GLFW nor a display.
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "osteo-console";
  if (!fs::exists(program))
    throw Error(ExitCode::failed, "this build has no window (osteo-console is missing)", "build with -DOSTEO_WINDOW=ON");
  std::vector<std::string> args{program.string(), io.arguments[0]};
  ConsoleFlags flags = p, defaults;
  const auto usual = fields_of<ConsoleFlags>(defaults), given = fields_of<ConsoleFlags>(flags);
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].to_text() != usual[i].to_text()) args.push_back(given[i].flag() + "=" + given[i].to_text());
  }
  if (io.common.quiet) args.emplace_back("--quiet");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  throw Error(ExitCode::failed, "cannot start '" + program.string() + "': " + std::strerror(errno));
}

}  // namespace osteo
