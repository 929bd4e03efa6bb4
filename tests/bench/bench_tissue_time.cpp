// Steps in time of the fast model: how many, how far off, beside a peer; what resolution buys; skins.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>

#include "bench_tissue.h"
#include "mapped.h"
#include "osteo/core/base/simd.h"
#include "osteo/geometry/tets/skin.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "osteo/simulation/tissue/implicit.h"

namespace osteo::bench {
namespace {

// One Gauss-Seidel pass over edges and tetrahedra (M. Macklin et al., XPBD, 2016), in single precision, as its open
// implementations do it.
class Xpbd {
 public:
  Xpbd(const test::Block& b, const TissueModel& model, double dt) {
    for (const Vec3& p : b.points) x_.push_back(to_floats(p));
    std::vector<double> mass(b.points.size());
    for (const auto& t : b.tets) {
      const double v = dot(b.points[t[1]] - b.points[t[0]],
                           cross(b.points[t[2]] - b.points[t[0]], b.points[t[3]] - b.points[t[0]])) /
                       6;
      for (const std::uint32_t p : t) mass[p] += v * 1e-9 / 4;
      tets_.push_back({t, static_cast<float>(v), static_cast<float>(1 / (0.05 * v * dt * dt) * 1e-6)});
    }
    for (const double m : mass) w_.push_back(static_cast<float>(1 / m));
    for (const auto& c : model.constraints()) {
      if (c.nodes == 2)
        edges_.push_back({{c.node[0], c.node[1]},
                          static_cast<float>(c.rest),
                          static_cast<float>(c.rest * c.rest / (c.stiffness * dt * dt))});
    }
  }
  void iterate() {
    for (Edge& e : edges_) {
      auto &p = x_[e.node[0]], &q = x_[e.node[1]];
      const float d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]},
                  l = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const float s = -(l - e.rest) / (w_[e.node[0]] + w_[e.node[1]] + e.compliance) / l;
      for (std::size_t a = 0; a < 3; ++a) {
        p[a] -= w_[e.node[0]] * s * d[a];
        q[a] += w_[e.node[1]] * s * d[a];
      }
    }
    for (Tet& t : tets_) {
      const auto v = [&](int i) { return from_floats(x_[t.node[static_cast<std::size_t>(i)]]); };
      const Vec3 d1 = v(1) - v(0), d2 = v(2) - v(0), d3 = v(3) - v(0);
      const Vec3 g[4] = {(cross(d2, d3) + cross(d3, d1) + cross(d1, d2)) / -6, cross(d2, d3) / 6, cross(d3, d1) / 6,
                         cross(d1, d2) / 6};
      double sum = static_cast<double>(t.compliance);
      for (std::size_t i = 0; i < 4; ++i) sum += static_cast<double>(w_[t.node[i]]) * dot(g[i], g[i]);
      const double s = -(dot(d1, cross(d2, d3)) / 6 - static_cast<double>(t.rest)) / sum;
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t a = 0; a < 3; ++a)
          x_[t.node[i]][a] += static_cast<float>(s * static_cast<double>(w_[t.node[i]]) * g[i][a]);
    }
  }
  [[nodiscard]] float first() const { return x_[0][0]; }

 private:
  struct Edge {
    std::array<std::uint32_t, 2> node;
    float rest, compliance;
  };
  struct Tet {
    std::array<std::uint32_t, 4> node;
    float rest, compliance;
  };
  std::vector<std::array<float, 3>> x_;
  std::vector<float> w_;
  std::vector<Edge> edges_;
  std::vector<Tet> tets_;
};

