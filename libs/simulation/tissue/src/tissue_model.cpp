#include "osteo/simulation/tissue/detail/tissue_model.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/core/base/error.h"
#include "voxel_split.h"

namespace osteo::inline simulation {
namespace {

struct Row {
  double m[9];
};
Row skew(Vec3 v) {
  return {{0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0}};
}
void add_block(double* h, std::size_t n, std::size_t a, std::size_t b, const Row& r, double s) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) h[(3 * a + i) * 3 * n + 3 * b + j] += s * r.m[3 * i + j];
}
void add_outer(double* h, std::size_t n, const Vec3* g, double s) {
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) h[(3 * a + i) * 3 * n + 3 * b + j] += s * g[a][i] * g[b][j];
}

constexpr int kWholeTet[4] = {0, 1, 2, 3};

// A tetrahedron's volume; its gradients, and where asked the Hessian times `s` added, for nodes `at` of n.
double tet_volume(const Vec3* x, const int* at, std::size_t n, Vec3* g, double* hessian, double s) {
  const Vec3 o = x[at[0]], d1 = x[at[1]] - o, d2 = x[at[2]] - o, d3 = x[at[3]] - o;
  const Vec3 g1 = cross(d2, d3) / 6, g2 = cross(d3, d1) / 6, g3 = cross(d1, d2) / 6;
  if (g != nullptr) {
    g[at[1]] += g1;
    g[at[2]] += g2;
    g[at[3]] += g3;
    g[at[0]] -= g1 + g2 + g3;
  }
  if (hessian != nullptr) {
    // 6 V = d1 . (d2 x d3); d2(6V)/d1 d2 = -[d3]x and so on; the first node by translation.
    const Row pairs[3] = {skew(d3 * -1), skew(d2), skew(d1 * -1)};  // 12, 13, 23
    constexpr std::size_t kA[3] = {1, 1, 2}, kB[3] = {2, 3, 3};
    for (std::size_t p = 0; p < 3; ++p) {
      Row t{};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) t.m[3 * i + j] = pairs[p].m[3 * j + i];
      const double q = s / 6;
      add_block(hessian, n, at[kA[p]], at[kB[p]], pairs[p], q);
      add_block(hessian, n, at[kB[p]], at[kA[p]], t, q);
      // Rows and columns of the first node: minus the sums over the others; twice over for its own block.
      add_block(hessian, n, at[kA[p]], at[0], pairs[p], -q);
      add_block(hessian, n, at[0], at[kB[p]], pairs[p], -q);
      add_block(hessian, n, at[kB[p]], at[0], t, -q);
      add_block(hessian, n, at[0], at[kA[p]], t, -q);
      add_block(hessian, n, at[0], at[0], pairs[p], q);
      add_block(hessian, n, at[0], at[0], t, q);
    }
  }
  return dot(d1, cross(d2, d3)) / 6;
}

}  // namespace

double TissueModel::measure(std::size_t e, const Vec3* x, Vec3* g) const {
  const Constraint& c = constraints_[e];
  const std::size_t n = c.nodes;
  if (n == 2) {
    const Vec3 d = x[1] - x[0];
    const double q = length(d);
    g[1] = q > 0 ? d / q : Vec3{};
    g[0] = g[1] * -1;
    return q;
  }
  if (n == 3) {
    const Vec3 normal = cross(x[1] - x[0], x[2] - x[0]);
    const double twice = length(normal);
    const Vec3 u = twice > 0 ? normal / twice : Vec3{};
    g[0] = cross(u, x[2] - x[1]) * 0.5;
    g[1] = cross(u, x[0] - x[2]) * 0.5;
    g[2] = cross(u, x[1] - x[0]) * 0.5;
    return 0.5 * twice;
  }
  std::fill(g, g + n, Vec3{});
  if (n == 4) return tet_volume(x, kWholeTet, n, g, nullptr, 0);
  double q = 0;
  for (const auto& t : tissue::kVoxelSplit[c.voxel]) q += tet_volume(x, t, n, g, nullptr, 0);
  return q;
}

