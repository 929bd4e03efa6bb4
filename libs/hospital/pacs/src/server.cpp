#include "osteo/hospital/pacs/server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <pwd.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>
#include <thread>

#include "node.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/shell.h"
#include "osteo/hospital/pacs/watch.h"
#include "osteo/hospital/pacs/web.h"

extern char** environ;

namespace osteo::inline hospital {
namespace {

using FindingState = ServerFinding::State;
using Findings = std::vector<ServerFinding>;

constexpr double kRoomGb = 20;                  // a day of scans and cases: less is worth a word
constexpr std::time_t kMadeAfter = 1767225600;  // 1 January 2026: before it this program was not there
constexpr double kClocksApart = 5;              // seconds between ours and a file server's
constexpr rlim_t kFewFiles = 256;               // free, of a file system that counts them
constexpr int kSystemctlMs = 10'000;            // a manager that hangs
constexpr std::size_t kMaxSaid = 65'536;        // bytes of its answer
constexpr std::array kUnits{"osteo-receive.service", "osteo-watch.service"};
constexpr const char* kInstances = "osteo-watch-orthanc@";  // one for each Orthanc

std::string reason() {
  return std::strerror(errno);
}

std::string gigabytes(double gb) {
  return format_number(gb < 10 ? std::round(gb * 100) / 100 : std::round(gb)) + " GB";
}

std::string user() {
  const passwd* const who = ::getpwuid(::geteuid());
  return who != nullptr ? who->pw_name : "user " + std::to_string(::geteuid());
}

std::string in_quotes(const fs::path& path) {
  return "'" + path.string() + "'";
}

// Writes into the folder as the services would, and takes it away again. Empty: it could. `apart_s`: how far the clock
// that stamps files is from ours.
std::string try_to_write(const fs::path& folder, double& apart_s) {
  std::string name = (folder / ".osteo-doctor-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  if (fd < 0) return reason();
  std::string why;
  const std::array<char, 4096> some{};
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  errno = 0;
  struct stat s {};
  if (::write(fd, some.data(), some.size()) != static_cast<ssize_t>(some.size()) || ::fsync(fd) != 0)
    why = errno != 0 ? reason() : "written in part";
  else if (::fstat(fd, &s) == 0)
    apart_s = static_cast<double>(s.st_mtim.tv_sec - now.tv_sec);
  ::close(fd);
  ::unlink(name.c_str());
  return why;
}

// The nearest folder above that is there: where a service would make the one that is not.
fs::path there_above(fs::path folder) {
  std::error_code ignored;
  folder = fs::absolute(folder, ignored);
  while (!fs::exists(folder, ignored) && folder.has_parent_path() && folder != folder.parent_path())
    folder = folder.parent_path();
  return folder;
}

void check_folder(Findings& all, const std::string& what, const fs::path& folder, double keep_free_gb,
                  bool of_patients) {
  const auto say = [&](FindingState state, const std::string& says, const std::string& advice) {
    all.push_back({what, state, says, advice});
  };
  std::error_code error;
  const fs::path above = there_above(folder);
  const bool there = fs::exists(folder, error);
  const std::string name = in_quotes(folder);
  if (!fs::is_directory(above, error))
    return say(FindingState::bad, in_quotes(above) + " is no folder", "another folder, or move that file away");
  double apart_s = 0;
  if (const std::string why = try_to_write(above, apart_s); !why.empty())
    return say(FindingState::bad, user() + " cannot write into " + in_quotes(above) + ": " + why,
               why == std::strerror(ENOSPC)
                   ? "make room there"
                   : "let " + user() + " write there (chown, chmod, mount); run this as the services' user");
  struct statvfs disk {};
  struct stat s {};
  if (::statvfs(above.c_str(), &disk) != 0 || ::stat(above.c_str(), &s) != 0)
    return say(FindingState::bad, name + ": " + reason(), "another folder");
  const double free_gb = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / 1e9;
  const std::string room = gigabytes(free_gb) + " free";
  if (free_gb < keep_free_gb)
    return say(FindingState::bad,
               name + ": " + room + ", and " + gigabytes(keep_free_gb) +
                   " are to stay free: nothing would be taken in or begun",
               "make room, or a smaller --keep-free-gb");
  if (disk.f_files > 0 && disk.f_favail < kFewFiles)
    return say(FindingState::bad, name + ": room for " + std::to_string(disk.f_favail) + " files more",
               "make room: the disk's inodes are used up");
  if (of_patients && there && (s.st_mode & 07) != 0)
    return say(FindingState::care,
               name + ": " + room + "; everybody on this machine may look into it, and it names patients",
               "chmod o= " + shell_path(folder));
  if (std::abs(apart_s) > kClocksApart)
    return say(FindingState::care,
               name + ": its clock is " + format_number(std::abs(apart_s)) + " s " +
                   (apart_s > 0 ? "before" : "behind") + " ours",
               "let both machines keep time by NTP");
  if (free_gb < kRoomGb)
    return say(FindingState::care, name + ": " + room, "a day of scans may need more than " + gigabytes(kRoomGb));
  say(FindingState::good, name + ": " + room + (there ? "" : "; it will be made"), {});
}

// What listens at a TCP port of this machine, as far as this user may see.
std::string listener(int port) {
  std::string inode;
  for (const char* const table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream in(table);
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream words(line);
      std::array<std::string, 10> w;
      for (std::string& word : w) words >> word;
      const std::size_t colon = w[1].rfind(':');
      if (colon != std::string::npos && w[3] == "0A" && std::strtol(w[1].c_str() + colon + 1, nullptr, 16) == port)
        inode = w[9];
    }
  }
  if (inode.empty()) return {};
  std::error_code error;
  for (const auto& process : fs::directory_iterator("/proc", error)) {
    if (process.path().filename().string().find_first_not_of("0123456789") != std::string::npos) continue;
    for (fs::directory_iterator fd(process.path() / "fd", error), end; !error && fd != end; fd.increment(error)) {
      if (fs::read_symlink(fd->path(), error) != "socket:[" + inode + "]") {
        error.clear();
        continue;
      }
      std::ifstream in(process.path() / "comm");
      std::string name;
      std::getline(in, name);
      return name + " (process " + process.path().filename().string() + ")";
    }
    error.clear();
  }
  return {};
}

void check_port(Findings& all, const ServerSetup& s) {
  const std::string where = s.bind + ":" + std::to_string(s.port);
  const auto say = [&](FindingState state, const std::string& says, const std::string& advice = {}) {
    all.push_back({"port", state, says, advice});
  };
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(s.port));
  if (::inet_pton(AF_INET, s.bind.c_str(), &at.sin_addr) != 1)
    return say(FindingState::bad, in_quotes(s.bind) + " is no IPv4 address",
               "127.0.0.1 for this machine alone, 0.0.0.0 for every network");
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool taken = fd < 0 || ::bind(fd, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 || ::listen(fd, 1) != 0;
  const int why = taken ? errno : 0;
  if (fd >= 0) ::close(fd);
  if (!taken) {
    if (s.bind != "127.0.0.1" && s.tls.ca.empty())
      return say(FindingState::care, where + " is free; what comes in there is not encrypted",
                 "--tls-ca, --tls-certificate and --tls-key, or a tunnel");
    return say(FindingState::good, where + " is free");
  }
  if (why == EADDRINUSE) {
    const std::string who = listener(s.port);
    if (who.starts_with("osteo ")) return say(FindingState::good, where + ": " + who + " listens");
    return say(FindingState::bad, where + " is taken by " + (who.empty() ? "what " + user() + " may not see" : who),
               "--port another, or stop what listens there");
  }
  if (why == EACCES)
    return say(FindingState::bad, where + ": " + user() + " may not listen there",
               "a port above 1023: the units have no rights");
  if (why == EADDRNOTAVAIL)
    return say(FindingState::bad, where + " is no address of this machine", "'ip address' lists those that are");
  say(FindingState::bad, where + ": " + std::strerror(why), "--bind and --port another");
}

// Runs `check` and says what it throws.
template <class F>
void try_to(Findings& all, const std::string& what, const std::string& good, const F& check) {
  try {
    check();
    all.push_back({what, FindingState::good, good, {}});
  } catch (const Error& e) {
    all.push_back(bad_finding(what, e));
  }
}

void check_titles(Findings& all, const ServerSetup& s) {
  try_to(all, "title",
         in_quotes(s.ae) + (s.allowed.empty() ? "" : "; " + std::to_string(s.allowed.size()) + " may send"), [&] {
           static_cast<void>(checked_ae(s.ae));
           for (const std::string& title : s.allowed) static_cast<void>(checked_ae(title));
         });
}

void check_tls(Findings& all, const ServerSetup& s) {
  if (s.tls.ca.empty() && s.tls.certificate.empty() && s.tls.key.empty()) return;
  try_to(all, "TLS", "certificate and key belong together, and only " + user() + " may read the key", [&] {
    static_cast<void>(pacs::tls_layer(s.tls, NET_ACCEPTOR));
    struct stat of {};
    if (::stat(s.tls.key.c_str(), &of) != 0 || (of.st_mode & 077) != 0)
      throw Error(ExitCode::usage, "others can read " + in_quotes(s.tls.key), "chmod 600 " + shell_path(s.tls.key));
  });
}

void check_memory(Findings& all, const ServerSetup& s) {
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  std::ifstream in("/proc/meminfo");
  double total_mb = 0, available_mb = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("MemTotal:")) total_mb = std::strtod(line.c_str() + 9, nullptr) * 1.024e-3;
    if (line.starts_with("MemAvailable:")) available_mb = std::strtod(line.c_str() + 13, nullptr) * 1.024e-3;
  }
  const double wanted_mb = s.jobs * s.memory_mb;
  const std::string there = std::to_string(cores) + (cores == 1 ? " core, " : " cores, ") + gigabytes(total_mb / 1e3) +
                            " of memory, " + gigabytes(available_mb / 1e3) + " of it available";
  const std::string want = "; " + std::to_string(s.jobs) +
                           (s.jobs == 1 ? " case may take " : " cases at a time may take ") +
                           gigabytes(wanted_mb / 1e3);
  if (total_mb > 0 && wanted_mb > total_mb)
    all.push_back({"machine", FindingState::bad, there + want, "fewer --jobs, less --memory-mb, or more memory"});
  else if (total_mb > 0 && wanted_mb > available_mb)
    all.push_back({"machine", FindingState::care, there + want, "fewer --jobs, or end what else runs here"});
  else if (static_cast<unsigned>(s.jobs) > cores)
    all.push_back({"machine", FindingState::care, there + want, "no more --jobs than cores"});
  else
    all.push_back({"machine", FindingState::good, there + want, {}});
}

