// What lies on the inner side of the skull: brain, the plate under the middle fossa, the dura's layer.
#include <algorithm>
#include <cmath>

#include "ear_parts.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::segment {
namespace {

constexpr double kBrainBallMm = 7;  // wider than the sinus, the canals of nerves and the muscles between bone
constexpr double kAboveDrumMm = 8, kMinBrainMm3 = 300;
constexpr double kSureBrainMm3 = 2500;  // with less most of the skull's inner side lies out of the ball's reach
constexpr double kDuraMm = 2;           // labelled on the brain's side
constexpr double kPlateMm = 4;          // of the tegmen, where no air ends it before

constexpr const char* kLittleBrain = "only a part of it: little of the brain's side lies within the image";

/// Closing of a mask in the plane by a disc.
Mask closed2(const Mask& m, int nx, int ny, double radius) {
  const auto grow = [&](const Mask& from, std::uint8_t value) {
    Mask to = from;
    const int r = static_cast<int>(radius);
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        if (from[static_cast<std::size_t>(y * nx + x)] != value) continue;
        for (int dy = -r; dy <= r; ++dy)
          for (int dx = -r; dx <= r; ++dx) {
            if (dx * dx + dy * dy > radius * radius || x + dx < 0 || y + dy < 0 || x + dx >= nx || y + dy >= ny)
              continue;
            to[static_cast<std::size_t>((y + dy) * nx + x + dx)] = value;
          }
      }
    return to;
  };
  return grow(grow(m, 1), 0);
}

/// Which of the conditions fails: the image ends too low, nothing soft is there, or it is too small a part of a head.
std::string why_no_brain(const Field& f, const Mask& soft, const Canal& canal) {
  const double from = canal.drum_mm.z + kAboveDrumMm, to = f.world(0, 0, f.n[2] - 1).z;
  const auto mm = [](double x) { return std::to_string(std::max(0, static_cast<int>(std::lround(x)))); };
  if (to < from + kBrainBallMm)
    return "the image ends " + mm(to - canal.drum_mm.z) + " mm above the ear canal's inner end, " +
           mm(kAboveDrumMm + kBrainBallMm) + " mm are needed to tell the brain's side";
  double volume = 0;
  for (std::size_t i = 0; i < f.size(); ++i)
    if (soft[i] != 0 && f.world(0, 0, f.place(i)[2]).z > from) volume += f.h_mm * f.h_mm * f.h_mm;
  if (volume < kMinBrainMm3) return "no soft tissue above the ear: a dry skull, or cropped away";
  return "above the ear no soft tissue as wide as " + mm(2 * kBrainBallMm) +
         " mm with bone outward of it lies within the image: too small a field, or the skull's outer side is cut off";
}

}  // namespace

Brain find_brain(const Field& f, const Levels& levels, const Canal& canal, const Context& context) {
  Brain b;
  const std::size_t n = f.size();
  Mask soft(n), other(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto v = static_cast<double>(f.v[i]);
    soft[i] = v > levels.air_below && v < levels.bone_above ? 1 : 0;
    other[i] = 1 - soft[i];
  }
  const std::vector<float> to_other = distance_mm(f, other, context);
  Mask core(n);
  for (std::size_t i = 0; i < n; ++i) core[i] = static_cast<double>(to_other[i]) > kBrainBallMm ? 1 : 0;
  const Pieces pieces = pieces_of(f, core, true);
  // Inside the skull is what lies above the ear canal and has bone outward of it. Where the image ends before that
  // bone, it has none inward of it either: muscle and skin over the skull have.
  std::vector<double> high(pieces.size.size()), covered(pieces.size.size()), cut(pieces.size.size()),
      over_bone(pieces.size.size());
  std::vector<int> inward(static_cast<std::size_t>(f.n[0]));
  for (int k = 0; k < f.n[2]; ++k) {
    for (int j = 0; j < f.n[1]; ++j) {
      for (int i = 0, bones = 0; i < f.n[0]; ++i) {
        inward[static_cast<std::size_t>(i)] = bones;
        bones += static_cast<double>(f.v[f.at(i, j, k)]) > levels.bone_above ? 1 : 0;
      }
      int bones = 0;
      bool cut_row = true;
      for (int i = f.n[0] - 1; i >= 0; --i) {
        const std::size_t at = f.at(i, j, k);
        bones += static_cast<double>(f.v[at]) > levels.bone_above ? 1 : 0;
        cut_row = cut_row && soft[at] != 0;
        if (pieces.of[at] == 0 || f.world(i, j, k).z < canal.drum_mm.z + kAboveDrumMm) continue;
        high[pieces.of[at]] += 1;
        covered[pieces.of[at]] += bones * f.h_mm > 1 ? 1 : 0;
        cut[pieces.of[at]] += cut_row ? 1 : 0;
        over_bone[pieces.of[at]] += inward[static_cast<std::size_t>(i)] * f.h_mm > 1 ? 1 : 0;
      }
    }
  }
  const double voxel = f.h_mm * f.h_mm * f.h_mm;
  std::vector<std::uint8_t> inside(pieces.size.size());
  double volume = 0;
  for (std::size_t p = 1; p < inside.size(); ++p) {
    const bool seen = covered[p] > 0.8 * high[p],
               likely = covered[p] + cut[p] > 0.8 * high[p] && over_bone[p] < 0.3 * high[p];
    inside[p] = high[p] * voxel > kMinBrainMm3 && (seen || likely) ? 1 : 0;
    b.found = b.found || inside[p] != 0;
    if (inside[p] != 0) volume += high[p] * voxel;
  }
  b.share = std::min(1.0, volume / kSureBrainMm3);
  if (!b.found) {
    b.why = why_no_brain(f, soft, canal);
    return b;
  }
  for (std::size_t i = 0; i < n; ++i) core[i] = inside[pieces.of[i]];
  const std::vector<float> to_core = distance_mm(f, core, context);
  b.mask.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    b.mask[i] = soft[i] != 0 && static_cast<double>(to_core[i]) <= kBrainBallMm + 0.5 * f.h_mm ? 1 : 0;
  return b;
}

