// Flat cuts through a volume as pictures, and drawing on pictures.
#pragma once
#include <functional>
#include <string_view>

#include "osteo/data/data.h"

namespace osteo {

/// The three cuts as a radiologist expects them. axial: seen from the feet, the patient's left on the right of the picture.
/// coronal: seen from the front, left on the right. sagittal: front to the left.
enum class Plane : int { axial, coronal, sagittal };

struct SliceView {
  Plane plane = Plane::axial;
  Vec3 through_mm;  ///< the point that the cut passes through
  Vec3 centre_mm;   ///< what lies at the centre of the picture
  double mm_per_pixel = 1;
  int width = 256, height = 256;

  /// The world point at a pixel (its centre), y downwards.
  [[nodiscard]] Vec3 world(double px, double py) const;
  /// The pixel of a world point projected onto the cut.
  [[nodiscard]] std::array<double, 2> pixel(Vec3 world_mm) const;
};

/// Grey value 0 to 255 at a point of the world.
using GreyAt = std::function<double(Vec3)>;
/// Label at a point; 0 is clear, others are tinted over the grey.
using LabelAt = std::function<int(Vec3)>;

/// `structures` give labels colours of their own.
[[nodiscard]] Picture draw_slice(const SliceView& view, const GreyAt& grey, const LabelAt& label = nullptr,
                                 const std::vector<Structure>& structures = {});

/// Grey for bone work: -200 HU black to 1500 HU white.
[[nodiscard]] double grey_of_hu(double hu);

void paste(Picture& onto, const Picture& from, int x, int y);
/// Text with its lower left corner at (x, y from the top). VTK's own font.
void write_text(Picture& onto, std::string_view text, int x, int y, int size, std::array<int, 3> rgb = {235, 235, 235});
/// The letters at the edges of a slice: L R A P H F.
void write_directions(Picture& onto, const SliceView& view, int x, int y);

}  // namespace osteo
