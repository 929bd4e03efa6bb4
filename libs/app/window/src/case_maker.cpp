#include "case_maker.h"

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
#include <string_view>
#include <system_error>

extern char** environ;  // of POSIX, but in no header

namespace osteo::inline app {
namespace {

namespace fs = std::filesystem;

// Both steps of docs/guides/start.md; $1: the program, $2: the folder. What an earlier try left is made again.
constexpr const char* kDemo =
    "set -e; mkdir -p \"$2\"; cd \"$2\"; "
    "\"$1\" phantom ct.nrrd --labels-out labels.nrrd --region temporal --spacing-mm 0.4 --force --progress json; "
    "exec \"$1\" prepare ct.nrrd -o case --lower 500 --spacing-mm 0.4 --structures labels.nrrd --no-report "
    "--progress json --names '5=ossicles, 6=facial nerve, 7=sigmoid sinus, 12=labyrinth, 13=chorda tympani, 16=dura, "
    "17=air cells, 18=external ear canal, 19=antrum'";
constexpr double kPhantomShare = 0.35;  // of the time
constexpr const char* kPrepare = "exec \"$1\" prepare \"$2\" -o \"$3\" ${4:+--structures \"$4\"} --progress json";

}  // namespace

fs::path CaseMaker::demo_case() {
  const char* const data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && *data == '/') return fs::path(data) / "osteotome/demo/case";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home == '/' ? fs::path(home) / ".local/share/osteotome/demo/case" : fs::path();
}

fs::path CaseMaker::case_beside(const fs::path& scan) {
  const fs::path beside = fs::absolute(scan).parent_path() / (scan.filename().string() + "-case");
  std::error_code unknown;
  fs::path free = beside;
  for (int n = 2; fs::exists(free, unknown); ++n) free = beside.string() + "-" + std::to_string(n);
  return free;
}

bool CaseMaker::can_make() const {
  return ::access(program_.c_str(), X_OK) == 0;
}

std::string CaseMaker::make_demo() {
  if (!making_.empty()) return {};
  const fs::path the_case = demo_case();
  const std::string why = start(kDemo, {program_.string(), the_case.parent_path().string()}, kPhantomShare);
  if (why.empty()) making_ = the_case;
  return why;
}

std::string CaseMaker::make(const fs::path& scan, const fs::path& the_case, const fs::path& network) {
  if (!making_.empty()) return {};
  const std::string why = start(kPrepare, {program_.string(), scan.string(), the_case.string(), network.string()}, 0);
  if (why.empty()) making_ = the_case;
  return why;
}

std::string CaseMaker::start(const char* script, std::vector<std::string> words, double first_share) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return std::strerror(errno);
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  words.insert(words.begin(), {"sh", "-c", script, "sh"});
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
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
  first_share_ = first_share;
  return {};
}

// Lines like {"progress":0.35,"activity":"body"}: first the phantom's, where there is one, then the case's, which begin
// at 0 again.
void CaseMaker::read_on() {
  std::array<char, 4096> some;
  for (ssize_t n = 0; (n = ::read(from_, some.data(), some.size())) > 0;)
    said_.append(some.data(), static_cast<std::size_t>(n));
  constexpr const char* kKey = "{\"progress\":";
  const std::size_t at = said_.rfind(kKey);
  if (at == std::string::npos || said_.find('\n', at) == std::string::npos) return;
  const double now = std::strtod(said_.c_str() + at + std::strlen(kKey), nullptr);
  const bool first = first_share_ > 0 && said_.find("\"activity\":\"import\"") == std::string::npos;
  share_ = std::max(share_, first ? first_share_ * now : first_share_ + (1 - first_share_) * now);
}

std::optional<CaseMaker::Made> CaseMaker::poll() {
  if (making_.empty()) return std::nullopt;
  read_on();
  int status = 0;
  const pid_t ended = ::waitpid(process_, &status, WNOHANG);
  if (ended == 0) return std::nullopt;
  read_on();
  if (ended > 0) process_ = -1;
  const std::string said = said_;
  Made made{making_, {}};
  close();
  if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) return made;
  // From "osteo: " on it says why, and below that what to do.
  bool told = false;
  for (std::size_t from = 0; from < said.size();) {
    const std::size_t end = std::min(said.find('\n', from), said.size());
    std::string line = said.substr(from, end - from);
    from = end + 1;
    constexpr std::string_view kOwn = "osteo: ";
    if (line.starts_with(kOwn)) {
      told = true;
      made.why = line.substr(kOwn.size());
    } else if (told && !line.empty() && line[0] != '{') {
      made.why += "; " + line.substr(std::min(line.find_first_not_of(' '), line.size()));
    }
  }
  if (made.why.empty()) made.why = "'osteo' ended without a word";
  return made;
}

void CaseMaker::close() {
  if (process_ > 0) {
    ::kill(-process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  process_ = -1;
  if (from_ >= 0) ::close(from_);
  from_ = -1;
  said_.clear();
  making_.clear();
}

}  // namespace osteo::inline app
