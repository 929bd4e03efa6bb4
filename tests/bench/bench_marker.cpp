// A pen before a camera: how true, how steady, how late. Prints what docs/how-to/marker.md holds.
//   bench_marker places     still poses by distance, picture size and light
//   bench_marker motion     a hand that moves and rests, by filter
//   bench_marker write DIR  a rendered session: plate/, pivot/, pen/ (pictures), for the commands
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>

#include "marker/render.h"
#include "osteo/simulation/marker/detail/filter.h"
#include "osteo/simulation/marker/detail/pen.h"

namespace osteo {
namespace {

using test::Look;
using test::pen_pose;
using test::Renderer;

// Of this thread's own work: the machine does other things too.
double now_ms() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}
double quantile(std::vector<double> v, double q) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}
double rms(const std::vector<double>& v) {
  double s = 0;
  for (const double x : v) s += x * x;
  return std::sqrt(s / static_cast<double>(v.size()));
}

struct Light {
  const char* name;
  Look look;
};
std::vector<Light> lights() {
  Look good, dim, soft;
  dim.exposure = 0.35;
  dim.noise = 6;
  dim.gradient = 0.5;
  soft.blur_px = 1.2;
  soft.noise = 5;
  return {{"good light", good}, {"dim, noisy, uneven", dim}, {"out of focus", soft}};
}

void places() {
  constexpr int kPoses = 24;
  std::printf(
      "size      light               distance  tip RMS  p95 mm  across  along  angle RMS  p95 deg  lost  CPU ms\n");
  for (const auto& [w, h] : {std::pair{640, 480}, {1280, 720}}) {
    const CameraModel camera = test::webcam(w, h);
    for (const Light& light : lights()) {
      for (const double distance : {250.0, 350.0, 450.0, 600.0}) {
        Renderer renderer(camera, test::pen_faces(), 7);
        std::vector<double> tip, across, along, angle;
        double cpu = 0;
        int lost = 0;
        PenTracker tracker(camera, 1);
        for (int i = 0; i < kPoses; ++i) {
          const RigidTransform pose =
              pen_pose(distance, 53.0 * i, 30 * std::sin(1.9 * i), 25 * std::cos(2.3 * i),
                       {0.12 * distance * std::sin(2.9 * i), 0.06 * distance * std::cos(3.7 * i), 0});
          const GrayPicture picture = renderer.picture(pose, light.look);
          tracker.forget();
          const double begin = now_ms();
          const PenSight s = tracker.look(picture);
          cpu += now_ms() - begin;
          if (s.state != PenSight::State::seen) {
            ++lost;
            continue;
          }
          const Vec3 truth = pose(PenBody::kUsualTipMm), off = s.camera_from_body(PenBody::kUsualTipMm) - truth;
          const double depth = dot(off, normalized(truth));
          tip.push_back(length(off));
          along.push_back(depth);
          across.push_back(length(off - normalized(truth) * depth));
          angle.push_back(
              std::acos(std::min(1.0, dot(s.camera_from_body.rotation.column[2], pose.rotation.column[2]))) * 180 /
              std::numbers::pi);
        }
        std::printf("%4dx%-4d %-19s %5.0f mm  %6.2f %7.2f %7.2f %6.2f %8.2f %9.2f %5.0f%% %6.1f\n", w, h, light.name,
                    distance, rms(tip), quantile(tip, 0.95), rms(across), rms(along), rms(angle), quantile(angle, 0.95),
                    100.0 * lost / kPoses, cpu / kPoses);
        std::fflush(stdout);
      }
    }
  }
}

// The 1 Euro filter (G. Casiez, N. Roussel, D. Vogel, CHI 2012), each coordinate by itself, as a peer.
class OneEuro {
 public:
  OneEuro(double least_hz, double beta) : least_hz_(least_hz), beta_(beta) {}
  Vec3 add(Vec3 x, double dt) {
    if (!started_) {
      started_ = true;
      last_ = x;
      return x;
    }
    const auto alpha = [&](double hz) { return 1 / (1 + 1 / (2 * std::numbers::pi * hz * dt)); };
    const Vec3 rate = (x - last_) / dt;
    rate_ = rate_ + (rate - rate_) * alpha(1);
    last_ = last_ + (x - last_) * alpha(least_hz_ + beta_ * length(rate_));
    return last_;
  }

