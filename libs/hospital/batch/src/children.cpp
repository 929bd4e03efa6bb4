#include "osteo/hospital/batch/children.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo::inline hospital {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kGrace = 10;  // seconds from being asked to end to being killed
constexpr double kLook = 0.1;  // seconds between looks at memory
constexpr std::size_t kMaxOut = 4'000'000, kMaxErr = 64'000;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

// Memory in use that is this process' alone, in MB; what is mapped from files can be given back at any time and does
// not count.
double own_memory_mb(pid_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/statm");
  double size = 0, resident = 0, shared = 0;
  if (!(in >> size >> resident >> shared)) return 0;
  return (resident - shared) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

void close_fd(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

struct Child {
  std::size_t id = 0;
  pid_t pid = -1;
  int out = -1, err = -1;
  ChildLimits limits;
  Clock::time_point start, looked, asked;
  bool reported = false;  // asked to end
  ChildEnd end;
};

// A sanitizer reserves terabytes that it never uses: there only what is in use is bounded.
constexpr bool kShadowMemory =
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    true;
#else
    false;
#endif

[[noreturn]] void run_in_child(const std::function<int()>& work, const ChildLimits& limits, int out, int err,
                               pid_t parent) {
  ::setpgid(0, 0);                     // Ctrl-C at the terminal reaches the parent, which asks each child once
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // it cleans up behind itself
  if (::getppid() != parent) ::_exit(1);
  const int null = ::open("/dev/null", O_RDONLY);
  ::dup2(null, 0);
  ::dup2(out, 1);
  ::dup2(err, 2);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  if (limits.memory_mb > 0 && !kShadowMemory) {
    const auto bytes = static_cast<rlim_t>(limits.memory_mb * 1e6);
    const rlimit data{bytes, bytes};
    ::setrlimit(RLIMIT_DATA, &data);
  }
  int code = 1;
  try {
    code = work();
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
  }
  std::cout.flush();
  std::cerr.flush();
  std::fflush(nullptr);
  ::_exit(code);
}

// Whether there may be more to come.
bool read_some(int& fd, std::string& text, std::size_t most, bool keep_last) {
  char buffer[65536];
  const ssize_t n = ::read(fd, buffer, sizeof buffer);
  if (n < 0 && (errno == EINTR || errno == EAGAIN)) return false;
  if (n <= 0) {
    close_fd(fd);
    return false;
  }
  const auto got = static_cast<std::size_t>(n);
  if (keep_last) {
    text.append(buffer, got);
    if (text.size() > 2 * most) text.erase(0, text.size() - most);
  } else {
    text.append(buffer, std::min(got, most - std::min(most, text.size())));
  }
  return true;
}

}  // namespace

struct Children::Impl {
  std::vector<Child> children;

  // What is due by now.
  static void look_after(Child& c) {
    const double ran = seconds_since(c.start);
    if (c.reported && seconds_since(c.asked) > kGrace) ::kill(-c.pid, SIGKILL);
    if (!c.reported && c.limits.seconds > 0 && ran > c.limits.seconds) {
      c.end.over_time = true;
      ask(c);
    }
    if (c.limits.memory_mb <= 0 || seconds_since(c.looked) < kLook) return;
    c.looked = Clock::now();
    if (own_memory_mb(c.pid) > c.limits.memory_mb) {
      c.end.over_memory = true;
      ::kill(-c.pid, SIGKILL);
    }
  }
  static void ask(Child& c) {
    if (c.reported) return;
    c.reported = true;
    c.asked = Clock::now();
    // Until the child has made its group there is only itself.
    if (::kill(-c.pid, SIGTERM) != 0) ::kill(c.pid, SIGTERM);
  }
  std::optional<ChildEnd> take_ended() {
    for (std::size_t i = 0; i < children.size(); ++i) {
      Child& c = children[i];
      int status = 0;
      rusage usage{};
      const pid_t got = ::wait4(c.pid, &status, WNOHANG, &usage);
      if (got == 0 || (got < 0 && errno == EINTR)) continue;
      ::kill(-c.pid, SIGKILL);  // what it may have left behind
      while (c.out >= 0 && read_some(c.out, c.end.out, kMaxOut, false)) {
      }
      while (c.err >= 0 && read_some(c.err, c.end.err, kMaxErr, true)) {
      }
      close_fd(c.out);
      close_fd(c.err);
      ChildEnd end = std::move(c.end);
      if (end.err.size() > kMaxErr) end.err.erase(0, end.err.size() - kMaxErr);
      end.id = c.id;
      end.seconds = seconds_since(c.start);
      end.peak_mb = static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
      end.exit_code = got > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      end.signal = got > 0 && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
      return end;
    }
    return std::nullopt;
  }
};

Children::Children() : impl_(std::make_unique<Impl>()) {}

Children::~Children() {
  for (Child& c : impl_->children) {
    if (::kill(-c.pid, SIGKILL) != 0) ::kill(c.pid, SIGKILL);
    int status = 0;
    while (::waitpid(c.pid, &status, 0) < 0 && errno == EINTR) {
    }
    close_fd(c.out);
    close_fd(c.err);
  }
}

void Children::start(std::size_t id, const std::function<int()>& work, const ChildLimits& limits) {
  std::cout.flush();
  std::cerr.flush();
  std::fflush(nullptr);  // or the child writes it once more
  int out[2] = {-1, -1}, err[2] = {-1, -1};
  const auto close_all = [&] {
    for (int* end : {&out[0], &out[1], &err[0], &err[1]}) close_fd(*end);
  };
  const pid_t parent = ::getpid();
  const bool piped = ::pipe2(out, O_CLOEXEC | O_NONBLOCK) == 0 && ::pipe2(err, O_CLOEXEC | O_NONBLOCK) == 0;
  const pid_t pid = piped ? ::fork() : -1;
  if (pid < 0) {
    const int reason = errno;
    close_all();
    throw Error(ExitCode::resources, std::string("no process can be started: ") + std::strerror(reason));
  }
  if (pid == 0) {
    // The child's own ends block like any pipe.
    for (const int fd : {out[1], err[1]}) ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) & ~O_NONBLOCK);
    for (Child& c : impl_->children) {
      close_fd(c.out);
      close_fd(c.err);
    }
    run_in_child(work, limits, out[1], err[1], parent);
  }
  ::setpgid(pid, pid);
  close_fd(out[1]);
  close_fd(err[1]);
  Child child;
  child.id = id;
  child.pid = pid;
  child.out = out[0];
  child.err = err[0];
  child.limits = limits;
  child.start = child.looked = child.asked = Clock::now();
  impl_->children.push_back(std::move(child));
}

