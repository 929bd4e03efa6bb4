#include "osteo/simulation/tissue/fem.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "tet_faces.h"

namespace osteo::inline simulation {
namespace {

// The body's elements, then one for each point of its surface and each rigid thing.
class Touching final : public Energy {
 public:
  Touching(const FemBody& body, const std::vector<RigidContact>& contacts) : body_(body), contacts_(contacts) {
    if (contacts.empty()) return;
    // Corners of faces that one tetrahedron has, and what lies between two of them.
    std::vector<std::array<std::uint32_t, 3>> faces;
    for (std::size_t e = 0; e < body.tet_count(); ++e) {
      const auto n = body.nodes(e);
      for (const auto& f : kTetFaces) {
        faces.push_back({n[f[0]], n[f[1]], n[f[2]]});
        std::sort(faces.back().begin(), faces.back().end());
      }
    }
    std::sort(faces.begin(), faces.end());
    std::vector<bool> on(body.corner_count());
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
      for (j = i + 1; j < faces.size() && faces[j] == faces[i];) ++j;
      if (j - i != 1) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        on[faces[i][c]] = true;
        edges.push_back({std::min(faces[i][c], faces[i][(c + 1) % 3]), std::max(faces[i][c], faces[i][(c + 1) % 3])});
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::uint32_t p = 0; p < on.size(); ++p) {
      if (on[p]) surface_.push_back(p);
    }
    constexpr std::size_t kEnds[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};  // of C3D10
    for (std::size_t e = 0; e < body.tet_count() && body.order() == TetOrder::t10; ++e) {
      const auto n = body.nodes(e);
      for (std::size_t k = 0; k < 6; ++k) {
        const std::array<std::uint32_t, 2> edge{std::min(n[kEnds[k][0]], n[kEnds[k][1]]),
                                                std::max(n[kEnds[k][0]], n[kEnds[k][1]])};
        if (std::binary_search(edges.begin(), edges.end(), edge)) surface_.push_back(n[4 + k]);
      }
    }
    std::sort(surface_.begin(), surface_.end());
    surface_.erase(std::unique(surface_.begin(), surface_.end()), surface_.end());
  }
  [[nodiscard]] std::size_t point_count() const override { return body_.point_count(); }
  [[nodiscard]] std::size_t element_count() const override {
    return body_.element_count() + surface_.size() * contacts_.size();
  }
  [[nodiscard]] std::span<const std::uint32_t> nodes(std::size_t e) const override {
    return e < body_.element_count() ? body_.nodes(e)
                                     : std::span(&surface_[(e - body_.element_count()) % surface_.size()], 1);
  }
  double element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const override {
    if (e < body_.element_count()) return body_.element(e, x, gradient, hessian);
    if (gradient != nullptr) std::fill(gradient, gradient + 3, 0.0);
    if (hessian != nullptr) std::fill(hessian, hessian + 9, 0.0);
    const RigidContact& by = contacts_[(e - body_.element_count()) / surface_.size()];
    Vec3 out{};
    const double depth = by.shape->distance_mm(x[0], out);
    if (!(depth < 0)) return 0;
    const double k = by.stiffness_n_per_mm;
    for (std::size_t a = 0; a < 3; ++a) {
      if (gradient != nullptr) gradient[a] = k * depth * out[a];
      for (std::size_t b = 0; b < 3 && hessian != nullptr; ++b) hessian[3 * a + b] = k * out[a] * out[b];
    }
    return 0.5 * k * depth * depth;
  }

 private:
  const FemBody& body_;
  const std::vector<RigidContact>& contacts_;
  std::vector<std::uint32_t> surface_;
};

}  // namespace