Part find_tegmen(const Field& f, const Levels& levels, const Canal& canal, const Brain& brain, const Mask& air,
                 const Context&) {
  Part part;
  const int nx = f.n[0], ny = f.n[1], nz = f.n[2];
  const auto columns = static_cast<std::size_t>(nx * ny);
  // Of each column: the plate's faces, in voxels from below.
  struct Plate {
    double top = -1, bottom = -1;
    bool air_below = false, seen = false;
  };
  std::vector<Plate> plates(columns);
  const int z_lo = std::max(1, static_cast<int>((canal.drum_mm.z - 3 - f.origin_mm.z) / f.h_mm));
  const int z_hi = std::min(nz - 1, static_cast<int>((canal.drum_mm.z + 28 - f.origin_mm.z) / f.h_mm));
  Mask over_air(columns);
  const int reach = static_cast<int>(std::ceil(kPlateMm / f.h_mm));
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const auto v = [&](int k) { return static_cast<double>(f.v[f.at(i, j, k)]); };
      // Down through the brain to where it ends.
      int k = z_hi;
      while (k > z_lo && brain.mask[f.at(i, j, k)] == 0) --k;
      while (k > z_lo && (brain.mask[f.at(i, j, k)] != 0 || (v(k) < levels.bone_above && v(k) > levels.air_below))) --k;
      if (k <= z_lo + 1) continue;
      // k is the first that is no soft tissue: bone, or air where the plate is too thin to be seen.
      Plate& p = plates[static_cast<std::size_t>(j * nx + i)];
      const auto crossing = [&](int above, double level) {  // between above - 1 and above
        const double a = v(above - 1), b = v(above);
        return above - 1 + (a != b ? std::clamp((level - a) / (b - a), 0.0, 1.0) : 0.5);
      };
      p.seen = v(k) >= levels.bone_above;
      p.top = p.seen ? crossing(k + 1, levels.bone_above) : crossing(k + 1, levels.air_below);
      int q = k;
      while (q > 0 && k - q <= reach && v(q) > levels.cell_below) --q;
      p.bottom = p.seen && v(q) <= levels.cell_below ? crossing(q + 1, levels.cell_below) : p.top;
      p.air_below = v(q) <= levels.cell_below &&
                    (air[f.at(i, j, q)] != 0 || air[f.at(i, j, std::max(0, q - 1))] != 0) &&
                    (p.top - p.bottom) * f.h_mm <= kPlateMm;
      over_air[static_cast<std::size_t>(j * nx + i)] = p.air_below ? 1 : 0;
    }
  }
  // Where there is air below, and what that encloses; the piece nearest to the ear.
  const Mask shape = closed2(over_air, nx, ny, 2.0 / f.h_mm);
  Field plane;
  plane.n = {nx, ny, 1};
  plane.h_mm = f.h_mm;
  const Pieces pieces = pieces_of(plane, shape, true);
  std::size_t best = 0, most = 0;
  for (std::size_t p = 1; p < pieces.size.size(); ++p)
    if (pieces.size[p] > most) most = pieces.size[p], best = p;
  const double area = static_cast<double>(most) * f.h_mm * f.h_mm;
  if (area < 60) {
    part.why = "no plate of bone between brain and the ear's air: cropped away, or no cells below it";
    return part;
  }
  part.mask.assign(f.size(), 0);
  double seen = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    if (pieces.of[c] != best) continue;
    const Plate& p = plates[c];
    if (p.top < 0) continue;
    seen += p.seen ? 1 : 0;
    const double bottom = p.air_below ? p.bottom : std::max(p.bottom, p.top - kPlateMm / f.h_mm);
    const double low = !p.air_below && p.bottom >= p.top ? p.top - kPlateMm / f.h_mm : bottom;
    const int i = static_cast<int>(c) % nx, j = static_cast<int>(c) / nx;
    for (int k = std::max(0, static_cast<int>(std::ceil(low)));
         k <= std::min(nz - 1, static_cast<int>(std::floor(p.top))); ++k)
      part.mask[f.at(i, j, k)] = 1;
  }
  part.quality = brain.share * seen / static_cast<double>(most);
  part.found = true;
  if (brain.share < 1)
    part.why = kLittleBrain;
  else if (part.quality < 0.9)
    part.why = "thinner than can be seen in " +
               std::to_string(static_cast<int>(std::lround(100 * (1 - part.quality)))) + " % of it";
  return part;
}

