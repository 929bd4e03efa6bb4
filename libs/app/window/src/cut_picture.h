// A slice of a case under correction as pixels: grey values, the outline of bone, structures. Private to
// libs/app/window; no OpenGL.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "osteo/display/view/slices.h"
#include "osteo/imaging/edit/document.h"

namespace osteo::inline app {

struct CutLook {
  HuWindow hu;
  bool outlines = true;
  int line_pixels = 1;
  std::optional<ThresholdEdit> live;  ///< a threshold that is being chosen: outlined instead of bone as it is
};

inline constexpr std::array<std::uint8_t, 3> kBoneColour{255, 196, 60}, kLiveColour{80, 220, 255};

/// RGBA, top row first, `view.width` * `view.height`; linear between voxels, black outside the scan. 12 ns a pixel on
/// one core. The document must not change meanwhile.
void draw_cut(const SliceView& view, const EditDocument& document, const CutLook& look,
              std::vector<std::uint32_t>& rgba);

/// HU between voxels; nothing outside the scan.
[[nodiscard]] std::optional<double> hu_at(const Image& ct, Vec3 world_mm);

}  // namespace osteo::inline app