void check_clock(Findings& all) {
  const std::time_t now = std::time(nullptr);
  std::array<char, 32> text{};
  std::tm parts{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", ::gmtime_r(&now, &parts));
  timex t{};
  const int kept = ::adjtimex(&t);
  if (now < kMadeAfter)
    all.push_back({"clock", FindingState::bad, std::string("it says ") + text.data(),
                   "set it: certificates and records go by it"});
  else if (kept == TIME_ERROR || (t.status & STA_UNSYNC) != 0)
    all.push_back({"clock", FindingState::care, std::string(text.data()) + "; nothing keeps it",
                   "timedatectl set-ntp true (or chrony)"});
  else
    all.push_back({"clock", FindingState::good, std::string(text.data()) + ", kept", {}});
}

bool in_path(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && ::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

// What a program says, and whether it ended well. One that hangs is ended.
bool answer_of(std::vector<std::string> words, std::string& said) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return false;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t process = -1;
  const int failed = ::posix_spawnp(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  bool ended = false;
  std::array<char, 4096> some;
  for (pollfd p{ends[0], POLLIN, 0}; failed == 0 && said.size() < kMaxSaid && ::poll(&p, 1, kSystemctlMs) > 0;) {
    const ssize_t n = ::read(ends[0], some.data(), some.size());
    if (n <= 0) {
      ended = n == 0;
      break;
    }
    said.append(some.data(), static_cast<std::size_t>(n));
  }
  ::close(ends[0]);
  if (failed != 0) return false;
  if (!ended) ::kill(process, SIGKILL);
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return ended && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// False: systemd does not answer.
bool check_unit(Findings& all, const std::string& unit) {
  std::string said;
  if (!answer_of({"systemctl", "show", "--property=LoadState,ActiveState,UnitFileState,Result", unit}, said))
    return false;
  const auto value = [&](const std::string& key) {
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);)
      if (line.starts_with(key + "=")) return line.substr(key.size() + 1);
    return std::string();
  };
  const std::string active = value("ActiveState");
  const bool starts = value("UnitFileState").starts_with("enabled");
  if (value("LoadState") != "loaded")
    all.push_back({unit, FindingState::none, "not installed (" + value("LoadState") + ")",
                   "it comes with the package osteo, for the prefix /usr"});
  else if (active == "failed")
    all.push_back({unit, FindingState::bad, "has failed: " + value("Result"), "journalctl -u " + unit});
  else if (active != "active" && active != "activating")
    all.push_back({unit, FindingState::care, "does not run (" + active + ")", "systemctl enable --now " + unit});
  else if (active == "activating")
    all.push_back({unit, FindingState::care, "is being started, perhaps again and again", "journalctl -u " + unit});
  else if (!starts)
    all.push_back(
        {unit, FindingState::care, "runs, but not after the next start of the machine", "systemctl enable " + unit});
  else
    all.push_back({unit, FindingState::good, "runs", {}});
  return true;
}

void check_units(Findings& all) {
  for (const std::string unit : kUnits) {
    if (!in_path("systemctl") || !check_unit(all, unit)) {
      all.push_back({"systemd", FindingState::none, "no systemd runs here",
                     "start 'osteo receive' and 'osteo watch-folder' by what starts services here"});
      return;
    }
  }
  // Those that were started since the machine was, also if they have failed; that there is none is nothing to tell.
  std::string said;
  if (!answer_of({"systemctl", "list-units", "--all", "--plain", "--no-legend", kInstances + std::string("*")}, said))
    return;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(kInstances)) static_cast<void>(check_unit(all, line.substr(0, line.find(' '))));
}

