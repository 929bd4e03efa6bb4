#include "osteo/simulation/bone/instrument.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace osteo {
namespace {

const Instrument& of(const char* name) {
  return instrument_library()[static_cast<std::size_t>(instrument_index(name))];
}
Vec3 random_unit(std::mt19937& g) {
  std::normal_distribution<double> n;
  return normalized({n(g), n(g), n(g)});
}

// Of two instruments' surfaces by so many balls along both axes: an upper bound, off by less than half a step's reach.
double by_balls(const InstrumentPlace& a, const InstrumentPlace& b) {
  double least = 1e9;
  for (const RoundCone* x : {&a.held->head, &a.held->shaft})
    for (const RoundCone* y : {&b.held->head, &b.held->shaft})
      for (int i = 0; i <= 300; ++i)
        for (int k = 0; k <= 300; ++k) {
          const double s = x->length_mm * i / 300, t = y->length_mm * k / 300;
          const Vec3 p = a.tip_mm + a.axis * (x->start_mm + s), q = b.tip_mm + b.axis * (y->start_mm + t);
          least = std::min(least, length(p - q) - x->radius_at_mm(s) - y->radius_at_mm(t));
        }
  return least;
}

TEST(InstrumentGap, IsTheLeastDistanceOfTheirSurfaces) {
  std::mt19937 g(7);
  std::uniform_real_distribution<double> u(-12, 12);
  double worst = 0;
  for (int n = 0; n < 60; ++n) {
    const InstrumentPlace a{&of("cutting 4 mm"), {u(g), u(g), u(g)}, random_unit(g)},
        b{&of("sucker 8 Fr"), {u(g), u(g), u(g)}, random_unit(g)};
    const InstrumentGap found = gap_between(a, b), other_way = gap_between(b, a);
    if (found.gap_mm > 15) continue;
    EXPECT_NEAR(found.gap_mm, other_way.gap_mm, 1e-3);
    worst = std::max(worst, std::abs(found.gap_mm - by_balls(a, b)));
  }
  std::printf("off 90,000 pairs of balls by %.4f mm at most\n", worst);
  EXPECT_LT(worst, 0.02);
}

TEST(InstrumentGap, SaysWhatTouchesWhereAndHowDeep) {
  const Instrument &drill = of("cutting 4 mm"), &sucker = of("sucker 8 Fr");
  const double tube = sucker.shaft.start_radius_mm;
  // The burr against the tube, 20 mm up from its tip, from the side.
  const InstrumentPlace held{&sucker, {0, 0, 0}, {0, 0, 1}};
  for (const double gap : {1.0, 0.0, -0.5}) {
    const InstrumentGap g = gap_between({&drill, {2 + tube + gap, 0, 20}, {1, 0, 0}}, held);
    EXPECT_NEAR(g.gap_mm, gap, 1e-3);
    EXPECT_TRUE(g.first_head);
    EXPECT_FALSE(g.other_head);
    EXPECT_NEAR(g.at_mm.x, tube + gap / 2, 1e-3);
    EXPECT_NEAR(g.at_mm.z, 20, 1e-2);
  }
  EXPECT_GT(gap_between({&drill, {100, 0, 0}, {1, 0, 0}}, held).gap_mm, 20);
}

}  // namespace
}  // namespace osteo
