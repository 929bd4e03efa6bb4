// The nerve monitor's console, a window of its own.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "osteo/app/window/monitor_controller.h"
#include "osteo/app/window/window_shell.h"

namespace osteo::inline app {

/// What of the network it shows, and says in its state file.
struct ConsoleFacts {
  bool connected = false, ended = false;
  std::uint64_t samples = 0, lost = 0, events = 0;
  std::string trouble;  ///< in words; empty: none
};

struct ConsoleOptions {
  std::string server;                ///< as it was named
  std::filesystem::path state_file;  ///< as of the rehearsal's window
  bool sound = true;
  std::function<std::shared_ptr<MonitorController>()>
      controller;  ///< of the monitor that is heard of; null: none yet. Another one: another monitor
  std::function<ConsoleFacts()> facts;
  std::function<bool()> stop;  ///< asked before each picture
};

/// Until the person closes it (Q). F: freeze, M: mute, G: free run or by stimulus, S: stimulator, T: its threshold,
/// F11: full screen.
void run_console_window(WindowShell& shell, const ConsoleOptions& options);

}  // namespace osteo::inline app
