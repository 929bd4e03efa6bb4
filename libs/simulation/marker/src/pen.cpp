#include "osteo/simulation/marker/detail/pen.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/order.h"

namespace osteo::inline simulation {
namespace {

constexpr std::size_t kMinPoses = 20;
constexpr double kMinTiltDeg = 20;

struct PenFields {
  using Params = PenFields;
  int version = 1;
  Pen pen;
  std::array<double, 3> tip_mm{PenBody::kUsualTipMm.x, PenBody::kUsualTipMm.y, PenBody::kUsualTipMm.z};
  static void describe(PenFields& f, auto& visit) {
    visit({"osteotome_pen", "version of the format", "", 1, 1, true}, f.version);
    visit({"pen", "which print it carries", "", 1, PenBody::kMaxPens}, f.pen.pen);
    visit({"scale", "printed mm for a drawn one", "", 0.5, 2}, f.pen.scale);
    visit({"tip_mm", "tip of the pen, from the middle of the prism, z along the pen to its upper end", "mm", -500, 500,
           true},
          f.tip_mm);
    visit({"rms_mm", "how far the tip seemed to wander while the pen was turned on it (below 0: it was not)", "mm", -1,
           1000},
          f.pen.rms_mm);
  }
};

PivotFit solve(const std::vector<const RigidTransform*>& poses) {
  // R tip - pivot = -t, by normal equations of six unknowns.
  Eigen::Matrix<double, 6, 6> h = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> g = Eigen::Matrix<double, 6, 1>::Zero();
  for (const RigidTransform* p : poses) {
    Eigen::Matrix<double, 3, 6> a;
    for (int c = 0; c < 3; ++c) {
      const Vec3 column = p->rotation.column[static_cast<std::size_t>(c)];
      a.col(c) << column.x, column.y, column.z;
    }
    a.rightCols<3>() = -Eigen::Matrix3d::Identity();
    const Eigen::Vector3d t(p->shift_mm.x, p->shift_mm.y, p->shift_mm.z);
    h += a.transpose() * a;
    g -= a.transpose() * t;
  }
  const Eigen::Matrix<double, 6, 1> x = h.completeOrthogonalDecomposition().solve(g);
  PivotFit fit;
  fit.tip_mm = {x[0], x[1], x[2]};
  fit.pivot_mm = {x[3], x[4], x[5]};
  fit.poses = static_cast<int>(poses.size());
  double sum = 0;
  for (const RigidTransform* p : poses) {
    const double off = length((*p)(fit.tip_mm) - fit.pivot_mm);
    sum += off * off;
    fit.worst_mm = std::max(fit.worst_mm, off);
  }
  fit.rms_mm = std::sqrt(sum / static_cast<double>(poses.size()));
  return fit;
}

}  // namespace

Pen load_pen(const fs::path& path) {
  PenFields f;
  const JsonFile file(read_text(path), path.string());
  file.read(file.root(), "", fields_of<PenFields>(f));
  f.pen.tip_mm = {f.tip_mm[0], f.tip_mm[1], f.tip_mm[2]};
  return f.pen;
}

std::string pen_json(const Pen& p) {
  return Json{{"osteotome_pen", 1},
              {"pen", p.pen},
              {"scale", p.scale},
              {"tip_mm", std::vector<double>{p.tip_mm.x, p.tip_mm.y, p.tip_mm.z}},
              {"rms_mm", p.rms_mm}}
             .dump(2) +
         "\n";
}

PivotFit fit_pivot(std::span<const RigidTransform> all, double most_rms_mm) {
  if (all.size() < kMinPoses)
    throw Error(
        ExitCode::failed,
        "the pen was seen in " + std::to_string(all.size()) + " pictures; " + std::to_string(kMinPoses) + " are needed",
        "turn it on its tip for ten seconds, its markers towards the camera, in good light");
  double least = 1;
  for (const RigidTransform& a : all) {
    for (const RigidTransform& b : all) least = std::min(least, dot(a.rotation.column[2], b.rotation.column[2]));
  }
  const double tilt_deg = std::acos(std::clamp(least, -1.0, 1.0)) * 180 / std::numbers::pi;
  char text[200];
  if (tilt_deg < kMinTiltDeg) {
    std::snprintf(text, sizeof text, "the pen was tilted by %.0f degrees only; its tip cannot be found from that",
                  tilt_deg);
    throw Error(ExitCode::failed, text, "keep the tip in a small dent and lean the pen by 30 degrees to all sides");
  }
  std::vector<const RigidTransform*> poses;
  for (const RigidTransform& p : all) poses.push_back(&p);
  PivotFit fit = solve(poses);
  std::vector<double> off;
  for (const RigidTransform* p : poses) off.push_back(length((*p)(fit.tip_mm) - fit.pivot_mm));
  const double most = std::max(1e-9, 3 * upper_median(off));
  std::vector<const RigidTransform*> kept;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (off[i] <= most) kept.push_back(poses[i]);
  }
  if (kept.size() < poses.size() && kept.size() >= kMinPoses) {
    fit = solve(kept);
    fit.left_out = static_cast<int>(poses.size() - kept.size());
  }
  fit.tilt_deg = tilt_deg;
  if (fit.rms_mm > most_rms_mm) {
    std::snprintf(text, sizeof text, "the tip wandered by %.1f mm (RMS); at most %.1f are taken", fit.rms_mm,
                  most_rms_mm);
    throw Error(ExitCode::failed, text,
                "hold the tip in a small dent so that it does not slip, and turn the pen slowly");
  }
  return fit;
}

}  // namespace osteo::inline simulation
