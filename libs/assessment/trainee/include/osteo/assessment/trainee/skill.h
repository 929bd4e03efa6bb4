// How good a simulated trainee is: the numbers that its hand and its plan go by, and that a study of it knows as truth.
#pragma once
#include <string>
#include <string_view>

#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"

namespace osteo::inline assessment {

/// None of it is fitted to people. Each number acts in one place (docs/validation/trainee.md), so that a metric can be held
/// against it.
struct TraineeSkill {
  using Params = TraineeSkill;
  double region = 1;
  double undercut = 0;
  double force_n = 1;
  double force_control = 1;
  double tremor_mm = 0.05;
  double speed_mm_s = 25;
  double knowledge = 1;
  double instruments = 1;
  double camera = 1;
  static void describe(TraineeSkill& p, auto& visit) {
    visit({"region", "how well it knows where to drill: 1 in the middle of the plan, 0 off by 7 mm", "", 0, 1},
          p.region);
    visit({"undercut", "how much of the opening it leaves undrilled, and works on under its edge", "", 0, 1},
          p.undercut);
    visit({"force_n", "how hard it means to press", "N", 0.2, 5}, p.force_n);
    visit({"force_control", "how well it holds that force, and how much it eases off near structures", "", 0, 1},
          p.force_control);
    visit({"tremor_mm", "tremor of the hand, 8 to 12 Hz, root mean square in each direction", "mm", 0, 2}, p.tremor_mm);
    visit({"speed_mm_s", "speed of the strokes", "mm/s", 2, 100}, p.speed_mm_s);
    visit(
        {"knowledge",
         "knowledge of structures: 1 it keeps clear of them, 0 it believes them 2.5 mm deeper than they are", "", 0, 1},
        p.knowledge);
    visit(
        {"instruments",
         "share of the strokes near a structure that are made with a burr which the procedure allows there", "", 0, 1},
        p.instruments);
    visit({"camera", "how often it moves its view to where it works: 1 every 4 s, 0 every 40 s", "", 0, 1}, p.camera);
  }
};

/// "expert" or "novice", then KEY=VALUE, by commas, all of it optional: "novice, undercut=0.8". What is not named is an
/// expert's. Error(usage) with names and ranges.
[[nodiscard]] TraineeSkill parse_skill(std::string_view text);
[[nodiscard]] Json skill_json(const TraineeSkill& skill);

}  // namespace osteo::inline assessment
