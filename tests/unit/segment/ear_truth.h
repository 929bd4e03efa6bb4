// The truth of what the ear's finders look for, from the phantom's formulas and exact labels.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::test {

inline constexpr Vec3 kTrueDrum{45, 0, -20};

/// Values on another scale, as of a scanner that is off: water stays, air and bone change.
inline Image scaled(const Image& ct, double factor) {
  const std::size_t n = ct.frame.voxel_count();
  const auto v = make_voxels<std::int16_t>(n);
  for (std::size_t i = 0; i < n; ++i)
    v[i] = static_cast<std::int16_t>(std::clamp(std::lround(ct.voxels[i] * factor), -1024L, 3071L));
  return {ct.frame, v};
}

/// Of the sinus' centre line, which points bone holds half around: walls within 2 mm beyond its radius.
inline std::vector<bool> held_part(const HeadAnatomy& head) {
  const auto line = head.sigmoid_sinus();
  std::vector<bool> held(line.size());
  std::vector<double> share(line.size());
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const Vec3 along = normalized(line[i + 1].at_mm - line[i - 1].at_mm), u = any_perpendicular(along),
               v = cross(along, u);
    int n = 0;
    for (int q = 0; q < 64; ++q) {
      const double a = 2 * std::numbers::pi * q / 64;
      for (double r = line[i].radius_mm + 0.1; r < line[i].radius_mm + 2; r += 0.1) {
        const Tissue t = head.tissue(line[i].at_mm + (u * std::cos(a) + v * std::sin(a)) * r);
        if (!is_bone(t) && t != Tissue::air_cells) continue;
        ++n;
        break;
      }
    }
    share[i] = n / 64.0;
  }
  // From the point beside the drum both ways.
  std::size_t middle = 0;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (std::abs(line[i].at_mm.z + 22) < std::abs(line[middle].at_mm.z + 22) && line[i].at_mm.y > 20) middle = i;
  const auto end_of = [&](int step) {
    std::size_t end = middle;
    double since = 0;
    for (auto i = static_cast<std::ptrdiff_t>(middle); i > 0 && i + 1 < static_cast<std::ptrdiff_t>(line.size());
         i += step) {
      const auto at = static_cast<std::size_t>(i);
      since += length(line[at].at_mm - line[static_cast<std::size_t>(i - step)].at_mm);
      if (share[at] >= 0.5) end = at, since = 0;
      if (share[at] < 0.3 || since > 6) break;  // short stretches that less bone holds do not end it
    }
    return end;
  };
  const std::size_t first = end_of(-1), last = end_of(1);
  for (std::size_t i = 0; i < line.size(); ++i) held[i] = i >= first && i <= last;
  return held;
}

