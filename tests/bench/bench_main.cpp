// osteo_bench [SUBJECT] [THREADS]
#include <cstdio>
#include <cstdlib>
#include <string>

#include "bench.h"

int main(int argc, char** argv) {
  const std::string subject = argc > 1 ? argv[1] : "all";
  osteo::Context context;
  context.threads = argc > 2 ? std::atoi(argv[2]) : 0;
  // Import first: it measures in processes of its own, which must start before any thread does.
  if (subject == "import" || subject == "all") osteo::bench_import(context);
  if (subject == "bone" || subject == "all") osteo::bench_bone(context);
  if (subject == "haptics" || subject == "all") osteo::bench_haptics(context);
  if (subject == "operation" || subject == "all") osteo::bench_operation(context);
  if (subject == "tissue" || subject == "all") osteo::bench_tissue(context);
  if (subject == "haptics-hands") osteo::bench_haptics_hands(context);
  if (subject == "haptics-fuzz") osteo::bench_haptics_fuzz(context);
  if (subject == "removal" || subject == "all") osteo::bench_removal(context);
#ifdef OSTEO_BENCH_GEOMETRY
  if (subject == "geometry" || subject == "all") osteo::bench_geometry(context);
#else
  if (subject == "geometry") {
    std::fprintf(stderr, "osteo_bench: geometry needs a build with CGAL and TetGen, and the packages libembree-dev and libnanoflann-dev\n");
    return 2;
  }
#endif
  if (subject != "all" && subject != "import" && subject != "bone" && subject != "geometry" && subject != "haptics" &&
      subject != "operation" && subject != "tissue" && subject != "haptics-fuzz" && subject != "haptics-hands" && subject != "removal") {
    std::fprintf(stderr,
                 "osteo_bench: there is no subject '%s'; all, bone, geometry, haptics, haptics-fuzz, haptics-hands, import, operation, "
                 "removal, tissue\n",
                 subject.c_str());
    return 2;
  }
  return 0;
}
