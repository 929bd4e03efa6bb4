#include "osteo/assessment/ground_truth/trajectory.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::truth {
namespace {

// Normal force at a time, N; negative: how far it is lifted off the surface, in N of the spring.
double pressed(double s, const TruthParams& p) {
  const double push = p.push_n + p.swing_n * portable::sin_cos(2.3 * s).sin;
  if (!p.lifts) return push;
  // Down for 4.3 s, up within 0.1 s, half a second in the air.
  const double at = s - 5 * std::floor(s / 5);
  const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
  double up = 0;
  if (at > 4.3 && at <= 4.4) up = smooth((at - 4.3) / 0.1);
  if (at > 4.4 && at <= 4.9) up = 1;
  if (at > 4.9) up = smooth((5 - at) / 0.1);
  return push * (1 - up) - 1.0 * up;
}

double rounded_to(double v, double step) {
  return std::floor(v / step + 0.5) * step;
}

}  // namespace

Trajectory true_trajectory(const Solid& solid, const TruthParams& p) {
  const double k = p.stiffness_n_per_mm > 0 ? p.stiffness_n_per_mm : solid.stiffness_n_per_mm();
  if (!(p.seconds > 0 && p.seconds <= 3600 && p.rate_hz >= 1 && p.rate_hz <= 1e5 && p.friction >= 0 &&
        p.friction <= 3 && p.push_n > p.swing_n && p.swing_n >= 0 && p.probe_radius_mm >= 0))
    throw Error(
        ExitCode::usage,
        "a trajectory takes up to an hour at 1 to 100,000 Hz, friction up to 3, and a push that stays positive");
  Trajectory t;
  t.stiffness_n_per_mm = k;
  t.friction = p.friction;
  t.rate_hz = p.rate_hz;
  t.probe_radius_mm = p.probe_radius_mm;
  const auto count = static_cast<std::size_t>(std::llround(p.seconds * p.rate_hz));
  t.moments.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Moment m;
    const double s = static_cast<double>(i) / p.rate_hz;
    m.time_s = s;
    m.surface_mm = solid.place(s, p.path);
    m.normal = solid.normal(m.surface_mm);
    const double push = pressed(s, p);
    m.contact = push > 0;
    Vec3 spring = m.normal * push;  // in the air: towards the surface
    if (m.contact) {
      // Friction acts against the motion of what touches: of a ball's foot the same way as of its middle.
      if (p.friction > 0) {
        const Vec3 v = normalized(solid.place(s + 1e-4, p.path) - solid.place(s - 1e-4, p.path));
        spring -= v * (p.friction * push);
      }
      m.force_n = spring;
    }
    m.device_mm =
        m.surface_mm + m.normal * p.probe_radius_mm - (p.device_by_normal_force ? m.normal * push : spring) / k;
    t.moments.push_back(m);
  }
  return t;
}

Trajectory measured_trajectory(const Solid& solid, const Trajectory& truth, const Instruments& in) {
  if (!(in.tracker_hz > 0 && in.tracker_sd_mm >= 0 && in.force_sd_n >= 0))
    throw Error(ExitCode::usage, "instruments need a rate and noise of 0 or more");
  Trajectory t = truth;
  statistics::Random random(in.seed);
  const auto gauss = [&](double sd) { return Vec3{random.normal(), random.normal(), random.normal()} * sd; };
  // The tracker's places: of the contact itself, at its own times.
  const double last = truth.moments.empty() ? 0 : truth.moments.back().time_s;
  std::vector<Vec3> seen;
  for (double s = 0; s <= last + 1 / in.tracker_hz; s += 1 / in.tracker_hz) {
    const auto i = std::min(truth.moments.size() - 1, static_cast<std::size_t>(std::llround(s * truth.rate_hz)));
    seen.push_back(truth.moments[i].surface_mm + gauss(in.tracker_sd_mm));
  }
  for (Moment& m : t.moments) {
    const double at = m.time_s * in.tracker_hz;
    const auto i = std::min(seen.size() - 2, static_cast<std::size_t>(at));
    m.surface_mm = solid.foot(seen[i] + (seen[i + 1] - seen[i]) * (at - static_cast<double>(i)));
    m.normal = solid.normal(m.surface_mm);
    m.force_n += gauss(in.force_sd_n);
    m.force_n = {rounded_to(m.force_n.x, 1.0 / 320), rounded_to(m.force_n.y, 1.0 / 320),
                 rounded_to(m.force_n.z, 1.0 / 640)};
    const double pressed_n = std::max(0.0, dot(m.force_n, m.normal));
    m.device_mm = m.surface_mm + m.normal * t.probe_radius_mm - m.normal * (pressed_n / t.stiffness_n_per_mm);
  }
  return t;
}

std::string traj_text(const Trajectory& t, TrajectoryRole role) {
  std::string text;
  char line[256];
  for (const Moment& m : t.moments) {
    const Vec3 x = role == TrajectoryRole::in ? m.device_mm : m.surface_mm;
    const Vec3 f = role == TrajectoryRole::probe              ? m.force_n
                   : role == TrajectoryRole::out && m.contact ? Vec3{0, 0, 1}
                                                              : Vec3{};
    std::snprintf(line, sizeof line, "%.6f %.9g %.9g %.9g %.9g %.9g %.9g\n", m.time_s, x.x, x.y, x.z, f.x, f.y, f.z);
    text += line;
  }
  return text;
}

