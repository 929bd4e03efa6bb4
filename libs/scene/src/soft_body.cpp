#include "osteo/scene/soft_body.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/bone/instrument.h"
#include "osteo/io/surface_io.h"
#include "osteo/io/tet_io.h"
#include "osteo/tets/skin.h"
#include "osteo/tissue/dynamics.h"
#include "osteo/tissue/problem.h"
#include "osteo/tissue/voxel_cutting.h"
#include "rigid_shapes.h"

namespace osteo {
namespace {

// An update stays within its hundredth of a second: so many steps, and so many steps times tetrahedra (4 to 10 ms of a core). Not measured
// here, or two runs of one script would differ.
constexpr int kMostSteps = 200;
constexpr double kMostTetSteps = 250'000;
constexpr double kToolStiffness = 0.1;   // N/mm of each place that the tool meets
constexpr double kBoneStiffness = 0.3;   // and of each point that meets bone
constexpr double kFeltStiffness = 0.05;  // N/mm for each place that the tool meets: in series with what gives way behind it
constexpr double kDampingPerS = 150;     // tissue does not ring
constexpr double kStepShare = 0.75;      // of the certified step, so that there is room for stiff contact

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
  std::uint64_t version = 1;
  int steps = 1;
  bool pushed = false;

  Impl(TissueModel m, const TissueProblem& problem, const TetMesh& of, const TriMesh* finer)
      : mesh(of),
        model(std::move(m)),
        dynamics(model, problem.fixed, {.density_kg_m3 = 1000, .damping_per_s = kDampingPerS, .step_share = kStepShare}, problem.sliders),
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
    const double wanted = 1 / kUpdatesPerS / dynamics.step_s();
    const double most = std::min<double>(kMostSteps, kMostTetSteps / static_cast<double>(model.tets().size()));
    steps = static_cast<int>(std::max(1.0, std::round(std::min(wanted, most))));
  }

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
}

std::optional<SceneAction> SoftBody::update(const SoftTool& tool) {
  Impl& m = *impl_;
  const Instrument& held = instrument_of(tool.tool);
  const auto shape = std::make_shared<ToolShape>(held.head, tool.at_mm, tool.axis);
  m.dynamics.set_tool({shape, kToolStiffness});
  const Vec3 force = m.dynamics.step(m.steps);
  const double size = length(force);
  const bool pushes = size > 1e-4;
  const double met = std::max(1, m.dynamics.met_by_tool());
  if (const Burr* const edge = held.cutter(); edge != nullptr && tool.turns && pushes) {
    if (m.cutting.cut(m.dynamics, *shape, VoxelCutting::rate_mm3_per_s(size, edge->rate_mm3_per_s_per_n) / kUpdatesPerS)) m.lay_surface();
  }
  if (!pushes && !m.pushed) return std::nullopt;
  m.pushed = pushes;
  if (!pushes) return SceneAction::soft_push(tool.at_mm, {}, 0, 0);
  return SceneAction::soft_push(tool.at_mm, force / size, size, kFeltStiffness * met);
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
  for (std::size_t p = 0; p < m.point_of.size(); ++p) m.drawn.points_mm[m.skin_points + p] = to_floats(x[m.point_of[p]]);
  return m.drawn;
}
std::uint64_t SoftBody::version() const {
  return impl_->version;
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

std::shared_ptr<SoftBody> soft_body_of(const std::filesystem::path& folder) {
  const auto mesh = folder / "tissue.vtu", problem = folder / "tissue.json", constants = folder / "tissue-constants.json",
             skin = folder / "tissue.ply";
  if (!std::filesystem::exists(mesh) && !std::filesystem::exists(problem)) return nullptr;
  if (!std::filesystem::exists(mesh) || !std::filesystem::exists(problem))
    throw Error(ExitCode::no_input, "the case lists soft tissue by halves: it needs tissue.vtu and tissue.json",
                "'osteo tetrahedralize --method grid' makes the first, docs/tissue.md describes the second");
  const Surface finer = std::filesystem::exists(skin) ? load_surface(skin) : nullptr;
  return std::make_shared<SoftBody>(*load_tets(mesh), read_text(problem),
                                    std::filesystem::exists(constants) ? std::optional(read_text(constants)) : std::nullopt, finer.get());
}

}  // namespace osteo
