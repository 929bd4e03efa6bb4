// What edits are tried on: a noisy shell of bone with cells and crumbs, and random actions on it.
#pragma once
#include <cmath>
#include <random>

#include "osteo/imaging/edit/document.h"

namespace osteo::test {

inline Frame oblique_frame(std::array<int, 3> dims) {
  // Turned about two axes, and left-handed.
  const double c = std::cos(0.3), s = std::sin(0.3), d = std::cos(0.2), e = std::sin(0.2);
  return {dims, {0.5, 0.6, 0.9}, {12, -7, 30}, {{Vec3{c, s, 0}, Vec3{-s * d, c * d, e}, Vec3{-s * e, c * e, -d}}}};
}

inline Image flat(const Frame& frame, std::int16_t value) {
  const auto v = make_voxels<std::int16_t>(frame.voxel_count());
  std::fill_n(v.get(), frame.voxel_count(), value);
  return {frame, v};
}

/// A thick shell at about 1000 HU in tissue at 50, noise 120 HU.
inline Image walnut(std::array<int, 3> dims, unsigned seed = 1) {
  Image ct = flat({dims, {0.6, 0.6, 0.6}, {-4, 2, 9}, {}}, 0);
  const auto v = make_voxels<std::int16_t>(ct.frame.voxel_count());
  std::uint32_t state = seed;
  std::size_t at = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++at) {
        const double x = (i - dims[0] / 2.0) / (dims[0] / 2.0), y = (j - dims[1] / 2.0) / (dims[1] / 2.0),
                     z = (k - dims[2] / 2.0) / (dims[2] / 2.0);
        const double r = std::sqrt(x * x + y * y + z * z);
        state = state * 1664525U + 1013904223U;
        const int noise = static_cast<int>(state >> 24) - 128;
        v[static_cast<std::ptrdiff_t>(at)] = static_cast<std::int16_t>((r > 0.5 && r < 0.85 ? 900 : 150) + 3 * noise);
      }
    }
  }
  ct.voxels = v;
  return ct;
}

inline Labels start_of(const Image& ct, double lower_hu) {
  const BitMask mask(ct, lower_hu, 32767);
  const auto v = make_voxels<std::uint8_t>(ct.frame.voxel_count());
  mask.to_bytes(v.get());
  Labels out;
  out.frame = ct.frame;
  out.voxels = v;
  return out;
}

/// One thing that a person might do; with `history` also undo and redo. What is rejected is no error here.
inline void random_action(EditDocument& d, std::mt19937& random, bool history = true) {
  const Frame& f = d.ct().frame;
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto point = [&] {
    return f.world_from_index(
        {below(f.dims[0] * 10) / 10.0, below(f.dims[1] * 10) / 10.0, below(f.dims[2] * 10) / 10.0});
  };
  const auto any_structure = [&] {
    return d.structures().empty()
               ? 0
               : static_cast<int>(
                     d.structures()[static_cast<std::size_t>(below(static_cast<int>(d.structures().size())))].is.value);
  };
  const int what = below(100);
  if (history && what < 15) {
    for (int n = 1 + below(5); n > 0; --n) static_cast<void>(what < 9 ? d.undo() : d.redo());
  } else if (what < 62) {
    BrushEdit brush{below(2) == 0 ? 0 : any_structure(), below(3) == 0, 0.3 + below(25) / 10.0, {}};
    for (int n = 1 + below(4); n > 0; --n) brush.points_mm.push_back(point());
    d.apply(brush);
  } else if (what < 66) {
    d.apply(ThresholdEdit{100.0 + 10 * below(60), below(2) == 0 ? 32767.0 : 900.0 + below(300)});
  } else if (what < 70) {
    const Vec3 p = point();
    d.apply(IslandEdit{{p.x, p.y, p.z}, below(2) == 0 ? IslandChoice::remove : IslandChoice::keep});
  } else if (what < 74) {
    d.apply(IslandSizeEdit{static_cast<double>(below(20)), below(2) == 0 ? 0 : 1 + below(4)});
  } else if (what < 80) {
    const Vec3 a = point(), b = point();
    d.apply(BoxEdit{{std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)},
                    {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)},
                    below(4) == 0 ? BoxChoice::keep_inside : BoxChoice::clear_inside});
  } else if (what < 84) {
    d.apply(FillEdit{static_cast<double>(below(60))});
  } else if (what < 87) {
    d.apply(SmoothEdit{0.6 + 0.6 * below(2)});
  } else if (what < 92) {
    if (const int value = d.free_value(); value > 0 && value < 9)
      d.apply(AddStructureEdit{value,
                               "structure " + std::to_string(value) + "." + std::to_string(random() % 1000000U),
                               {below(256), below(256), below(256)},
                               below(2) == 0 ? StructureRole::at_risk : StructureRole::landmark});
  } else if (what < 94) {
    if (const int value = any_structure(); value > 0)
      d.apply(ChangeStructureEdit{
          value, "renamed " + std::to_string(random()), {below(256), 2, 3}, StructureRole::at_risk});
  } else if (what < 96) {
    if (const int value = any_structure(); value > 0) d.apply(DeleteStructureEdit{value});
  } else if (const int value = any_structure(); value > 0) {
    d.apply(VoxelsEdit{value, std::to_string(below(5000)) + " " + std::to_string(1 + below(300)) + " 7 3"});
  }
}

}  // namespace osteo::test
