#include "osteo/display/view/detail/bone_paint.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline display {
namespace {

// Chosen by eye beside photographs of drilled temporal bones.
constexpr Vec3 kIvory{0.95, 0.90, 0.81}, kMarrow{0.80, 0.60, 0.47};
constexpr double kFadeMm =
    0.8;  // bone this thick lets a third of the colour below through (a guess: what drilled bone looks like)
// Of Hardness, 1 being dense cortical bone: where marrow ends and ivory begins.
constexpr double kSpongy = 0.22, kDense = 0.55;
constexpr double kSpeckleMm = 0.45, kSpeckle = 0.16;

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// -1 to 1 at each place of a lattice, the same for ever.
double lattice(int i, int j, int k) {
  std::uint32_t h = static_cast<std::uint32_t>(i) * 0x8da6b343U ^ static_cast<std::uint32_t>(j) * 0xd8163841U ^
                    static_cast<std::uint32_t>(k) * 0xcb1ab31fU;
  h ^= h >> 15;
  h *= 0x2c1b3c6dU;
  h ^= h >> 12;
  h *= 0x297a2d39U;
  h ^= h >> 15;
  return static_cast<double>(h) / 2147483647.5 - 1;
}

// Linear between the places.
double speckle(Vec3 p) {
  int n[3];
  double f[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const double u = p[a] / kSpeckleMm, whole = std::floor(u);
    n[a] = static_cast<int>(whole);
    f[a] = u - whole;
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const double w =
        ((c & 1) != 0 ? f[0] : 1 - f[0]) * ((c >> 1 & 1) != 0 ? f[1] : 1 - f[1]) * ((c >> 2) != 0 ? f[2] : 1 - f[2]);
    sum += w * lattice(n[0] + (c & 1), n[1] + (c >> 1 & 1), n[2] + (c >> 2));
  }
  return sum;
}

}  // namespace

Shine shine_through(const StructureMap& structures, Vec3 p, Vec3 inwards) {
  constexpr double kMax = BonePaint::kShownThroughMm, kStep = 0.25;
  const double none = std::exp(-kMax / kFadeMm);  // taken off, so that it ends without a step
  auto last = structures.at(p);
  if (last.structure == 0 || last.distance_mm >= kMax) return {};
  if (last.distance_mm <= 0) return {1, last.structure};
  // How far there is none for certain; distances are read between the places of a grid.
  const auto free_mm = [](double distance_mm) { return 0.9 * distance_mm - 0.05; };
  for (double t = 0; t < kMax;) {
    if (t + free_mm(last.distance_mm) > kMax) return {};
    t += kStep * std::max(1.0, std::floor(free_mm(last.distance_mm) / kStep));
    const auto there = structures.at(p + inwards * t);
    if (there.structure != 0 && there.distance_mm <= 0) {
      // Where between the two the face lies.
      const double fall = last.distance_mm - there.distance_mm;
      const double deep = t - kStep * (fall > 0 ? -there.distance_mm / fall : 0);
      return {std::clamp((std::exp(-deep / kFadeMm) - none) / (1 - none), 0.0, 1.0), there.structure};
    }
    if (there.structure == 0) return {};
    last = there;
  }
  return {};
}

BonePaint::BonePaint(const BrickGrid& bone, const StructureMap* structures, std::shared_ptr<const Hardness> hardness)
    : structures_(structures), hardness_(std::move(hardness)), openness_(std::make_shared<Openness>(bone)) {}

// The densest of a millimetre below, so that a thin cortex counts as one.
double BonePaint::density_below(const BrickGrid& bone, Vec3 index, Vec3 outwards) const {
  const double voxel_mm = bone.frame().spacing_mm.x;
  double densest = 0;
  for (const double mm : {0.4, 0.7, 1.0}) {
    const double steps = std::max(mm / voxel_mm, 0.75 * (mm / 0.4));
    const Vec3 q = index - outwards * steps;
    const VoxelKey key = bone.find(static_cast<int>(std::floor(q.x + 0.5)), static_cast<int>(std::floor(q.y + 0.5)),
                                   static_cast<int>(std::floor(q.z + 0.5)));
    if (key == BrickGrid::kNone || !(bone.value(key) > 0.5F)) break;
    densest = std::max(densest, static_cast<double>(hardness_->at(key)));
  }
  return densest;
}

void BonePaint::paint(const BrickGrid& bone, const SurfacePatch& patch, std::vector<Rgb>& colours,
                      ShineMemo* memo) const {
  if (memo != nullptr && memo->of_key.size() > 2 * patch.vertices.size()) memo->of_key.clear();
  const Frame& frame = bone.frame();
  colours.resize(patch.vertices.size());
  for (std::size_t n = 0; n < patch.vertices.size(); ++n) {
    const auto& v = patch.vertices[n];
    const Vec3 index{static_cast<double>(v.index[0]), static_cast<double>(v.index[1]), static_cast<double>(v.index[2])},
        outwards{static_cast<double>(v.normal[0]), static_cast<double>(v.normal[1]), static_cast<double>(v.normal[2])};
    Vec3 colour = kIvory;
    const Vec3 at = frame.world_from_index(index);
    if (hardness_) {
      const double dense = smooth_step(kSpongy, kDense, density_below(bone, index, outwards));
      colour = kMarrow + (kIvory - kMarrow) * dense;
      if (dense < 1) colour = colour * (1 + kSpeckle * (1 - dense) * speckle(at));
    }
    if (structures_ != nullptr) {
      const auto look = [&] { return shine_through(*structures_, at, -(frame.direction * outwards)); };
      Shine shine;
      if (memo == nullptr) {
        shine = look();
      } else {
        constexpr double kSame = 0.9998;  // cosine of a degree
        const auto [known, fresh] = memo->of_key.try_emplace(v.key);
        ShineMemo::Found& found = known->second;
        if (fresh || found.index != v.index || dot(from_floats(found.normal), outwards) < kSame)
          found = {v.index, v.normal, look()};
        shine = found.shine;
      }
      if (shine.share > 0) {
        const auto below = structures_->colour_of(shine.structure);
        for (std::size_t c = 0; c < 3; ++c) colour[c] += shine.share * (below[c] - colour[c]);
      }
    }
    const double light = kDarkest + (1 - kDarkest) * openness_->at(v.index, v.normal, others_);
    for (std::size_t c = 0; c < 3; ++c)
      colours[n][c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(light * colour[c], 0.0, 0.95)));
  }
}

}  // namespace osteo::inline display
