// Timed views in the window: what is said and written.
#include "trial_overlay.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "osteo/core/base/files.h"

namespace osteo {
namespace {

TEST(TrialOverlay, SaysAndWritesEachViewThatIsReached) {
  const TemporaryFolder folder;
  const auto csv = folder.path() / "camera-trial.csv";
  ScopeView start = overview({0, 0, 0}, 60, {1, 0, 0});
  start.focus_mm = {5, 6, 7};
  const auto targets = camera_targets(start, TrialOverlay::kTargets, 1);
  TrialOverlay trial;
  ScopeControl control;
  control.flights = false;
  EXPECT_FALSE(trial.advance(control, 1, csv)) << "none was asked for";
  trial.begin(overview({0, 0, 0}, 60, {1, 0, 0}), {5, 6, 7});
  EXPECT_FALSE(trial.advance(control, 0.1, csv));
  EXPECT_FALSE(std::filesystem::exists(csv));
  std::string last;
  for (std::size_t n = 0; n < targets.size(); ++n) {
    ASSERT_TRUE(trial.running());
    control.go(targets[n]);
    std::optional<LocalText> said;
    for (int frame = 0; frame < 60 && !said; ++frame) said = trial.advance(control, 1.0 / 60, csv);
    ASSERT_TRUE(said) << n;
    last = said->shown;
  }
  EXPECT_FALSE(trial.running());
  EXPECT_NE(last.find("view 12 of 12"), std::string::npos) << last;
  EXPECT_NE(last.find("camera-trial.csv"), std::string::npos) << last;
  std::ifstream file(csv);
  std::stringstream text;
  text << file.rdbuf();
  const std::string written = text.str();
  EXPECT_EQ(std::count(written.begin(), written.end(), '\n'), 13);
}

TEST(TrialOverlay, AFolderThatIsGoneIsSaid) {
  TrialOverlay trial;
  ScopeControl control;
  control.flights = false;
  const ScopeView start = overview({}, 60, {1, 0, 0});
  trial.begin(start, {});
  control.go(camera_targets(start, TrialOverlay::kTargets, 1)[0]);
  std::optional<LocalText> said;
  for (int frame = 0; frame < 60 && !said; ++frame) said = trial.advance(control, 1.0 / 60, "/nowhere/at/all.csv");
  ASSERT_TRUE(said);
  EXPECT_NE(said->shown.find("/nowhere"), std::string::npos) << said->shown;
}

}  // namespace
}  // namespace osteo
