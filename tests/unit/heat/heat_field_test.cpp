// Heat conduction against analytic solutions (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed.) and its own
// balance.
#include "osteo/simulation/heat/heat_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

namespace osteo {
namespace {

constexpr double kK = 0.55e-3, kC = 1900.0 * 1300 / 1e9, kAlpha = kK / kC,
                 kPi = std::numbers::pi;  // W/(mm K), J/(mm3 K), mm2/s

HeatField everywhere(double h) {
  return HeatField(h, {}, [](Ijk) { return HeatMatter{1, 0}; });
}
// Bone from cell k = 0 on: its face lies half a cell before the first centre.
HeatField half_space(double h) {
  return HeatField(h, {}, [](Ijk c) { return HeatMatter{c.k >= 0 ? 1.0F : 0.0F, 0}; });
}
// The step that a field takes by itself.
double natural_s(double h) {
  return h * h / (6 * kAlpha);
}
void for_each(const HeatField& f, const auto& see) {
  for (const Ijk b : f.warm_bricks()) {
    for (const double k : f.brick(b)) see(k);
  }
}
double balance(const HeatField& f) {
  const HeatLedger& l = f.ledger();
  return l.added_j - f.stored_j() - l.chips_j - l.cooled_j - l.forgotten_j;
}
void expect_near_of(double got, double truth, double share, const char* what) {
  EXPECT_NEAR(got, truth, share * std::abs(truth)) << what;
  std::printf("%s: %.4f, exact %.4f (%+.2f %%)\n", what, got, truth, 100 * (got / truth - 1));
}

// 1 J at once in all of space, `s` seconds ago.
double instantaneous(double r, double s) {
  return s <= 0 ? 0 : 1 / (kC * std::pow(4 * kPi * kAlpha * s, 1.5)) * std::exp(-r * r / (4 * kAlpha * s));
}
// A point of heat on a face, or what is the same to a wall, half as much at either side of it: heat in a cell lies at
// its centre.
double in_the_cell(Vec3 off, double depth, const auto& f) {
  return 0.5 * (f(length(off - Vec3{0, 0, depth})) + f(length(off + Vec3{0, 0, depth})));
}

TEST(HeatField, AnInstantaneousPoint) {
  HeatField f = everywhere(0.25);
  f.add({{0, 0, 0}, 0.1}, 1);
  f.step(1e-9);
  double t = 0;
  // Where cells have their centres: along the lattice, between two axes and between three.
  for (const auto& cell : {Ijk{4, 0, 0}, {3, 3, 0}, {3, 3, 3}, {8, 0, 0}, {5, 5, 5}, {12, 0, 0}, {7, 7, 7}}) {
    const double r = 0.25 * std::sqrt(double(cell.i * cell.i + cell.j * cell.j + cell.k * cell.k)),
                 peak_s = r * r / (6 * kAlpha);
    f.step(peak_s - t);
    t = peak_s;
    char what[64];
    std::snprintf(what, sizeof(what), "1 J at once, %.3f mm (%d %d %d), %.2f s", r, cell.i, cell.j, cell.k, t);
    expect_near_of(f.at(cell), instantaneous(r, t), r < 2 ? 0.012 : 0.005, what);
  }
  EXPECT_NEAR(balance(f), 0, 1e-6);
}

TEST(HeatField, AFixedPointOnASurface) {
  constexpr double kH = 0.25;
  HeatField f = half_space(kH);
  double t = 0;
  for (const double until : {5.0, 10.0}) {
    const double steps = std::ceil((until - t) / natural_s(kH)), dt = (until - t) / steps;
    for (int n = 0; n < steps; ++n) {
      f.add({{0, 0, 0}, 0.1}, dt);
      f.step(dt);
    }
    t = until;
    // Where cells have their centres: straight below and aside.
    for (const auto& cell : {Ijk{0, 0, 4}, {4, 0, 0}, {0, 0, 8}, {6, 6, 0}, {0, 0, 12}, {7, 7, 7}}) {
      const Vec3 at{kH * cell.i, kH * cell.j, kH * (cell.k + 0.5)};
      const auto continuous = [&](double r) {
        return 1 / (2 * kPi * kK * r) * std::erfc(r / std::sqrt(4 * kAlpha * t));
      };
      char what[64];
      std::snprintf(what, sizeof(what), "1 W on a point, %.0f s, %.3f mm off (%d %d %d)", t, length(at), cell.i, cell.j,
                    cell.k);
      expect_near_of(f.at(cell), in_the_cell(at, kH / 2, continuous), 0.01, what);
      // On the face itself instead of half a cell below: that much no lattice of such cells can tell.
      EXPECT_NEAR(f.at(cell), continuous(length(at)), 0.03 * continuous(length(at))) << what;
    }
  }
  EXPECT_NEAR(balance(f), 0, 1e-6 * 10);
}

TEST(HeatField, AMovingPoint) {
  // 2 alpha / v is how far ahead and aside heat gets: six cells, and at 1 mm/s not two.
  for (const double v : {0.3, 1.0}) {
    constexpr double kH = 0.25, kW = 0.1, kDt = 0.025;
    HeatField f = half_space(kH);
    double t = 0;
    int steps = 0;
    for (; v * t < 6; t += kDt, ++steps) {
      f.add({{v * (t + kDt / 2) / kH, 0, 0}, 0.6}, kW * kDt);
      f.step(kDt);
    }
    // What has come since it set out; long after that Rosenthal's steady state.
    const auto exact = [&](Vec3 at) {
      double sum = 0;
      for (int n = 0; n < 4 * steps; ++n) {
        const double then = (n + 0.5) * kDt / 4;
        sum += 2 * kW * kDt / 4 *
               in_the_cell(at - Vec3{v * then, 0, 0}, kH / 2, [&](double r) { return instantaneous(r, t - then); });
      }
      return sum;
    };
    for (const auto& [off, where] : {std::pair{Vec3{-2, 0, 0.125}, "2 mm behind"},
                                     {{-1, 0, 1.125}, "behind and below"},
                                     {{0, 0, 1.125}, "1.1 mm below"}}) {
      char what[64];
      std::snprintf(what, sizeof(what), "0.1 W at %.1f mm/s, %s", v, where);
      const double i = std::round((v * t + off.x) / kH);
      const Vec3 at{i * kH, 0, off.z};
      expect_near_of(f.at(Ijk{static_cast<int>(i), 0, static_cast<int>(off.z / kH)}), exact(at), 0.02, what);
    }
  }
}

// A stroke at working speeds, over the middle of its way: beside and below it, two cells away and farther, what a place
// has is within a twentieth of the highest that it gets (Jaeger's moving source, from its beginning), at all times.
// Before its heat is there a lattice knows it sooner: a share of what there is then would be large and say nothing.
TEST(HeatField, AMovingPointAtWorkingSpeeds) {
  constexpr double kH = 0.5, kW = 1, kSub = 2e-3;  // cells as sessions have them
  const double dt = natural_s(kH);
  for (const double v : {1.0, 5.0, 12.0, 25.0}) {
    const double way = std::max(6.0, 0.4 * v), over_s = way / v, middle_s = over_s / 2;
    HeatField f = half_space(kH);
    const int middle = static_cast<int>(std::round(way / 2 / kH));
    const Ijk cells[] = {{middle, 0, 2}, {middle, 2, 0}, {middle, 0, 3}, {middle, 2, 2}, {middle, 0, 4}};
    std::array<std::vector<std::array<double, 2>>, 5> seen;
    const auto exact = [&](Ijk c, double t) {
      const Vec3 at{c.i * kH, c.j * kH, (c.k + 0.5) * kH};
      double sum = 0;
      constexpr int kParts = 400;
      for (int n = 0; n < kParts; ++n) {  // closer the later
        const double u = 1 - (n + 0.5) / kParts, s = std::min(t, over_s), then = s * (1 - u * u);
        sum += 2 * kW * s * 2 * u / kParts *
               in_the_cell(at - Vec3{v * then, 0, 0}, kH / 2, [&](double r) { return instantaneous(r, t - then); });
      }
      return sum;
    };
    double t = 0, next = kSub / 2;
    while (t < middle_s + 3) {
      for (; next < t + dt; next += kSub) {
        if (next < over_s) f.add({{v * next / kH, 0, 0}, 0.6}, kW * kSub, (next - t) / dt);
      }
      f.step(dt);
      t += dt;
      for (std::size_t n = 0; n < seen.size() && t > middle_s - 0.2; ++n)
        seen[n].push_back({f.at(cells[n]), exact(cells[n], t)});
    }
    EXPECT_NEAR(balance(f), 0, 1e-6 * over_s);
    for (std::size_t n = 0; n < seen.size(); ++n) {
      std::array<double, 2> most{};
      for (const auto& s : seen[n]) most = {std::max(most[0], s[0]), std::max(most[1], s[1])};
      double off = 0;
      for (const auto& s : seen[n]) off = std::max(off, std::abs(s[0] - s[1]) / most[1]);
      char what[80];
      std::snprintf(what, sizeof(what), "%.0f mm/s, %.1f mm aside, %.1f below: off by %.1f %% at most, peak", v,
                    cells[n].j * kH, cells[n].k * kH, 100 * off);
      expect_near_of(most[0], most[1], 0.01, what);
      EXPECT_LT(off, 0.05) << what;
    }
  }
}

TEST(HeatField, UniformFluxIntoAWall) {
  for (const double h : {0.25, 0.5, 1.0}) {
    // A column one brick wide: nothing goes sideways.
    HeatField f(h, {}, [](Ijk c) {
      return HeatMatter{c.k >= 0 && c.i >= 0 && c.i < 4 && c.j >= 0 && c.j < 4 ? 1.0F : 0.0F, 0};
    });
    double t = 0;
    const double flux = 0.01;
    for (const double until : {5.0, 10.0, 30.0}) {
      const double steps = std::ceil((until - t) / natural_s(h)), dt = (until - t) / steps;
      for (int s = 0; s < steps; ++s) {
        for (int n = 0; n < 16; ++n) f.add({{double(n % 4), double(n / 4), 0}, 0.1}, flux * h * h * dt);
        f.step(dt);
      }
      t = until;
      const auto truth = [&](double z) {
        const double u = z / std::sqrt(4 * kAlpha * t);
        return 2 * flux / kK * std::sqrt(kAlpha * t) * (std::exp(-u * u) / std::sqrt(kPi) - u * std::erfc(u));
      };
      const double z = (std::floor(2 / h) + 0.5) * h;  // where a cell has its centre
      const double got = f.at(Ijk{1, 1, static_cast<int>(z / h)});
      char what[64];
      std::snprintf(what, sizeof(what), "flux, cells %.2f mm, %.0f s, %.3f mm", h, t, z);
      expect_near_of(got, 0.5 * (truth(z - h / 2) + truth(z + h / 2)), h <= 0.5 ? 0.005 : 0.03, what);
      std::snprintf(what, sizeof(what), "  on the face itself");
      expect_near_of(got, truth(z), h <= 0.25 ? 0.02 : h <= 0.5 ? 0.07 : 0.3, what);
    }
    EXPECT_NEAR(balance(f) / f.ledger().added_j, 0, 1e-6);
  }
}

TEST(HeatField, ADiscHeatsUp) {
  constexpr double kH = 0.25, kA = 1, kW = 0.1;
  HeatField f = half_space(kH);
  const double t = 10, steps = std::ceil(t / natural_s(kH)), dt = t / steps;
  for (int s = 0; s < steps; ++s) {
    for (int j = -4; j <= 4; ++j) {
      for (int i = -4; i <= 4; ++i) {
        // The share of each square that the disc covers.
        int in = 0;
        for (int n = 0; n < 400; ++n)
          in += std::hypot(i + (n % 20 + 0.5) / 20 - 0.5, j + (n / 20 + 0.5) / 20 - 0.5) * kH < kA ? 1 : 0;
        if (in > 0) f.add({{double(i), double(j), 0}, 0.1}, kW / (kPi * kA * kA) * kH * kH * in / 400 * dt);
      }
    }
    f.step(dt);
  }
  const double q = kW / (kPi * kA * kA);
  const auto truth = [&](double z) {
    const auto ierfc = [](double u) { return std::exp(-u * u) / std::sqrt(kPi) - u * std::erfc(u); };
    const double root = std::sqrt(kAlpha * t);
    return 2 * q * root / kK * (ierfc(z / (2 * root)) - ierfc(std::hypot(z, kA) / (2 * root)));
  };
  for (const double z : {0.125, 0.625, 1.125, 2.125, 3.125}) {
    char what[64];
    std::snprintf(what, sizeof(what), "disc of 1 mm, 10 s, %.3f mm", z);
    // Through the heated cell its own heat makes a roof: its mean.
    double sum = 0;
    for (int n = 0; n < 20; ++n) {
      const double at = z < kH ? (n + 0.5) / 20 * kH : z;
      sum += (truth(std::abs(at - kH / 2)) + truth(at + kH / 2)) / 40;
    }
    expect_near_of(f.at(Ijk{0, 0, static_cast<int>(z / kH)}), sum, 0.01, what);
  }
}

TEST(HeatField, WaterOnAWall) {
  constexpr double kH = 0.25, kFilm = 3000, kWater = -15;
  // Wider than heat goes in that time.
  HeatField wall = half_space(kH);
  double t = 0;
  for (; t < 5 - 1e-9; t += 0.02) {
    wall.cool({{0, 0, 0}, 24}, kFilm, kWater);
    wall.step(0.02);
  }
  const double hh = kFilm / 1e6 / kK;
  for (const double z : {0.125, 1.125, 2.125}) {
    const double root = 2 * std::sqrt(kAlpha * t);
    const double truth = kWater * (std::erfc(z / root) - std::exp(hh * z + hh * hh * kAlpha * t) *
                                                             std::erfc(z / root + hh * std::sqrt(kAlpha * t)));
    char what[64];
    std::snprintf(what, sizeof(what), "water 15 K below, 5 s, %.3f mm", z);
    expect_near_of(wall.at(Vec3{0, 0, z / kH - 0.5}), truth, 0.03, what);
  }
  EXPECT_NEAR(balance(wall), 0, 1e-6 * std::abs(wall.ledger().cooled_j));
}

// Odd bone that is drilled, wetted and put back, with a burr that goes about: nothing gets lost, nothing grows.
TEST(HeatField, NothingGetsLost) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> u(0, 1);
  std::map<std::array<int, 3>, float> bone;
  const auto fraction = [&](Ijk c) -> float& {
    auto [it, made] = bone.try_emplace({c.i, c.j, c.k}, 0.0F);
    if (made) it->second = u(random) < 0.3F ? 0.0F : u(random);
    return it->second;
  };
  HeatField f(0.5, {}, [&](Ijk c) { return HeatMatter{fraction(c), (c.i ^ c.j) % 5 == 0 ? 0.3F : 0.0F}; });
  double hottest = 0;
  for (int n = 0; n < 400; ++n) {
    const Vec3 at{8 * u(random), 8 * u(random), 8 * u(random)};
    f.add({at, 2}, 0.2 * u(random));
    if (n % 3 == 0) f.cool({at, 3}, 20000 * u(random), -15);
    if (n % 5 == 0) {
      const Ijk c{int(at.x), int(at.y), int(at.z)};
      fraction(c) = n % 2 == 0 ? 0 : u(random);
      f.set_matter(c, {fraction(c), (c.i ^ c.j) % 5 == 0 ? 0.3F : 0.0F});
    }
    f.step(0.05);
    for_each(f, [&](double k) { hottest = std::max(hottest, std::abs(k)); });
  }
  EXPECT_NEAR(balance(f), 0, 1e-9 * f.ledger().added_j);
  EXPECT_GT(f.ledger().chips_j, 0);
  EXPECT_LT(hottest, 500);
  // Under water nothing gets warmer than it was nor colder than the water.
  double most = hottest;
  for (int n = 0; n < 20; ++n) {
    f.cool({{4, 4, 4}, 12}, 5000, -15);
    f.step(2);
    double now = 0;
    for_each(f, [&](double k) {
      now = std::max(now, k);
      EXPECT_GE(k, -15.0 - 1e-9);
    });
    EXPECT_LE(now, most + 1e-9);
    most = now;
  }
  EXPECT_LT(most, 1);
  EXPECT_NEAR(balance(f), 0, 1e-9 * f.ledger().added_j);
}

TEST(HeatField, CostsNothingWhereNothingIsWarmAndIsTheSameAgain) {
  const auto run = [] {
    HeatField f = everywhere(0.5);
    f.step(1);
    EXPECT_EQ(f.bricks(), 0u);
    f.add({{3, 3, 3}, 1.5}, 0.05);
    f.step(3);
    return std::pair{f.at(Ijk{5, 3, 3}), f.stored_j()};
  };
  EXPECT_EQ(run(), run());
}

TEST(HeatField, RefusesWhatIsNone) {
  EXPECT_ANY_THROW(HeatField(0, {}, [](Ijk) { return HeatMatter{}; }));
  HeatField f = everywhere(0.5);
  EXPECT_EQ(f.add({{NAN, 0, 0}, 1}, 1), 0);
  EXPECT_EQ(f.add({{0, 0, 0}, 1}, NAN), 0);
  f.step(NAN);
  f.step(-1);
  f.cool({{0, 0, 0}, 1}, NAN, 0);
  EXPECT_EQ(f.bricks(), 0u);
  HeatField air(0.5, {}, [](Ijk) { return HeatMatter{}; });
  EXPECT_EQ(air.add({{0, 0, 0}, 1}, 1), 0) << "in air there is nothing to heat";
  EXPECT_EQ(air.ledger().added_j, 0);
}

}  // namespace
}  // namespace osteo