Statics statics(const FemBody& body, const TissueLoad& load, const EquilibriumOptions& options,
                const Context& context) {
  for (const TissueLoad::Moved& m : load.moved) {
    if (m.point >= body.point_count() || !std::isfinite(dot(m.by_mm, m.by_mm)))
      throw Error(ExitCode::usage,
                  "a movement of point " + std::to_string(m.point) + " is not finite, or there is no such point");
  }
  if (length(load.gravity_m_s2) > 0)
    throw Error(ExitCode::unspecified,
                "gravity that is kept apart is for files; what solves wants it among the forces");
  const Touching touching(body, load.contacts);
  const Energy& energy = load.contacts.empty() ? static_cast<const Energy&>(body) : touching;
  // What touches something is not held by it.
  std::vector<Slider> sliders = load.sliders;
  for (const TissueLoad::Moved& m : load.moved) sliders.push_back({m.point, m.held});
  if (!load.contacts.empty()) require_held(body, body.rest(), load.fixed, sliders);
  EquilibriumSolver solver(energy, body.rest(), load);
  const std::vector<Vec3>& rest = body.rest();
  std::vector<Vec3> whole(rest.size());  // how everything moves with what is moved, for small movements
  if (!load.moved.empty()) {
    std::vector<Vec3> start = rest;
    for (const TissueLoad::Moved& m : load.moved) {
      for (std::size_t a = 0; a < 3; ++a) start[m.point][a] += (m.held >> a & 1) != 0 ? m.by_mm[a] : 0;
    }
    std::vector<std::array<std::uint32_t, 4>> tets;
    for (std::size_t e = 0; e < body.tet_count(); ++e)
      tets.push_back({body.nodes(e)[0], body.nodes(e)[1], body.nodes(e)[2], body.nodes(e)[3]});
    const FemBody small({rest.data(), body.corner_count()}, tets, body.materials(), ElasticLaw::linear, body.order());
    const Equilibrium r = EquilibriumSolver(small, rest, load).solve(small, start, {}, {}, context);
    for (std::size_t p = 0; p < rest.size(); ++p) whole[p] = (r.converged ? r.points_mm[p] : start[p]) - rest[p];
  }
  Statics result;
  for (const int steps : {1, 4, 16, 64}) {
    std::vector<Vec3> x = rest;
    bool rests = true;
    int iterations = 0, factorisations = 0;
    for (int s = 1; s <= steps && rests; ++s) {
      std::vector<std::pair<std::uint32_t, Vec3>> forces = load.forces_n;
      for (auto& [p, f] : forces) f = f * (static_cast<double>(s) / steps);
      for (std::size_t p = 0; p < x.size(); ++p) x[p] += whole[p] / steps;
      // Held places to the bit.
      for (const TissueLoad::Moved& m : load.moved) {
        for (std::size_t a = 0; a < 3; ++a) {
          if ((m.held >> a & 1) != 0) x[m.point][a] = rest[m.point][a] + m.by_mm[a] * s / steps;
        }
      }
      static_cast<Equilibrium&>(result) = solver.solve(energy, x, forces, options, context);
      iterations += result.iterations;
      factorisations += result.factorisations;
      rests = result.converged;
      x = result.points_mm;
    }
    result.iterations = iterations;
    result.factorisations = factorisations;
    if (rests || (load.moved.empty() && load.contacts.empty())) break;
  }
  std::vector<Vec3> g(rest.size());
  total_gradient(body, result.points_mm, g);
  std::vector<std::uint8_t> held(rest.size());
  for (const std::uint32_t p : load.fixed) held[p] = 7;
  for (const Slider& s : sliders) held[s.point] = static_cast<std::uint8_t>(held[s.point] | s.held);
  for (std::size_t p = 0; p < rest.size(); ++p) {
    for (std::size_t a = 0; a < 3; ++a) result.reaction_n[a] += (held[p] >> a & 1) != 0 ? g[p][a] : 0;
  }
  // What acts on held points goes straight to what holds them.
  for (const auto& [p, f] : load.forces_n) {
    for (std::size_t a = 0; a < 3; ++a) result.reaction_n[a] -= (held[p] >> a & 1) != 0 ? f[a] : 0;
  }
  for (std::size_t e = body.element_count(); e < energy.element_count(); ++e) {
    double push[3];
    if (energy.element(e, &result.points_mm[energy.nodes(e)[0]], push, nullptr) == 0) continue;
    ++result.touching;
    result.contact_n -= Vec3{push[0], push[1], push[2]};
  }
  return result;
}

}  // namespace osteo::inline simulation
