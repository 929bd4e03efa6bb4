#include "osteo/core/base/guarded.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

#if defined(__SANITIZE_ADDRESS__)
#define OSTEO_ADDRESS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define OSTEO_ADDRESS_SANITIZER 1
#endif
#endif

namespace osteo {
namespace {

// What the child says first: its bytes follow, an Error's code, text and advice, that it ran out of memory, or that it
// threw anything else.
constexpr char kDone = 'd', kError = 'e', kMemory = 'm', kThrown = 't';

bool write_all(int to, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t n = ::write(to, bytes, count);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    count -= static_cast<std::size_t>(n);
  }
  return true;
}

[[noreturn]] void be_child(int to, const GuardLimits& limits, const std::function<std::string()>& work) {
  // Libraries that call exit() must not run what the parent registered, nor write what it had in its buffers.
  static_cast<void>(std::atexit([] { ::_exit(1); }));
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int s : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGTERM, SIGPIPE}) std::signal(s, SIG_DFL);
  std::signal(SIGINT, SIG_IGN);  // the parent ends it
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
#ifndef OSTEO_ADDRESS_SANITIZER
  if (limits.memory_gb > 0) {
    unsigned long pages = 0;
    if (std::FILE* const statm = std::fopen("/proc/self/statm", "r"); statm != nullptr) {
      if (std::fscanf(statm, "%lu", &pages) != 1) pages = 0;
      std::fclose(statm);
    }
    const auto bytes = static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) +
                       static_cast<rlim_t>(limits.memory_gb * 1e9);
    const rlimit most{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &most);
  }
#endif
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) {
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
  }
  std::string reply;
  try {
    try {
      reply = work();
      reply.insert(reply.begin(), kDone);
    } catch (const Error& e) {
      reply = std::string(1, kError) + static_cast<char>(static_cast<int>(e.code())) + e.what() + '\0' + e.advice();
    } catch (const std::bad_alloc&) {
      reply.assign(1, kMemory);
    } catch (const std::exception& e) {
      reply = std::string(1, kThrown) + e.what();
    } catch (...) {
      reply.assign(1, kThrown);
    }
  } catch (...) {
    const char memory = kMemory;
    ::_exit(write_all(to, &memory, 1) ? 0 : 1);
  }
  ::_exit(write_all(to, reply.data(), reply.size()) ? 0 : 1);
}

// Ends the child and takes its state, however this is left.
class Child {
 public:
  Child(pid_t pid, int from) : pid_(pid), from_(from) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    ::close(from_);
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    static_cast<void>(wait());
  }
  [[nodiscard]] int from() const { return from_; }
  int wait() {
    if (pid_ <= 0) return state_;
    while (::waitpid(pid_, &state_, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    return state_;
  }

 private:
  pid_t pid_;
  int from_, state_ = 0;
};

}  // namespace

std::string run_guarded(const std::string& what, const std::string& advice, const GuardLimits& limits,
                        const std::function<std::string()>& work, const Context& context) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw Error(ExitCode::resources, what + " cannot be started: " + std::strerror(errno));
  const pid_t pid = ::fork();
  if (pid < 0) {
    const std::string why = std::strerror(errno);
    ::close(ends[0]);
    ::close(ends[1]);
    throw Error(ExitCode::resources, what + " cannot be started: " + why);
  }
  if (pid == 0) {
    ::close(ends[0]);
    be_child(ends[1], limits, work);
  }
  ::close(ends[1]);
  Child child(pid, ends[0]);
  std::string reply;
  std::string buffer(1 << 16, '\0');
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  while (true) {
    context.check_cancelled();
    if (limits.seconds > 0 && std::chrono::duration<double>(Clock::now() - begin).count() > limits.seconds)
      throw Error(ExitCode::resources,
                  what + " was stopped: it had not ended after " + format_number(limits.seconds) + " s", advice);
    pollfd wanted{child.from(), POLLIN, 0};
    if (::poll(&wanted, 1, 50) <= 0) continue;
    const ssize_t n = ::read(child.from(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    reply.append(buffer.data(), static_cast<std::size_t>(n));
  }
  const int state = child.wait();
  if (WIFSIGNALED(state)) {
    const int s = WTERMSIG(state);
    const std::string why = s == SIGSEGV || s == SIGBUS ? "it reached into memory that is not its own"
                            : s == SIGABRT              ? "it gave itself up"
                            : s == SIGFPE               ? "it divided by zero"
                            : s == SIGKILL              ? "it was killed, perhaps for want of memory"
                                                        : "signal " + std::to_string(s);
    throw Error(s == SIGKILL ? ExitCode::resources : ExitCode::failed, what + " crashed: " + why, advice);
  }
  if (reply.empty() || (reply[0] != kDone && reply[0] != kError && reply[0] != kMemory && reply[0] != kThrown) ||
      WEXITSTATUS(state) != 0)
    throw Error(ExitCode::failed, what + " ended without a result", advice);
  if (reply[0] == kMemory)
    throw Error(ExitCode::resources,
                what + " ran out of memory, of which it has " + format_number(limits.memory_gb) + " GB", advice);
  if (reply[0] == kThrown) throw Error(ExitCode::failed, what + " failed: " + reply.substr(1), advice);
  if (reply[0] == kError) {
    const std::size_t end = reply.find('\0', 2);
    throw Error(static_cast<ExitCode>(static_cast<unsigned char>(reply[1])), reply.substr(2, end - 2),
                end == std::string::npos ? "" : reply.substr(end + 1));
  }
  reply.erase(0, 1);
  return reply;
}

}  // namespace osteo
