#include "osteo/simulation/tissue/fem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "osteo/core/base/error.h"
#include "outer_faces.h"

namespace osteo::inline simulation {
namespace {

// The body's elements, then for each rigid thing one for each point of its surface, or of quadratic elements for each
// face. At corners of a quadratic face a pressure makes no force, so that points alone would let them lift off.
class Touching final : public Energy {
 public:
  Touching(const FemBody& body, const std::vector<RigidContact>& contacts) : body_(body), contacts_(contacts) {
    if (contacts.empty()) return;
    const std::vector<OuterFace> faces = outer_faces(body);
    for (const OuterFace face : faces) {
      const auto points = points_of(body, face);
      surface_.insert(surface_.end(), points.begin(), points.end());
      if (body.order() != TetOrder::t10) continue;
      const auto at = [&](std::size_t c) { return body.rest()[points[c]]; };
      faces_.push_back({{}, length(cross(at(1) - at(0), at(2) - at(0))) / 2});
      std::copy(points.begin(), points.end(), faces_.back().points.begin());
    }
    std::sort(surface_.begin(), surface_.end());
    surface_.erase(std::unique(surface_.begin(), surface_.end()), surface_.end());
    for (const RigidContact& by : contacts)
      stiffness_.push_back(by.stiffness_n_per_mm * (faces_.empty() ? 1 : points_per_mm2(body, faces, *by.shape)));
  }
  [[nodiscard]] std::size_t point_count() const override { return body_.point_count(); }
  [[nodiscard]] std::size_t element_count() const override { return body_.element_count() + each() * contacts_.size(); }
  [[nodiscard]] std::span<const std::uint32_t> nodes(std::size_t e) const override {
    if (e < body_.element_count()) return body_.nodes(e);
    const std::size_t n = (e - body_.element_count()) % each();
    return faces_.empty() ? std::span(&surface_[n], 1) : std::span<const std::uint32_t>(faces_[n].points);
  }
  double element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const override {
    if (e < body_.element_count()) return body_.element(e, x, gradient, hessian);
    const std::size_t n = (e - body_.element_count()) % each(), by = (e - body_.element_count()) / each();
    const std::size_t points = faces_.empty() ? 1 : kFacePoints;
    if (gradient != nullptr) std::fill(gradient, gradient + 3 * points, 0.0);
    if (hessian != nullptr) std::fill(hessian, hessian + 9 * points * points, 0.0);
    if (faces_.empty()) {
      constexpr double kOne = 1;
      return push(by, stiffness_[by], std::span(&kOne, 1), x, gradient, hessian);
    }
    double energy = 0;
    for_shares([&](std::span<const double> share, double weight) {
      energy += push(by, stiffness_[by] * weight * faces_[n].area_mm2, share, x, gradient, hessian);
    });
    return energy;
  }
  /// Points of the surface that are in one of the things; of quadratic faces those that stand for their parts.
  [[nodiscard]] std::uint64_t count(std::span<const Vec3> x) const {
    std::uint64_t count = 0;
    const auto look = [&](Vec3 at) {
      for (const RigidContact& by : contacts_) {
        Vec3 out{};
        count += by.shape->distance_mm(at, out) < 0 ? 1 : 0;
      }
    };
    for (const Face& face : faces_) {
      for_shares([&](std::span<const double> share, double) {
        Vec3 at{};
        for (std::size_t p = 0; p < kFacePoints; ++p) at += x[face.points[p]] * share[p];
        look(at);
      });
    }
    for (const std::uint32_t p : surface_) {
      if (faces_.empty()) look(x[p]);
    }
    return count;
  }

 private:
  static constexpr std::size_t kFacePoints = 6;
  struct Face {
    std::array<std::uint32_t, kFacePoints> points;
    double area_mm2;
  };
  // Where a face is pushed: by the shares of its points there, and for which part of its area. In seven places, exact
  // for polynomials of degree five: D. Dunavant, Int. J. Numer. Meth. Eng. 21 (1985).
  template <class F>
  static void for_shares(const F& f) {
    const auto place = [&](double l0, double l1, double l2, double weight) {
      const double l[3] = {l0, l1, l2};
      std::array<double, kFacePoints> share;
      for (std::size_t c = 0; c < 3; ++c) {
        share[c] = l[c] * (2 * l[c] - 1);
        share[3 + c] = 4 * l[c] * l[(c + 1) % 3];
      }
      f(share, weight);
    };
    place(1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225);
    constexpr double kRule[2][2] = {{0.470142064105115, 0.132394152788506}, {0.101286507323456, 0.125939180544827}};
    for (const auto& [side, weight] : kRule) {
      place(1 - 2 * side, side, side, weight);
      place(side, 1 - 2 * side, side, weight);
      place(side, side, 1 - 2 * side, weight);
    }
  }
  [[nodiscard]] std::size_t each() const { return faces_.empty() ? surface_.size() : faces_.size(); }

  // By a spring at the mean of the points by their shares.
  double push(std::size_t by, double k, std::span<const double> share, const Vec3* x, double* gradient,
              double* hessian) const {
    Vec3 at{}, out{};
    for (std::size_t p = 0; p < share.size(); ++p) at += x[p] * share[p];
    const double depth = contacts_[by].shape->distance_mm(at, out);
    if (!(depth < 0)) return 0;
    const std::size_t row = 3 * share.size();
    for (std::size_t i = 0; i < row; ++i) {
      const double own = share[i / 3] * out[i % 3];
      if (gradient != nullptr) gradient[i] += k * depth * own;
      for (std::size_t j = 0; j < row && hessian != nullptr; ++j)
        hessian[row * i + j] += k * own * share[j / 3] * out[j % 3];
    }
    return 0.5 * k * depth * depth;
  }

  const FemBody& body_;
  const std::vector<RigidContact>& contacts_;
  std::vector<std::uint32_t> surface_;
  std::vector<Face> faces_;        // of t10
  std::vector<double> stiffness_;  // of each contact: N/mm a point, or MPa a mm of depth
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
      // Forces count as small by those at the start. Of what starts deep in something stiff these are a thousand times
      // those at rest: so once more from there.
      if (result.converged && !load.contacts.empty()) {
        Equilibrium again = solver.solve(energy, result.points_mm, forces, options, context);
        iterations += again.iterations;
        factorisations += again.factorisations;
        if (again.converged) static_cast<Equilibrium&>(result) = std::move(again);
      }
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
    const auto nodes = energy.nodes(e);
    Vec3 local[Energy::kMaxNodes];
    double push[3 * Energy::kMaxNodes];
    for (std::size_t n = 0; n < nodes.size(); ++n) local[n] = result.points_mm[nodes[n]];
    if (energy.element(e, local, push, nullptr) == 0) continue;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      for (std::size_t a = 0; a < 3; ++a) {
        result.contact_n[a] -= push[3 * n + a];
        result.reaction_n[a] += (held[nodes[n]] >> a & 1) != 0 ? push[3 * n + a] : 0;  // goes straight to what holds it
      }
    }
  }
  result.touching = touching.count(result.points_mm);
  return result;
}

}  // namespace osteo::inline simulation
