// What the window shows of a session that is over: findings, its course over time, and the session itself as of any
// time. Plain values; who makes them may take seconds and is called in another thread.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/data/vec.h"
#include "osteo/session/scene/session_player.h"

namespace osteo::inline simulation {
class StructureMap;
}

namespace osteo::inline app {

/// A sentence, and what it comes from.
struct ReviewFinding {
  enum class Weight { good, note, caution, serious };
  Weight weight = Weight::note;
  std::string text, why;
  std::vector<double> times_s;  ///< moments to look at, by time
  std::optional<Vec3> at_mm;    ///< where to look
  std::vector<Vec3> places_mm;  ///< voxels or places that prove it
};

/// Ten samples a second, arrays of one length; not a number where nothing is known.
struct ReviewCourse {
  static constexpr double kRateHz = 10;
  std::vector<float> force_n, distance_mm;  ///< of burrs on bone, the most; to the nearest structure, the least
  std::vector<float> seen_mm3, hidden_mm3;  ///< bone removed
  struct Event {
    double t_s = 0;
    std::string what;
    bool grave = false;  ///< a structure was reached
  };
  std::vector<Event> events;  ///< by time
  [[nodiscard]] std::size_t size() const { return force_n.size(); }
};

struct SessionReview {
  std::vector<std::string> summary;     ///< sentences
  std::vector<ReviewFinding> findings;  ///< the most serious first
  std::vector<std::string> words;       ///< what limits them
  ReviewCourse course;
  std::unique_ptr<SessionPlayer> player;
  std::shared_ptr<const StructureMap> structures;  ///< null where the case has none
};

}  // namespace osteo::inline app
