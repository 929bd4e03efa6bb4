// Another program as a renderer: lines of text over its standard input and output.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "osteo/assessment/ground_truth/point_renderer.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"

extern char** environ;  // NOLINT

namespace osteo::inline assessment::truth {
namespace {

constexpr std::size_t kLongestLine = 1 << 16;

// As OFF: every language reads it in ten lines.
std::string off_text(const TriangleSoup& mesh) {
  std::string text =
      "OFF\n" + std::to_string(mesh.points_mm.size()) + " " + std::to_string(mesh.triangles.size()) + " 0\n";
  char line[128];
  for (const Vec3& p : mesh.points_mm) {
    std::snprintf(line, sizeof line, "%.17g %.17g %.17g\n", p.x, p.y, p.z);
    text += line;
  }
  for (const auto& t : mesh.triangles)
    text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
  return text;
}

class ProcessRenderer final : public PointRenderer {
 public:
  ProcessRenderer(const std::string& command, const TriangleSoup& mesh, const RenderSettings& s, double patience_s)
      : command_(command), patience_s_(patience_s) {
    const auto begin = std::chrono::steady_clock::now();
    write_file(folder_.path() / "solid.off", off_text(mesh));
    start();
    char text[512];
    std::snprintf(text, sizeof text, "stiffness %.17g\nfriction %.17g\nrate_hz %.17g\nunit_mm %.17g\n",
                  s.stiffness_n_per_mm / s.unit, s.friction, s.rate_hz, 1 / s.unit);
    say("osteotome-ground-truth 1\nmesh " + (folder_.path() / "solid.off").string() + "\n" + text + "ready?\n");
    const std::string answer = hear();
    if (answer.rfind("ready", 0) != 0) fail("said '" + answer.substr(0, 80) + "' where 'ready' was due");
    setup_s_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const BoxMm box = bounds_of(mesh);
    grain_mm_ = length(box.hi - box.lo) / std::sqrt(static_cast<double>(mesh.triangles.size())) / s.unit;
  }
  ProcessRenderer(const ProcessRenderer&) = delete;
  ProcessRenderer& operator=(const ProcessRenderer&) = delete;
  ~ProcessRenderer() override { stop(); }

  void place(Vec3 device) override { say(line_of("place", device)); }
  Rendered render(Vec3 device) override {
    say(line_of("at", device));
    const std::string answer = hear();
    Rendered r;
    int contact = 0, used = 0;
    own_ns_ = -1;
    const int got =
        std::sscanf(answer.c_str(), "force %lf %lf %lf contact %d %lf %lf %lf%n", &r.force_n.x, &r.force_n.y,
                    &r.force_n.z, &contact, &r.contact_mm.x, &r.contact_mm.y, &r.contact_mm.z, &used);
    const auto finite = [](Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
    if (got < 7 || !finite(r.force_n) || !finite(r.contact_mm))
      fail("answered '" + answer.substr(0, 80) + "' where 'force FX FY FZ contact 0|1 X Y Z [ns N]' was due");
    double ns = 0;
    if (std::sscanf(answer.c_str() + used, " ns %lf", &ns) == 1 && ns >= 0) own_ns_ = ns;
    r.contact = contact != 0;
    r.operations = 0;
    return r;
  }
  [[nodiscard]] double own_ns() const override { return own_ns_; }

 private:
  static std::string line_of(const char* what, Vec3 v) {
    char line[128];
    std::snprintf(line, sizeof line, "%s %.17g %.17g %.17g\n", what, v.x, v.y, v.z);
    return line;
  }
  [[noreturn]] void fail(const std::string& what) {
    stop();
    throw Error(ExitCode::failed, "the renderer '" + command_ + "' " + what, "docs/validation/ground-truth.md has the protocol");
  }
  void start() {
    // A program that has ended must be an error here, not the end of this one.
    static std::once_flag once;
    std::call_once(once, [] { ::signal(SIGPIPE, SIG_IGN); });
    int to[2], from[2];
    if (::pipe2(to, O_CLOEXEC) != 0) throw Error(ExitCode::resources, std::string("no pipe: ") + std::strerror(errno));
    if (::pipe2(from, O_CLOEXEC) != 0) {
      ::close(to[0]);
      ::close(to[1]);
      throw Error(ExitCode::resources, std::string("no pipe: ") + std::strerror(errno));
    }
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, to[0], STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, from[1], STDOUT_FILENO);
    std::string shell = "sh", flag = "-c", words = command_;
    std::array<char*, 4> arguments{shell.data(), flag.data(), words.data(), nullptr};
    // A group of its own, so that what the shell starts ends with it.
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    const int failed = ::posix_spawnp(&process_, "sh", &actions, &attributes, arguments.data(), environ);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(to[0]);
    ::close(from[1]);
    to_ = to[1];
    from_ = from[0];
    if (failed != 0) {
      process_ = -1;
      fail(std::string("could not be started: ") + std::strerror(failed));
    }
  }
  void say(std::string_view text) {
    while (!text.empty()) {
      const ssize_t n = ::write(to_, text.data(), text.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail("has ended");
      text.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  std::string hear() {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s_);
    for (;;) {
      if (const std::size_t end = heard_.find('\n'); end != std::string::npos) {
        std::string line = heard_.substr(0, end);
        heard_.erase(0, end + 1);
        return line;
      }
      if (heard_.size() > kLongestLine) fail("says more than a line holds");
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now()).count();
      pollfd wait{from_, POLLIN, 0};
      const int ready = left > 0 ? ::poll(&wait, 1, static_cast<int>(left)) : 0;
      if (ready < 0 && errno == EINTR) continue;
      if (ready <= 0) fail("has not answered for " + std::to_string(static_cast<int>(patience_s_)) + " s");
      std::array<char, 4096> some;
      const ssize_t n = ::read(from_, some.data(), some.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail("has ended");
      heard_.append(some.data(), static_cast<std::size_t>(n));
    }
  }
  void stop() {
    if (to_ >= 0) ::close(to_);
    if (from_ >= 0) ::close(from_);
    to_ = from_ = -1;
    if (process_ <= 0) return;
    // Its input has ended: it has a moment to end as well.
    int status = 0;
    for (int i = 0; i < 50; ++i) {
      if (::waitpid(process_, &status, WNOHANG) != 0) {
        process_ = -1;
        return;
      }
      ::usleep(10000);
    }
    ::kill(-process_, SIGKILL);
    ::waitpid(process_, &status, 0);
    process_ = -1;
  }

  std::string command_, heard_;
  double patience_s_, own_ns_ = -1;
  TemporaryFolder folder_;
  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
};

}  // namespace

std::unique_ptr<PointRenderer> make_process_renderer(const std::string& command, const TriangleSoup& mesh,
                                                     const RenderSettings& settings, double patience_s) {
  return std::make_unique<ProcessRenderer>(command, mesh, settings, patience_s);
}

}  // namespace osteo::inline assessment::truth
