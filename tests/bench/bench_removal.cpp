// Removal against the volume that the burr swept. Prints Markdown for docs/haptics.md.
#include <cstdio>

#include "bench.h"
#include "sweep.h"

namespace osteo {
namespace {
using namespace test;
const char* name_of(ContactMethod m) { return EnumNames<ContactMethod>::values[static_cast<std::size_t>(m)].data(); }
}

void bench_removal_sweep(const Context&) {
  const double s = 1;
  for (const ContactMethod m : {ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays, ContactMethod::overlap}) {
    for (const double h : {0.2, 0.5, 0.9}) {
      std::printf("%s %g:", name_of(m), h);
      for (const Face face : {Face{}, Face{{0, 0, 1}, 0.11}, Face{normalized({0.3, 0.2, 1}), 0.07}}) {
        const Path d = dwell(3, 0.46 + 0, 2 * s);
        auto bone = block(h, face);
        const double a = removed_mm3(d, bone, m, 500) / swept_mm3(d, face);
        const Path g = groove(3, 0.4, 0.3, 1, 0);
        bone = block(h, face);
        const double b = removed_mm3(g, bone, m, 500) / swept_mm3(g, face);
        const Path n = groove(3, 0.4, 0.5, 3, 0.7);
        bone = block(h, face);
        const double c = removed_mm3(n, bone, m, 500) / swept_mm3(n, face);
        std::printf("  %.3f %.3f %.3f |", a, b, c);
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  }
}
}  // namespace osteo
