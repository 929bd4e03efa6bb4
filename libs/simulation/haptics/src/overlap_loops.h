// The body of the overlap kernel, compiled once for each instruction set. A row of a brick is a vector of eight: the
// same operations on the same lanes everywhere, no fused ones, so the same bits.
#include <cstring>

#include "overlap_kernel.h"

namespace osteo::inline simulation::overlap {
namespace {

using F = float __attribute__((vector_size(32)));
using M = std::int32_t __attribute__((vector_size(32)));

inline F all(float x) {
  return F{x, x, x, x, x, x, x, x};
}
inline F least(F a, F b) {
  return a < b ? a : b;
}
inline F most(F a, F b) {
  return a > b ? a : b;
}
inline F absolute(F a) {
  return most(a, -a);
}
inline F root(F a) {
  F r;
  for (int l = 0; l < 8; ++l) r[l] = __builtin_sqrtf(a[l]);
  return r;
}
inline bool any_of(M set) {
  std::uint64_t any[4];
  std::memcpy(any, &set, sizeof any);
  return (any[0] | any[1] | any[2] | any[3]) != 0;
}
inline float sum(F a) {
  const float e0 = a[0] + a[4], e1 = a[1] + a[5], e2 = a[2] + a[6], e3 = a[3] + a[7];
  return (e0 + e2) + (e1 + e3);
}

// The eight densities of a row, each as it was or as it is while another thread writes: a trainee's hand feels a copy
// of the bone in which that thread repeats the host's removal. Processors load vectors by whole words, and what is
// volatile is loaded once, so all that follows goes by one value. C++ has no atomic vector: the thread sanitizer is
// told.
__attribute__((no_sanitize("thread"))) inline F row_of(const float* at) {
  using Row = F __attribute__((aligned(4), may_alias));
  return *reinterpret_cast<const volatile Row*>(at);
}

// Share of a unit cube on the inner side of a plane, and the area of the plane inside it. `s`: how far inside the shape
// the cube's centre lies; nx, ny, nz: the unit normal. R. Scardovelli, S. Zaleski, J. Comput. Phys. 164 (2000), in the
// form without cancellation for normals nearly along an axis; within 3e-5.
inline void cut_cube(F s, F nx, F ny, F nz, F& share, F& area) {
  const F ax = absolute(nx), ay = absolute(ny), az = absolute(nz);
  const F total = ax + ay + az, scale = all(1) / total;
  const F a = ax * scale, b = ay * scale, c = az * scale;
  const F lo = least(a, b), hi = most(a, b);
  const F m1 = most(least(lo, c), all(1e-3F));
  const F m2 = most(most(lo, least(hi, c)), m1);
  const F m3 = all(1) - m1 - m2;
  const F m12 = m1 + m2, d6 = all(1) / (all(6) * m1 * m2 * m3);
  const F alpha = all(0.5F) + s * scale;
  const M upper = alpha > all(0.5F);
  const F x = most(upper ? all(1) - alpha : alpha, all(0));
  const F x2 = x * x, q1 = m1 * m1, q2 = m2 * m2, q3 = m3 * m3;
  F v = x2 * x, g = all(3) * x2;
  const M beyond1 = x >= m1, beyond2 = x >= m2, beyond3 = x >= least(m12, m3), flat = m3 >= m12;
  v = beyond1 ? m1 * (all(3) * x2 - all(3) * x * m1 + q1) : v;
  g = beyond1 ? m1 * (all(6) * x - all(3) * m1) : g;
  const F v3 = x2 * (all(3) * m12 - x) + q1 * (m1 - all(3) * x) + q2 * (m2 - all(3) * x);
  const F g3 = all(3) * (all(2) * x * m12 - x2 - q1 - q2);
  v = beyond2 ? v3 : v;
  g = beyond2 ? g3 : g;
  const F product = all(3) * m1 * m2;
  const F v4 = flat ? product * (all(2) * x - m12) : v3 + x2 * (all(3) * m3 - x) + q3 * (m3 - all(3) * x);
  const F g4 = flat ? all(2) * product : g3 + all(3) * (all(2) * x * m3 - x2 - q3);
  v = beyond3 ? v4 : v;
  g = beyond3 ? g4 : g;
  v = v * d6;
  share = upper ? all(1) - v : v;
  area = g * d6 * scale;
}

// asin of x in [0, 1], within 7e-5: Abramowitz and Stegun 4.4.45.
inline F arc_sine(F x) {
  const F p = all(1.5707288F) + x * (all(-0.2121144F) + x * (all(0.0742610F) + x * all(-0.0187293F)));
  return all(1.5707963F) - root(most(all(1) - x, all(0))) * p;
}

template <bool kBall>
void brick(const Shape& shape, const float* values, const float* first, VoxelKey key, Sums& sums, HitList& list,
           PartialList& partial) {
  const F lane{0, 1, 2, 3, 4, 5, 6, 7};
  const F ax = all(shape.axis[0]), ay = all(shape.axis[1]), az = all(shape.axis[2]);
  const F x = lane + all(first[0]);
  // Half a row and half a voxel's diagonal: a row whose middle is farther than this from the surface is wholly in or
  // out.
  constexpr float kReach = 3.5F + 0.9F;
  // Farther out than half its diagonal a voxel has no share in the shape.
  constexpr float kOut = 0.9F;
  F volume{}, surface{}, gx{}, gy{}, gz{}, fx{}, fy{}, fz{};
  for (int k = 0; k < 8; ++k) {
    const float z = first[2] + static_cast<float>(k);
    // The middles of the eight rows of this layer, all at once.
    F row_depth;
    {
      const F qx = all(first[0] + 3.5F), qy = lane + all(first[1]), qz = all(z);
      const F q2 = qx * qx + qy * qy + qz * qz;
      if constexpr (kBall) {
        row_depth = all(shape.start_radius) - root(q2);
      } else {
        const F along = qx * ax + qy * ay + qz * az;
        const F off = root(most(q2 - along * along, all(0)));
        const F t = least(most(along - off * all(shape.slope_run), all(0)), all(shape.length));
        row_depth =
            all(shape.start_radius) - all(shape.slope) * t - root(most(q2 - all(2) * t * along + t * t, all(0)));
      }
    }
    for (int j = 0; j < 8; ++j) {
      if (row_depth[j] < -kReach) continue;
      const float* const row = values + (k * 64 + j * 8);
      const F density = row_of(row);
      std::uint64_t bits[4];
      std::memcpy(bits, &density, sizeof bits);
      if ((bits[0] | bits[1] | bits[2] | bits[3]) == 0) continue;
      const bool whole = row_depth[j] > kReach;
      if (whole && list.hits == nullptr) {
        volume += density;
        continue;
      }
      const F qy = all(first[1] + static_cast<float>(j)), qz = all(z);
      F vx = x, vy = qy, vz = qz, t{};
      if constexpr (!kBall) {
        const F along = x * ax + qy * ay + qz * az;
        const F off = root(most(x * x + qy * qy + qz * qz - along * along, all(0)));
        t = least(most(along - off * all(shape.slope_run), all(0)), all(shape.length));
        vx = x - t * ax;
        vy = qy - t * ay;
        vz = qz - t * az;
      }
      const F distance = root(most(vx * vx + vy * vy + vz * vz, all(1e-12F)));
      // Half of the rows that come here have no voxel at the shape: all that follows would be zeros.
      if (!whole && !any_of(all(shape.start_radius) - all(shape.slope) * t - distance > all(-kOut))) continue;
      const F inverse = all(1) / distance;
      const F nx = vx * inverse, ny = vy * inverse, nz = vz * inverse;
      F share = all(1);
      if (!whole) {
        const F radius = all(shape.start_radius) - all(shape.slope) * t;
        // The surface curves away from the plane that stands for it: in the mean over a cube by 1/24 of the sum of its
        // curvatures.
        F curvature = all(1.0F / 24) / most(radius, all(0.5F));
        if constexpr (kBall) {
          curvature = curvature + curvature;
        } else {
          const M round_end = (t <= all(0)) | (t >= all(shape.length));
          curvature = round_end ? curvature + curvature : curvature;
        }
        F area;
        cut_cube(radius - distance - curvature, nx, ny, nz, share, area);
        const M both = (density < all(1)) & (density > all(0)) & (share < all(1)) & (share > all(0));
        const unsigned begun =
            partial.begun != nullptr ? partial.begun[key / 8 + static_cast<std::uint32_t>(k * 8 + j)] : 0U;
        if (begun != 0 || any_of(both)) {
          for (int l = 0; l < 8 && partial.count < partial.capacity; ++l) {
            if (both[l] == 0 && ((begun >> l & 1U) == 0 || !(share[l] > 0) || !(density[l] > 0))) continue;
            partial.items[partial.count++] = {key + static_cast<VoxelKey>(k * 64 + j * 8 + l),
                                              density[l],
                                              share[l],
                                              {nx[l], ny[l], nz[l]},
                                              area[l],
                                              t[l]};
          }
        }
        const F pressed = density * area;
        surface += pressed;
        gx += pressed * nx;
        gy += pressed * ny;
        gz += pressed * nz;
        if constexpr (!kBall) {
          const F lever = pressed * t;
          fx += lever * nx;
          fy += lever * ny;
          fz += lever * nz;
        }
      }
      const F covered = density * share;
      volume += covered;
      if (list.hits == nullptr) continue;
      const F latitude = arc_sine(least(absolute(nx * ax + ny * ay + nz * az), all(1)));
      const F efficiency = most(all(1) - all(shape.falloff) * latitude, all(0));
      const std::uint32_t row_number = key / 8 + static_cast<std::uint32_t>(k * 8 + j);
      if ((row_number + list.phase) % list.stride != 0 || list.count >= list.capacity) continue;
      for (int l = 0; l < 8; ++l) {
        list.hits[list.count] = {key + static_cast<VoxelKey>(k * 64 + j * 8 + l), share[l], efficiency[l]};
        list.count += covered[l] * efficiency[l] > 0 ? 1 : 0;
      }
    }
  }
  sums.volume += static_cast<double>(sum(volume));
  sums.surface += static_cast<double>(sum(surface));
  const F g[3] = {gx, gy, gz}, f[3] = {fx, fy, fz};
  for (int a = 0; a < 3; ++a) {
    sums.area[a] += static_cast<double>(sum(g[a]));
    sums.area_foot[a] += static_cast<double>(sum(f[a]));
  }
}

inline void run_brick(const Shape& shape, const float* values, const float* first, VoxelKey key, Sums& sums,
                      HitList& list, PartialList& partial) {
  if (shape.ball) {
    brick<true>(shape, values, first, key, sums, list, partial);
  } else {
    brick<false>(shape, values, first, key, sums, list, partial);
  }
}

// 64 points of a voxel's cubes, from a cube's middle: a lattice of rank 1 with the generators of the longest shortest
// dual vector, so that planes of points are close together whichever way they face, and along an axis no two points are
// level.
struct Lattice {
  float x[64], y[64], z[64];
};
constexpr Lattice lattice(unsigned parts) {
  Lattice l{};
  const auto at = [&](unsigned n) {
    return ((static_cast<float>(n % 64) + 0.5F) / 64 - 0.5F) / static_cast<float>(parts);
  };
  for (unsigned n = 0; n < 64; ++n) {
    l.x[n] = at(n);
    l.y[n] = at(n * 5);
    l.z[n] = at(n * 13);
  }
  return l;
}

// Middles of the cubes of a voxel that is cut kParts times along each edge, from its own; a whole number of eights of
// them.
template <unsigned kParts>
struct Cubes {
  static constexpr unsigned kCount = kParts * kParts * kParts;
  float x[(kCount + 7) / 8 * 8] = {}, y[(kCount + 7) / 8 * 8] = {}, z[(kCount + 7) / 8 * 8] = {};
};
template <unsigned kParts>
constexpr Cubes<kParts> cubes() {
  Cubes<kParts> c;
  for (unsigned n = 0; n < c.kCount; ++n) {
    c.x[n] = (static_cast<float>(n % kParts) + 0.5F) / kParts - 0.5F;
    c.y[n] = (static_cast<float>(n / kParts % kParts) + 0.5F) / kParts - 0.5F;
    c.z[n] = (static_cast<float>(n / (kParts * kParts)) + 0.5F) / kParts - 0.5F;
  }
  return c;
}
inline F load(const float* p) {
  F v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

// Clears the bits of points that lie `inside` what takes them; `depth`: how far inside. Cubes that are in or out as a
// whole are told by their middle.
template <unsigned kParts, class Depth, class Inside>
inline std::uint32_t sift(std::uint64_t* left, const float* at, Depth depth, Inside inside) {
  static constexpr Cubes<kParts> kCubes = cubes<kParts>();
  static constexpr Lattice kLattice = lattice(kParts);
  constexpr unsigned kAtOnce = kCubes.kCount < 8 ? kCubes.kCount : 8;
  constexpr float kHalfDiagonal = 0.8661F / kParts;
  const F ax = all(at[0]), ay = all(at[1]), az = all(at[2]);
  std::uint32_t count = 0;
  for (unsigned first = 0; first < kCubes.kCount; first += 8) {
    std::uint64_t any = 0;
    for (unsigned l = 0; l < kAtOnce; ++l) any |= left[first + l];
    if (any == 0) continue;
    const F cx = ax + load(kCubes.x + first), cy = ay + load(kCubes.y + first), cz = az + load(kCubes.z + first);
    F deep{};
    if constexpr (kParts > 1) deep = depth(cx, cy, cz);
    for (unsigned l = 0; l < kAtOnce; ++l) {
      std::uint64_t& kept = left[first + l];
      if (kept == 0) continue;
      if (deep[l] > kHalfDiagonal) {
        kept = 0;
        continue;
      }
      if (deep[l] >= -kHalfDiagonal) {
        const F mx = all(cx[l]), my = all(cy[l]), mz = all(cz[l]);
        M set{};
        for (std::int32_t g = 0; g < 8; ++g) {
          const std::int32_t bit = 1 << g;
          const M bits{bit, bit, bit, bit, bit, bit, bit, bit};
          set |= inside(mx + load(kLattice.x + 8 * g), my + load(kLattice.y + 8 * g), mz + load(kLattice.z + 8 * g)) &
                 bits;
        }
        using B = std::uint8_t __attribute__((vector_size(8)));
        const B bytes = __builtin_convertvector(set, B);
        std::uint64_t gone;
        std::memcpy(&gone, &bytes, sizeof gone);
        kept &= ~gone;
      }
      count += static_cast<std::uint32_t>(__builtin_popcountll(kept));
    }
  }
  return count;
}
template <class Depth, class Inside>
inline std::uint32_t sift(std::uint32_t parts, std::uint64_t* left, const float* at, Depth depth, Inside inside) {
  return parts == 1   ? sift<1>(left, at, depth, inside)
         : parts == 2 ? sift<2>(left, at, depth, inside)
                      : sift<4>(left, at, depth, inside);
}

inline std::uint32_t take_grains(const Shape& shape, const float* at, std::uint32_t parts, std::uint64_t* left) {
  const F start = all(shape.start_radius);
  if (shape.ball) {
    const F r2 = start * start;
    return sift(
        parts, left, at, [&](F x, F y, F z) { return start - root(x * x + y * y + z * z); },
        [&](F x, F y, F z) { return x * x + y * y + z * z < r2; });
  }
  const F ax = all(shape.axis[0]), ay = all(shape.axis[1]), az = all(shape.axis[2]), length = all(shape.length);
  const F slope = all(shape.slope), run = all(shape.slope_run);
  const bool tapers = shape.slope != 0;
  // The square of the distance from the axis' foot, and the radius there.
  const auto foot = [&](F x, F y, F z, F& r) {
    const F along = x * ax + y * ay + z * az, q2 = x * x + y * y + z * z;
    const F t = least(most(tapers ? along - root(most(q2 - along * along, all(0))) * run : along, all(0)), length);
    r = start - slope * t;
    return q2 - all(2) * t * along + t * t;
  };
  return sift(
      parts, left, at,
      [&](F x, F y, F z) {
        F r;
        const F d2 = foot(x, y, z, r);
        return r - root(most(d2, all(0)));
      },
      [&](F x, F y, F z) {
        F r;
        const F d2 = foot(x, y, z, r);
        return d2 < r * r;
      });
}

inline std::uint32_t grains_beyond(const float* inwards, float least_dot, std::uint32_t parts, std::uint64_t* left) {
  const F nx = all(inwards[0]), ny = all(inwards[1]), nz = all(inwards[2]), level = all(least_dot);
  const F inverse = all(1) / root(nx * nx + ny * ny + nz * nz);
  const float middle[3] = {};
  return sift(
      parts, left, middle, [&](F x, F y, F z) { return (level - (x * nx + y * ny + z * nz)) * inverse; },
      [&](F x, F y, F z) { return x * nx + y * ny + z * nz < level; });
}

}  // namespace
}  // namespace osteo::inline simulation::overlap