Part find_dura(const Field& f, const Levels& levels, const Canal& canal, const Brain& brain, const Mask& sinus,
               const Context& context) {
  Part part;
  const std::size_t n = f.size();
  // Brain and what a smaller ball reaches from there: corners, not the canals of nerves and vessels.
  constexpr double kBallMm = 3.2;
  Mask soft(n), other(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto v = static_cast<double>(f.v[i]);
    soft[i] = v > levels.air_below && v < levels.bone_above ? 1 : 0;
    other[i] = 1 - soft[i];
  }
  const std::vector<float> to_other = distance_mm(f, other, context), to_brain = distance_mm(f, brain.mask, context);
  Mask core(n);
  for (std::size_t i = 0; i < n; ++i) {
    core[i] = brain.mask[i] != 0 || (static_cast<double>(to_other[i]) > kBallMm &&
                                     static_cast<double>(to_brain[i]) < 3 && sinus[i] == 0)
                  ? 1
                  : 0;
  }
  const std::vector<float> to_core = distance_mm(f, core, context);
  Mask inner(n), bone(n);
  for (std::size_t i = 0; i < n; ++i) {
    inner[i] = brain.mask[i] != 0 || (soft[i] != 0 && sinus[i] == 0 && static_cast<double>(to_core[i]) < kBallMm &&
                                      static_cast<double>(to_brain[i]) < 4)
                   ? 1
                   : 0;
    bone[i] = static_cast<double>(f.v[i]) >= levels.bone_above ? 1 : 0;
  }
  // What is only near, as the blurred edge of a cell across a thin plate, is no part of it.
  const Pieces pieces = pieces_of(f, inner, false);
  std::vector<std::uint8_t> joined(pieces.size.size());
  for (std::size_t i = 0; i < n; ++i)
    if (brain.mask[i] != 0) joined[pieces.of[i]] = 1;
  for (std::size_t i = 0; i < n; ++i) inner[i] = inner[i] != 0 && joined[pieces.of[i]] != 0 ? 1 : 0;
  const std::vector<float> to_bone = distance_mm(f, bone, context);
  const Vec3 lo = canal.drum_mm + Vec3{-22, -25, -30}, hi = canal.drum_mm + Vec3{32, 45, 25};
  part.mask.assign(n, 0);
  double area = 0, sharp = 0;
  const double voxel = f.h_mm * f.h_mm * f.h_mm;
  double volume = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (inner[i] == 0) continue;
    const auto p = f.place(i);
    const Vec3 x = f.world(p[0], p[1], p[2]);
    if (x.x < lo.x || x.y < lo.y || x.z < lo.z || x.x > hi.x || x.y > hi.y || x.z > hi.z) continue;
    const auto d = static_cast<double>(to_bone[i]);
    // Bone's edge lies half a voxel before the centre of its first voxel.
    if (d > kDuraMm + 0.5 * f.h_mm) continue;
    part.mask[i] = 1;
    volume += voxel;
    if (d > 1.1 * f.h_mm) continue;
    // Does bone really begin here: within 1.5 mm it must come near to its full value.
    area += 1;
    float most = 0;
    const int r = static_cast<int>(std::ceil(1.5 / f.h_mm));
    for (int q = -r; q <= r; ++q) {
      if (f.inside(p[0] + q, p[1], p[2])) most = std::max(most, f.v[f.at(p[0] + q, p[1], p[2])]);
      if (f.inside(p[0], p[1] + q, p[2])) most = std::max(most, f.v[f.at(p[0], p[1] + q, p[2])]);
      if (f.inside(p[0], p[1], p[2] + q)) most = std::max(most, f.v[f.at(p[0], p[1], p[2] + q)]);
    }
    sharp += static_cast<double>(most) > 0.5 * (levels.bone_above + levels.bone_hu) ? 1 : 0;
  }
  if (volume < 500) {
    part.why = "less than 0.5 mL of it lies in the image";
    return part;
  }
  part.quality = area > 0 ? brain.share * sharp / area : 0;
  part.found = true;
  if (brain.share < 1) part.why = kLittleBrain;
  return part;
}

}  // namespace osteo::inline imaging::segment