double TissueModel::element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const {
  const Constraint& c = constraints_[e];
  const std::size_t n = c.nodes;
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  if (c.stiffness == 0 || c.rest == 0) return 0;
  Vec3 g[8];
  const double q = measure(e, x, g);
  const double k = c.stiffness / c.rest;  // force = -k C grad q
  if (n == 2) {
    const Vec3 u = g[1];
    if (hessian != nullptr && q > 0) {
      const double bend = k * (q / c.rest - 1) / q;
      Row r{};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) r.m[3 * i + j] = (i == j ? 1 : 0) - u[i] * u[j];
      add_block(hessian, n, 0, 0, r, bend);
      add_block(hessian, n, 1, 1, r, bend);
      add_block(hessian, n, 0, 1, r, -bend);
      add_block(hessian, n, 1, 0, r, -bend);
    }
  } else if (n == 3) {
    const double twice = 2 * q;
    if (hessian != nullptr && twice > 0) {
      const Vec3 u = cross(x[1] - x[0], x[2] - x[0]) / twice;
      // A = |c| / 2: d2A = (Jc^T (1 - u u^T) Jc / |c| + u . d2c) / 2, Jc for node a being [opposite edge]x.
      const double s = k * (q / c.rest - 1);
      const Vec3 opposite[3] = {x[2] - x[1], x[0] - x[2], x[1] - x[0]};
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          // (e_a x .)^T P (e_b x .), P = 1 - u u^T.
          const Row ea = skew(opposite[a]), eb = skew(opposite[b]);
          Row r{};
          const Vec3 ua = cross(u, opposite[a]), ub = cross(u, opposite[b]);  // u^T [e]x as a row
          for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
              double v = 0;
              for (std::size_t m = 0; m < 3; ++m) v += ea.m[3 * m + i] * eb.m[3 * m + j];
              r.m[3 * i + j] = (v - ua[i] * ub[j]) / (2 * twice);
            }
          }
          add_block(hessian, n, a, b, r, s);
          if (a != b) add_block(hessian, n, a, b, skew(u), ((b + 3 - a) % 3 == 1 ? -0.5 : 0.5) * s);
        }
      }
    }
  } else if (n == 4) {
    if (hessian != nullptr) tet_volume(x, kWholeTet, n, nullptr, hessian, k * (q / c.rest - 1));
  } else {
    if (hessian != nullptr) {
      for (const auto& t : tissue::kVoxelSplit[c.voxel]) tet_volume(x, t, n, nullptr, hessian, k * (q / c.rest - 1));
    }
  }
  const double strain = q / c.rest - 1;
  if (gradient != nullptr) {
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t i = 0; i < 3; ++i) gradient[3 * a + i] = k * strain * g[a][i];
  }
  if (hessian != nullptr) add_outer(hessian, n, g, k / c.rest);
  return 0.5 * c.stiffness * strain * strain;
}

