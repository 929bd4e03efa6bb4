// The external canal and the air behind the drum.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "ear_parts.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::segment {
namespace {

constexpr double kMinBony = 0.5;
constexpr double kOutsideBallMm = 8;                     // wider than the canal, narrower than what is outside
constexpr double kCanalEnclosed = 0.75, kMouthMm = 2.5;  // where less of the round is wall, its mouth begins
constexpr double kCavityMm3 =
    60;  // the tympanic cavity below its ossicles has more; behind wax or a bend there is less

constexpr double kMaxToBehindMm = 4;  // from the canal's end to air behind the drum; through a drum it is half a mm
constexpr double kCutOff = 0.3;       // of the outer face; skin at the rim of a field that holds the mouth is less

// Across a canal, 7 x 9 mm in most adults, as the image may cut it: more is folds of skin, or cells that open into each
// other.
constexpr double kSectionInscribedMm = 1.8, kSectionMm2 = 160;
constexpr std::size_t kSections = 3;
// From the section to the drum a canal is no longer than from its mouth. Behind the drum lies the tympanic cavity, 0.5
// mL; behind a pass between cells there is less.
constexpr double kMaxCutMm = 30, kMinBehindMm3 = 300;

constexpr double kMaxBesideMm3 = 250;  // of air beside the tube that no pass parts from it: folds of a canal have less
// Twice the most that nine in ten adults have in front of the drum (0.63 to 1.46 mL: R. Margolis, J. Heller, Screening
// tympanometry, Audiology 1987).
constexpr double kMaxCanalMm3 = 3000;

/// Of air that runs inward, what is a tube: shells of equal way from its inner end have about the same area. Where they
/// widen it opens into a fold of the skin; from there on only what lies straight on is kept.
void keep_tube(const Field& f, Mask& mask, const std::vector<float>& to_outside) {
  const std::size_t n = f.size();
  float deepest = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (mask[i] != 0) deepest = std::max(deepest, to_outside[i]);
  constexpr float kFar = std::numeric_limits<float>::max();
  std::vector<float> way(n, kFar);
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::size_t i = 0; i < n; ++i) {
    if (mask[i] == 0 || to_outside[i] < deepest - 1.5F) continue;
    way[i] = 0;
    queue.emplace(0.0F, i);
  }
  while (!queue.empty()) {
    const auto [w, at] = queue.top();
    queue.pop();
    if (w > way[at]) continue;
    const auto p = f.place(at);
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          if (!f.inside(p[0] + i, p[1] + j, p[2] + k)) continue;
          const std::size_t to = f.at(p[0] + i, p[1] + j, p[2] + k);
          const auto step = static_cast<float>(f.h_mm * std::sqrt(static_cast<double>(i * i + j * j + k * k)));
          if (mask[to] == 0 || w + step >= way[to]) continue;
          way[to] = w + step;
          queue.emplace(way[to], to);
        }
  }
  struct Shell {
    Vec3 sum;
    double count = 0;
  };
  std::vector<Shell> shells;
  for (std::size_t i = 0; i < n; ++i) {
    if (way[i] == kFar) continue;
    const auto s = static_cast<std::size_t>(way[i]);
    if (shells.size() <= s) shells.resize(s + 1);
    const auto p = f.place(i);
    shells[s].sum += f.world(p[0], p[1], p[2]);
    shells[s].count += 1;
  }
  if (shells.size() < 10) return;
  std::vector<double> areas;
  for (std::size_t s = 3; s < std::min<std::size_t>(13, shells.size()); ++s) areas.push_back(shells[s].count);
  const double usual = upper_median(std::move(areas)),
               radius = std::sqrt(usual * f.h_mm * f.h_mm * f.h_mm / 3.14159265358979);
  std::size_t mouth = shells.size();
  for (std::size_t s = 8; s + 1 < shells.size() && mouth == shells.size(); ++s)
    if (shells[s].count > 1.5 * usual && shells[s + 1].count > 1.5 * usual) mouth = s;
  const auto middle = [&](std::size_t s) { return shells[s].sum / std::max(1.0, shells[s].count); };
  const std::size_t last = mouth - 1;
  const Vec3 tip = middle(last), out = normalized(tip - middle(last > 6 ? last - 6 : 0));
  for (std::size_t i = 0; i < n; ++i) {
    if (mask[i] == 0) continue;
    if (way[i] == kFar) {
      mask[i] = 0;
      continue;
    }
    const auto s = static_cast<std::size_t>(way[i]);
    const auto p = f.place(i);
    const Vec3 x = f.world(p[0], p[1], p[2]);
    if (s < mouth) {
      if (length(x - middle(s)) > 2.5 * radius + 1) mask[i] = 0;
      continue;
    }
    const double on = dot(x - tip, out);
    if (on < -1 || on > 14 || length(x - tip - out * on) > 1.3 * radius + 0.5) mask[i] = 0;
  }
}

