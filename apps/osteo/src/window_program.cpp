#include "window_program.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "osteo/core/base/error.h"

namespace osteo {

std::string window_program(std::string_view name, std::string_view instead) {
  const std::string program(name);
  const std::filesystem::path path = std::filesystem::read_symlink("/proc/self/exe").parent_path() / program;
  if (!std::filesystem::exists(path)) {
    std::string advice =
        "in a clone './osteo' builds it when its command is asked for, and 'cmake --build build/release --target " +
        program + "' does (with OSTEO_WINDOW=ON); from packages: apt-get install osteo-rehearse";
    if (!instead.empty()) advice += "; or " + std::string(instead);
    throw Error(ExitCode::failed, "the window's program '" + program + "' is not beside this one", advice);
  }
  return path.string();
}

void add_changed_flags(std::vector<std::string>& command, const std::vector<FieldRef>& given,
                       const std::vector<FieldRef>& usual, const cli::Invocation& io) {
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].to_text() != usual[i].to_text() || io.given.contains(std::string(given[i].doc.name)))
      command.push_back(given[i].flag() + "=" + given[i].to_text());
  }
}

void become(std::vector<std::string> command, const cli::Invocation& io) {
  if (io.common.quiet) command.emplace_back("--quiet");
  std::vector<char*> argv;
  for (auto& a : command) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(command[0].c_str(), argv.data());
  throw Error(ExitCode::failed, "cannot start '" + command[0] + "': " + std::strerror(errno));
}

}  // namespace osteo