TissueModel TissueModel::of_voxels(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets,
                                   std::span<const Material> materials, bool faces) {
  const auto refuse = [](const std::string& what) {
    return Error(ExitCode::usage, "this is no mesh of voxels split into five tetrahedra each: " + what,
                 "make it with tetrahedralize --method grid");
  };
  if (tets.empty() || tets.size() % 5 != 0) throw refuse("it has " + std::to_string(tets.size()) + " tetrahedra");
  const std::size_t voxels = tets.size() / 5;
  if (materials.size() != 1 && materials.size() != voxels)
    throw Error(ExitCode::usage,
                std::to_string(materials.size()) + " materials for " + std::to_string(voxels) + " voxels",
                "give one for all, or one each");
  for (const Material& m : materials) {
    if (!(m.young_mpa > 0) || !(m.poisson >= 0.25) || !(m.poisson < 0.5))
      throw Error(ExitCode::usage,
                  "the closed form needs a modulus above 0 and a Poisson's ratio from 0.25 to below 0.5, not " +
                      std::to_string(m.young_mpa) + " MPa and " + std::to_string(m.poisson));
  }
  TissueModel model;
  model.rest_.assign(points.begin(), points.end());
  model.tets_.assign(tets.begin(), tets.end());
  double h = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<double, TissueClass>> edges;
  std::map<std::array<std::uint32_t, 3>, double> areas;
  std::vector<Constraint> volumes;
  for (std::size_t v = 0; v < voxels; ++v) {
    const Material& m = materials[materials.size() == 1 ? 0 : v];
    const double mu = m.shear_mpa(), lambda = m.lambda_mpa();
    Vec3 lo{1e30, 1e30, 1e30}, hi = lo * -1;
    std::vector<std::uint32_t> corners;
    for (std::size_t t = 0; t < 5; ++t) {
      for (const std::uint32_t p : tets[5 * v + t]) {
        if (p >= points.size()) throw refuse("a tetrahedron names a point that is not there");
        if (std::find(corners.begin(), corners.end(), p) == corners.end()) corners.push_back(p);
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], points[p][a]);
          hi[a] = std::max(hi[a], points[p][a]);
        }
      }
    }
    const Vec3 size = hi - lo;
    if (v == 0) h = size.x;
    if (corners.size() != 8 || std::abs(size.x - h) > 1e-4 * h || std::abs(size.y - h) > 1e-4 * h ||
        std::abs(size.z - h) > 1e-4 * h)
      throw refuse("the tetrahedra " + std::to_string(5 * v) + " to " + std::to_string(5 * v + 4) +
                   " fill no cube like the first");
    Constraint volume;
    volume.nodes = 8;
    volume.kind = TissueClass::volume;
    volume.stiffness = (lambda - mu) * h * h * h;
    for (const std::uint32_t p : corners) {
      std::size_t place = 0;
      for (std::size_t a = 0; a < 3; ++a) place |= (points[p][a] - lo[a] > 0.5 * h ? 1U : 0U) << a;
      volume.node[place] = p;
    }
    // Which split: the one whose first tetrahedron (the regular one) is among the five.
    for (std::uint32_t s = 0; s < 2; ++s) {
      std::array<std::uint32_t, 4> regular;
      for (std::size_t i = 0; i < 4; ++i)
        regular[i] = volume.node[static_cast<std::size_t>(tissue::kVoxelSplit[s][0][i])];
      std::sort(regular.begin(), regular.end());
      for (std::size_t t = 0; t < 5; ++t) {
        auto sorted = tets[5 * v + t];
        std::sort(sorted.begin(), sorted.end());
        if (sorted == regular) volume.voxel = s;
      }
    }
    volume.rest = 0;
    Vec3 place[8];
    for (std::size_t i = 0; i < 8; ++i) place[i] = points[volume.node[i]];
    for (const auto& t : tissue::kVoxelSplit[volume.voxel]) volume.rest += tet_volume(place, t, 8, nullptr, nullptr, 0);
    if (!(volume.rest > 0.99 * h * h * h)) throw refuse("its voxels are turned inside out");
    volumes.push_back(volume);
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> own;
    for (std::size_t t = 0; t < 5; ++t) {
      const auto& tet = tets[5 * v + t];
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = i + 1; j < 4; ++j) own[{std::min(tet[i], tet[j]), std::max(tet[i], tet[j])}] = true;
        std::array<std::uint32_t, 3> face{tet[(i + 1) % 4], tet[(i + 2) % 4], tet[(i + 3) % 4]};
        std::sort(face.begin(), face.end());
        areas[face] += 0.01 * mu * h * h * h;
      }
    }
    for (const auto& [edge, unused] : own) {
      const bool diagonal = length(points[edge.second] - points[edge.first]) > 1.2 * h;
      auto& k =
          edges.try_emplace(edge, 0.0, diagonal ? TissueClass::diagonal_edge : TissueClass::axis_edge).first->second;
      k.first += (diagonal ? 2.0 : 0.25) * mu * h * h * h;
    }
  }
  for (const auto& [edge, k] : edges) {
    Constraint c;
    c.node[0] = edge.first;
    c.node[1] = edge.second;
    c.kind = k.second;
    c.rest = length(points[edge.second] - points[edge.first]);
    c.stiffness = k.first;
    model.constraints_.push_back(c);
  }
  for (const auto& [face, k] : areas) {
    if (!faces) break;
    Constraint c;
    c.nodes = 3;
    for (std::size_t i = 0; i < 3; ++i) c.node[i] = face[i];
    c.kind = TissueClass::face;
    c.rest = 0.5 * length(cross(points[face[1]] - points[face[0]], points[face[2]] - points[face[0]]));
    c.stiffness = k;
    model.constraints_.push_back(c);
  }
  model.constraints_.insert(model.constraints_.end(), volumes.begin(), volumes.end());
  for (Constraint& c : model.constraints_) {
    model.base_.push_back(c.stiffness);
    if (c.kind == TissueClass::face) c.stiffness = 0;
  }
  return model;
}