// The thesis' own structure (section 5.4.1): each point gathers the forces of its edges, faces and tetrahedra,
// normalising as it goes; in single precision. Its forces as printed are not gradients, so here the right ones.
class Gathered {
 public:
  Gathered(const test::Block& b, const TissueModel& model) {
    for (const Vec3& p : b.points) x_.push_back(to_floats(p));
    f_.resize(x_.size());
    of_.resize(x_.size());
    for (const auto& c : model.constraints()) {
      for (std::uint32_t n = 0; n < c.nodes; ++n)
        of_[c.node[n]].push_back({static_cast<std::uint32_t>(all_.size()), n});
      all_.push_back({{c.node[0], c.node[1], c.node[2], c.node[3]},
                      c.nodes,
                      static_cast<float>(c.rest),
                      static_cast<float>(c.stiffness)});
    }
  }
  void step() {
    for (std::size_t p = 0; p < x_.size(); ++p) {
      V sum{};
      for (const auto& [c, own] : of_[p]) {
        const Constraint& k = all_[c];
        const auto at = [&](std::uint32_t n) { return V{x_[k.node[n]][0], x_[k.node[n]][1], x_[k.node[n]][2]}; };
        if (k.nodes == 2) {
          const V d = at(1 - own) - at(own);
          const float l = d.length();
          sum += d * (k.stiffness * (l / k.rest - 1) / (k.rest * l));
        } else if (k.nodes == 3) {
          const V a = at(own), b = at((own + 1) % 3), c2 = at((own + 2) % 3), n = (b - a).cross(c2 - a);
          const float twice = n.length();
          sum += n.cross(c2 - b) * (-k.stiffness * (0.5F * twice / k.rest - 1) * 0.5F / (k.rest * twice));
        } else {
          const V o = at(0), d1 = at(1) - o, d2 = at(2) - o, d3 = at(3) - o;
          const V g1 = d2.cross(d3), g2 = d3.cross(d1), g3 = d1.cross(d2);
          const float volume = d1.dot(g1) / 6;
          const V g = own == 0 ? (g1 + g2 + g3) * -1.0F : own == 1 ? g1 : own == 2 ? g2 : g3;
          sum += g * (-k.stiffness * (volume / k.rest - 1) / (6 * k.rest));
        }
      }
      f_[p] = sum;
    }
    for (std::size_t p = 0; p < x_.size(); ++p) {
      x_[p][0] += 1e-12F * f_[p].x;
      x_[p][1] += 1e-12F * f_[p].y;
      x_[p][2] += 1e-12F * f_[p].z;
    }
  }

 private:
  struct V {
    float x, y, z;
    V operator+(V o) const { return {x + o.x, y + o.y, z + o.z}; }
    V operator-(V o) const { return {x - o.x, y - o.y, z - o.z}; }
    V operator*(float s) const { return {x * s, y * s, z * s}; }
    V& operator+=(V o) { return *this = *this + o; }
    [[nodiscard]] float dot(V o) const { return x * o.x + y * o.y + z * o.z; }
    [[nodiscard]] V cross(V o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
    [[nodiscard]] float length() const { return std::sqrt(dot(*this)); }
  };
  struct Constraint {
    std::array<std::uint32_t, 4> node;
    std::uint8_t nodes;
    float rest, stiffness;
  };
  std::vector<std::array<float, 3>> x_;
  std::vector<V> f_;
  std::vector<Constraint> all_;
  std::vector<std::vector<std::array<std::uint32_t, 2>>>
      of_;  // of each point: constraints, and which of their nodes it is
};

void throughput() {
  std::printf(
      "### Steps in time, one core (%s), cubes of voxels\n\n| tetrahedra | certified step ms | closed form, float: "
      "tets/ms | steps/s | "
      "double | thesis' constraints (edges, faces, tetrahedra) in the same loops | thesis' structure (points gather) | "
      "one pass of XPBD "
      "|\n|---|---|---|---|---|---|---|---|\n",
      simd_name(simd()).data());
  for (const int n : {14, 22, 40}) {
    const auto b = test::block(n, n, n, 5);
    const Material m{0.1, 0.45};
    TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1), false);
    const TissueModel old = TissueModel::uniform(b.points, b.tets, 0.5, 0.2, 0.9);
    TissueDynamics<float> quick(model, {});
    TissueDynamics<double> exact(model, {});
    TissueDynamics<float> thesis(old, {});
    Gathered gathered(b, old);
    Xpbd xpbd(b, model, quick.step_s());
    const auto rate = [&](const std::function<void()>& f) {
      f();
      double best = 1e9;
      for (int r = 0; r < 5; ++r) {
        const double begin = now_s();
        for (int s = 0; s < 20; ++s) f();
        best = std::min(best, (now_s() - begin) / 20);
      }
      return static_cast<double>(b.tets.size()) / best / 1000;
    };
    const double own = rate([&] { quick.step(); });
    std::printf("| %zu | %.3f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f |\n", b.tets.size(), 1000 * quick.step_s(), own,
                own * 1000 / static_cast<double>(b.tets.size()), rate([&] { exact.step(); }),
                rate([&] { thesis.step(); }), rate([&] { gathered.step(); }), rate([&] { xpbd.iterate(); }));
  }
  std::printf("\n");
}