std::string trajectory_csv(const Trajectory& t) {
  std::string text =
      "time_s,surface_x_mm,surface_y_mm,surface_z_mm,normal_x,normal_y,normal_z,force_x_n,force_y_n,force_z_n,device_x_"
      "mm,device_y_mm,"
      "device_z_mm,contact\n";
  char line[512];
  for (const Moment& m : t.moments) {
    std::snprintf(line, sizeof line,
                  "%.6f,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%d\n", m.time_s,
                  m.surface_mm.x, m.surface_mm.y, m.surface_mm.z, m.normal.x, m.normal.y, m.normal.z, m.force_n.x,
                  m.force_n.y, m.force_n.z, m.device_mm.x, m.device_mm.y, m.device_mm.z, m.contact ? 1 : 0);
    text += line;
  }
  return text;
}

std::vector<TrajSample> parse_traj(std::string_view text, const std::string& name, std::string_view columns,
                                   double rate_hz) {
  enum { kTime, kX, kY, kZ, kFx, kFy, kFz, kKinds };
  static constexpr std::array<std::string_view, kKinds> kNames{"t", "x", "y", "z", "fx", "fy", "fz"};
  const auto next_word = [](std::string_view& rest) {
    constexpr std::string_view kBetween = " \t,\r";
    const std::size_t from = rest.find_first_not_of(kBetween);
    if (from == std::string_view::npos) {
      rest = {};
      return std::string_view{};
    }
    const std::size_t to = std::min(rest.find_first_of(kBetween, from), rest.size());
    const std::string_view word = rest.substr(from, to - from);
    rest.remove_prefix(to);
    return word;
  };
  std::vector<int> kinds;
  std::array<bool, kKinds> there{};
  for (std::string_view word = next_word(columns); !word.empty(); word = next_word(columns)) {
    const auto* const found = std::find(kNames.begin(), kNames.end(), word);
    const auto kind = static_cast<int>(found - kNames.begin());
    if (word != "-" && (found == kNames.end() || there[static_cast<std::size_t>(kind)]))
      throw Error(ExitCode::usage, "'" + std::string(word) + "' is no column, or there twice",
                  "columns are t, x, y, z, fx, fy, fz and -");
    kinds.push_back(word == "-" ? -1 : kind);
    if (word != "-") there[static_cast<std::size_t>(kind)] = true;
  }
  if (!there[kX] || !there[kY] || !there[kZ]) throw Error(ExitCode::usage, "the columns must name x, y and z");
  if (!there[kTime] && !(rate_hz > 0)) throw Error(ExitCode::usage, "without a column t a rate above 0 is needed");
  std::vector<TrajSample> all;
  std::size_t number = 0;
  bool words_seen = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    std::string_view look = line;
    const std::string_view first = next_word(look);
    if (first.empty() || first.front() == '#' || first.front() == '%') continue;
    std::array<double, kKinds> value{};
    std::size_t column = 0;
    bool bad = false, header = false;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line), ++column) {
      if (column >= kinds.size()) break;  // further columns are nobody's
      const std::string copy(word);
      char* stop = nullptr;
      const double v = std::strtod(copy.c_str(), &stop);
      if (*stop != '\0' || !std::isfinite(v)) {
        header = all.empty() && !words_seen && column == 0;
        bad = true;
        break;
      }
      if (kinds[column] >= 0) value[static_cast<std::size_t>(kinds[column])] = v;
    }
    if (header) {
      words_seen = true;
      continue;
    }
    if (bad || column < kinds.size())
      throw Error(ExitCode::corrupt,
                  "'" + name + "' line " + std::to_string(number) + ": there are not " + std::to_string(kinds.size()) +
                      " numbers",
                  "--columns says what stands where");
    TrajSample s;
    s.time_s = there[kTime] ? value[kTime] : static_cast<double>(all.size()) / rate_hz;
    if (!all.empty() && !(s.time_s > all.back().time_s))
      throw Error(ExitCode::corrupt, "'" + name + "' line " + std::to_string(number) + ": time does not go on");
    s.position_mm = {value[kX], value[kY], value[kZ]};
    s.force_n = {value[kFx], value[kFy], value[kFz]};
    all.push_back(s);
  }
  if (all.empty()) throw Error(ExitCode::no_input, "'" + name + "' holds no sample");
  return all;
}

std::vector<TrajSample> load_traj(const std::filesystem::path& path, std::string_view columns, double rate_hz) {
  return parse_traj(read_text(path), path.string(), columns, rate_hz);
}

Trajectory trajectory_of(const Solid& solid, const std::vector<TrajSample>& samples, double stiffness) {
  if (!(stiffness > 0)) throw Error(ExitCode::usage, "the spring needs a stiffness above 0");
  Trajectory t;
  t.stiffness_n_per_mm = stiffness;
  const double span = samples.size() > 1 ? samples.back().time_s - samples.front().time_s : 0;
  t.rate_hz = span > 0 ? static_cast<double>(samples.size() - 1) / span : 1000;
  for (const TrajSample& s : samples) {
    Moment m;
    m.time_s = s.time_s;
    m.surface_mm = solid.foot(s.position_mm);
    m.normal = solid.normal(m.surface_mm);
    m.force_n = s.force_n;
    const double pressed_n = dot(s.force_n, m.normal);
    m.contact = pressed_n > 0;
    m.device_mm = m.contact ? m.surface_mm - m.normal * (pressed_n / stiffness) : s.position_mm;
    t.moments.push_back(m);
  }
  return t;
}

}  // namespace osteo::inline assessment::truth