std::optional<ChildEnd> Children::wait(double at_most_s) {
  const auto start = Clock::now();
  while (!impl_->children.empty()) {
    if (auto end = impl_->take_ended()) return end;
    std::vector<pollfd> fds;
    for (Child& c : impl_->children) {
      Impl::look_after(c);
      for (const int fd : {c.out, c.err}) {
        if (fd >= 0) fds.push_back({fd, POLLIN, 0});
      }
    }
    const double left = at_most_s - seconds_since(start);
    if (left <= 0) return std::nullopt;
    // Who has closed both ends is about to be gone: look again soon.
    const bool closing = std::any_of(impl_->children.begin(), impl_->children.end(),
                                     [](const Child& c) { return c.out < 0 && c.err < 0; });
    const double nap = std::min(left, closing ? 0.001 : kLook);
    const int ready = ::poll(fds.data(), fds.size(), static_cast<int>(nap * 1000) + 1);
    if (ready < 0 && errno == EINTR) return impl_->take_ended();
    for (Child& c : impl_->children) {
      if (c.out >= 0) static_cast<void>(read_some(c.out, c.end.out, kMaxOut, false));
      if (c.err >= 0) static_cast<void>(read_some(c.err, c.end.err, kMaxErr, true));
    }
  }
  return std::nullopt;
}

void Children::stop() {
  for (Child& c : impl_->children) Impl::ask(c);
}

std::size_t Children::running() const {
  return impl_->children.size();
}

}  // namespace osteo::inline hospital
