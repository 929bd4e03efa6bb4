#include "osteo/display/view/quality.h"

namespace osteo::inline display {

void QualityChoice::want(Quality wish) {
  wish_ = wish;
  level_ = wish == Quality::automatic ? found_ : wish;
}

PictureStyle QualityChoice::style(Motion motion) const {
  if (motion == Motion::none) return {level_ != Quality::plain, 1};
  return {level_ == Quality::deep, motion == Motion::all ? kScales[scale_] : 1};
}

void QualityChoice::took(const PictureStyle& style, Motion motion, double ms, double pixels) {
  const bool moving = motion != Motion::none;
  (moving ? moving_ms_ : resting_ms_) = ms;
  constexpr int kSlow = 3, kQuick = 8;
  if (moving) {
    // Times of another scale are late news. What a picture costs apart from its pixels is not known: none of it is
    // counted on to shrink.
    if (motion == Motion::all && style.scale == kScales[scale_]) {
      const double more = scale_ > 0 ? kScales[scale_ - 1] / kScales[scale_] : 1;
      slow_ = ms > kMovingMs ? slow_ + 1 : 0;
      quick_ = scale_ > 0 && ms * more * more < 0.8 * kMovingMs ? quick_ + 1 : 0;
      if (slow_ >= kSlow && scale_ + 1 < kScales.size()) {
        ++scale_;
        slow_ = quick_ = 0;
      } else if (quick_ >= kQuick) {
        --scale_;
        slow_ = quick_ = 0;
      }
    }
    too_deep_ = style.effects && ms > kTooDeepMs ? too_deep_ + 1 : 0;
    if (too_deep_ >= kQuick && found_ == Quality::deep) {
      found_ = Quality::calm;
      too_deep_ = 0;
    }
  } else if (style.effects) {
    if (ms > kTooCalmMs) {
      found_ = Quality::plain;
      plain_from_pixels_ = pixels;
    } else if (ms <= kDeepMs) {
      found_ = Quality::deep;
    }
  }
  if (found_ == Quality::plain && pixels <= plain_from_pixels_ / 2) found_ = Quality::calm;
  want(wish_);
}

}  // namespace osteo::inline display
