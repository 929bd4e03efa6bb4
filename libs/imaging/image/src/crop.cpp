#include "osteo/imaging/image/crop.h"

#include <algorithm>
#include <cmath>

#include "clean.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging {
namespace {

struct Skull {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  double top_mm2 = 0;        // bone cut by the end of the scan that is nearest to the head's top
  bool top_at_side = false;  // and at a side of the scan as well: a block out of a head
};

// Bounds of the largest piece of bone, on every other voxel.
Skull find_skull(const Image& ct) {
  constexpr int kBoneHu = 250;
  // A head holder may reach higher than the head.
  std::vector<std::uint8_t> mask(ct.frame.voxel_count());
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = ct.voxels[i] >= kBoneHu ? 1 : 0;
  const image::Outside outside = image::find_outside(mask.data(), ct, {});
  for (const auto* voxels : {&outside.certain, &outside.doubtful}) {
    for (const std::size_t i : *voxels) mask[i] = 0;
  }
  Frame f = ct.frame;
  for (std::size_t a = 0; a < 3; ++a) {
    f.dims[a] = (f.dims[a] + 1) / 2;
    f.spacing_mm[a] *= 2;
  }
  std::vector<std::uint8_t> bone(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) bone[at] = mask[ct.offset(2 * i, 2 * j, 2 * k)];
    }
  }
  const Components parts = connected_components(bone, f.dims, 1, Connectivity::full);
  if (parts.voxels.empty())
    throw Error(ExitCode::failed, "there is no bone by which to find the region",
                "give --region box with --centre-mm and --size-mm");
  const auto largest =
      static_cast<std::uint32_t>(std::max_element(parts.voxels.begin(), parts.voxels.end()) - parts.voxels.begin());
  Skull s;
  // The index axis that runs up the body, and its end at the head.
  std::size_t up = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(f.direction.column[a].z) > std::abs(f.direction.column[up].z)) up = a;
  }
  const int last = f.direction.column[up].z > 0 ? f.dims[up] - 1 : 0;
  const double pixel = f.voxel_volume_mm3() / f.spacing_mm[up];
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    if (parts.component[r] != largest) continue;
    const Run& run = parts.runs[r];
    const int y = static_cast<int>(run.row) % f.dims[1], z = static_cast<int>(run.row) / f.dims[1];
    for (const std::uint32_t x : {run.begin, run.end - 1}) {
      const Vec3 p = f.world_from_index({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
      for (std::size_t a = 0; a < 3; ++a) {
        s.lo[a] = std::min(s.lo[a], p[a]);
        s.hi[a] = std::max(s.hi[a], p[a]);
      }
    }
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      const std::array<int, 3> index{static_cast<int>(x), y, z};
      if (index[up] != last) continue;
      s.top_mm2 += pixel;
      for (std::size_t a = 0; a < 3; ++a)
        s.top_at_side = s.top_at_side || (a != up && (index[a] == 0 || index[a] == f.dims[a] - 1));
    }
  }
  return s;
}

template <class T>
Volume<T> cut(const Volume<T>& v, const Box& box) {
  const Frame& f = v.frame;
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (int c = 0; c < 8; ++c) {
    const Vec3 corner{(c & 1) != 0 ? box.hi_mm.x : box.lo_mm.x, (c & 2) != 0 ? box.hi_mm.y : box.lo_mm.y,
                      (c & 4) != 0 ? box.hi_mm.z : box.lo_mm.z};
    const Vec3 index = f.index_from_world(corner);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], index[a]);
      hi[a] = std::max(hi[a], index[a]);
    }
  }
  std::array<int, 3> first{}, last{};
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::max(0, static_cast<int>(std::floor(lo[a] + 0.5 + 1e-6)));
    last[a] = std::min(f.dims[a] - 1, static_cast<int>(std::ceil(hi[a] - 0.5 - 1e-6)));
    if (first[a] > last[a]) {
      const Vec3 c = (box.lo_mm + box.hi_mm) * 0.5;
      throw Error(ExitCode::usage,
                  "the box around (" + format_number(c.x) + ", " + format_number(c.y) + ", " + format_number(c.z) +
                      ") mm lies outside the scan",
                  "'osteo info FILE' shows where the scan lies (LPS mm)");
    }
  }
  Volume<T> out;
  out.frame = f;
  out.frame.origin_mm =
      f.world_from_index({static_cast<double>(first[0]), static_cast<double>(first[1]), static_cast<double>(first[2])});
  for (std::size_t a = 0; a < 3; ++a) out.frame.dims[a] = last[a] - first[a] + 1;
  if (out.frame.dims == f.dims) return v;
  const auto voxels = make_voxels<T>(out.frame.voxel_count());
  T* to = voxels.get();
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j, to += out.frame.dims[0]) {
      std::copy_n(v.voxels.get() + v.offset(first[0], j, k), out.frame.dims[0], to);
    }
  }
  out.voxels = voxels;
  return out;
}