/// Air, all else, and the air outside of the head on the side of +x.
struct Airs {
  Mask air, solid, exterior;
  std::vector<float> to_solid;
  bool outside = false;  ///< there is air outside
};

/// Outside: where a ball of air reaches that begins at the outer face of the image.
Airs airs_of(const Field& f, const Levels& levels, const Context& context) {
  const std::size_t n = f.size();
  Airs a{Mask(n), Mask(n), Mask(n), {}, false};
  for (std::size_t i = 0; i < n; ++i) {
    a.air[i] = static_cast<double>(f.v[i]) < levels.air_below ? 1 : 0;
    a.solid[i] = 1 - a.air[i];
  }
  a.to_solid = distance_mm(f, a.solid, context);
  Mask core(n);
  for (std::size_t i = 0; i < n; ++i)
    core[i] = a.air[i] != 0 && static_cast<double>(a.to_solid[i]) > kOutsideBallMm ? 1 : 0;
  const Pieces cores = pieces_of(f, core, true);
  std::vector<std::uint8_t> outer(cores.size.size());
  for (int k = 0; k < f.n[2]; ++k)
    for (int j = 0; j < f.n[1]; ++j) outer[cores.of[f.at(f.n[0] - 1, j, k)]] = 1;
  outer[0] = 0;
  for (std::size_t i = 0; i < n; ++i) core[i] = outer[cores.of[i]];
  a.outside = std::any_of(core.begin(), core.end(), [](std::uint8_t x) { return x != 0; });
  if (!a.outside) return a;
  const std::vector<float> to_core = distance_mm(f, core, context);
  for (std::size_t i = 0; i < n; ++i)
    a.exterior[i] = a.air[i] != 0 && static_cast<double>(to_core[i]) <= kOutsideBallMm + f.h_mm ? 1 : 0;
  return a;
}

/// Narrow air that opens to the outside, and goes deep into bone.
struct Inward {
  Pieces pieces;
  std::size_t best = 0;  ///< 0: none
  std::vector<float> to_outside, to_bone;

  [[nodiscard]] bool holds(std::size_t i) const { return pieces.of[i] == best; }
  [[nodiscard]] double depth(std::size_t i) const { return static_cast<double>(to_outside[i]); }
};

Inward inward_air(const Field& f, const Levels& levels, const Airs& airs, const Context& context) {
  const std::size_t n = f.size();
  Mask narrow(n), bone(n);
  for (std::size_t i = 0; i < n; ++i) {
    narrow[i] = airs.air[i] != 0 && airs.exterior[i] == 0 ? 1 : 0;
    bone[i] = static_cast<double>(f.v[i]) > levels.bone_above ? 1 : 0;
  }
  Inward in;
  in.to_outside = distance_mm(f, airs.exterior, context);
  in.to_bone = distance_mm(f, bone, context);
  in.pieces = pieces_of(f, narrow, false);
  std::vector<double> deep(in.pieces.size.size());
  std::vector<std::uint8_t> opens(in.pieces.size.size());
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t p = in.pieces.of[i];
    if (p == 0) continue;
    if (in.depth(i) < 1.5 * f.h_mm) opens[p] = 1;
    // Counts up to the length of a canal: cells behind a drum that is not seen must not decide.
    if (in.depth(i) > 6 && in.depth(i) < 30 && static_cast<double>(in.to_bone[i]) < 5.5) deep[p] += 1;
  }
  for (std::size_t p = 1; p < deep.size(); ++p)
    if (opens[p] != 0 && deep[p] > deep[in.best]) in.best = p;
  if (deep[in.best] * f.h_mm * f.h_mm * f.h_mm < 60) in.best = 0;
  return in;
}

