// The experiment's window: pages before and between runs, and what is seen in one.
#pragma once
#include <filesystem>

#include "osteo/assessment/experiment/force_skill_controller.h"
#include "osteo/core/base/context.h"

namespace osteo {

struct RunScreenOptions {
  int width = 1360, height = 860;
  bool by_hand = false;  ///< mouse or keys: the force axis is shown
  bool keys = false;
  std::filesystem::path state_file;
};

/// Where a mouse or keys say how hard the hand presses, N.
struct PressedForce {
  std::atomic<float> n{0};
};

/// Until it is closed. Returns how many OpenGL errors were seen.
int run_experiment_window(experiment::ForceSkillController& controller, PressedForce& pressed,
                          const RunScreenOptions& options, const Context& context);

}  // namespace osteo
