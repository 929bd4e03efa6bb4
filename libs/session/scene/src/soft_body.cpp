#include "osteo/session/scene/detail/soft_body.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "osteo/geometry/tets/skin.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "osteo/simulation/tissue/problem.h"
#include "osteo/simulation/tissue/voxel_cutting.h"
#include "rigid_shapes.h"

namespace osteo::inline session {
namespace {

constexpr int kMaxSteps = 400;          // of an update: beside SoftBody::kMaxWork
constexpr double kToolStiffness = 0.1;  // N/mm of each place that the tool meets
constexpr double kBoneStiffness = 0.3;  // and of each point that meets bone
constexpr double kMinPushN = 1e-4;
constexpr double kFeltStiffness =
    0.05;  // N/mm for each place that the tool meets: in series with what gives way behind it
constexpr double kDampingPerS = 150;  // tissue does not ring
constexpr double kStepShare = 0.6;    // of the certified step, so that contact need not be softened
constexpr double kGrip = 1;           // of what does not turn: a surface does not slip round what has dug in
// Still: no point further than this from where it was so many updates ago. Then the bone is looked at once more, and it
// takes so many more.
constexpr double kStillMm = 1e-3;
constexpr int kStillUpdates = 50, kLastUpdates = 5;

std::array<std::uint32_t, 4> sorted(std::array<std::uint32_t, 4> t) {
  std::sort(t.begin(), t.end());
  return t;
}

}  // namespace

struct SoftBody::Impl {
  TetMesh mesh;  // what is left of it; its points at rest
  TissueModel model;
  TissueDynamics<float> dynamics;
  VoxelCutting cutting;
  // What is drawn: triangles over points of the skin (if there is one), then over points of the body.
  std::optional<Skin> skin;
  std::size_t skin_points = 0;
  TriMesh drawn;
  std::vector<std::uint32_t> point_of;                    // of the points after the skin's: point of the body
  TriMesh whole_skin;                                     // with all its triangles
  std::set<std::array<std::uint32_t, 3>> whole_boundary;  // faces outside before anything was cut; with a skin only
  std::uint64_t version = 1, updates = 0;
  double wanted_steps = 1;  // for an update in real time
  int steps = 1;            // of the last one
  Vec3 lo, hi;              // box around the points
  std::vector<Vec3> still_at;
  int still = 0;  // updates
  bool asleep = false;

  Impl(TissueModel m, const TissueProblem& problem, const TetMesh& of, const TriMesh* finer)
      : mesh(of),
        model(std::move(m)),
        dynamics(model, problem.fixed, {.density_kg_m3 = 1000, .damping_per_s = kDampingPerS, .step_share = kStepShare},
                 problem.sliders),
        cutting(model, volume_mm3(mesh) / (static_cast<double>(model.tets().size()) / 5)) {
    if (finer != nullptr) {
      skin.emplace(*finer, mesh);
      skin_points = finer->points_mm.size();
      whole_skin = *finer;
      whole_skin.normals.clear();
      drawn = whole_skin;
      for (const auto& face : faces_of(boundary_of(mesh, &point_of))) whole_boundary.insert(face);
      point_of.clear();
    } else {
      drawn = boundary_of(mesh, &point_of);
    }
    wanted_steps = 1 / kUpdatesPerS / dynamics.step_s();
    steps = steps_within(kMaxWork);
    still_at = dynamics.positions_mm();
    box_in(still_at);
  }