/// Which of the inward air lies before the drum: what is nearer to air that no pass parts from outside.
struct Drum {
  bool seen = false;
  double behind_mm3 = 0;  ///< volume of the air behind it
  std::vector<float> to_before, to_behind;
};

/// Behind the drum is what can only be reached over a pass. The noise must not make one.
Drum drum_of(const Field& f, const Levels& levels, const Inward& in, const Context& context) {
  const std::size_t n = f.size();
  std::vector<float> height = smoothed(f.v, f.n, std::max(0.5, 0.5 / f.h_mm), context.threads);
  std::vector<std::size_t> seeds;
  for (std::size_t i = 0; i < n; ++i) {
    height[i] = std::max(height[i], -1000.0F);
    if (in.holds(i) && in.depth(i) < 1.5 * f.h_mm) seeds.push_back(i);
  }
  const std::vector<float> up = climbed(f, height, seeds, [&](std::size_t i) { return in.holds(i); });
  const Pass pass = lowest_pass(f, height, up, std::max(25.0, 1.0 * levels.noise_hu), kCavityMm3);
  Drum drum;
  drum.seen = pass.volume_mm3 > 0;
  // Voxels at the walls are as high as a pass: they go with the nearest that are not.
  Mask before(n), behind(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!in.holds(i)) continue;
    before[i] = !drum.seen || static_cast<double>(up[i]) < pass.height ? 1 : 0;
    behind[i] =
        drum.seen && static_cast<double>(up[i]) >= pass.height && static_cast<double>(height[i]) < pass.height ? 1 : 0;
  }
  for (const std::uint8_t b : behind) drum.behind_mm3 += b * f.h_mm * f.h_mm * f.h_mm;
  drum.to_before = distance_mm(f, before, context);
  drum.to_behind = distance_mm(f, behind, context);
  return drum;
}

/// The air before the drum that is enclosed as a canal is; the folds of the auricle are open to more sides.
Mask enclosed_air(const Field& f, const Airs& airs, const Inward& in, const Drum& drum, const Context& context) {
  const std::size_t n = f.size();
  Mask inner(n);
  parallel_for(n, 1 << 12, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!in.holds(i) || static_cast<double>(drum.to_before[i]) > static_cast<double>(drum.to_behind[i])) continue;
      const auto p = f.place(i);
      inner[i] = in.depth(i) > 25 || enclosure(f, f.world(p[0], p[1], p[2]), 14,
                                               [&](std::size_t q) { return airs.air[q] != 0 ? 0 : 1; }) > kCanalEnclosed
                     ? 1
                     : 0;
    }
  });
  const Pieces inners = pieces_of(f, inner, true);
  std::vector<double> depth(inners.size.size());
  for (std::size_t i = 0; i < n; ++i)
    if (inners.of[i] != 0 && in.depth(i) > 6) depth[inners.of[i]] += 1;
  const std::size_t main = static_cast<std::size_t>(std::max_element(depth.begin(), depth.end()) - depth.begin());
  for (std::size_t i = 0; i < n; ++i) inner[i] = main > 0 && inners.of[i] == main ? 1 : 0;
  const std::vector<float> to_inner = distance_mm(f, inner, context);
  Mask mask(n);
  for (std::size_t i = 0; i < n; ++i) {
    mask[i] =
        in.holds(i) && drum.to_before[i] <= drum.to_behind[i] && static_cast<double>(to_inner[i]) < kMouthMm ? 1 : 0;
  }
  return mask;
}