 private:
  double least_hz_, beta_;
  bool started_ = false;
  Vec3 last_, rate_;
};

// A hand at work: strokes of 8 mm at 1.2 Hz across and 4 mm at 2 Hz along, rolling; then it rests. `t` in s.
RigidTransform hand_at(double t) {
  const double on = t < 4 ? 1 : 0, w = 2 * std::numbers::pi;
  const double fade = on * std::min(1.0, (4 - t) / 0.5);
  const Vec3 off = Vec3{8 * std::sin(w * 1.2 * t), 3 * std::sin(w * 0.7 * t), 4 * std::sin(w * 2 * t)} * fade;
  return pen_pose(380, 25 + 6 * fade * std::sin(w * 0.9 * t), 12 + 5 * fade * std::sin(w * 1.1 * t),
                  15 + 4 * fade * std::cos(w * 0.8 * t), off);
}

struct Recorded {
  double time_s;
  PenSight sight;
};

// Delay that explains the motion best: the shift of the truth that leaves the least error.
double delay_ms(const std::vector<std::pair<double, Vec3>>& shown) {
  double best = 1e9, at = 0;
  for (double d = -20; d <= 120; d += 1) {
    double sum = 0;
    for (const auto& [t, p] : shown) sum += std::pow(length(p - hand_at(t - d / 1e3)(PenBody::kUsualTipMm)), 2);
    if (sum < best) {
      best = sum;
      at = d;
    }
  }
  return at;
}

void report(const char* name, const std::vector<std::pair<double, Vec3>>& shown) {
  std::vector<double> moving, rest;
  Vec3 middle;
  std::vector<std::pair<double, Vec3>> motion;
  int n = 0;
  for (const auto& [t, p] : shown) {
    if (t > 0.5 && t < 3.4) {
      moving.push_back(length(p - hand_at(t)(PenBody::kUsualTipMm)));
      motion.emplace_back(t, p);
    }
    if (t > 4.7) {
      middle += p;
      ++n;
    }
  }
  middle = middle / n;
  for (const auto& [t, p] : shown) {
    if (t > 4.7) rest.push_back(length(p - middle));
  }
  std::printf("  %-42s delay %4.0f ms  error while moving %5.2f mm (p95 %5.2f)  jitter at rest %5.3f mm\n", name,
              delay_ms(motion), rms(moving), quantile(moving, 0.95), rms(rest));
}

