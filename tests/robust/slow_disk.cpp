// A disk that stalls: for LD_PRELOAD in front of a program that writes stream.oss.
//   OSTEO_STALL_AFTER_S  seconds from the first write to a stream until the disk takes nothing
//   OSTEO_STALL_S        for how long
//   OSTEO_NO_BLOCKS=1    statvfs tells of a file system of no blocks at all, as some in user space do
#include <dlfcn.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;

double from_env(const char* name) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::atof(text) : 0;
}

bool is_stream(int fd) {
  char link[64], path[PATH_MAX];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t n = ::readlink(link, path, sizeof path);
  return n > 0 && std::string_view(path, static_cast<std::size_t>(n)).ends_with("stream.oss");
}

// Only one thread writes the stream.
void stall(int fd) {
  if (!is_stream(fd)) return;
  static const auto first = Clock::now();
  const auto begin = first + std::chrono::duration<double>(from_env("OSTEO_STALL_AFTER_S"));
  const auto end = begin + std::chrono::duration<double>(from_env("OSTEO_STALL_S"));
  if (Clock::now() < begin) return;
  while (Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

template <class F>
F* next(const char* name) {
  return reinterpret_cast<F*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* bytes, size_t n) {
  static auto* const real = next<ssize_t(int, const void*, size_t)>("write");
  stall(fd);
  return real(fd, bytes, n);
}

int fdatasync(int fd) {
  static auto* const real = next<int(int)>("fdatasync");
  stall(fd);
  return real(fd);
}

int statvfs(const char* path, struct statvfs* s) noexcept {
  static auto* const real = next<int(const char*, struct statvfs*)>("statvfs");
  const int rc = real(path, s);
  if (rc == 0 && std::getenv("OSTEO_NO_BLOCKS") != nullptr) s->f_blocks = s->f_bfree = s->f_bavail = 0;
  return rc;
}

}  // extern "C"