/// Against bone the edge lies half way from air to bone, which is higher than half way to skin.
void widen_at_bone(Canal& c, const Field& f, const Levels& levels, const Inward& in, const Drum& drum,
                   const Context& context) {
  const std::vector<float> to_mask = distance_mm(f, c.mask, context);
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (c.mask[i] != 0 || c.exterior[i] != 0 || drum.to_behind[i] < drum.to_before[i]) continue;
    c.mask[i] = static_cast<double>(to_mask[i]) < 1.1 * f.h_mm && static_cast<double>(in.to_bone[i]) < 1.6 * f.h_mm &&
                        static_cast<double>(f.v[i]) < levels.cell_below
                    ? 1
                    : 0;
  }
}

/// Its inner end, the voxels deepest from the outside, and the share of the deeper half's wall that has bone behind it.
/// Returns its volume in mm3.
double measure_canal(Canal& c, const Field& f, const Airs& airs, const Inward& in) {
  const std::size_t n = f.size();
  for (std::size_t i = 0; i < n; ++i)
    if (c.mask[i] != 0) c.length_mm = std::max(c.length_mm, in.depth(i));
  if (c.length_mm <= 0) return 0;
  Vec3 sum;
  double count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (c.mask[i] == 0 || in.depth(i) < c.length_mm - 1) continue;
    const auto p = f.place(i);
    sum += f.world(p[0], p[1], p[2]);
    count += 1;
  }
  c.drum_mm = sum / count;
  double wall = 0, backed = 0, volume = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (c.mask[i] == 0) continue;
    volume += f.h_mm * f.h_mm * f.h_mm;
    if (in.depth(i) < 0.5 * c.length_mm || in.depth(i) > c.length_mm - 2.5) continue;
    if (static_cast<double>(airs.to_solid[i]) > 1.5 * f.h_mm) continue;
    wall += 1;
    backed += static_cast<double>(in.to_bone[i]) < 1.5 + f.h_mm ? 1 : 0;
  }
  c.quality = wall > 0 ? backed / wall : 0;
  return volume;
}

/// From the inner end of the canal to the nearest air behind the drum.
double behind_mm(const Canal& c, const Field& f, const Inward& in, const Drum& drum) {
  double nearest = 1e9;
  for (std::size_t i = 0; i < f.size(); ++i)
    if (c.mask[i] != 0 && in.depth(i) > c.length_mm - 1)
      nearest = std::min(nearest, static_cast<double>(drum.to_behind[i]));
  return nearest;
}

/// Wider outward by what lies at the outer face. A field that ends just beyond the skin has air in which no ball fits,
/// which would be taken for more of the canal.
Field widened(const Field& f, double by_mm) {
  Field wide = f;
  const int more = static_cast<int>(std::ceil(by_mm / f.h_mm));
  wide.n[0] += more;
  wide.v.resize(wide.size());
  for (int k = 0; k < f.n[2]; ++k)
    for (int j = 0; j < f.n[1]; ++j)
      for (int i = 0; i < wide.n[0]; ++i) wide.v[wide.at(i, j, k)] = f.v[f.at(std::min(i, f.n[0] - 1), j, k)];
  return wide;
}

void narrow_again(Mask& mask, const Field& wide, const Field& f) {
  if (mask.empty()) return;
  Mask kept(f.size());
  for (int k = 0; k < f.n[2]; ++k)
    for (int j = 0; j < f.n[1]; ++j)
      for (int i = 0; i < f.n[0]; ++i) kept[f.at(i, j, k)] = mask[wide.at(i, j, k)];
  mask = std::move(kept);
}

