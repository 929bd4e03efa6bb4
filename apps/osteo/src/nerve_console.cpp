// osteo nerve-console: the nerve monitor in a window of its own.
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "commands/nerve_console.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/network/wire/server.h"
#include "window_program.h"

namespace osteo {

cli::CommandInfo NerveConsoleCommand::info() {
  return {"nerve-console",
          "the nerve monitor's console, over the network",
          "A window that shows the nerve monitor of a rehearsal elsewhere, which streams by OpenIGTLink (--stream "
          "igtl:PORT, or osteo stream): "
          "sweep of the channels, answers to pulses, events, gain of each channel, freeze, sound and alarm. It only "
          "listens, but for the "
          "stimulator, where it is "
          "given the code of a rehearsal that lets it. It looks for the "
          "server until it is there, and again when it went.",
          {{"server", "PORT, for this machine, or HOST:PORT"}},
          "osteo nerve-console 18944"};
}

int NerveConsoleCommand::run(const Params& p, cli::Invocation& io) {
  static_cast<void>(wire_address(io.arguments[0]));
  std::vector<std::string> args{window_program("osteo-console", ""), io.arguments[0]};
  ConsoleFlags flags = p, defaults;
  const auto usual = fields_of<ConsoleFlags>(defaults), given = fields_of<ConsoleFlags>(flags);
  add_changed_flags(args, given, usual, io);
  become(std::move(args), io);
}

}  // namespace osteo