// A post, plucked: where it is after a tenth of a second, by steps of many lengths, against explicit ones of a fiftieth
// of the limit.
void time_steps() {
  const auto b = test::block(6, 6, 12, 5);
  std::vector<std::uint32_t> fixed;
  std::vector<std::pair<std::uint32_t, Vec3>> load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
    if (b.points[p].z > 59.9) load.push_back({p, {0.01, 0, 0}});
  }
  for (const double nu : {0.45, 0.499}) {
    const Material m{0.05, nu};
    TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1), false);
    constexpr double kEnd = 0.1;
    const auto explicit_run = [&](double share, double least) {
      TissueDynamics<double> d(
          model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 10, .step_share = share, .least_step_s = least});
      d.set_load(load);
      const double begin = now_s();
      d.step(static_cast<int>(std::lround(kEnd / d.step_s())));
      return std::tuple{d.positions_mm(), d.step_s(), now_s() - begin, d.counts().made_heavier};
    };
    const auto truth = std::get<0>(explicit_run(0.02, 0));
    std::printf(
        "### A plucked post of %zu tetrahedra, nu %.3f, after %.1f s\n\n| way | step ms | off | s a simulated second | "
        "|\n|---|---|---|---|---|\n",
        b.tets.size(), nu, kEnd);
    double certified = 0;
    for (const double share : {0.25, 0.5, 0.9}) {
      const auto [x, h, s, heavier] = explicit_run(share, 0);
      certified = h;
      std::printf("| explicit, %.2f of the limit | %.4f | %.2g | %.2f | |\n", share, 1000 * h,
                  calibration_error(b.points, x, truth).nrms, s / kEnd);
    }
    for (const double times : {2.0, 4.0}) {
      const auto [x, h, s, heavier] = explicit_run(0.9, times * certified);
      std::printf("| explicit, heavier | %.4f | %.2g | %.2f | %llu points made heavier |\n", 1000 * h,
                  calibration_error(b.points, x, truth).nrms, s / kEnd, static_cast<unsigned long long>(heavier));
    }
    for (const double ms : {0.25, 1.0, 4.0, 10.0}) {
      for (const int iterations : {1, 30}) {
        ImplicitDynamics d(model, fixed,
                           {.density_kg_m3 = 1000, .damping_per_s = 10, .step_s = ms / 1000, .iterations = iterations});
        d.set_load(load);
        const double begin = now_s();
        const int steps = static_cast<int>(std::lround(kEnd / d.step_s()));
        d.step(steps);
        std::printf("| implicit, %s | %.4f | %.2g | %.2f | %.1f iterations a step |\n",
                    iterations == 1 ? "one iteration" : "to its end", ms,
                    calibration_error(b.points, d.positions_mm(), truth).nrms, (now_s() - begin) / kEnd,
                    static_cast<double>(d.counts().iterations) / steps);
        std::fflush(stdout);
      }
    }
    std::printf("\n");
  }
}