void check_cluster(Findings& all) {
  // What pipelines/snakemake/profiles/slurm calls.
  std::string missing, there;
  for (const char* const program : {"snakemake", "sbatch", "scontrol"})
    (in_path(program) ? there : missing) += std::string(" ") + program;
  if (there.empty())
    all.push_back({"Slurm", FindingState::none, "not here: 'osteo batch' runs cases on this machine alone", {}});
  else if (!missing.empty())
    all.push_back({"Slurm", FindingState::none, "there is" + there + ", but not" + missing,
                   "cases over a cluster want all three"});
  else
    all.push_back({"Slurm", FindingState::good, "there are" + there, {}});
}

}  // namespace

ServerFinding bad_finding(const std::string& what, const Error& error) {
  const bool input = error.code() == ExitCode::no_input || error.code() == ExitCode::cannot_read;
  return {what, FindingState::bad, error.what(),
          !error.advice().empty() ? error.advice()
          : input                 ? "name a file that is there and that " + user() + " may read"
                                  : "mend it: what needs it would stop with this"};
}

std::string_view state_name(ServerFinding::State state) {
  switch (state) {
    case FindingState::good:
      return "good";
    case FindingState::none:
      return "none";
    case FindingState::care:
      return "care";
    case FindingState::bad:
      return "bad";
  }
  return "bad";
}