Canal canal_in(const Field& f, const Levels& levels, const Airs& airs, const Context& context) {
  Canal c;
  const std::size_t n = f.size();
  c.exterior = airs.exterior;
  if (!airs.outside) {
    c.why = "no air outside of the head within the image on this side";
    return c;
  }
  const Inward in = inward_air(f, levels, airs, context);
  if (in.best == 0) {
    c.why = "no air goes from outside into bone on this side";
    return c;
  }
  const Drum drum = drum_of(f, levels, in, context);
  c.mask = enclosed_air(f, airs, in, drum, context);
  // What no tube is, but reached without a pass: the middle ear and its cells, where no drum is seen.
  const double voxel = f.h_mm * f.h_mm * f.h_mm;
  double reached_mm3 = 0, tube_mm3 = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (in.holds(i) && drum.to_before[i] <= drum.to_behind[i] && in.depth(i) > 6) reached_mm3 += voxel;
  keep_tube(f, c.mask, in.to_outside);
  for (std::size_t i = 0; i < n; ++i)
    if (c.mask[i] != 0 && in.depth(i) > 6) tube_mm3 += voxel;
  widen_at_bone(c, f, levels, in, drum, context);
  const double volume = measure_canal(c, f, airs, in);
  if (c.length_mm <= 0) {
    c.why = "no air goes from outside into bone on this side";
  } else if (reached_mm3 - tube_mm3 > kMaxBesideMm3 && reached_mm3 > 1.3 * tube_mm3) {
    c.why = "no drum is seen between the ear canal and the air behind it, so the two cannot be distinguished";
  } else if (drum.seen && behind_mm(c, f, in, drum) > kMaxToBehindMm) {
    // The pass lies elsewhere, between cells that the image cuts off: what was taken for the canal goes on behind it.
    c.why = "no drum is seen at the inner end of the air that goes inward";
  } else if (c.length_mm < 8 || volume < 150) {
    c.why = "the air that goes inward is too short for a canal";
  } else if (c.length_mm > 50 || volume > kMaxCanalMm3) {
    c.why = "the air that goes inward is no canal: no drum ends it";
  } else if (c.quality < kMinBony) {
    // A fold, the mouth or the nose: what would be placed by it would be wrong.
    c.why = "the air that goes inward has bone behind only " +
            std::to_string(static_cast<int>(std::lround(100 * c.quality))) + " % of its wall";
  } else {
    c.found = true;
    c.behind_mm3 = drum.behind_mm3;
    if (!drum.seen) c.why = "no air behind its end: the middle ear is not seen apart from it";
  }
  return c;
}

/// Air that the outer side of the image cuts across, where a canal could be: as wide as one, with a wall around it.
/// Widest first.
std::vector<std::vector<std::size_t>> sections_of(const Field& f, const Levels& levels, const Airs& airs,
                                                  const Field& wide, const Context& context) {
  Field side;
  side.n = {f.n[1], f.n[2], 1};
  side.h_mm = f.h_mm;
  Mask air(side.size()), solid(side.size());
  const auto in_wide = [&](std::size_t i) {
    const auto p = side.place(i);
    return wide.at(f.n[0] - 1, p[0], p[1]);
  };
  for (std::size_t i = 0; i < side.size(); ++i) {
    const auto v = static_cast<double>(wide.v[in_wide(i)]);
    air[i] = v < levels.air_below && airs.exterior[in_wide(i)] == 0 ? 1 : 0;
    solid[i] = v < levels.air_below ? 0 : 1;
  }
  const std::vector<float> to_solid = distance_mm(side, solid, context);
  const Pieces pieces = pieces_of(side, air, false);
  struct Section {
    double inscribed_mm = 0;
    std::vector<std::size_t> at;
  };
  std::vector<Section> all(pieces.size.size());
  for (std::size_t i = 0; i < side.size(); ++i) {
    if (pieces.of[i] == 0) continue;
    Section& s = all[pieces.of[i]];
    s.inscribed_mm = std::max(s.inscribed_mm, static_cast<double>(to_solid[i]));
    s.at.push_back(i);
  }
  std::erase_if(all, [&](const Section& s) {
    const double area = static_cast<double>(s.at.size()) * f.h_mm * f.h_mm;
    return s.inscribed_mm < kSectionInscribedMm || area > kSectionMm2;
  });
  std::stable_sort(all.begin(), all.end(),
                   [](const Section& x, const Section& y) { return x.inscribed_mm > y.inscribed_mm; });
  if (all.size() > kSections) all.resize(kSections);
  std::vector<std::vector<std::size_t>> sections;
  for (Section& s : all) sections.push_back(std::move(s.at));
  return sections;
}

