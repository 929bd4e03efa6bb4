// osteo_bench [SUBJECT] [THREADS]
#include "bench.h"
#include "bench_subjects.h"

#include <cstdio>
#include <cstdlib>
#include <string>

namespace osteo {
namespace {

using Run = void (*)(const Context&);

#ifdef OSTEO_BENCH_GEOMETRY
constexpr Run kGeometry = bench_geometry;
#else
constexpr Run kGeometry = nullptr;  // needs CGAL, TetGen, Embree and nanoflann
#endif

constexpr std::array<Run, kBenchSubjects.size()> kRuns{
    bench_import,       bench_bone,          bench_haptics,      bench_operation, bench_tissue,
    bench_haptics_fuzz, bench_haptics_hands, bench_ground_truth, bench_removal,   bench_slices,
    bench_registration, bench_tutoring,      bench_network,      kGeometry};
// The order of the table.
static_assert(kBenchSubjects[0].name == "import" && kBenchSubjects[1].name == "bone" &&
              kBenchSubjects[2].name == "haptics" && kBenchSubjects[3].name == "operation" &&
              kBenchSubjects[4].name == "tissue" && kBenchSubjects[5].name == "haptics-fuzz" &&
              kBenchSubjects[6].name == "haptics-hands" && kBenchSubjects[7].name == "ground-truth" &&
              kBenchSubjects[8].name == "removal" && kBenchSubjects[9].name == "slices" &&
              kBenchSubjects[10].name == "registration" && kBenchSubjects[11].name == "tutoring" &&
              kBenchSubjects[12].name == "network" && kBenchSubjects[13].name == "geometry");

int run(const std::string& wanted, const Context& context) {
  bool known = wanted == "all";
  for (const BenchSubject& s : kBenchSubjects) known = known || s.name == wanted;
  if (!known) {
    std::fprintf(stderr, "osteo_bench: there is no subject '%s'; %s\n", wanted.c_str(), bench_subject_names().c_str());
    return 2;
  }
  for (std::size_t i = 0; i < kBenchSubjects.size(); ++i) {
    const BenchSubject& s = kBenchSubjects[i];
    if (wanted != s.name && !(wanted == "all" && s.in_all)) continue;
    if (kRuns[i] != nullptr) {
      kRuns[i](context);
    } else if (wanted == s.name) {
      std::fprintf(
          stderr,
          "osteo_bench: %s needs a build with CGAL and TetGen, and the packages libembree-dev and libnanoflann-dev\n",
          wanted.c_str());
      return 2;
    }
  }
  return 0;
}

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  osteo::Context context;
  context.threads = argc > 2 ? std::atoi(argv[2]) : 0;
  return osteo::run(argc > 1 ? argv[1] : "all", context);
}
