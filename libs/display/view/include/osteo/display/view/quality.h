// How much is done for a picture, by what a picture costs here. Plain values; no graphics.
#pragma once
#include <array>
#include <string_view>

#include "osteo/core/base/param.h"
#include "osteo/display/view/detail/still_layer.h"

namespace osteo::inline display {

/// plain: light and the shade of cavities that the bone's colours hold, nothing else. calm: while something moves as
/// plain; occlusion and smooth edges are added when the picture rests. deep: both always, for graphics cards.
/// automatic: by measured time.
enum class Quality : int { automatic, plain, calm, deep };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(Quality) {
  return {"auto", "plain", "calm", "deep"};
}

/// How one picture is drawn.
struct PictureStyle {
  bool effects = false;  ///< ambient occlusion and smooth edges
  double scale = 1;      ///< pixels drawn along an edge for each one shown; 1 or less
  friend bool operator==(const PictureStyle&, const PictureStyle&) = default;
};

/// What moves in a picture: nothing; a little before a camera that rests, so that only that is drawn again; or the
/// camera, or so much that all is.
enum class Motion : int { none, little, all };

/// Chooses style by times of pictures. A picture in which all moves is to take at most kMovingMs: where three in a row
/// take more, the next has fewer pixels (of kScales), until eight in a row would take less than 0.8 of that with more.
/// Where little moves, fewer pixels would save next to nothing. Effects: a resting picture's time tells what they cost.
/// At or below kDeepMs automatic goes from calm to deep, and back where eight moving pictures in a row take more than
/// kTooDeepMs; where a resting picture takes more than kTooCalmMs, automatic goes on as plain, until the picture has
/// half as many pixels. Deterministic.
class QualityChoice {
 public:
  static constexpr double kMovingMs = 50, kDeepMs = 20, kTooDeepMs = 40, kTooCalmMs = 2500;
  static constexpr std::array<double, 3> kScales{1, 0.7, 0.5};

  explicit QualityChoice(Quality wish = Quality::automatic) { want(wish); }
  /// Of a person; what was measured stays.
  void want(Quality wish);
  [[nodiscard]] Quality wish() const { return wish_; }
  /// plain, calm or deep.
  [[nodiscard]] Quality level() const { return level_; }
  [[nodiscard]] PictureStyle style(Motion motion) const;
  /// A picture of that style took so long, its own work and handing it to the screen; `pixels` shown.
  void took(const PictureStyle& style, Motion motion, double ms, double pixels);
  /// Of the last ones; 0: none yet.
  [[nodiscard]] double moving_ms() const { return moving_ms_; }
  [[nodiscard]] double resting_ms() const { return resting_ms_; }

 private:
  Quality wish_ = Quality::automatic, level_ = Quality::calm, found_ = Quality::calm;
  std::size_t scale_ = 0;  // of kScales
  int slow_ = 0, quick_ = 0, too_deep_ = 0;
  double moving_ms_ = 0, resting_ms_ = 0, plain_from_pixels_ = 0;
};

}  // namespace osteo::inline display
