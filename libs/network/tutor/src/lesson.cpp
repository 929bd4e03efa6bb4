#include "osteo/network/tutor/lesson.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"

namespace osteo::inline network {
namespace {

bool plays_on(const SceneAction& a) {
  const ActionRow& row = row_of(a);
  return row.by_servo || row.moves_dust || row.begins_state || a.is(ActionKind::hold) || a.is(ActionKind::resume);
}

}  // namespace

std::vector<Lesson::Point> way_of(std::span<const DeviceSample> samples) {
  std::vector<Lesson::Point> way;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vec3 at = from_floats(samples[i].position_mm);
    if (!std::isfinite(dot(at, at))) continue;
    const double moved = way.empty() ? 0 : length(at - from_floats(way.back().at_mm));
    if (!way.empty() && moved < Lesson::kStepMm) continue;
    const double arc = way.empty() ? 0 : static_cast<double>(way.back().arc_mm) + moved;
    way.push_back({samples[i].position_mm, static_cast<float>(arc), static_cast<std::uint32_t>(i)});
  }
  return way;
}

Lesson read_lesson(const SessionReader& session, double from_s, double to_s) {
  const SessionOutline& o = session.outline();
  const auto at_s = [&](std::uint64_t tick) {
    return format_number(static_cast<double>(tick) / o.header.rate_hz) + " s";
  };
  if (!o.not_replayable.empty())
    throw Error(ExitCode::corrupt, "the session cannot be repeated by this version: " + o.not_replayable,
                "play it with " + o.header.program_version);
  Lesson lesson;
  lesson.rate_hz = o.header.rate_hz;
  lesson.setup = o.header.haptics;
  const std::size_t hands = lesson.setup.hands();
  if (hands >= kMaxHands)
    throw Error(ExitCode::usage,
                "the session has " + std::to_string(hands) + " hands, and who learns needs one more than there can be",
                "record it with at most " + std::to_string(kMaxHands - 1));
  if (lesson.setup.curve.size() >= 2)
    throw Error(ExitCode::usage,
                "a curve of the settings holds the first hand of this session, and would hold who learns",
                "record it without \"curve_file\"");
  lesson.first_tick = static_cast<std::uint64_t>(std::llround(from_s * lesson.rate_hz));
  const std::uint64_t end =
      to_s > 0 ? static_cast<std::uint64_t>(std::llround(to_s * lesson.rate_hz)) : std::uint64_t{0xffffffffffffffffULL};
  lesson.hands.resize(hands);
  std::uint64_t next = lesson.first_tick;
  auto parts = session.parts();
  while (const SessionPart* const part = parts.next()) {
    for (const SceneAction& a : part->actions) {
      if (a.tick >= end) continue;
      if (a.is(ActionKind::setting) && a.tick <= lesson.first_tick) {
        change_setting(lesson.setup.params, a.item, a.values[0]);
      } else if (a.is(ActionKind::setting) ||
                 (a.tick >= lesson.first_tick && (row_of(a).moves_dust || row_of(a).begins_state))) {
        lesson.actions.push_back(a);
        lesson.actions.back().tick -= lesson.first_tick;
      } else if (a.is(ActionKind::grip) || a.is(ActionKind::guide) || a.is(ActionKind::cutting_guide) ||
                 (a.tick >= lesson.first_tick && !plays_on(a))) {
        throw Error(ExitCode::usage,
                    "at " + at_s(a.tick) + " the session has '" + std::string(name_of(a)) +
                        "', which hands alone do not repeat",
                    "play a part before or behind it: --from-s, --to-s");
      }
    }
    for (const TickRecord& t : part->ticks) {
      if (t.tick < lesson.first_tick || t.tick >= end) continue;
      if (t.hand == 0 && t.tick != next++)
        throw Error(ExitCode::corrupt, "ticks are missing before " + at_s(t.tick),
                    "play a part that is whole: --from-s, --to-s");
      lesson.hands[t.hand].push_back(t.device);
    }
    if (next >= end) break;
  }
  for (auto& samples : lesson.hands) samples.resize(lesson.hands.front().size());
  if (lesson.hands.front().empty())
    throw Error(ExitCode::usage, "the session has nothing from " + at_s(lesson.first_tick) + " on",
                "it is shorter; give an earlier --from-s");
  lesson.way = way_of(lesson.hands.front());
  if (lesson.way.empty())
    throw Error(ExitCode::corrupt, "the first hand of the session has no pose that could be used");
  return lesson;
}

double spread_mm(const Lesson& lesson, std::span<const Lesson> others, double share) {
  std::vector<double> apart;
  for (const Lesson& other : others) {
    for (const Lesson::Point& p : lesson.way) {
      double least = 1e300;
      for (const Lesson::Point& q : other.way) {
        const Vec3 d = from_floats(p.at_mm) - from_floats(q.at_mm);
        least = std::min(least, dot(d, d));
      }
      apart.push_back(std::sqrt(least));
    }
  }
  return value_at_share(std::move(apart), std::clamp(share, 0.0, 1.0));
}

}  // namespace osteo::inline network
