// What a person measures and writes on the bone: a ruler, notes pinned to places. They touch no physics and go into the
// session as notes. Private to libs/app/window; no ImGui.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline app {

class Ruler {
 public:
  [[nodiscard]] bool on() const { return on_; }
  /// Off: what it showed is gone.
  void turn(bool on);
  /// A point on the bone. The second completes a measure, the third begins another one. The value of a "ruler" note,
  /// once complete.
  std::optional<std::string> click(Vec3 at_mm);
  [[nodiscard]] const std::vector<Vec3>& points_mm() const { return points_; }
  /// Nothing before the second point.
  [[nodiscard]] std::optional<double> length_mm() const;

 private:
  bool on_ = false;
  std::vector<Vec3> points_;
};

struct PinnedNote {
  int number = 1;
  Vec3 at_mm;
  std::string text;
};
/// Numbered from 1 within a session.
class PinnedNotes {
 public:
  static constexpr std::size_t kMaxBytes = 300;
  /// The value of a "note" note. Blanks at the ends are dropped; empty text: nothing is pinned, nothing returned.
  /// Beyond kMaxBytes it is cut at a letter's end.
  std::optional<std::string> pin(Vec3 at_mm, std::string text);
  [[nodiscard]] const std::vector<PinnedNote>& all() const { return notes_; }
  /// Another session.
  void clear() { notes_.clear(); }

 private:
  std::vector<PinnedNote> notes_;
};

/// 1, 2 or 5 times a power of ten: the longest that is at most so many pixels on the screen.
[[nodiscard]] double scale_bar_mm(double pixels_per_mm, double most_pixels);

}  // namespace osteo::inline app