/// The image as if it ended so much farther in.
Field cut_back(const Field& f, double by_mm) {
  Field part = f;
  part.n[0] = std::max(0, f.n[0] - static_cast<int>(std::lround(by_mm / f.h_mm)));
  part.v.resize(part.size());
  for (int k = 0; k < part.n[2]; ++k)
    for (int j = 0; j < part.n[1]; ++j)
      for (int i = 0; i < part.n[0]; ++i) part.v[part.at(i, j, k)] = f.v[f.at(i, j, k)];
  return part;
}

/// From a canal of the cut back image on to the end of the whole: air straight on, as wide as the section.
void continue_outward(Mask& mask, const Field& f, int end, const Levels& levels, const Mask& exterior) {
  Vec3 tip, inner;
  double tips = 0, inners = 0;
  const int deeper = std::max(1, static_cast<int>(std::lround(6 / f.h_mm)));
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (mask[i] == 0) continue;
    const auto p = f.place(i);
    if (p[0] == end - 1) tip += f.world(p[0], p[1], p[2]), ++tips;
    if (p[0] == end - 1 - deeper) inner += f.world(p[0], p[1], p[2]), ++inners;
  }
  if (tips == 0 || inners == 0) return;
  tip = tip / tips;
  const Vec3 out = normalized(tip - inner / inners);
  const double radius = std::sqrt(tips / std::numbers::pi) * f.h_mm;
  for (int k = 0; k < f.n[2]; ++k)
    for (int j = 0; j < f.n[1]; ++j)
      for (int i = end; i < f.n[0]; ++i) {
        const std::size_t at = f.at(i, j, k);
        const Vec3 x = f.world(i, j, k) - tip;
        if (static_cast<double>(f.v[at]) < levels.air_below && exterior[at] == 0 &&
            length(x - out * dot(x, out)) < 1.3 * radius + 0.5)
          mask[at] = 1;
      }
}

/// The canal of an image that cuts its outer end off: a tube from a section on the outer side to a drum. What ends at
/// no drum may be a cell. Where the outer side lies among the folds of the auricle, the section is taken farther in.
Canal cut_canal(const Field& f, const Levels& levels, const Mask& exterior, const Context& context) {
  Canal best;
  for (const double by_mm : {0.0, 6.0, 12.0}) {
    const Field part = cut_back(f, by_mm);
    if (part.n[0] * f.h_mm < 15) break;
    const Field wide = widened(part, kOutsideBallMm + 2);
    const Airs airs = airs_of(wide, levels, context);
    for (const std::vector<std::size_t>& section : sections_of(part, levels, airs, wide, context)) {
      context.check_cancelled();
      Airs from = airs;
      from.outside = true;
      for (const std::size_t i : section) {
        const int j = static_cast<int>(i) % part.n[1], k = static_cast<int>(i) / part.n[1];
        for (int x = part.n[0]; x < wide.n[0]; ++x) from.exterior[wide.at(x, j, k)] = 1;
      }
      Canal c = canal_in(wide, levels, from, context);
      if (!c.found || c.length_mm > kMaxCutMm || c.behind_mm3 < std::max(kMinBehindMm3, best.behind_mm3)) continue;
      narrow_again(c.mask, wide, part);
      best = std::move(c);
    }
    if (!best.found) continue;
    Mask mask(f.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      const auto p = part.place(i);
      mask[f.at(p[0], p[1], p[2])] = best.mask[i];
    }
    if (by_mm > 0) continue_outward(mask, f, part.n[0], levels, exterior);
    best.mask = std::move(mask);
    best.exterior = exterior;
    best.why = "the image cuts its outer end off";
    return best;
  }
  return best;
}

}  // namespace