/// Voxels of the truth in the frame of the phantom's labels.
inline std::vector<std::uint8_t> ear_truth(const Labels& labels, const HeadAnatomy& head, EarStructure what) {
  const Frame& f = labels.frame;
  const std::size_t n = f.voxel_count();
  std::vector<std::uint8_t> m(n);
  const auto is = [&](std::size_t i, Tissue t) { return labels.voxels[i] == static_cast<std::uint8_t>(t); };
  const auto place = [&](std::size_t i) {
    const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]);
    return f.world_from_index({double(i % nx), double(i / nx % ny), double(i / nx / ny)});
  };
  switch (what) {
    case EarStructure::ear_canal:
      for (std::size_t i = 0; i < n; ++i) m[i] = is(i, Tissue::ear_canal) && place(i).x > 0;
      break;
    case EarStructure::labyrinth:
      for (std::size_t i = 0; i < n; ++i) m[i] = is(i, Tissue::labyrinth) && place(i).x > 0;
      break;
    case EarStructure::air_cells:
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3 d = place(i) - kTrueDrum;
        m[i] = (is(i, Tissue::air_cells) || is(i, Tissue::tympanic_cavity)) && d.x > -9 && d.y > -12 && d.z > -36 &&
               d.x < 42;
      }
      break;
    case EarStructure::sigmoid_sinus: {
      const auto line = head.sigmoid_sinus();
      const std::vector<bool> held = held_part(head);
      for (std::size_t i = 0; i < n; ++i) {
        if (!is(i, Tissue::sigmoid_sinus)) continue;
        const Vec3 p = place(i);
        std::size_t best = 0;
        for (std::size_t q = 0; q < line.size(); ++q)
          if (length(line[q].at_mm - p) - line[q].radius_mm < length(line[best].at_mm - p) - line[best].radius_mm)
            best = q;
        m[i] = held[best];
      }
      break;
    }
    case EarStructure::tegmen: {
      // Of each column the plate under the middle fossa, by the formulas in steps of 0.05 mm.
      const int nx = f.dims[0], ny = f.dims[1], nz = f.dims[2];
      struct Plate {
        double top = -1e9, bottom = -1e9;
        bool air = false;
      };
      std::vector<Plate> plates(static_cast<std::size_t>(nx * ny));
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          const Vec3 base = f.world_from_index({double(i), double(j), 0});
          const auto at = [&](double z) { return head.tissue({base.x, base.y, z}); };
          const auto brain = [&](double z) {
            const Tissue t = at(z);
            return t == Tissue::soft || t == Tissue::dura;
          };
          // Brain begins where there is dura below: skin over the skull has none.
          double z = std::min(kTrueDrum.z + 28, f.origin_mm.z + (nz - 1) * f.spacing_mm.z);
          while (z > kTrueDrum.z - 3 && !brain(z)) z -= 0.5;
          Tissue last = Tissue::soft;
          while (z > kTrueDrum.z - 3 && brain(z)) last = at(z), z -= 0.05;
          if (z <= kTrueDrum.z - 3 || last != Tissue::dura || !is_bone(at(z))) continue;
          Plate& p = plates[static_cast<std::size_t>(j * nx + i)];
          p.top = z + 0.025;
          while (p.top - z < 4.5 && (is_bone(at(z)))) z -= 0.05;
          p.bottom = z + 0.025;
          const Tissue t = at(z);
          p.air = p.top - p.bottom <= 4 && (t == Tissue::air_cells || t == Tissue::tympanic_cavity);
        }
      }
      const auto near = [&](const std::vector<std::uint8_t>& a, std::uint8_t value, double reach) {
        std::vector<std::uint8_t> b(a);
        const int r = static_cast<int>(reach / f.spacing_mm.x);
        for (int j = 0; j < ny; ++j)
          for (int i = 0; i < nx; ++i)
            for (int y = std::max(0, j - r); y <= std::min(ny - 1, j + r); ++y)
              for (int x = std::max(0, i - r); x <= std::min(nx - 1, i + r); ++x)
                if (std::hypot(x - i, y - j) * f.spacing_mm.x <= reach &&
                    a[static_cast<std::size_t>(y * nx + x)] == value)
                  b[static_cast<std::size_t>(j * nx + i)] = value;
        return b;
      };
      std::vector<std::uint8_t> foot(plates.size());
      for (std::size_t c = 0; c < plates.size(); ++c) foot[c] = plates[c].air ? 1 : 0;
      foot = near(near(foot, 1, 2), 0, 2);
      // The largest piece: others lie under the posterior fossa.
      std::vector<int> piece(plates.size(), 0);
      int pieces = 0, best = 0;
      std::size_t most = 0;
      for (std::size_t c = 0; c < plates.size(); ++c) {
        if (foot[c] == 0 || piece[c] != 0) continue;
        std::vector<std::size_t> stack{c};
        piece[c] = ++pieces;
        std::size_t size = 0;
        while (!stack.empty()) {
          const std::size_t at = stack.back();
          stack.pop_back();
          ++size;
          const int x = static_cast<int>(at) % nx, y = static_cast<int>(at) / nx;
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
              if (x + dx < 0 || y + dy < 0 || x + dx >= nx || y + dy >= ny) continue;
              const auto to = static_cast<std::size_t>((y + dy) * nx + x + dx);
              if (foot[to] != 0 && piece[to] == 0) piece[to] = pieces, stack.push_back(to);
            }
        }
        if (size > most) most = size, best = pieces;
      }
      for (std::size_t c = 0; c < plates.size(); ++c) {
        if (piece[c] != best || plates[c].top < -1e8) continue;
        const double low = std::max(plates[c].bottom, plates[c].top - 4);
        for (int k = 0; k < nz; ++k) {
          const double z = f.origin_mm.z + k * f.spacing_mm.z;
          m[static_cast<std::size_t>(k) * plates.size() + c] = z >= low && z <= plates[c].top;
        }
      }
      break;
    }
    case EarStructure::dura: {
      std::vector<std::uint8_t> dura(n), bone(n);
      for (std::size_t i = 0; i < n; ++i) {
        dura[i] = is(i, Tissue::dura);
        bone[i] = is_bone(static_cast<Tissue>(labels.voxels[i]));
      }
      const auto to_dura = squared_distance_mm2(dura, f, 1), to_bone = squared_distance_mm2(bone, f, 1);
      const double half = 0.5 * f.spacing_mm.x;
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3 d = place(i) - kTrueDrum;
        const bool box = d.x > -20 && d.x < 34 && d.y > -24 && d.y < 46 && d.z > -30 && d.z < 25;
        const bool in = dura[i] != 0 || (is(i, Tissue::soft) && std::sqrt(double(to_dura[i])) <= 1.2 + half);
        m[i] = box && in && std::sqrt(double(to_bone[i])) <= 2 + half;
      }
      break;
    }
  }
  return m;
}

