// Flat cuts through a volume as pictures, and drawing on pictures.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "osteo/core/data/data.h"

namespace osteo::inline display {

/// The three cuts as a radiologist expects them. axial: seen from the feet, the patient's left on the right of the
/// picture. coronal: seen from the front, left on the right. sagittal: front to the left.
enum class Plane : int { axial, coronal, sagittal };

/// Directions of a picture, unit and at right angles. What is farther from who looks lies along cross(right, down).
struct SliceAxes {
  Vec3 right, down;
};
[[nodiscard]] SliceAxes axes_of(Plane plane);

struct SliceView {
  Plane plane = Plane::axial;
  Vec3 through_mm;  ///< the point that the cut passes through
  Vec3 centre_mm;   ///< what lies at the centre of the picture
  double mm_per_pixel = 1;
  int width = 256, height = 256;
  std::optional<SliceAxes> oblique = {};  ///< in place of the plane's

  [[nodiscard]] SliceAxes axes() const { return oblique ? *oblique : axes_of(plane); }
  /// Unit, away from who looks.
  [[nodiscard]] Vec3 normal() const;
  /// The world point at a pixel (its centre), y downwards.
  [[nodiscard]] Vec3 world(double px, double py) const;
  /// The pixel of a world point projected onto the cut.
  [[nodiscard]] std::array<double, 2> pixel(Vec3 world_mm) const;

  /// What lies at a pixel stays there; millimetres a pixel are divided by `factor` and kept between 0.005 and 5.
  void zoom_about(double px, double py, double factor);
  /// What lies at a pixel goes with it.
  void drag(double dx, double dy);
  /// The same millimetres fill the smaller side. Sizes below 1 count as 1.
  void resize(int new_width, int new_height);
};

/// The sides of the body that a cut's left, right, top and bottom edge lie on: "R", of an oblique cut up to three
/// letters, the nearest direction first ("AR"). R L A P H F.
[[nodiscard]] std::array<std::string, 4> edge_letters(const SliceView& view);
/// "L 12.3  P 4.0  H 31.5": the sides that LPS coordinates lie on.
[[nodiscard]] std::string place_text(Vec3 lps_mm);

/// Which CT values are shown between black and white.
struct HuWindow {
  double width = 1000, level = 400;
  /// 0 to 255.
  [[nodiscard]] double grey(double hu) const;
  /// Of a mouse that is dragged: to the right wider, upwards brighter things come into view (a higher level). 4 HU a
  /// pixel; width 1 to 10000, level -2000 to 8000.
  void drag(double dx, double dy);
  friend bool operator==(const HuWindow&, const HuWindow&) = default;
};

struct GreyPreset {
  const char* name;
  HuWindow hu;
};
/// Bone, soft tissue, temporal bone.
[[nodiscard]] std::span<const GreyPreset> grey_presets();

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

}  // namespace osteo::inline display
