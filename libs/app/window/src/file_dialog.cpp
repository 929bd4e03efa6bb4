#include "file_dialog.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <utility>

extern char** environ;  // of POSIX, but in no header

namespace osteo::inline app {
namespace {

constexpr const char* kProgram = "zenity";
constexpr std::size_t kMaxSaid = 1 << 16;  // a path is shorter

}  // namespace

bool FileDialog::there() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  std::string folder;
  while (std::getline(folders, folder, ':')) {
    if (!folder.empty() && ::access((folder + "/" + kProgram).c_str(), X_OK) == 0) return true;
  }
  return false;
}

std::string FileDialog::open(const std::filesystem::path& folder) {
  if (is_open()) return {};
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return std::string("no dialog: ") + std::strerror(errno);
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  // A folder that ends in a slash is looked into.
  std::array<std::string, 5> words{kProgram, "--file-selection", "--directory", "--title=Osteotome: choose a case",
                                   "--filename=" + folder.string() + "/"};
  std::array<char*, 6> arguments{};
  for (std::size_t n = 0; n < words.size(); ++n) arguments[n] = words[n].data();
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY,
                                     0);  // toolkits complain there about themes
  const int failed = ::posix_spawnp(&process_, kProgram, &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    process_ = -1;
    return std::string("zenity could not be started: ") + std::strerror(failed);
  }
  from_ = ends[0];
  said_.clear();
  return {};
}

// False where it says more than a path has letters.
bool FileDialog::read_on() {
  std::array<char, 4096> some;
  for (ssize_t n = 0; (n = ::read(from_, some.data(), some.size())) > 0;) {
    said_.append(some.data(), static_cast<std::size_t>(n));
    if (said_.size() > kMaxSaid) return false;
  }
  return true;
}

std::optional<FileDialog::Answer> FileDialog::poll() {
  if (!is_open()) return std::nullopt;
  bool sane = read_on();
  int status = 0;
  if (sane) {
    const pid_t ended = ::waitpid(process_, &status, WNOHANG);
    if (ended == 0) return std::nullopt;
    process_ = ended < 0 ? process_ : -1;
    sane = read_on();
  }
  std::string said = std::move(said_);
  close();
  if (!said.empty() && said.back() == '\n') said.pop_back();
  if (sane && WIFEXITED(status) && WEXITSTATUS(status) == 1) return Answer{};
  if (sane && !(WIFEXITED(status) && WEXITSTATUS(status) == 0))
    return Answer{{}, "the dialog has ended without an answer; choose here"};
  const bool path = sane && said.starts_with('/') &&
                    std::none_of(said.begin(), said.end(), [](char c) { return c == '\n' || c == '\0'; });
  if (!path) return Answer{{}, "the dialog named no folder; choose here"};
  return Answer{said, {}};
}

void FileDialog::close() {
  if (process_ > 0) {
    ::kill(process_, SIGKILL);  // it has nothing to put in order, and must not be waited for
    ::waitpid(process_, nullptr, 0);
  }
  process_ = -1;
  if (from_ >= 0) ::close(from_);
  from_ = -1;
  said_.clear();
}

}  // namespace osteo::inline app