  [[nodiscard]] int steps_within(double work) const {
    const double most = std::min<double>(kMaxSteps, work / static_cast<double>(model.tets().size()));
    return static_cast<int>(std::max(1.0, std::round(std::min(wanted_steps, most))));
  }
  void box_in(std::span<const Vec3> points) {
    lo = {1e300, 1e300, 1e300};
    hi = {-1e300, -1e300, -1e300};
    for (const Vec3& p : points) {
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], p[a]);
        hi[a] = std::max(hi[a], p[a]);
      }
    }
  }
  // A place that is no number is not near.
  [[nodiscard]] bool near(const RigidShape::Ball& ball) const {
    Vec3 off;
    for (std::size_t a = 0; a < 3; ++a) off[a] = std::max({lo[a] - ball.centre_mm[a], 0.0, ball.centre_mm[a] - hi[a]});
    return std::isfinite(dot(ball.centre_mm, ball.centre_mm)) && length(off) <= ball.radius_mm + kNearMm;
  }
  void rest_or_not(bool disturbed);

  // Triangles by the body's points, sorted.
  [[nodiscard]] std::vector<std::array<std::uint32_t, 3>> faces_of(const TriMesh& surface) const {
    std::vector<std::array<std::uint32_t, 3>> faces;
    for (const auto& t : surface.triangles) {
      std::array<std::uint32_t, 3> f{point_of[t[0]], point_of[t[1]], point_of[t[2]]};
      std::sort(f.begin(), f.end());
      faces.push_back(f);
    }
    return faces;
  }

  void lay_surface();
};

void SoftBody::Impl::lay_surface() {
  ++version;
  mesh.tets.clear();
  std::set<std::array<std::uint32_t, 4>> left;
  for (std::size_t t = 0; t < cutting.gone().size(); ++t) {
    if (cutting.gone()[t]) continue;
    mesh.tets.push_back(model.tets()[t]);
    if (skin) left.insert(sorted(model.tets()[t]));
  }
  const TriMesh boundary = boundary_of(mesh, &point_of);
  if (!skin) {
    drawn = boundary;
    return;
  }
  // Of the skin what hangs on tetrahedra that are left; and the faces that the cut opened.
  drawn.triangles.clear();
  for (const auto& t : whole_skin.triangles) {
    if (std::all_of(t.begin(), t.end(), [&](std::uint32_t p) { return left.contains(sorted(skin->corners(p))); }))
      drawn.triangles.push_back(t);
  }
  const auto faces = faces_of(boundary);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (whole_boundary.contains(faces[f])) continue;
    auto t = boundary.triangles[f];
    for (std::uint32_t& p : t) p += static_cast<std::uint32_t>(skin_points);
    drawn.triangles.push_back(t);
  }
  drawn.points_mm.resize(skin_points + point_of.size());
}

SoftBody::SoftBody(const TetMesh& mesh, std::string_view problem_json, const std::optional<std::string>& constants_json,
                   const TriMesh* skin) {
  const TissueProblem problem = parse_tissue_problem(problem_json, mesh, false);
  impl_ = std::make_unique<Impl>(model_of_problem(mesh, problem, constants_json), problem, mesh, skin);
}
SoftBody::~SoftBody() = default;

void SoftBody::meet(const World* world) {
  impl_->dynamics.set_obstacle({world != nullptr ? std::make_shared<LiveBone>(*world) : nullptr, kBoneStiffness});
  wake();
}

std::vector<SoftPush> SoftBody::update(std::span<const SoftTool> tools, double most_work) {
  Impl& m = *impl_;
  std::vector<SoftPush> pushes(tools.size());
  if (sleeps_with(tools)) return pushes;
  if (m.asleep) wake();
  m.steps = m.steps_within(most_work);
  bool disturbed = false;
  std::vector<std::shared_ptr<const ToolShape>> shapes;
  for (std::size_t n = 0; n < tools.size(); ++n) {
    auto shape = std::make_shared<const ToolShape>(instrument_of(tools[n].tool).head, tools[n].at_mm, tools[n].axis);
    if (m.near(shape->bounds())) {
      disturbed = true;
      m.dynamics.set_tool({shape, kToolStiffness, tools[n].turns ? 0 : kGrip}, n);
    } else {
      m.dynamics.set_tool({}, n);
    }
    shapes.push_back(std::move(shape));
  }
  m.dynamics.step(m.steps);
  ++m.updates;
  for (std::size_t n = 0; n < tools.size(); ++n) {
    const Vec3 force = m.dynamics.force_on_tool_n(n);
    if (!(length(force) > kMinPushN)) continue;
    pushes[n] = {force, kFeltStiffness * std::max(1, m.dynamics.met_by_tool(n))};
  }
  bool cut = false;
  for (std::size_t n = 0; n < tools.size(); ++n) {
    const Burr* const edge = instrument_of(tools[n].tool).cutter();
    const double size = length(pushes[n].force_n);
    if (edge == nullptr || !tools[n].turns || !(size > 0)) continue;
    cut = m.cutting.cut(m.dynamics, *shapes[n],
                        VoxelCutting::rate_mm3_per_s(size, edge->rate_mm3_per_s_per_n) / kUpdatesPerS, n) ||
          cut;
  }
  if (cut) m.lay_surface();
  m.rest_or_not(disturbed);
  return pushes;
}