void motion() {
  for (const auto& [w, h, fps] : {std::tuple{640, 480, 30.0}, {1280, 720, 30.0}, {1280, 720, 60.0}}) {
    const CameraModel camera = test::webcam(w, h);
    Renderer renderer(camera, test::pen_faces(), 11);
    PenTracker tracker(camera, 1);
    Look look;
    look.shutter_s = 0.01;
    std::vector<Recorded> seen;
    double cpu = 0;
    int pictures = 0;
    for (double t = 0; t < 6; t += 1 / fps) {
      const GrayPicture picture = renderer.picture([&](double dt) { return hand_at(t + dt); }, look);
      const double begin = now_ms();
      const PenSight s = tracker.look(picture);
      cpu += now_ms() - begin;
      ++pictures;
      if (s.state == PenSight::State::seen) seen.push_back({t, s});
    }
    std::printf("%d x %d at %.0f Hz, 10 ms exposure: %d of %d pictures lost, %.1f ms a picture\n", w, h, fps,
                pictures - static_cast<int>(seen.size()), pictures, cpu / pictures);
    // What is shown at a time follows from pictures that are a period old by then: transfer and sight.
    const double latency = 1 / fps;
    const auto shown_by = [&](auto&& add, auto&& at) {
      std::vector<std::pair<double, Vec3>> shown;
      std::size_t next = 0;
      for (double t = 0.2; t < 6; t += 0.002) {
        while (next < seen.size() && seen[next].time_s + latency <= t) add(seen[next++]);
        shown.emplace_back(t, at(t));
      }
      return shown;
    };
    Vec3 raw;
    report("as seen", shown_by([&](const Recorded& r) { raw = r.sight.camera_from_body(PenBody::kUsualTipMm); },
                               [&](double) { return raw; }));
    for (const auto& [hz, beta] : {std::pair{1.0, 0.05}, {2.0, 0.2}}) {
      OneEuro euro(hz, beta);
      double last = 0;
      char name[64];
      std::snprintf(name, sizeof name, "1 Euro, %.0f Hz, beta %.2f", hz, beta);
      report(name, shown_by(
                       [&](const Recorded& r) {
                         raw = euro.add(r.sight.camera_from_body(PenBody::kUsualTipMm), r.time_s - last);
                         last = r.time_s;
                       },
                       [&](double) { return raw; }));
    }
    for (const auto& [q, rest] : {std::pair{1e4, 1.0}, {2e5, 1.0}, {2e5, 0.005}, {2e5, 0.001}, {1e6, 0.002}}) {
      PenFilterParams params;
      params.acceleration_mm2_s3 = q;
      params.rest_share = rest;
      PenFilter filter(PenBody::kUsualTipMm, params);
      char name[64];
      std::snprintf(
          name, sizeof name, "Kalman, %.0e mm2/s3, %g at rest%s", q, rest,
          q == PenFilterParams{}.acceleration_mm2_s3 && rest == PenFilterParams{}.rest_share ? " (used)" : "");
      report(name, shown_by([&](const Recorded& r) { filter.add(r.time_s, r.sight); },
                            [&](double t) { return filter.motion().tip_at(t); }));
    }
    std::fflush(stdout);
  }
}

void save(const GrayPicture& p, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << p.width << ' ' << p.height << "\n255\n";
  out.write(reinterpret_cast<const char*>(p.pixels.data()), static_cast<std::streamsize>(p.pixels.size()));
}

void write(const std::filesystem::path& folder) {
  const CameraModel camera = test::webcam(640, 480);
  for (const char* name : {"plate", "pivot", "pen"}) std::filesystem::create_directories(folder / name);
  char name[32];
  Look look;
  look.samples = 2;
  Renderer plate(camera, test::plate_face());
  constexpr double k = std::numbers::pi / 180;
  for (int i = 0; i < 14; ++i) {
    RigidTransform p = rotation_about({}, {1, 0, 0}, 35 * k * std::sin(1.3 * i + 0.5)) *
                       rotation_about({}, {0, 1, 0}, 35 * k * std::cos(2.1 * i)) *
                       rotation_about({}, {0, 0, 1}, (90 + 12.0 * (i % 5)) * k);
    p.shift_mm =
        Vec3{70 * std::sin(2.6 * i), 45 * std::cos(1.9 * i), 480 + 30.0 * (i % 4)} - p.rotation * Vec3{87.5, 122.5, 0};
    std::snprintf(name, sizeof name, "%04d.pgm", i);
    save(plate.picture(p, look), folder / "plate" / name);
  }
  Renderer pen(camera, test::pen_faces());
  const Vec3 tip{2, -1, -112};
  for (int i = 0; i < 40; ++i) {
    std::snprintf(name, sizeof name, "%04d.pgm", i);
    RigidTransform p = pen_pose(0, 3.0 * i, 30 * std::sin(0.25 * i), 30 * std::cos(0.33 * i));
    p.shift_mm = Vec3{10, 70, 360} - p.rotation * tip;
    save(pen.picture(p, look), folder / "pivot" / name);
    save(pen.picture(hand_at(i / 30.0), look), folder / "pen" / name);
  }
}

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  cv::setNumThreads(1);
  if (what == "write" && argc > 2) {
    osteo::write(argv[2]);
  } else {
    if (what.empty() || what == "places") osteo::places();
    if (what.empty() || what == "motion") osteo::motion();
  }
  return 0;
}
