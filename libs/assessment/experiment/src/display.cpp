// What a participant sees.
#include <algorithm>
#include <cstdio>

#include "osteo/assessment/experiment/analysis.h"

namespace osteo::inline assessment::experiment {
namespace {
using Colour = sheet::Drawing::Colour;
constexpr Colour kBlack{28, 33, 41}, kPath{120, 128, 140}, kBlue{38, 99, 200}, kGreen{40, 150, 70}, kRed{190, 40, 40},
    kPaper{250, 250, 252}, kHand{240, 150, 20};
}  // namespace

sheet::Drawing run_drawing(const Stimulus& s, const DisplayState& state, double width, double height) {
  sheet::Drawing d;
  d.width = width;
  d.height = height;
  d.alt = std::string("path and position, ") + (state.kind == RunKind::test ? "test" : short_name(state.training));
  d.box(0, 0, width, height, kPaper);
  // Room for the bars above and below the path's own height.
  const double scale = std::min(0.8 * width / s.params.length_mm, 0.55 * height / s.params.width_mm),
               bar = 0.32 * height;
  const auto at = [&](double x_mm, double z_mm) -> std::array<double, 2> {
    return {width / 2 + scale * x_mm, 0.55 * height + scale * z_mm};
  };
  std::vector<std::array<double, 2>> path;
  for (std::size_t i = 0; i < s.x_mm.size(); i += std::max<std::size_t>(1, s.x_mm.size() / 400))
    path.push_back(at(s.x_mm[i], s.z_mm[i]));
  path.push_back(at(s.x_mm.back(), s.z_mm.back()));
  const double line = std::max(1.0, height / 250);
  d.line(path, kPath, line);
  const auto hand = at(state.view.hand_mm.x, state.view.hand_mm.z);
  const bool bars = state.kind == RunKind::training && state.training != Training::haptic;
  const double wide = 0.022 * width;
  if (bars) {
    const auto height_of = [&](double n) { return bar * std::clamp(n / state.most_n, 0.0, 1.0); };
    const double target = height_of(state.view.target_n);
    d.box(hand[0] - 1.4 * wide, hand[1] - target - wide, wide, target, kBlue, std::max(0.15, state.aid));
    d.line({{hand[0] - 1.5 * wide, hand[1] - wide}, {hand[0] - 0.3 * wide, hand[1] - wide}}, kBlue, line);
    if (state.training == Training::visuohaptic && (state.feedback == Feedback::concurrent || state.view.done)) {
      const double shown = state.view.target_n + state.amplification * (state.view.applied_n - state.view.target_n),
                   own = height_of(shown);
      d.box(hand[0] + 0.4 * wide, hand[1] - own - wide, wide, own, kGreen);
      d.line({{hand[0] + 0.3 * wide, hand[1] - wide}, {hand[0] + 1.5 * wide, hand[1] - wide}}, kGreen, line);
    }
  }
  const double dot = 0.008 * width;
  const auto goal = at(state.view.path_x_mm, state.view.path_z_mm);
  d.line({{goal[0] - 1.6 * dot, goal[1]}, {goal[0] + 1.6 * dot, goal[1]}}, kBlack, line);
  d.line({{goal[0], goal[1] - 1.6 * dot}, {goal[0], goal[1] + 1.6 * dot}}, kBlack, line);
  std::vector<std::array<double, 2>> round{
      {hand[0] - dot, hand[1]}, {hand[0], hand[1] - dot}, {hand[0] + dot, hand[1]}, {hand[0], hand[1] + dot}};
  d.area(round, kHand);
  if (state.view.saturated) {
    const double side = 0.04 * width;
    d.box(width - 1.5 * side, 0.5 * side, side, side, kRed);
    d.text(width - 1.7 * side, side, "device at its limit", 0.022 * height + 6, kRed, 1);
  }
  const std::string words = state.kind == RunKind::test          ? "T: press what you have learned"
                            : state.training == Training::haptic ? "H: hold the device in its plane"
                            : state.training == Training::visual ? "V: watch the blue bar"
                                                                 : "V+H: make the green bar as high as the blue one";
  d.text(0.02 * width, 0.06 * height, words, 0.024 * height + 7, kBlack, -1, true);
  return d;
}

}  // namespace osteo::inline assessment::experiment
