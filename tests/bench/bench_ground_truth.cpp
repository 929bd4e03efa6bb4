// Haptic renderers against solids of which everything is known: the tables of docs/validation/ground-truth.md, and the
// files beside them.
#include <cstdio>

#include "bench.h"
#include "folders.h"
#include "osteo/assessment/ground_truth/experiments.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/surface_io.h"

namespace osteo {

void bench_ground_truth(const Context& context) {
  truth::GroundTruthOptions o;
  // A real bone, where one is at hand.
  const std::filesystem::path bone = shared_data() / "meshes_bone" / "sofa_malleus.obj";
  if (std::filesystem::exists(bone)) {
    try {
      o.bone = soup_of(*load_surface(bone));
    } catch (const Error& e) {
      std::printf("No real bone: %s\n", e.what());
    }
  }
  const truth::GroundTruthResult r = truth::run_ground_truth(o, context);
  std::filesystem::create_directories("out");
  truth::write_ground_truth(r, o, "out/ground-truth", true);
  std::printf("%s", truth::markdown_of(r).c_str());
  truth::GroundTruthResult costs;
  costs.tables = r.costs;
  std::printf("%s", truth::markdown_of(costs).c_str());
}

}  // namespace osteo