Canal find_canal(const Field& f, const Levels& levels, const Context& context) {
  const Field wide = widened(f, kOutsideBallMm + 2);
  Canal c = canal_in(wide, levels, airs_of(wide, levels, context), context);
  narrow_again(c.mask, wide, f);
  narrow_again(c.exterior, wide, f);
  if (c.found) return c;
  // Whatever was seen instead: from the canal's mouth on it cannot be followed where that is not in the image.
  double solid = 0;
  for (int k = 0; k < f.n[2]; ++k)
    for (int j = 0; j < f.n[1]; ++j)
      solid += static_cast<double>(f.v[f.at(f.n[0] - 1, j, k)]) < levels.air_below ? 0 : 1;
  const double share = solid / (static_cast<double>(f.n[1]) * f.n[2]);
  if (share <= kCutOff) return c;
  Canal cut = cut_canal(f, levels, c.exterior, context);
  if (cut.found) return cut;
  c.why = "the image ends inside the head on " + std::to_string(static_cast<int>(std::lround(100 * share))) +
          " % of its outer side, and no canal is seen that is cut there (" + c.why + ")";
  return c;
}

Part find_air_cells(const Field& f, const Levels& levels, const Canal& canal, const Context& context) {
  Part part;
  const std::size_t n = f.size();
  // Surely air, in the ear's box, neither outside nor canal.
  const Vec3 lo = canal.drum_mm + Vec3{-11, -13, -36}, hi = canal.drum_mm + Vec3{40, 45, 22};
  const auto in_box = [&](std::size_t i) {
    const auto p = f.place(i);
    const Vec3 x = f.world(p[0], p[1], p[2]);
    return x.x > lo.x && x.y > lo.y && x.z > lo.z && x.x < hi.x && x.y < hi.y && x.z < hi.z;
  };
  Mask sure(n), bone(n), taken(n);
  for (std::size_t i = 0; i < n; ++i) {
    bone[i] = static_cast<double>(f.v[i]) > levels.bone_above ? 1 : 0;
    taken[i] = canal.mask[i] != 0 || canal.exterior[i] != 0 ? 1 : 0;
  }
  const std::vector<float> to_bone = distance_mm(f, bone, context), to_taken = distance_mm(f, taken, context);
  for (std::size_t i = 0; i < n; ++i) {
    sure[i] = static_cast<double>(f.v[i]) < levels.air_below && taken[i] == 0 && static_cast<double>(to_bone[i]) < 6 &&
                      in_box(i)
                  ? 1
                  : 0;
  }
  // Pieces that bone surrounds: not the folds of the auricle.
  const Pieces pieces = pieces_of(f, sure, true);
  std::vector<double> near(pieces.size.size()), open(pieces.size.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (pieces.of[i] == 0) continue;
    near[pieces.of[i]] += static_cast<double>(to_bone[i]) < 3 ? 1 : 0;
    const auto p = f.place(i);
    for (const int d : {-1, 1}) {
      if (!f.inside(p[0] + d, p[1], p[2])) continue;
      open[pieces.of[i]] += canal.exterior[f.at(p[0] + d, p[1], p[2])];
    }
  }
  const double voxel = f.h_mm * f.h_mm * f.h_mm;
  Mask kept(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t p = pieces.of[i];
    if (p == 0) continue;
    kept[i] = near[p] > 0.7 * static_cast<double>(pieces.size[p]) &&
                      static_cast<double>(pieces.size[p]) * voxel > 0.6 &&
                      open[p] < 0.1 * static_cast<double>(pieces.size[p])
                  ? 1
                  : 0;
  }
  // Their edges towards bone lie half way from air to bone, within a voxel of what is surely air.
  const std::vector<float> to_kept = distance_mm(f, kept, context);
  double volume = 0, more = 0, less = 0;
  part.mask.assign(n, 0);
  constexpr double kShiftHu = 150;
  for (std::size_t i = 0; i < n; ++i) {
    if (taken[i] != 0 || static_cast<double>(to_taken[i]) < 1.1 * f.h_mm ||
        static_cast<double>(to_kept[i]) > 1.1 * f.h_mm || !in_box(i)) {
      part.mask[i] = kept[i];
      volume += kept[i] * voxel;
      more += kept[i] * voxel;
      less += kept[i] * voxel;
      continue;
    }
    const auto v = static_cast<double>(f.v[i]);
    const double level = levels.cell_below;
    part.mask[i] = v < level ? 1 : 0;
    volume += v < level ? voxel : 0;
    more += v < level + kShiftHu ? voxel : 0;
    less += v < level - kShiftHu ? voxel : 0;
  }
  if (volume < 200) {
    part.why = "less than 0.2 mL of air behind the ear canal: a mastoid without cells, or filled";
    return part;
  }
  part.quality = std::clamp(1 - (more - less) / (2 * volume), 0.0, 1.0);
  part.found = true;
  return part;
}