void SoftBody::Impl::rest_or_not(bool disturbed) {
  const std::vector<Vec3> now = dynamics.positions_mm();
  box_in(now);
  bool moved = disturbed;
  for (std::size_t p = 0; p < now.size() && !moved; ++p) moved = !(length(now[p] - still_at[p]) <= kStillMm);
  if (moved) {
    still = 0;
    still_at = now;
    return;
  }
  // What it lies on is looked at only now and then: it does not fall asleep on what is gone.
  if (++still == kStillUpdates) dynamics.look_at_obstacle();
  asleep = still >= kStillUpdates + kLastUpdates;
}

bool SoftBody::sleeps_with(std::span<const SoftTool> tools) const {
  return impl_->asleep && std::none_of(tools.begin(), tools.end(), [&](const SoftTool& t) {
           return impl_->near(ToolShape(instrument_of(t.tool).head, t.at_mm, t.axis).bounds());
         });
}

void SoftBody::wake() {
  Impl& m = *impl_;
  if (m.asleep) m.dynamics.look_at_obstacle();
  m.asleep = false;
  m.still = 0;
}

void SoftBody::wake_near(Vec3 at_mm, std::uint8_t tool) {
  const RoundCone& head = instrument_of(tool).head;
  // Whichever way it is held.
  if (impl_->near({at_mm, std::abs(head.start_mm) + head.length_mm + head.largest_radius_mm()})) wake();
}

bool SoftBody::asleep() const {
  return impl_->asleep;
}
double SoftBody::work() const {
  return std::min<double>(impl_->wanted_steps, kMaxSteps) * static_cast<double>(impl_->model.tets().size());
}
std::vector<Vec3> SoftBody::points_mm() const {
  return impl_->dynamics.positions_mm();
}
const TriMesh& SoftBody::drawn() {
  Impl& m = *impl_;
  const auto x = m.dynamics.positions_mm();
  if (m.skin) {
    std::vector<std::array<float, 3>> at(x.size());
    for (std::size_t p = 0; p < x.size(); ++p) at[p] = to_floats(x[p]);
    m.skin->apply(at, std::span(m.drawn.points_mm.data(), m.skin_points));
  }
  for (std::size_t p = 0; p < m.point_of.size(); ++p)
    m.drawn.points_mm[m.skin_points + p] = to_floats(x[m.point_of[p]]);
  return m.drawn;
}
std::uint64_t SoftBody::version() const {
  return impl_->version;
}
std::uint64_t SoftBody::updates() const {
  return impl_->updates;
}
double SoftBody::cut_off_mm3() const {
  return impl_->cutting.cut_mm3();
}
double SoftBody::slow_motion() const {
  return std::min(1.0, impl_->steps * impl_->dynamics.step_s() * kUpdatesPerS);
}
std::size_t SoftBody::memory_bytes() const {
  return impl_->model.element_count() * (sizeof(TissueModel::Constraint) + 40) + impl_->model.point_count() * 100;
}

}  // namespace osteo::inline session
