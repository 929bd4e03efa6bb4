// The three linked cuts at the side of the window. Private to libs/window.
#pragma once
#include <array>
#include <optional>
#include <span>

#include "osteo/grid/sampler.h"
#include "osteo/scene/rehearsal.h"

namespace osteo {

class CutsPanel {
 public:
  struct Box {
    float x, y, width, height;
  };
  /// With an OpenGL context: makes and frees the textures.
  void create();
  void release();
  /// Grey values of the bone; without them bone is one grey.
  void set_hu(const SparseGrid& hu) { hu_.emplace(hu); }
  /// Draws the cuts anew at the next frame; otherwise about seven times a second.
  void renew() { age_s_ = 1e9; }
  /// Between ImGui::NewFrame and Render.
  void draw(Rehearsal& rehearsal, int tool, Box box) { draw(rehearsal, tool, std::span(&box, 1)); }
  /// Each cut in a box of its own: axial, coronal, sagittal.
  void draw(Rehearsal& rehearsal, int tool, const std::array<Box, 3>& boxes) { draw(rehearsal, tool, std::span(boxes)); }

 private:
  void draw(Rehearsal& rehearsal, int tool, std::span<const Box> boxes);
  std::array<unsigned, 3> textures_{};
  std::optional<GridSampler> hu_;
  Vec3 cross_{};
  double age_s_ = 1e9;
  float span_mm_ = 90;
  bool follow_drill_ = true;
};

}  // namespace osteo
