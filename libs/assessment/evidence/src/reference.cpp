#include "osteo/assessment/evidence/detail/reference.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/statistics/curves.h"

namespace osteo::inline assessment {

std::vector<ReferenceSession> load_reference(const std::filesystem::path& folder) {
  const JsonFile file(read_text(folder / "reference.json"), "reference.json");
  const std::vector<std::string> known{"osteotome_reference", "$schema", "about", "sessions"};
  file.require_format("osteotome_reference");
  file.allow(file.root(), "", known);
  std::vector<ReferenceSession> sessions;
  for (const JsonValue& v : file.list(file.need(file.root(), "", "sessions"), "sessions")) {
    ReferenceSession s;
    const std::string where = "session " + std::to_string(sessions.size() + 1);
    file.read(v, where, fields_of<ReferenceSession>(s));
    if (!std::filesystem::exists(folder / s.session / "stream.oss"))
      throw file.wrong(v, where + ": '" + s.session + "' is no session", "name folders beside reference.json");
    for (const ReferenceSession& o : sessions) {
      if (o.session == s.session) throw file.wrong(v, where + ": '" + s.session + "' is there twice");
      if (o.subject == s.subject && o.group != s.group)
        throw file.wrong(v, where + ": subject '" + s.subject + "' is in both groups");
    }
    sessions.push_back(std::move(s));
  }
  return sessions;
}

RegionScore score_region(const RemovedSet& session, std::span<const RemovedSet> experts,
                         std::span<const RemovedSet> novices) {
  struct Count {
    std::uint32_t experts = 0, novices = 0;
    bool here = false;
  };
  std::map<VoxelKey, Count> counts;
  for (const RemovedSet& s : experts)
    for (const VoxelKey v : s) ++counts[v].experts;
  for (const RemovedSet& s : novices)
    for (const VoxelKey v : s) ++counts[v].novices;
  for (const VoxelKey v : session) counts[v].here = true;
  RegionScore score;
  double sum = 0, squares = 0;
  const auto ne = static_cast<double>(experts.size()), nn = static_cast<double>(novices.size());
  for (const auto& [voxel, c] : counts) {
    const double pe = (c.experts + 1) / (ne + 2), pn = (c.novices + 1) / (nn + 2);
    const double gone = std::log(pe / pn), kept = std::log((1 - pe) / (1 - pn));
    score.log_ratio += c.here ? gone : kept;
    if (c.here) score.thesis += gone;
    const double w = std::abs(gone - kept);
    sum += w;
    squares += w * w;
  }
  if (squares > 0) {
    score.effective_voxels = sum * sum / squares;
    score.per_voxel = score.log_ratio / score.effective_voxels;
  }
  return score;
}

IsotonicQuantile::IsotonicQuantile(std::span<const Point> points, double q) {
  if (points.empty()) return;
  std::vector<double> step_mm, values;
  for (const Point& p : points) {
    step_mm.push_back(std::floor(p.distance_mm / kStepMm) * kStepMm);
    values.push_back(p.value);
  }
  const statistics::MonotoneCurve curve = statistics::isotonic_quantile(step_mm, values, q);
  for (std::size_t n = 0; n < curve.x.size(); ++n) steps_.push_back({curve.x[n], curve.y[n]});
}

double IsotonicQuantile::at(double distance_mm) const {
  if (steps_.empty()) return 0;
  const double step = std::floor(distance_mm / kStepMm) * kStepMm;
  const auto behind = std::upper_bound(steps_.begin(), steps_.end(), step + kStepMm / 2,
                                       [](double d, const Point& p) { return d < p.distance_mm; });
  return behind == steps_.begin() ? steps_.front().value : (behind - 1)->value;
}

}  // namespace osteo::inline assessment
