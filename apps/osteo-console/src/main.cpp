// The nerve monitor's console of 'osteo nerve-console', a program of its own.
#include <iostream>
#include <mutex>

#include "console_flags.h"
#include "osteo/app/cli/command.h"
#include "osteo/app/window/console_window.h"
#include "osteo/core/base/error.h"
#include "osteo/network/wire/remote_monitor.h"
#include "window_main.h"

namespace osteo {
namespace {

struct ConsoleWindowCommand {
  using Params = ConsoleFlags;
  static void describe(Params& p, auto& visit) { ConsoleFlags::describe(p, visit); }
  static cli::CommandInfo info() {
    return {"nerve-console",
            "the nerve monitor's console, over the network",
            "What 'osteo nerve-console SERVER' opens.",
            {{"server", "PORT or HOST:PORT of a rehearsal that streams"}},
            "osteo-console 18944"};
  }
  static int run(const Params& p, cli::Invocation& io) {
    const WireAddress server = wire_address(io.arguments[0]);
    if (server.port == 0) throw Error(ExitCode::usage, "'" + io.arguments[0] + "' names no port", "PORT or HOST:PORT");
    const std::string code = tidy_code(p.code);
    if (!p.code.empty() && code.empty())
      throw Error(ExitCode::usage, "this is no code",
                  "eight letters and digits, as the rehearsal shows them: K7MX-2QPA");
    ShellOptions shown;
    shown.width = p.width;
    shown.height = p.height;
    shown.scale = p.scale;
    WindowShell shell(shown);
    std::mutex mutex;
    std::shared_ptr<MonitorController> controller;  // the network's thread makes it, the window's shows it
    RemoteMonitor* there = nullptr;                 // of the window's thread
    const auto begin = [&](const WireMonitor& monitor) {
      auto made = std::make_shared<MonitorController>(monitor.labels, monitor.event_uv);
      if (!code.empty()) {
        made->lend({[&] { return there != nullptr && there->stimulator().paired; },
                    [&](const StimulatorSetting& s) { there->stimulate(s); }, [&] { return there->stimulator().now; },
                    [&] { return std::size_t{there->stimulator().hands}; }});
      }
      const std::lock_guard lock(mutex);
      controller = made;
      return made->sinks();
    };
    RemoteMonitor remote(server, begin, code);
    there = &remote;
    ConsoleOptions options;
    options.server = server.host + ":" + std::to_string(server.port);
    options.state_file = p.state_file;
    options.sound = p.sound;
    options.controller = [&] {
      const std::lock_guard lock(mutex);
      return controller;
    };
    options.facts = [&] {
      return ConsoleFacts{remote.connected(), remote.ended(),  remote.samples(),
                          remote.lost(),      remote.events(), remote.trouble()};
    };
    options.stop = [&] { return io.context.cancelled(); };
    run_console_window(shell, options);
    if (!io.common.quiet)
      io.err << remote.samples() << " samples, " << remote.lost() << " lost on the way, " << remote.events()
             << " events" << std::endl;
    require_no_gl_errors(shell.gl_errors());
    return 0;
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  return osteo::run_window_program<osteo::ConsoleWindowCommand>(
      argc, argv, "osteo-console: the nerve monitor's console, over the network", std::string(osteo::kOwnLicence));
}