std::vector<ServerFinding> check_server(const ServerSetup& s) {
  Findings all;
  check_memory(all, s);
  check_clock(all);
  if (!s.inbox.empty()) check_folder(all, "inbox", s.inbox, s.keep_free_gb, true);
  if (!s.cases.empty()) check_folder(all, "cases", s.cases, s.keep_free_gb, true);
  if (!s.inbox.empty() && !s.cases.empty()) {
    try {
      check_watch_folders(s.inbox, s.cases);
    } catch (const Error& e) {
      all.push_back(bad_finding("folders", e));
    }
  }
  std::error_code error;
  // Zips are unpacked there, and half a gigabyte stays free.
  check_folder(all, "temporary", fs::temp_directory_path(error), 0.5, false);
  check_titles(all, s);
  check_port(all, s);
  check_tls(all, s);
  for (const fs::path& login : s.logins)
    try_to(all, "login", in_quotes(login) + ": only " + user() + " may read it",
           [&] { static_cast<void>(read_login(login)); });
  for (const fs::path& file : s.metrics) {
    // It is replaced, never written into: what counts is its folder.
    const fs::path folder = fs::absolute(file, error).parent_path();
    if (fs::is_directory(file, error))
      all.push_back({"counters", FindingState::bad, in_quotes(file) + " is a folder", "the name of a file"});
    else if (!fs::exists(folder, error))
      all.push_back(
          {"counters", FindingState::bad, in_quotes(folder) + " is not there", "mkdir -p " + folder.string()});
    else
      check_folder(all, "counters", folder, 0, false);
  }
  check_units(all);
  check_cluster(all);
  return all;
}

}  // namespace osteo::inline hospital
