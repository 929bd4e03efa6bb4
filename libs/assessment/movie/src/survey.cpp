// What a movie has to know of a session beforehand, and which moments it shows.
#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/assessment/movie/movie.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline assessment {
namespace {

constexpr double kBinS = 0.1, kStillMmPerS = 2;

void widen(std::optional<std::pair<Vec3, Vec3>>& box, Vec3 at) {
  if (!box) box.emplace(at, at);
  for (std::size_t a = 0; a < 3; ++a) {
    box->first[a] = std::min(box->first[a], at[a]);
    box->second[a] = std::max(box->second[a], at[a]);
  }
}

// In seconds: what is shown, piece by piece.
std::vector<std::pair<double, double>> shown_parts(const SessionSurvey& survey, double from_s, double to_s,
                                                   bool skip_idle) {
  if (!skip_idle) return {{from_s, to_s}};
  std::vector<std::pair<double, double>> parts;
  double begin = from_s;
  for (std::size_t b = 0; b < survey.idle.size();) {
    std::size_t e = b;
    while (e < survey.idle.size() && survey.idle[e]) ++e;
    if (e == b) {
      ++b;
      continue;
    }
    const double first = std::max(from_s, static_cast<double>(b) * kBinS),
                 last = std::min(to_s, static_cast<double>(e) * kBinS);
    if (last - first > kIdleS) {
      parts.emplace_back(begin, first + kRestS);
      begin = last - kRestS;
    }
    b = e;
  }
  parts.emplace_back(begin, to_s);
  return parts;
}

}  // namespace

SessionSurvey survey_of(const SessionReader& session) {
  SessionSurvey s;
  s.rate_hz = session.header().rate_hz;
  s.dust = session.header().dust;
  const double bin_ticks = std::max(1.0, kBinS * s.rate_hz);
  const auto bin_of = [&](std::uint64_t tick) {
    return static_cast<std::size_t>(static_cast<double>(tick) / bin_ticks);
  };
  const auto stir = [&](std::uint64_t tick) {
    const std::size_t b = bin_of(tick);
    if (b >= s.idle.size()) s.idle.resize(b + 1, true);
    s.idle[b] = false;
  };
  std::array<std::optional<std::pair<std::size_t, Vec3>>, kMaxHands> began;  // bin, and where the hand was in it first
  Vec3 axes;
  auto parts = session.parts();
  while (const SessionPart* const p = parts.next()) {
    for (const SceneAction& a : p->actions) {
      if (!row_of(a).by_servo) stir(a.tick);
      if (a.is(ActionKind::simulate) && a.item == static_cast<std::uint32_t>(Simulated::dust) && a.values[0] > 0)
        s.dust = true;
    }
    for (const TickRecord& t : p->ticks) {
      s.end_tick = std::max(s.end_tick, t.tick + 1);
      const std::size_t bin = bin_of(t.tick);
      if (bin >= s.idle.size()) s.idle.resize(bin + 1, true);
      const Vec3 at = from_floats(t.device.position_mm);
      auto& from = began[std::min<std::size_t>(t.hand, kMaxHands - 1)];
      if (!from || from->first != bin) from.emplace(bin, at);
      if (t.device.pedal > 0 || t.voxels_changed > 0 || length(at - from->second) > kStillMmPerS * kBinS)
        s.idle[bin] = false;
      if (t.removed_mm3 <= 0) continue;
      widen(s.drilled_mm, at + from_floats(t.shown_offset_mm));
      axes += normalized(from_floats(t.device.axis)) * static_cast<double>(t.removed_mm3);
    }
    for (const Note& n : p->notes) {
      if (n.kind != "camera") continue;
      if (const auto view = view_of_note(n.json)) {
        s.views.emplace_back(n.tick, *view);
        stir(n.tick);
      } else {
        ++s.unreadable_views;
      }
    }
  }
  s.idle.resize(std::min(s.idle.size(), bin_of(std::max<std::uint64_t>(s.end_tick, 1) - 1) + 1));
  std::stable_sort(s.views.begin(), s.views.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (length(axes) > 0) s.handle = normalized(axes);
  return s;
}

MovieTimes movie_times(const SessionSurvey& survey, double from_s, double to_s, double speed, int fps, bool skip_idle) {
  const double end_s = survey.seconds(), last_s = to_s < 0 ? end_s : std::min(to_s, end_s);
  if (survey.end_tick == 0) throw Error(ExitCode::no_input, "the session holds no tick: there is nothing to show");
  if (!(from_s >= 0) || from_s >= last_s)
    throw Error(ExitCode::usage,
                "from " + format_number(from_s) + " s to " + format_number(to_s < 0 ? end_s : to_s) +
                    " s there is nothing of the session",
                "it lasts " + format_number(std::round(end_s * 10) / 10) + " s");
  const auto parts = shown_parts(survey, from_s, last_s, skip_idle);
  MovieTimes times;
  for (const auto& [a, b] : parts) times.shown_s += b - a;
  times.left_out_s = last_s - from_s - times.shown_s;
  const double wanted = times.shown_s * fps / speed;
  if (wanted > static_cast<double>(kMaxFrames))
    throw Error(ExitCode::usage, "a movie of more than " + std::to_string(kMaxFrames) + " frames is asked for",
                "raise --speed, lower --fps, or name a part with --from-s and --to-s");
  const auto frames = static_cast<std::uint64_t>(std::max(1LL, std::llround(wanted)));
  times.ticks.reserve(frames);
  std::size_t part = 0;
  double before_s = 0;  // shown in the parts before this one
  for (std::uint64_t n = 1; n <= frames; ++n) {
    const double shown =
        n == frames ? times.shown_s : times.shown_s * static_cast<double>(n) / static_cast<double>(frames);
    while (part + 1 < parts.size() && shown > before_s + (parts[part].second - parts[part].first)) {
      before_s += parts[part].second - parts[part].first;
      ++part;
    }
    const double at_s = n == frames ? last_s : parts[part].first + (shown - before_s);
    times.ticks.push_back(static_cast<std::uint64_t>(std::llround(at_s * survey.rate_hz)));
  }
  return times;
}

}  // namespace osteo::inline assessment
