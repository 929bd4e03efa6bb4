// devices and doctor: what is plugged in, and what this machine can do.
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>
#include <vtkGenericOpenGLRenderWindow.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <mutex>
#include <ostream>
#include <thread>

#include "commands/devices.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/simd.h"
#include "osteo/core/rt/loop.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/simulation/devices/devices.h"
#include "pacs_commands.h"
#include "server_doctor.h"

namespace osteo {
namespace {

std::string hex4(unsigned v) {
  char text[8];
  std::snprintf(text, sizeof text, "%04x", v);
  return text;
}

std::string text_of(const SpaceMouseState& s) {
  char text[160];
  std::snprintf(text, sizeof text, "move %+.2f %+.2f %+.2f  turn %+.2f %+.2f %+.2f  buttons %u", s.move[0], s.move[1],
                s.move[2], s.turn[0], s.turn[1], s.turn[2], s.buttons);
  return text;
}

/// Decodes reports of one device into lines for people.
class Watcher {
 public:
  Watcher(DeviceModel model, std::string name) : model_(model), name_(std::move(name)) {}

  std::string decode(std::span<const std::byte> report) {
    std::string text = name_ + ": ";
    std::uint32_t pressed = 0;
    WoodenHapticsReport w;
    if (model_ == DeviceModel::space_mouse || model_ == DeviceModel::space_mouse_wireless) {
      return decode_space_mouse(report, mouse_) ? text + text_of(mouse_) : text + unknown(report);
    }
    if (model_ == DeviceModel::woodenhaptics) {
      if (!decode_woodenhaptics(report, w)) return text + unknown(report);
      text += "encoders";
      for (const int e : w.encoder) text += " " + std::to_string(e);
      return text + (w.button ? "  button" : "");
    }
    return decode_pedal(model_, report, pressed) ? text + "pedals " + std::to_string(pressed) : text + unknown(report);
  }

