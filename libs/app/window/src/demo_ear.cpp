#include "demo_ear.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <system_error>

extern char** environ;  // of POSIX, but in no header

namespace osteo::inline app {
namespace {

namespace fs = std::filesystem;

// Both steps of docs/guides/start.md; $1: the program, $2: the folder. What an earlier try left is made again.
constexpr const char* kScript =
    "set -e; mkdir -p \"$2\"; cd \"$2\"; "
    "\"$1\" phantom ct.nrrd --labels-out labels.nrrd --region temporal --spacing-mm 0.4 --force --progress json; "
    "exec \"$1\" prepare ct.nrrd -o case --lower 500 --spacing-mm 0.4 --structures labels.nrrd --no-report "
    "--progress json --names '5=ossicles, 6=facial nerve, 7=sigmoid sinus, 12=labyrinth, 13=chorda tympani, 16=dura, "
    "17=air cells, 18=external ear canal, 19=antrum'";
constexpr double kPhantomShare = 0.35;  // of the time

}  // namespace

fs::path DemoEar::usual_folder() {
  const char* const data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && *data == '/') return fs::path(data) / "osteotome/demo";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home == '/' ? fs::path(home) / ".local/share/osteotome/demo" : fs::path();
}

bool DemoEar::offered() const {
  std::error_code unknown;
  if (folder_.empty()) return false;
  return fs::exists(the_case() / "manifest.json", unknown) || ::access(program_.c_str(), X_OK) == 0;
}

std::string DemoEar::make() {
  if (making()) return {};
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return std::strerror(errno);
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  std::array<std::string, 6> words{"sh", "-c", kScript, "sh", program_.string(), folder_.string()};
  std::array<char*, 7> arguments{};
  for (std::size_t n = 0; n < words.size(); ++n) arguments[n] = words[n].data();
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  // A group of its own, so that all of it can be ended.
  posix_spawnattr_t own;
  ::posix_spawnattr_init(&own);
  ::posix_spawnattr_setflags(&own, POSIX_SPAWN_SETPGROUP);
  const int failed = ::posix_spawn(&process_, "/bin/sh", &actions, &own, arguments.data(), environ);
  ::posix_spawnattr_destroy(&own);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    process_ = -1;
    return std::strerror(failed);
  }
  from_ = ends[0];
  said_.clear();
  share_ = 0;
  return {};
}

// Lines like {"progress":0.35,"activity":"body"}: first the phantom's, then the case's, which begin at 0 again.
void DemoEar::read_on() {
  std::array<char, 4096> some;
  for (ssize_t n = 0; (n = ::read(from_, some.data(), some.size())) > 0;)
    said_.append(some.data(), static_cast<std::size_t>(n));
  constexpr const char* kKey = "{\"progress\":";
  const std::size_t at = said_.rfind(kKey);
  if (at == std::string::npos || said_.find('\n', at) == std::string::npos) return;
  const double now = std::strtod(said_.c_str() + at + std::strlen(kKey), nullptr);
  const bool phantom = said_.find("\"activity\":\"import\"") == std::string::npos;
  const double all = phantom ? kPhantomShare * now : kPhantomShare + (1 - kPhantomShare) * now;
  share_ = all > share_ ? all : share_;
}

std::optional<std::string> DemoEar::poll() {
  if (!making()) return std::nullopt;
  read_on();
  int status = 0;
  const pid_t ended = ::waitpid(process_, &status, WNOHANG);
  if (ended == 0) return std::nullopt;
  read_on();
  if (ended > 0) process_ = -1;
  const std::string said = said_;
  close();
  if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::string();
  // Its last line that is no progress says why.
  std::string why;
  for (std::size_t from = 0; from < said.size();) {
    const std::size_t end = std::min(said.find('\n', from), said.size());
    if (end > from && said[from] != '{' && said[from] != ' ') why = said.substr(from, end - from);
    from = end + 1;
  }
  return why.empty() ? std::string("'osteo' ended without a word") : why;
}

void DemoEar::close() {
  if (process_ > 0) {
    ::kill(-process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  process_ = -1;
  if (from_ >= 0) ::close(from_);
  from_ = -1;
  said_.clear();
}

}  // namespace osteo::inline app
