// Views to bring the camera to, shown in the picture and timed. Private to libs/app/window.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "local_text.h"
#include "osteo/simulation/camera/camera_trial.h"

namespace osteo::inline app {

class TrialOverlay {
 public:
  static constexpr std::size_t kTargets = 12;
  /// From the whole bone; `middle_mm`: bone to look at.
  void begin(const ScopeView& start, Vec3 middle_mm);
  [[nodiscard]] bool running() const { return trial_.has_value() && trial_->target() != nullptr; }
  /// Once a frame. What there is to say, once. `csv` is written whenever a view was reached; what cannot be written is
  /// said.
  std::optional<LocalText> advance(const ScopeControl& control, double seconds, const std::filesystem::path& csv);
  /// Into ImGui's background: two rings, the target's field in its focus and a smaller one nearer to its eye. Where
  /// they are one in the other and the larger as large as the picture, the view is reached.
  void draw(const ScopeView& view, const PictureArea& area) const;

 private:
  std::optional<CameraTrial> trial_;
};

}  // namespace osteo::inline app
