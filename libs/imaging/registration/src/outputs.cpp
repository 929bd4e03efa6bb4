// What is made of a transform: the moved scan, its labels, a picture, a file.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/registration/register.h"

namespace osteo::inline imaging {
namespace {

// Index coordinates of the second scan along a row of the first's voxels: where it begins, and the step.
struct Row {
  Vec3 begin, step;
};

template <class T, class At>
std::shared_ptr<T[]> sampled(const Frame& first, const Frame& second, const RigidTransform& t, const Context& context,
                             At&& at) {
  auto out = make_voxels<T>(first.voxel_count());
  const auto nx = static_cast<std::size_t>(first.dims[0]), ny = static_cast<std::size_t>(first.dims[1]);
  parallel_for(ny * static_cast<std::size_t>(first.dims[2]), ny, context.threads,
               [&](std::size_t begin, std::size_t end) {
                 context.check_cancelled();
                 for (std::size_t r = begin; r < end; ++r) {
                   const auto where = [&](double i) {
                     return second.index_from_world(
                         t(first.world_from_index({i, static_cast<double>(r % ny), static_cast<double>(r / ny)})));
                   };
                   const Row row{where(0), where(1) - where(0)};
                   for (std::size_t i = 0; i < nx; ++i)
                     out[r * nx + i] = at(row.begin + row.step * static_cast<double>(i));
                 }
               });
  return out;
}

bool inside(const Frame& f, Vec3 x) {
  for (std::size_t a = 0; a < 3; ++a)
    if (!(x[a] >= -0.5 && x[a] <= f.dims[a] - 0.5)) return false;
  return true;
}

// Greys between what one in 50 and one in 200 voxels lie beyond.
struct Window {
  double lo = 0, hi = 1;
  [[nodiscard]] std::uint8_t grey(double v) const {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp((v - lo) / (hi - lo), 0.0, 1.0)));
  }
};
Window window_of(const Image& image) {
  std::vector<std::int16_t> some;
  const auto v = image.span();
  for (std::size_t i = 0; i < v.size(); i += std::max<std::size_t>(1, v.size() / 200000)) some.push_back(v[i]);
  std::sort(some.begin(), some.end());
  Window w{static_cast<double>(some[some.size() / 50]), static_cast<double>(some[some.size() - 1 - some.size() / 200])};
  w.hi = std::max(w.hi, w.lo + 1);
  return w;
}

}  // namespace

Image moved_onto(const Frame& first, const Image& second, const RigidTransform& second_from_first,
                 const Context& context) {
  const auto voxels = second.span();
  const std::int16_t nothing = voxels.empty() ? std::int16_t{0} : *std::min_element(voxels.begin(), voxels.end());
  return {first, sampled<std::int16_t>(first, second.frame, second_from_first, context, [&](Vec3 x) {
            return inside(second.frame, x) ? static_cast<std::int16_t>(std::floor(sample_linear(second, x) + 0.5))
                                           : nothing;
          })};
}

Labels moved_onto(const Frame& first, const Labels& second, const RigidTransform& second_from_first,
                  const Context& context) {
  Labels out;
  out.frame = first;
  out.structures = second.structures;
  out.voxels = sampled<std::uint8_t>(first, second.frame, second_from_first, context, [&](Vec3 x) {
    if (!inside(second.frame, x)) return std::uint8_t{0};
    const auto nearest = [&](std::size_t a) {
      return std::clamp(static_cast<int>(std::floor(x[a] + 0.5)), 0, second.frame.dims[a] - 1);
    };
    return second.at(nearest(0), nearest(1), nearest(2));
  });
  return out;
}

Picture checkerboard(const Image& first, const Image& second, const RigidTransform& second_from_first) {
  constexpr int kPanel = 400, kSquare = 50, kGap = 6;
  const Frame& f = first.frame;
  const Vec3 centre = f.centre_mm();
  // The body's box along the patient's axes.
  Vec3 half;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t c = 0; c < 3; ++c)
      half[a] += 0.5 * std::abs(f.direction.column[c][a]) * f.dims[c] * f.spacing_mm[c];
  const double mm_per_pixel = 2 * std::max({half.x, half.y, half.z}) / kPanel;
  const Window wa = window_of(first), wb = window_of(second);
  Picture picture;
  picture.width = 3 * kPanel + 2 * kGap;
  picture.height = kPanel;
  picture.rgb.assign(static_cast<std::size_t>(3 * picture.width * picture.height), 0);
  // Axial from the feet, coronal from the front, sagittal from the left: right, down.
  const Vec3 right[3] = {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}}, down[3] = {{0, 1, 0}, {0, 0, -1}, {0, 0, -1}};
  for (int panel = 0; panel < 3; ++panel)
    for (int j = 0; j < kPanel; ++j)
      for (int i = 0; i < kPanel; ++i) {
        const Vec3 p = centre + right[panel] * ((i - 0.5 * (kPanel - 1)) * mm_per_pixel) +
                       down[panel] * ((j - 0.5 * (kPanel - 1)) * mm_per_pixel);
        const bool of_second = (i / kSquare + j / kSquare) % 2 != 0;
        const Image& image = of_second ? second : first;
        const Vec3 x = image.frame.index_from_world(of_second ? second_from_first(p) : p);
        if (!inside(image.frame, x)) continue;
        const std::uint8_t g = (of_second ? wb : wa).grey(sample_linear(image, x));
        auto* const out =
            picture.rgb.data() + 3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(picture.width) +
                                      static_cast<std::size_t>(panel * (kPanel + kGap) + i));
        // A breath of colour tells whose square it is.
        out[0] = static_cast<std::uint8_t>(of_second ? g * 9 / 10 : g);
        out[1] = static_cast<std::uint8_t>(g * 19 / 20);
        out[2] = static_cast<std::uint8_t>(of_second ? g : g * 9 / 10);
      }
  return picture;
}

std::string itk_transform_text(const RigidTransform& t) {
  std::string text = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters:";
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) text += " " + format_number(t.rotation.column[c][r]);
  for (std::size_t a = 0; a < 3; ++a) text += " " + format_number(t.shift_mm[a]);
  return text + "\nFixedParameters: 0 0 0\n";
}

}  // namespace osteo::inline imaging