TissueModel TissueModel::uniform(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets,
                                 double distance, double area, double volume) {
  TissueModel model;
  model.rest_.assign(points.begin(), points.end());
  model.tets_.assign(tets.begin(), tets.end());
  std::map<std::pair<std::uint32_t, std::uint32_t>, bool> edges;
  std::map<std::array<std::uint32_t, 3>, bool> areas;
  for (const auto& tet : tets) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (tet[i] >= points.size())
        throw Error(ExitCode::usage, "a tetrahedron names point " + std::to_string(tet[i]) + ", which is not there");
      for (std::size_t j = i + 1; j < 4; ++j) edges[{std::min(tet[i], tet[j]), std::max(tet[i], tet[j])}] = true;
      std::array<std::uint32_t, 3> face{tet[(i + 1) % 4], tet[(i + 2) % 4], tet[(i + 3) % 4]};
      std::sort(face.begin(), face.end());
      areas[face] = true;
    }
  }
  const auto push = [&](Constraint c, double k) {
    c.stiffness = k;
    model.constraints_.push_back(c);
    model.base_.push_back(k);
  };
  for (const auto& [edge, unused] : edges) {
    Constraint c;
    c.node[0] = edge.first;
    c.node[1] = edge.second;
    c.rest = length(points[edge.second] - points[edge.first]);
    push(c, distance);
  }
  for (const auto& [face, unused] : areas) {
    Constraint c;
    c.nodes = 3;
    c.kind = TissueClass::face;
    for (std::size_t i = 0; i < 3; ++i) c.node[i] = face[i];
    c.rest = 0.5 * length(cross(points[face[1]] - points[face[0]], points[face[2]] - points[face[0]]));
    push(c, area);
  }
  for (const auto& tet : tets) {
    Constraint c;
    c.nodes = 4;
    c.kind = TissueClass::volume;
    Vec3 x[4];
    for (std::size_t i = 0; i < 4; ++i) {
      c.node[i] = tet[i];
      x[i] = points[tet[i]];
    }
    c.rest = dot(x[1] - x[0], cross(x[2] - x[0], x[3] - x[0])) / 6;
    push(c, volume);
  }
  return model;
}

void TissueModel::scale(const std::array<double, kTissueClasses>& factors) {
  for (std::size_t c = 0; c < constraints_.size(); ++c)
    constraints_[c].stiffness = base_[c] * factors[static_cast<std::size_t>(constraints_[c].kind)];
}

void TissueModel::scale_each(std::span<const double> factors) {
  for (std::size_t c = 0; c < constraints_.size(); ++c) constraints_[c].stiffness = base_[c] * factors[c];
}

std::size_t TissueModel::inverted(std::span<const Vec3> x) const {
  std::size_t count = 0;
  for (const auto& t : tets_) {
    count += dot(x[t[1]] - x[t[0]], cross(x[t[2]] - x[t[0]], x[t[3]] - x[t[0]])) > 0 ? 0 : 1;
  }
  return count;
}

}  // namespace osteo::inline simulation
