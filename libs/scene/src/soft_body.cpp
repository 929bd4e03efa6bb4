#include "osteo/scene/soft_body.h"

#include <algorithm>
#include <cmath>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/io/tet_io.h"
#include "osteo/tissue/dynamics.h"
#include "osteo/tissue/problem.h"
#include "osteo/tissue/stages.h"

namespace osteo {
namespace {

constexpr int kMostSteps = 200;          // an update, so that it stays within its hundredth of a second
constexpr double kToolStiffness = 0.3;   // N/mm of each point that the tool meets
constexpr double kFeltStiffness = 0.15;  // N/mm for each of them: in series with what gives way behind it
constexpr double kDampingPerS = 60;

}  // namespace

struct SoftBody::Impl {
  TissueModel model;
  TissueDynamics<float> dynamics;
  TriMesh surface;
  std::vector<std::uint32_t> point_of;
  int steps = 1;
  bool pushed = false;

  Impl(TissueModel m, const TissueProblem& problem, const TetMesh& mesh)
      : model(std::move(m)), dynamics(model, problem.fixed, {.density_kg_m3 = 1000, .damping_per_s = kDampingPerS}, problem.sliders) {
    surface = boundary_of(mesh, &point_of);
    const double wanted = 1 / kUpdatesPerS / dynamics.step_s();
    steps = static_cast<int>(std::clamp(std::round(wanted), 1.0, double{kMostSteps}));
  }
};

SoftBody::SoftBody(const TetMesh& mesh, std::string_view problem_json, const std::optional<std::string>& constants_json) {
  const TissueProblem problem = parse_tissue_problem(problem_json, mesh, false);
  impl_ = std::make_unique<Impl>(model_of_problem(mesh, problem, constants_json), problem, mesh);
}
SoftBody::~SoftBody() = default;

std::optional<SceneAction> SoftBody::update(Vec3 tool_mm, double radius_mm) {
  Impl& m = *impl_;
  m.dynamics.set_tool({std::make_shared<BallShape>(tool_mm, radius_mm), kToolStiffness});
  const Vec3 force = m.dynamics.step(m.steps);
  const double size = length(force);
  const bool pushes = size > 1e-4;
  if (!pushes && !m.pushed) return std::nullopt;
  m.pushed = pushes;
  if (!pushes) return SceneAction::yield(tool_mm, {}, 0, 0);
  const double met = std::max(1, m.dynamics.met_by_tool());
  return SceneAction::yield(tool_mm, force / size, size, kFeltStiffness * met);
}

std::vector<Vec3> SoftBody::points_mm() const {
  return impl_->dynamics.positions_mm();
}
const TriMesh& SoftBody::surface() const {
  return impl_->surface;
}
std::span<const std::uint32_t> SoftBody::points_of_surface() const {
  return impl_->point_of;
}
double SoftBody::slow_motion() const {
  return std::min(1.0, impl_->steps * impl_->dynamics.step_s() * kUpdatesPerS);
}
std::size_t SoftBody::memory_bytes() const {
  return impl_->model.element_count() * (sizeof(TissueModel::Constraint) + 40) + impl_->model.point_count() * 100;
}

std::shared_ptr<SoftBody> soft_body_of(const std::filesystem::path& folder) {
  const auto mesh = folder / "tissue.vtu", problem = folder / "tissue.json", constants = folder / "tissue-constants.json";
  if (!std::filesystem::exists(mesh) && !std::filesystem::exists(problem)) return nullptr;
  if (!std::filesystem::exists(mesh) || !std::filesystem::exists(problem))
    throw Error(ExitCode::no_input, "the case lists soft tissue by halves: it needs tissue.vtu and tissue.json",
                "'osteo tetrahedralize --method grid' makes the first, docs/tissue.md describes the second");
  return std::make_shared<SoftBody>(*load_tets(mesh), read_text(problem),
                                    std::filesystem::exists(constants) ? std::optional(read_text(constants)) : std::nullopt);
}

}  // namespace osteo