Vec3 vec(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace

Box find_region(const Image& ct, const CropParams& p) {
  const bool centre_given = vec(p.centre_mm) != Vec3{}, size_given = vec(p.size_mm) != Vec3{};
  Vec3 centre = vec(p.centre_mm), size = vec(p.size_mm);
  if (p.region == Region::box && !size_given)
    throw Error(ExitCode::usage, "--region box needs --size-mm, the edges of the box");
  if (size_given && !(size.x > 0 && size.y > 0 && size.z > 0))
    throw Error(ExitCode::usage, "--size-mm: all three edges must be above 0");
  if (!size_given) size = p.region == Region::jaw ? Vec3{140, 115, 95} : Vec3{70, 85, 75};
  if (p.region != Region::box && !centre_given) {
    const Skull s = find_skull(ct);
    if (s.top_mm2 > 600 || s.top_at_side) {
      throw Error(ExitCode::failed,
                  "the scan does not reach the top of the head, by which " +
                      std::string(EnumNames<Region>::values[static_cast<std::size_t>(p.region)]) + " is found",
                  "give the middle of the region as --centre-mm X,Y,Z (LPS; 'osteo snapshot' shows the scan)");
    }
    const Vec3 middle = (s.lo + s.hi) * 0.5;
    constexpr double kEarBelowTop = 122, kChinBelowTop = 215, kJawHeight = 85;
    if (p.region == Region::jaw) {
      centre = {middle.x, s.lo.y + 50, s.hi.z - kChinBelowTop + 0.5 * kJawHeight};
    } else {
      // From just outside the skull's side inward.
      const double side = p.region == Region::left_temporal ? 1 : -1;
      const double edge = side > 0 ? s.hi.x : s.lo.x;
      centre = {edge - side * (0.5 * size.x - 8), middle.y + 10, s.hi.z - kEarBelowTop};
    }
  }
  return {centre - size * 0.5, centre + size * 0.5};
}

std::string bone_beyond_scan(const Image& ct, const Box& box) {
  constexpr double kMissingMm = 5, kBoneMm2 = 20;
  constexpr int kBoneHu = 250;
  // In the order of LPS, towards smaller values and towards larger ones.
  constexpr std::array<std::array<const char*, 2>, 3> kSides{
      {{"on the right", "on the left"}, {"in front", "behind"}, {"below", "above"}}};
  const Image inside = crop(ct, box);
  const Frame& f = inside.frame;
  std::string said;
  for (std::size_t a = 0; a < 3; ++a) {  // an index axis, and the one of the body that it follows
    const Vec3 direction = f.direction.column[a];
    std::size_t body = 0;
    for (std::size_t b = 1; b < 3; ++b) {
      if (std::abs(direction[b]) > std::abs(direction[body])) body = b;
    }
    for (const bool end : {false, true}) {
      std::array<int, 3> at{};
      at[a] = end ? f.dims[a] - 1 : 0;
      const std::size_t high = end == (direction[body] > 0) ? 1 : 0;
      const Vec3 face =
          f.world_from_index({static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])});
      const double missing = high == 1 ? box.hi_mm[body] - face[body] : face[body] - box.lo_mm[body];
      if (missing <= kMissingMm) continue;
      const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
      std::size_t bone = 0;
      for (at[u] = 0; at[u] < f.dims[u]; ++at[u]) {
        for (at[v] = 0; at[v] < f.dims[v]; ++at[v])
          bone += inside.voxels[inside.offset(at[0], at[1], at[2])] >= kBoneHu ? 1 : 0;
      }
      if (static_cast<double>(bone) * f.spacing_mm[u] * f.spacing_mm[v] < kBoneMm2) continue;
      said += (said.empty() ? "" : ", ") + std::string(kSides[body][high]) + " by " +
              format_number(std::round(missing)) + " mm";
    }
  }
  return said;
}

Image crop(const Image& ct, const Box& box) {
  return cut(ct, box);
}

Labels crop(const Labels& labels, const Box& box) {
  return {cut<std::uint8_t>(labels, box), labels.structures};
}

}  // namespace osteo::inline imaging