// A cube held at its base, pushed and pressed on its whole top: its points on a grid of 4, against quadratic elements
// on one of 16.
void resolution() {
  struct Found {
    std::vector<Vec3> x;
    double seconds;
  };
  const Material m{0.1, 0.45};
  const auto solve = [&](int n, int kind) {
    const auto cube = test::mapped(n, n, n, [](Vec3 u) { return u * 200; });
    TissueLoad load = test::held(cube, [](Vec3 u) { return u.z == 0 ? 7 : 0; });
    test::load_faces(
        cube, [](Vec3 u) { return u.z == 1; },
        [](Vec3 area) {
          return Vec3{0.008, 0, -0.004} * length(area);
        },
        load);
    const double begin = now_s();
    Equilibrium r;
    if (kind == 0) {
      TissueModel model = TissueModel::of_voxels(cube.b.points, cube.b.tets, std::span(&m, 1), false);
      EquilibriumSolver solver(model, model.rest(), load);
      r = solver.solve(model, model.rest(), load.forces_n, {1e-8, 60, 1});
    } else {
      const FemBody body(cube.b.points, cube.b.tets, {m}, ElasticLaw::neo_hooke,
                         kind == 1 ? TetOrder::t4 : TetOrder::t10);
      const TissueLoad all = body.on_all_points(load);
      EquilibriumSolver solver(body, body.rest(), all);
      r = solver.solve(body, body.rest(), all.forces_n, {1e-8, 60, 2});
    }
    Found f{{}, now_s() - begin};
    for (std::size_t p = 0; p < cube.from.size(); ++p) {
      const Vec3 u = cube.from[p] * 4;
      if (u.x == std::floor(u.x) && u.y == std::floor(u.y) && u.z == std::floor(u.z)) f.x.push_back(r.points_mm[p]);
    }
    return f;
  };
  const Found truth = solve(16, 2);
  std::vector<Vec3> rest;
  for (int k = 0; k <= 4; ++k)
    for (int j = 0; j <= 4; ++j)
      for (int i = 0; i <= 4; ++i) rest.push_back(Vec3{i * 50.0, j * 50.0, k * 50.0});
  // Blocks number points as their voxels meet them.
  const auto in_order = [&](int n, const Found& f) {
    const auto cube = test::mapped(n, n, n, [](Vec3 u) { return u * 200; });
    std::vector<Vec3> x(rest.size());
    std::size_t next = 0;
    for (const Vec3& from : cube.from) {
      const Vec3 u = from * 4;
      if (u.x != std::floor(u.x) || u.y != std::floor(u.y) || u.z != std::floor(u.z)) continue;
      x[static_cast<std::size_t>(u.x + 5 * u.y + 25 * u.z + 0.5)] = f.x[next++];
    }
    return x;
  };
  const auto exact = in_order(16, truth);
  std::printf(
      "### Resolution: a cube under shear and pressure on its top, nu 0.45, off quadratic elements of 1/16 (%.0f "
      "s)\n\n| voxels along | "
      "tetrahedra | closed form | s | t4 | s | t10 | s |\n|---|---|---|---|---|---|---|---|\n",
      truth.seconds);
  for (const int n : {4, 8, 12, 16}) {
    std::printf("| %d | %d |", n, 5 * n * n * n);
    for (const int kind : {0, 1, 2}) {
      if (n == 16 && kind == 2) {
        std::printf(" | |");
        continue;
      }
      const Found f = solve(n, kind);
      std::printf(" %.4f | %.2f |", calibration_error(rest, in_order(n, f), exact).nrms, f.seconds);
      std::fflush(stdout);
    }
    std::printf("\n");
  }
  std::printf("\n");
}

// Points of a sphere's surface on a body of voxels.
void skins() {
  std::printf(
      "### Skinning in the loop, one core\n\n| tetrahedra | points of the surface | embedded ms | thesis' frames ms "
      "|\n|---|---|---|---|\n");
  const auto b = test::block(14, 14, 14, 5);
  TetMesh mesh;
  for (const Vec3& p : b.points) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : b.tets) mesh.tets.push_back(t);
  TriMesh surface;
  constexpr int kAround = 250, kUp = 104;
  for (int j = 0; j < kUp; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const double a = 2 * 3.14159265 * i / kAround, u = 3.14159265 * (j + 0.5) / kUp;
      surface.points_mm.push_back(to_floats(
          Vec3{35 + 33 * std::sin(u) * std::cos(a), 35 + 33 * std::sin(u) * std::sin(a), 35 + 33 * std::cos(u)}));
    }
  }
  for (std::uint32_t j = 0; j + 1 < kUp; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t p = j * kAround + i, q = j * kAround + (i + 1) % kAround;
      surface.triangles.push_back({p, p + kAround, q});
      surface.triangles.push_back({q, p + kAround, q + kAround});
    }
  }
  std::vector<std::array<float, 3>> at(mesh.points_mm.begin(), mesh.points_mm.end()), out(surface.points_mm.size());
  double ms[2];
  for (const SkinMethod method : {SkinMethod::embedded, SkinMethod::frames}) {
    const Skin skin(surface, mesh, {method, 5});
    double best = 1e9;
    for (int r = 0; r < 20; ++r) {
      const double begin = now_s();
      skin.apply(at, out);
      best = std::min(best, now_s() - begin);
    }
    ms[method == SkinMethod::embedded ? 0 : 1] = 1000 * best;
  }
  std::printf("| %zu | %zu | %.3f | %.3f |\n\n", b.tets.size(), surface.points_mm.size(), ms[0], ms[1]);
}

}  // namespace

void tissue_time() {
  throughput();
  time_steps();
  resolution();
  skins();
}

}  // namespace osteo::bench