 private:
  static std::string unknown(std::span<const std::byte> report) {
    return "not understood, " + std::to_string(report.size()) + " bytes";
  }
  DeviceModel model_;
  std::string name_;
  SpaceMouseState mouse_;
};

Json quantiles(const Histogram& h) {
  const auto us = [](double v) { return std::round(v * 10) / 10; };
  return {{"p50_us", us(h.quantile_us(0.5))},
          {"p99_us", us(h.quantile_us(0.99))},
          {"p99_9_us", us(h.quantile_us(0.999))},
          {"max_us", us(h.max_us())}};
}

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

std::string opengl_here() {
  try {
    OffscreenWindow window(64, 64);
    static_cast<void>(window.render());
    const std::string all = std::string(window.window()->ReportCapabilities()).substr(0, 4096);
    const auto line = [&](const std::string& key) {
      const auto at = all.find(key);
      return at == std::string::npos ? std::string()
                                     : all.substr(at + key.size(), all.find('\n', at) - at - key.size());
    };
    return line("OpenGL renderer string:  ") + ", " + line("OpenGL version string:  ");
  } catch (const Error&) {
    return {};
  }
}

cli::CommandInfo DevicesCommand::info() {
  return {"devices",
          "haptic devices, 3D mice and pedals that are plugged in",
          "Known are WoodenHaptics and Polhem arms, 3Dconnexion SpaceMice, Infinity and PCsensor foot pedals. With "
          "--watch their reports are "
          "shown as they are understood.",
          {},
          "osteo devices --watch 5"};
}

int DevicesCommand::run(const Params& p, cli::Invocation& io) {
  Json j = Json::list();
  if (!p.recording.empty()) {
    const HidRecording recording = load_hid_recording(p.recording);
    const DeviceModel model = model_of(recording.info.vendor, recording.info.product);
    Watcher w(model, std::string(name_of(model)));
    io.end_progress();
    for (const auto& e : recording.events) io.out << w.decode(e.report) << '\n';
    return 0;
  }
  const auto found = find_devices();
  io.end_progress();
  for (const FoundDevice& f : found) {
    j.push_back({{"device", std::string(name_of(f.model))},
                 {"path", f.info.path},
                 {"vendor", hex4(f.info.vendor)},
                 {"product", hex4(f.info.product)},
                 {"name", f.info.name},
                 {"readable", f.readable}});
    if (!f.readable) j.back()["why"] = f.why;
    if (!io.common.json) {
      io.out << name_of(f.model) << "  " << f.info.path << "  " << hex4(f.info.vendor) << ":" << hex4(f.info.product)
             << "  " << f.info.name << (f.readable ? "" : "  (" + f.why + ")") << '\n';
    }
  }
  if (io.common.json) io.out << j.dump(2) << '\n';
  if (found.empty() && !io.common.json)
    io.out << "none of the devices known here is plugged in, or this process may not see it\n";
  if (p.watch > 0) {
    std::mutex mutex;  // a line at a time
    std::vector<std::thread> threads;
    bool all_heard = true;
    for (const FoundDevice& f : found) {
      if (!f.readable) continue;
      threads.emplace_back([&, f] {
        Watcher w(f.model, std::string(name_of(f.model)));
        const auto say = [&](const std::string& line) {
          const std::lock_guard lock(mutex);
          io.out << line << std::endl;
        };
        std::string why;
        const auto port = open_hid(f.info, why);
        std::array<std::byte, 512> buffer;
        const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(p.watch);
        int n = port == nullptr ? -1 : 0;
        while (n >= 0 && !io.context.cancelled() && std::chrono::steady_clock::now() < end) {
          n = port->read(buffer, 50);
          if (n > 0) say(w.decode({buffer.data(), static_cast<std::size_t>(n)}));
        }
        if (n >= 0) return;
        say(std::string(name_of(f.model)) + ": " + (port == nullptr ? "cannot be opened: " + why : "unplugged"));
        const std::lock_guard lock(mutex);
        all_heard = false;
      });
    }
    for (auto& t : threads) t.join();
    if (!all_heard) return static_cast<int>(ExitCode::cannot_read);
  }
  return 0;
}

cli::CommandInfo DoctorCommand::info() {
  return {
      "doctor",
      "what this machine can do for a rehearsal or as a server, and what to change",
      "Real-time priority, memory lock, lateness of a loop as the servo runs it, devices, OpenGL, audio. Exit code "
      "0 also when "
      "something is missing: the advice says what. With --server what 'osteo receive', 'osteo watch-folder' and 'osteo "
      "batch' need, a line "
      "each: memory, clock, folders and room in them, title, port, TLS and login files, counters, rules, pictures, "
      "systemd's units, "
      "Slurm. What is not named is not looked at. 'good', 'none' (not there, not needed), 'care' (works, but), "
      "'bad' (will not work): "
      "with a 'bad' the exit code is 7. To be run as the user of the services.",
      {},
      "osteo doctor --seconds 10"};
}

namespace {

// What this machine can do, as JSON; and what could be changed.
struct Examination {
  Json found;
  std::vector<std::string> advice;
};

// As much work as a tick of drilling, for a while.
LoopStats try_loop(double rate_hz, double seconds) {
  // From the first tick on: on a busy machine the thread may be late to begin.
  FixedRateLoop loop(rate_hz, [seconds, end = std::int64_t{0}](std::int64_t) mutable {
    if (end == 0) end = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
    const std::int64_t until = monotonic_ns() + 50'000;
    while (monotonic_ns() < until) {
    }
    return monotonic_ns() < end;
  });
  loop.start();
  loop.join();
  return loop.stats();
}

void judge_loop(const LoopStats& s, double rate_hz, bool realtime_kernel, Examination& e) {
  e.found["realtime_priority"] = s.realtime_granted;
  if (!s.realtime_granted) {
    e.found["realtime_refusal"] = s.realtime_refusal;
    e.advice.push_back(
        "give your user 'rtprio 80' in /etc/security/limits.conf and log in again: forces stutter without real-time "
        "priority");
  }
  e.found["memory_locked"] = s.memory_locked;
  if (!s.memory_locked)
    e.advice.push_back("give your user 'memlock unlimited' in /etc/security/limits.conf: paging makes ticks late");
  e.found["processor_sleep_held_off"] = s.idle_states_off;
  if (!s.idle_states_off)
    e.advice.push_back(
        "let your user write /dev/cpu_dma_latency (a udev rule): waking from deep sleep costs up to 0.1 ms");
  e.found["loop"] = {{"rate_hz", rate_hz},
                     {"ticks", s.ticks},
                     {"lateness", quantiles(s.lateness)},
                     {"missed_by_work", s.missed_by_work},
                     {"missed_by_machine", s.missed_by_machine}};
  if (s.lateness.quantile_us(0.99) > 350)
    e.advice.push_back(
        "a hundredth of the ticks is later than 0.35 ms: close other programs, or take a machine that is not shared");
  if (s.missed_by_machine > 0 && !realtime_kernel)
    e.advice.push_back(
        "ticks were lost to the machine: on a machine of your own, the package linux-image-rt-amd64 helps");
}

void judge_devices(Examination& e) {
  Json& devices = e.found["devices"] = Json::list();
  for (const FoundDevice& f : find_devices()) {
    devices.push_back(std::string(name_of(f.model)) + " " + f.info.path + (f.readable ? "" : " (" + f.why + ")"));
    if (!f.readable)
      e.advice.push_back("allow " + f.info.path + " for your user: KERNEL==\"hidraw*\", ATTRS{idVendor}==\"" +
                         hex4(f.info.vendor) + "\", TAG+=\"uaccess\" in /etc/udev/rules.d/70-osteotome.rules");
  }
}

void judge_picture_and_sound(Examination& e) {
  std::string opengl = opengl_here();
  if (opengl.empty()) {
    opengl = "none";
    e.advice.push_back("there is no OpenGL: install libegl1 and libgl1-mesa-dri");
  } else if (opengl.find("llvmpipe") != std::string::npos) {
    e.advice.push_back("OpenGL is drawn by the processor: a graphics card makes the picture smooth");
  }
  e.found["opengl"] = opengl;
  e.found["display"] = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  const bool audio = fs::exists("/dev/snd");
  e.found["audio"] = audio;
  if (!audio) e.advice.push_back("there is no sound device");
}

void report_examination(const Examination& e, const LoopStats& s, const utsname& u, bool realtime_kernel,
                        double rate_hz, std::ostream& out) {
  const Json& j = e.found;
  const auto yes = [](bool v) { return v ? "yes" : "NO"; };
  const auto is = [&](const char* what) { return yes(*j.find(what)->flag()); };
  const Json& late = *j.find("loop")->find("lateness");
  const auto us = [&](const char* quantile) { return late.find(quantile)->dump(); };
  out << processor() << ", " << j.find("cores")->dump() << " cores, " << u.sysname << " " << u.release
      << (realtime_kernel ? " (real-time)" : "") << ", vectors: " << simd_name(simd()) << '\n'
      << "real-time priority  " << yes(s.realtime_granted)
      << (s.realtime_refusal.empty() ? "" : "  (" + s.realtime_refusal + ")") << '\n'
      << "memory locked       " << yes(s.memory_locked) << '\n'
      << "deep sleep held off " << yes(s.idle_states_off) << '\n'
      << "loop at " << format_number(rate_hz) << " Hz    wake-up late p50 " << us("p50_us") << ", p99 " << us("p99_us")
      << ", p99.9 " << us("p99_9_us") << ", max " << us("max_us") << " us over " << s.ticks
      << " ticks; periods missed by work " << s.missed_by_work << ", by the machine " << s.missed_by_machine << '\n'
      << "devices             " << (j.find("devices")->empty() ? "none" : "") << '\n';
  for (const Json& d : j.find("devices")->items()) out << "  " << *d.text() << '\n';
  out << "OpenGL              " << *j.find("opengl")->text() << '\n'
      << "display             " << is("display") << '\n'
      << "sound               " << is("audio") << '\n';
  for (const auto& a : e.advice) out << "- " << a << '\n';
  if (e.advice.empty()) out << "nothing to change\n";
}

}  // namespace

int DoctorCommand::run(const Params& p, cli::Invocation& io) {
  if (p.server) return doctor_of_server(p, io);
  if (p.no_report) throw Error(ExitCode::usage, "--no-report is for --server", "osteo doctor --server ...");
  for (const std::string* const given :
       {&p.inbox, &p.cases, &p.rules, &p.metrics, &p.login, &p.allow, &p.tls_ca, &p.tls_certificate, &p.tls_key})
    if (!given->empty())
      throw Error(ExitCode::usage, "'" + *given + "' is looked at with --server alone", "osteo doctor --server ...");
  Examination e;
  utsname u{};
  ::uname(&u);
  e.found["processor"] = processor();
  e.found["cores"] = std::thread::hardware_concurrency();
  e.found["kernel"] = std::string(u.sysname) + " " + u.release;
  const bool realtime_kernel = fs::exists("/sys/kernel/realtime");
  e.found["kernel_is_realtime"] = realtime_kernel;
  e.found["vector_instructions"] = simd_name(simd());
  io.context.progress(0.1, "measuring the loop");
  const LoopStats s = try_loop(p.rate_hz, p.seconds);
  judge_loop(s, p.rate_hz, realtime_kernel, e);
  judge_devices(e);
  judge_picture_and_sound(e);
  e.found["advice"] = e.advice;
  io.end_progress();
  if (io.common.json) {
    io.out << e.found.dump(2) << '\n';
  } else {
    report_examination(e, s, u, realtime_kernel, p.rate_hz, io.out);
  }
  return 0;
}

}  // namespace osteo