Part find_labyrinth(const Field& f, const Levels& levels, Vec3 point_mm, const Context& context) {
  Part part;
  const std::size_t n = f.size();
  constexpr double kReachMm = 13;
  Mask air(n);
  for (std::size_t i = 0; i < n; ++i) air[i] = static_cast<double>(f.v[i]) < levels.air_below ? 1 : 0;
  const std::vector<float> to_air = distance_mm(f, air, context);
  // The seed: the darkest voxel within a mm of the point.
  const auto c = f.nearest(point_mm);
  std::size_t seed = f.at(c[0], c[1], c[2]);
  const int reach = std::max(1, static_cast<int>(1.0 / f.h_mm));
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        if (!f.inside(c[0] + i, c[1] + j, c[2] + k)) continue;
        const std::size_t at = f.at(c[0] + i, c[1] + j, c[2] + k);
        if (static_cast<double>(to_air[at]) > 1.6 * f.h_mm && f.v[at] < f.v[seed]) seed = at;
      }
  if (static_cast<double>(f.v[seed]) > levels.bone_above) {
    part.why = "the point lies in bone";
    return part;
  }
  if (static_cast<double>(f.v[seed]) < levels.air_below || static_cast<double>(to_air[seed]) <= 1.6 * f.h_mm) {
    part.why = "the point lies in air or beside it";
    return part;
  }
  const auto flood = [&](double level, const std::vector<std::uint8_t>* barred) {
    return climbed(f, f.v, {seed}, [&](std::size_t i) {
      if (static_cast<double>(f.v[i]) > level || static_cast<double>(to_air[i]) <= 1.6 * f.h_mm ||
          (barred != nullptr && (*barred)[i] != 0))
        return false;
      const auto p = f.place(i);
      return length(f.world(p[0], p[1], p[2]) - point_mm) < kReachMm;
    });
  };
  // What lies behind a pass and is wide or large, is no part of it: the internal auditory canal, the fallopian canal,
  // the brain.
  std::vector<std::uint8_t> barred(n, 0);
  std::vector<float> up;
  const double voxel = f.h_mm * f.h_mm * f.h_mm;
  for (int round = 0; round < 6; ++round) {
    up = flood(levels.bone_above, &barred);
    const Pass pass = greatest_pass(f, f.v, up, std::max(60.0, 2 * levels.noise_hu));
    // One of its canals has 20 mm3, the cochlea 60.
    const bool touches = pass.volume_mm3 > 90;
    if (!touches) break;
    for (std::size_t i = 0; i < n; ++i)
      if (static_cast<double>(up[i]) == pass.height) barred[i] = 1;
  }
  part.mask.assign(n, 0);
  double volume = 0, less = 0, rim = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (up[i] == std::numeric_limits<float>::infinity()) continue;
    part.mask[i] = 1;
    volume += voxel;
    less += static_cast<double>(up[i]) < levels.bone_above - 150 ? voxel : 0;
    const auto p = f.place(i);
    rim += length(f.world(p[0], p[1], p[2]) - point_mm) > kReachMm - 1 ? voxel : 0;
  }
  if (volume < 40) {
    part.why = "less than 40 mm3 of fluid around the point: not the labyrinth";
    return part;
  }
  if (volume > 600 || rim > 5) {
    part.why = "the fluid around the point runs out of the bone: not the labyrinth, or its walls are not seen";
    return part;
  }
  part.quality = std::clamp(less / volume, 0.0, 1.0);
  part.found = true;
  return part;
}

}  // namespace osteo::inline imaging::segment