struct Overlap {
  double dice = 0, mean_mm = 0, p95_mm = 0, true_mm3 = 0;
};
/// Dice, and distances of the surface voxels of each to the other's (95th percentile of both together).
inline Overlap overlap(const Labels& found, std::uint8_t value, const std::vector<std::uint8_t>& truth) {
  const Frame& f = found.frame;
  const std::size_t n = f.voxel_count();
  std::vector<std::uint8_t> a(n);
  double both = 0, na = 0, nb = 0;
  for (std::size_t i = 0; i < n; ++i) {
    a[i] = found.voxels[i] == value;
    both += a[i] && truth[i], na += a[i], nb += truth[i];
  }
  Overlap o;
  o.dice = na + nb > 0 ? 2 * both / (na + nb) : 1;
  o.true_mm3 = nb * f.voxel_volume_mm3();
  const auto surface = [&](const std::vector<std::uint8_t>& m) {
    std::vector<std::uint8_t> s(n);
    const int nx = f.dims[0], ny = f.dims[1], nz = f.dims[2];
    std::size_t at = 0;
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i, ++at) {
          if (!m[at]) continue;
          const auto x = static_cast<std::size_t>(nx), y = x * static_cast<std::size_t>(ny);
          s[at] = (i > 0 && !m[at - 1]) || (i + 1 < nx && !m[at + 1]) || (j > 0 && !m[at - x]) ||
                  (j + 1 < ny && !m[at + x]) || (k > 0 && !m[at - y]) || (k + 1 < nz && !m[at + y]);
        }
    return s;
  };
  const auto sa = surface(a), sb = surface(truth);
  const auto da = squared_distance_mm2(sa, f, 1), db = squared_distance_mm2(sb, f, 1);
  std::vector<double> d;
  for (std::size_t i = 0; i < n; ++i) {
    if (sa[i]) d.push_back(std::sqrt(double(db[i])));
    if (sb[i]) d.push_back(std::sqrt(double(da[i])));
  }
  if (d.empty()) return o;
  std::sort(d.begin(), d.end());
  for (const double x : d) o.mean_mm += x / double(d.size());
  o.p95_mm = d[static_cast<std::size_t>(0.95 * double(d.size() - 1))];
  return o;
}

}  // namespace osteo::test
