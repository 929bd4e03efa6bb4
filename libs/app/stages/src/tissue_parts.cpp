#include "tissue_parts.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"

namespace osteo::inline app::tissue {
namespace {

constexpr std::size_t kManyTets = 60'000;  // quadratic elements of more take minutes and gigabytes
constexpr double kSafePoisson = 0.4;       // above, linear elements lock

}  // namespace

Elements elements_for(LawChoice law, OrderChoice order, const TissueProblem& problem, const TetMesh& mesh) {
  Elements t{law == LawChoice::automatic ? problem.law.value_or(ElasticLaw::neo_hooke)
                                         : static_cast<ElasticLaw>(static_cast<int>(law) - 1),
             order == OrderChoice::t4        ? TetOrder::t4
             : order == OrderChoice::t4_mean ? TetOrder::t4_mean
                                             : TetOrder::t10,
             "asked for"};
  if (order != OrderChoice::automatic) return t;
  double poisson = 0;
  for (const Material& m : problem.materials) poisson = std::max(poisson, m.poisson);
  if (problem.order) {
    t.order = *problem.order;
    t.because = "as the problem says";
    if (t.order == TetOrder::t4 && poisson > kSafePoisson)
      t.because += "; linear tetrahedra lock at a Poisson's ratio of " + format_number(poisson);
  } else if (mesh.tets.size() > kManyTets && poisson <= kSafePoisson) {
    t.order = TetOrder::t4;
    t.because = std::to_string(mesh.tets.size()) + " tetrahedra, and none locks at a Poisson's ratio of " +
                format_number(poisson) + ": linear ones";
  } else {
    t.because = poisson > kSafePoisson ? "linear tetrahedra lock at a Poisson's ratio of " + format_number(poisson)
                                       : "linear tetrahedra bend too little";
  }
  return t;
}

std::string_view name_of(ElasticLaw law) {
  return EnumNames<LawChoice>::values[static_cast<std::size_t>(law) + 1];
}
std::string_view name_of(TetOrder order) {
  return order == TetOrder::t4 ? "t4" : order == TetOrder::t4_mean ? "t4_mean" : "t10";
}

std::size_t load_named(const TissueProblem& problem, const std::string& name) {
  if (name.empty()) return 0;
  std::string names;
  for (std::size_t n = 0; n < problem.load_names.size(); ++n) {
    if (problem.load_names[n] == name) return n;
    names += (n > 0 ? ", " : "") + problem.load_names[n];
  }
  throw Error(ExitCode::usage, "there is no load '" + name + "'", "the loads are: " + names);
}

Tets moved_mesh(const TetMesh& mesh, std::span<const Vec3> x) {
  TetMesh moved;
  moved.points_mm.resize(mesh.points_mm.size());
  for (std::size_t p = 0; p < moved.points_mm.size(); ++p) moved.points_mm[p] = to_floats(x[p]);
  moved.tets.resize(mesh.tets.size());
  std::copy(mesh.tets.begin(), mesh.tets.end(), moved.tets.begin());
  return std::make_shared<const TetMesh>(std::move(moved));
}

Json displacement(std::span<const Vec3> rest, std::span<const Vec3> x) {
  double most = 0, sum = 0;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const double d = length(x[p] - rest[p]);
    most = std::max(most, d);
    sum += d * d;
  }
  return {{"rms_mm", std::sqrt(sum / static_cast<double>(rest.size()))}, {"largest_mm", most}};
}

Error not_at_rest(const Equilibrium& r, const std::string& advice) {
  return Error(ExitCode::failed, "the body does not come to rest: " + r.why, advice);
}

std::string written(const Json& j) {
  return j.dump(1) + "\n";
}

}  // namespace osteo::inline app::tissue
