// What is removed against what the burr swept. Prints Markdown for docs/validation/haptics.md.
#include <algorithm>
#include <cstdio>

#include "bench.h"
#include "sweep.h"

namespace osteo {
namespace {

using test::Face;
using test::Path;

constexpr ContactMethod kMethods[] = {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume,
                                      ContactMethod::rays};
constexpr double kVoxels[] = {0.2, 0.35, 0.5, 0.6, 0.9};
const Face kFaces[] = {{{0, 0, 1}, 0.11}, {normalized({0.03, -0.02, 1}), 0.23}};

struct Range {
  double least = 9, most = 0;
  void add(double v) {
    least = std::min(least, v);
    most = std::max(most, v);
  }
  void print() const { std::printf(" %.3f to %.3f |", least, most); }
};

Path path_of(int tool, int passes) {
  const Burr& burr = burr_library()[static_cast<std::size_t>(tool)];
  const Vec3 axis = burr.shape == BurrShape::ball       ? Vec3{0.6, 0, 0.8}
                    : burr.shape == BurrShape::cylinder ? Vec3{0.2, 0.1, 1}
                                                        : Vec3{0.2, 0.95, 0.2};
  const double depth = std::min(0.46, 0.23 * burr.diameter_mm);
  return passes == 0 ? test::dwell(tool, depth, burr.diameter_mm > 5 ? 8 : 3, axis)
                     : test::groove(tool, depth, 1, passes, 0.3 * burr.diameter_mm, axis);
}
// So slow that the burr takes all that it reaches.
void take_time(Path& path, double swept_mm3) {
  double way = 0;
  for (std::size_t l = 1; l < path.legs.size(); ++l) way += length(path.legs[l].to_mm - path.legs[l - 1].to_mm);
  const Burr& burr = burr_library()[static_cast<std::size_t>(path.tool)];
  for (std::size_t l = 1; l < path.legs.size(); ++l)
    path.legs[l].mm_per_s =
        way * (burr.shape == BurrShape::taper ? 0.012 : 0.03) * burr.rate_mm3_per_s_per_n / swept_mm3;
}
double ratio(int tool, int passes, const Face& face, double h, ContactMethod method, double hz) {
  Path path = path_of(tool, passes);
  const double swept = test::swept_mm3(path, face, 30000);
  if (passes > 0) take_time(path, swept);
  if (passes == 0 && burr_library()[static_cast<std::size_t>(tool)].kind == BurrKind::diamond) path.stay_s *= 3;
  auto bone = test::block(h, face);
  return test::removed_mm3(path, bone, method, hz) / swept;
}

}  // namespace

void bench_removal(const Context&) {
  const char* const ways[] = {"resting", "a groove", "two side by side"};
  std::printf(
      "### Removed over swept, by method and voxel\n\n2 mm ball and 4 mm cylinder, on faces off the voxels' borders, "
      "250 Hz, time enough: "
      "least to most.\n\n| method | path |");
  for (const double h : kVoxels) std::printf(" %g mm |", h);
  std::printf("\n|---|---|---|---|---|---|---|\n");
  for (const ContactMethod method : kMethods) {
    for (int passes = 0; passes < 3; ++passes) {
      std::printf("| %s | %s |", EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)].data(),
                  ways[passes]);
      for (const double h : kVoxels) {
        Range range;
        for (const int tool : {1, 17}) range.add(ratio(tool, passes, kFaces[tool % 3 == 1 ? 0 : 1], h, method, 250));
        range.print();
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  }
  std::printf("\n### By burr and voxel\n\nBy overlap, 250 Hz, time enough.\n\n| burr | path |");
  for (const double h : kVoxels) std::printf(" %g mm |", h);
  std::printf("\n|---|---|---|---|---|---|---|\n");
  for (const int tool : {0, 1, 3, 6, 10, 14, 17, 20, 28, 31, 34}) {
    for (int passes = 0; passes < 2; ++passes) {
      std::printf("| %s | %s |", burr_library()[static_cast<std::size_t>(tool)].name().c_str(), ways[passes]);
      for (const double h : kVoxels)
        std::printf(" %.3f |", ratio(tool, passes, kFaces[0], h, ContactMethod::overlap, 250));
      std::printf("\n");
      std::fflush(stdout);
    }
  }
  std::printf(
      "\n### By rate of the servo, and where the hand is too fast\n\nA 4 mm ball in 0.5 mm voxels by overlap; the fast "
      "groove at 40 mm/s, "
      "once and 100 times.\n\n| Hz | resting | a groove | two side by side | fast, once | fast, 100 times "
      "|\n|---|---|---|---|---|---|\n");
  for (const double hz : {500.0, 1000.0, 2000.0, 5000.0}) {
    std::printf("| %g |", hz);
    for (int passes = 0; passes < 3; ++passes)
      std::printf(" %.3f |", ratio(3, passes, kFaces[0], 0.5, ContactMethod::overlap, hz));
    for (const int times : {1, 100}) {
      Path path = test::groove(3, 0.46, 40, 1, 0);
      const double swept = test::swept_mm3(path, kFaces[0]);
      for (int n = 1; n < times; ++n)
        path.legs.push_back({path.legs[1].to_mm + Vec3{n % 2 == 1 ? -4.06 : 0, 0, 0}, 40});
      auto bone = test::block(0.5, kFaces[0]);
      std::printf(" %.3f |", test::removed_mm3(path, bone, ContactMethod::overlap, hz) / swept);
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

}  // namespace osteo
