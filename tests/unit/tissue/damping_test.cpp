#include "osteo/simulation/tissue/damping.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/calibrate.h"

namespace osteo {
namespace {

using test::block;

constexpr double kTurn = 2 * std::numbers::pi;

// A bar held at one end, a load in proportion to a mode's inertia, and that mode by itself: what it does is known in
// closed form.
struct Bar {
  test::Block body = block(6, 1, 1, 2.0);
  TissueModel model;
  std::vector<std::uint32_t> fixed;
  TissueLoad pluck;
  std::uint32_t tip = 0;
  double w = 0;       // of the first mode bending along z, 1/s
  double tip_mm = 0;  // where the load holds the tip, for small movements

  Bar() : model(make(body)) {
    std::vector<double> mass(body.points.size());
    for (const auto& t : body.tets) {
      const auto& x = body.points;
      for (const std::uint32_t p : t)
        mass[p] +=
            dot(x[t[1]] - x[t[0]], cross(x[t[2]] - x[t[0]], x[t[3]] - x[t[0]])) / 24 * 1e-9;  // 1000 kg/m3 in tonnes
    }
    for (std::uint32_t p = 0; p < body.points.size(); ++p) {
      if (body.points[p].x < 1e-9) fixed.push_back(p);
      if (length(body.points[p] - Vec3{12, 2, 2}) < 1e-9) tip = p;
    }
    // Inverse iteration: K u = M u before. Small, so that the body is linear.
    EquilibriumSolver solver(model, model.rest(), fixed);
    std::vector<Vec3> u(body.points.size());
    for (Vec3& v : u) v = {0, 0, 1};
    for (int n = 0; n < 60; ++n) {
      double size = 0;
      for (std::size_t p = 0; p < u.size(); ++p) size = std::max(size, length(u[p]));
      std::vector<std::pair<std::uint32_t, Vec3>> forces;
      for (std::uint32_t p = 0; p < u.size(); ++p) forces.push_back({p, u[p] * (mass[p] / size)});
      // As large a load as moves the tip by a thousandth of a millimetre.
      const double by = w > 0 ? 1e-3 * w * w : 1e-3;
      for (auto& [p, f] : forces) f = f * by;
      const Equilibrium r = solver.solve(model, model.rest(), forces);
      if (!r.converged) throw std::runtime_error("no rest");
      double uf = 0, uu = 0;
      for (const auto& [p, f] : forces) {
        const Vec3 moved = r.points_mm[p] - model.rest()[p];
        uf += dot(moved, f);
        uu += mass[p] * dot(moved, moved);
        u[p] = moved;
      }
      w = std::sqrt(uf / uu);
      pluck.forces_n = forces;
    }
    pluck.fixed = fixed;
    tip_mm = u[tip].z;
  }
  static TissueModel make(const test::Block& b) {
    const Material m{0.1, 0.45};
    TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
    model.scale({1, 1, 0, 1});
    return model;
  }
  // An oscillator of the mode's frequency, let go at rest from 1.
  [[nodiscard]] static double swing(double w0, double damping, double t) {
    if (t <= 0) return 1;
    const double s = damping / 2;
    if (s < w0) {
      const double wd = std::sqrt(w0 * w0 - s * s);
      return std::exp(-s * t) * (std::cos(wd * t) + s / wd * std::sin(wd * t));
    }
    const double root = std::sqrt(s * s - w0 * w0), a = s + root, b = s - root;
    return (a * std::exp(-b * t) - b * std::exp(-a * t)) / (a - b);
  }
  // At the tip along z, sampled `per_swing` times a swing for so many swings of the body's own frequency.
  [[nodiscard]] MeasuredMotion measured(double w0, double damping, double swings, double per_swing, double noise,
                                        unsigned seed = 1) const {
    MeasuredMotion m;
    m.channels.push_back({tip, {0, 0, 1}, "uz_mm", {}, {}});
    std::mt19937_64 random(seed);
    std::normal_distribution<double> error(0, 1);
    for (int n = 0; n < static_cast<int>(swings * per_swing); ++n) {
      const double t = n / per_swing * kTurn / w;
      m.channels[0].time_s.push_back(t);
      m.channels[0].mm.push_back(tip_mm * (swing(w0, damping, t) + noise * error(random)));
    }
    return m;
  }
  [[nodiscard]] DampingFit fit(const MeasuredMotion& m, const DampingOptions& options = {}) const {
    return fit_damping(model, pluck, fixed, {}, m, options);
  }
};
const Bar& bar() {
  static const Bar value;
  return value;
}

std::string why_not(const MeasuredMotion& m, const DampingOptions& options = {}) {
  try {
    (void)bar().fit(m, options);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Damping, ASwingIsFoundWithoutAModel) {
  for (const double ratio : {0.0, 0.01, 0.1, 0.5}) {
    MeasuredMotion m;
    m.channels.push_back({0, {1, 0, 0}, "u", {}, {}});
    const double w = kTurn * 12, s = ratio * w, wd = std::sqrt(w * w - s * s);
    for (int n = 0; n < 200; ++n) {
      const double t = 0.004 * n + 0.0005 * std::sin(7.0 * n);  // not evenly
      m.channels[0].time_s.push_back(t);
      m.channels[0].mm.push_back(3 + 0.2 * t + 0.7 * std::exp(-s * t) * std::cos(wd * t + 0.4));
    }
    const Swing found = swing_of(m, 2, 90);
    EXPECT_TRUE(found.swings) << ratio;
    EXPECT_NEAR(found.decay_per_s, s, 1e-6 * w) << ratio;
    EXPECT_NEAR(found.hz, wd / kTurn, 1e-6 * 12) << ratio;
    EXPECT_LT(found.residual_share, 1e-6) << ratio;
    // The decrement of two tops that follow each other.
    EXPECT_NEAR(found.decay_per_s / found.hz, kTurn * ratio / std::sqrt(1 - ratio * ratio), 1e-5) << ratio;
  }
}

// Known truth in closed form, three dampings and three noises; the table of docs/validation/tissue.md.
TEST(Damping, AKnownTruthIsFoundAgain) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w;
  for (const double ratio : {0.02, 0.1, 0.3}) {
    for (const double noise : {0.0, 0.02, 0.05}) {
      const double truth = 2 * ratio * w;
      const DampingFit f = bar().fit(bar().measured(w, truth, 8, 25, noise));
      const double off = f.damping_per_s.value / truth - 1;
      std::printf("| %g | %g %% | %.2f %% | +-%.2f %% | %.3f %% | +-%.3f %% |\n", ratio, 100 * noise, 100 * off,
                  50 * (f.damping_per_s.high - f.damping_per_s.low) / truth, 100 * (f.stiffness_times.value - 1),
                  50 * (f.stiffness_times.high - f.stiffness_times.low));
      SCOPED_TRACE(std::to_string(ratio) + " " + std::to_string(noise));
      EXPECT_TRUE(f.converged) << f.why;
      EXPECT_LT(std::abs(off), noise == 0 ? 1e-3 : 1.3 * noise);
      EXPECT_LT(std::abs(f.stiffness_times.value - 1), noise == 0 ? 1e-3 : noise);
      EXPECT_LT(std::abs(f.damping_per_s.value - truth), (f.damping_per_s.high - f.damping_per_s.low) + 1e-3 * truth);
      EXPECT_NEAR(f.amplitude_times, 1, 0.01 + noise);
      EXPECT_NEAR(f.release_s.value, 0, noise / w + f.step_s);
      // Explicit steps take nothing away: all of it is damping.
      EXPECT_LT(std::abs(f.undamped.decay_per_s), 1e-4 * w);
      EXPECT_NEAR(f.model.decay_per_s, f.damping_per_s.value / 2, 1e-3 * truth);
    }
  }
}

// Intervals hold the truth about as often as they say.
TEST(Damping, IntervalsHoldTheTruth) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w, truth = 0.2 * w;
  int held = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const DampingFit f = bar().fit(bar().measured(w, truth, 5, 16, 0.05, seed));
    held += f.damping_per_s.low <= truth && truth <= f.damping_per_s.high ? 1 : 0;
  }
  std::printf("%d of 20 intervals hold the truth\n", held);
  EXPECT_GE(held, 17);  // fewer would be by chance once in 60
}

// Backward Euler takes away ln(1 + (wh)^2) / 2h of a swing by itself; what is left to find is the rest.
TEST(Damping, WhatTheStepsTakeAwayIsNotDamping) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w, truth = 0.2 * w;
  DampingOptions options;
  options.stepping = Stepping::implicit_steps;
  options.step_s = 0.1 / w;
  const DampingFit f = bar().fit(bar().measured(w, truth, 3, 25, 0), options);
  const double h = options.step_s, stiff = f.stiffness_times.value * w * w, taken = std::log1p(h * h * stiff) / (2 * h);
  std::printf("implicit: damping %.4f of %.4f; decay %.4f, numerical %.4f (closed form %.4f), stiffness %.5f\n",
              f.damping_per_s.value, truth, f.model.decay_per_s, f.undamped.decay_per_s, taken,
              f.stiffness_times.value);
  EXPECT_NEAR(f.undamped.decay_per_s, taken, 0.01 * taken);
  EXPECT_NEAR(f.model.decay_per_s, truth / 2, 0.005 * truth);
  // 1 + ch + (wh)^2 = exp(2 h decay), of which the root times the cosine of the swing's angle is 1 + ch / 2.
  const double wd = w * std::sqrt(1 - 0.01), c = 2 * (std::exp(h * truth / 2) * std::cos(h * wd) - 1) / h;
  EXPECT_NEAR(f.damping_per_s.value, c, 0.01 * truth);
  EXPECT_LT(f.damping_per_s.value, 0.6 * truth);
  options.step_s = 0.5 / w;
  EXPECT_NE(why_not(bar().measured(w, truth, 3, 25, 0), options).find("steps of"), std::string::npos);
}

// The first mode of a slender beam (L. Euler, D. Bernoulli): 1.8751^2 sqrt(E I / rho A L^4), not the body's own.
TEST(Damping, AStiffnessThatIsOffIsFoundToo) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = std::pow(1.8751040687, 2) / (12 * 12) * std::sqrt(0.1 * 2 * 2 / 12 / 1e-9), truth = 0.1 * w;
  const DampingFit f = bar().fit(bar().measured(w, truth, 8, 25, 0.02));
  std::printf("beam: %.4f Hz, the body's %.4f Hz (swing of its trace %.4f), stiffness %.4f, damping %.3f of %.3f\n",
              w / kTurn, bar().w / kTurn, f.model_hz, f.stiffness_times.value, f.damping_per_s.value, truth);
  EXPECT_NEAR(f.stiffness_times.value, std::pow(w / bar().w, 2), 0.01 * std::pow(w / bar().w, 2));
  EXPECT_NEAR(f.damping_per_s.value, truth, 0.02 * truth);
  EXPECT_NEAR(f.model_hz, bar().w / kTurn, 1e-3 * bar().w);
}

TEST(Damping, OverdampedIsRefusedOrFoundWhereStiffnessIsKnown) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w;
  for (const double ratio : {1.5, 4.0}) {
    const MeasuredMotion m = bar().measured(w, 2 * ratio * w, 8, 25, 0.005);
    EXPECT_NE(why_not(m).find("does not swing"), std::string::npos) << why_not(m);
    DampingOptions options;
    options.fit_stiffness = false;
    const DampingFit f = bar().fit(m, options);
    std::printf("overdamped %g: %.4f of %.4f, +- %.4f\n", ratio, f.damping_per_s.value, 2 * ratio * w,
                (f.damping_per_s.high - f.damping_per_s.low) / 2);
    EXPECT_NEAR(f.damping_per_s.value, 2 * ratio * w, 0.03 * 2 * ratio * w);
    EXPECT_EQ(f.stiffness_times.value, 1);
  }
}

TEST(Damping, DriftIsNotTakenForMotion) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w, truth = 0.1 * w;
  MeasuredMotion m = bar().measured(w, truth, 8, 25, 0.01);
  const double per_s = 0.1 * bar().tip_mm * w;
  for (std::size_t n = 0; n < m.channels[0].mm.size(); ++n)
    m.channels[0].mm[n] += 5 * bar().tip_mm + per_s * m.channels[0].time_s[n];
  const DampingFit f = bar().fit(m);
  EXPECT_NEAR(f.damping_per_s.value, truth, 0.02 * truth);
  EXPECT_NEAR(f.drift_mm_per_s[0], per_s, 0.01 * per_s);
  EXPECT_LT(f.drift_error_mm_per_s[0], 0.01 * per_s);
  // One that is no line leaves what is left in a row: told, and intervals widened by it.
  for (std::size_t n = 0; n < m.channels[0].mm.size(); ++n)
    m.channels[0].mm[n] += 0.3 * bar().tip_mm * std::sin(0.31 * w * m.channels[0].time_s[n]);
  const DampingFit g = bar().fit(m);
  EXPECT_GT(g.correlation, 0.8);
  EXPECT_LT(g.damping_per_s.low, truth);
  EXPECT_GT(g.damping_per_s.high, truth);
}

// Released later than the clock says, pulled the other way, and twice as far.
TEST(Damping, ReleaseAndAmplitudeAreFoundToo) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w, truth = 0.1 * w;
  MeasuredMotion m = bar().measured(w, truth, 8, 25, 0);
  for (auto& u : m.channels[0].mm) u *= -2;
  const double late = 0.3 / w;
  for (auto& t : m.channels[0].time_s) t += late;
  m.channels[0].time_s.insert(m.channels[0].time_s.begin(), 0.0);
  m.channels[0].mm.insert(m.channels[0].mm.begin(), m.channels[0].mm.front());
  const DampingFit f = bar().fit(m);
  EXPECT_NEAR(f.release_s.value, late, 0.01 * late);
  EXPECT_NEAR(f.amplitude_times, -2, 0.01);
  EXPECT_NEAR(f.damping_per_s.value, truth, 2e-3 * truth);
}

TEST(Damping, WhatCannotBeToldIsRefusedWithWords) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres";
  const double w = bar().w;
  const auto says = [](const MeasuredMotion& m, const std::string& words, const DampingOptions& options = {}) {
    EXPECT_NE(why_not(m, options).find(words), std::string::npos) << why_not(m, options);
  };
  says(bar().measured(w, 0.1 * w, 8, 1.5, 0), "tell frequencies up to");
  says(bar().measured(w, 0.1 * w, 1, 40, 0), "swings of the body's");
  says(bar().measured(w / 8, 0.1 * w / 8, 8, 40, 0), "1.5 are needed");
  says(bar().measured(w, 0.1 * w, 2, 5, 0), "at least 12");
  MeasuredMotion still = bar().measured(w, 0.1 * w, 8, 25, 0);
  for (auto& u : still.channels[0].mm) u = 0.5;
  says(still, "nothing moves");
  MeasuredMotion noise = bar().measured(w, 0.1 * w, 8, 25, 200);
  says(noise, "does not swing");
  MeasuredMotion aside = bar().measured(w, 0.1 * w, 8, 25, 0);
  aside.channels[0].point = bar().fixed.front();
  says(aside, "does not move what was measured");
  aside.channels[0].point = 100000;
  says(aside, "there is no point");
  MeasuredMotion gap = bar().measured(w, 0.1 * w, 8, 25, 0);
  gap.channels[0].mm[7] = NAN;
  says(gap, "no number");
  gap = bar().measured(w, 0.1 * w, 8, 25, 0);
  std::swap(gap.channels[0].time_s[7], gap.channels[0].time_s[8]);
  says(gap, "does not rise");
  DampingOptions options;
  options.release_s = 1e3;
  says(bar().measured(w, 0.1 * w, 8, 25, 0), "0 values", options);
}

TEST(Damping, ATableIsReadOrSaysWhatIsWrong) {
  const auto read = [](const std::string& text) { return read_motion(text, "m.csv", 10, 3, {0, 0, 2}); };
  const MeasuredMotion one = read("time_s,u_mm\n0,1\n0.5,2e-1\n");
  ASSERT_EQ(one.channels.size(), 1u);
  EXPECT_EQ(one.channels[0].point, 3u);
  EXPECT_EQ(one.channels[0].along.z, 1);
  EXPECT_EQ(one.channels[0].mm[1], 0.2);
  const MeasuredMotion two = read("point,uz_mm,time_s,ux_mm\n7,1,0,4\n2,2,0,5\n7,3,1,6\n");
  ASSERT_EQ(two.channels.size(), 4u);
  EXPECT_EQ(two.channels[0].name, "uz_mm of point 7");
  EXPECT_EQ(two.channels[1].mm, (std::vector<double>{4, 6}));
  EXPECT_EQ(two.channels[1].along.x, 1);
  EXPECT_EQ(two.channels[2].point, 2u);
  const auto says = [&](const std::string& text, const std::string& words) {
    try {
      (void)read(text);
      ADD_FAILURE() << words;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  says("time_s,u_mm\n0,1\n1,nan\n", "line 3: u_mm is 'nan'");
  says("time_s,u_mm\n0,1\n1,\n", "line 3: u_mm is ''");
  says("time_s,u_mm\n0,1\n2,1\n1,1\n", "line 4: time_s is 1 and does not rise");
  says("time_s,u_mm\n0,1\n0,1\n", "does not rise");
  says("time_s,ux\n0,1\n", "a column 'ux'");
  says("u_mm\n0\n", "no column time_s");
  says("time_s\n0\n", "no displacement");
  says("time_s,u_mm,point\n0,1,10\n", "line 2: point 10 is not one of the mesh's 10");
  says("time_s,u_mm\n", "no line under the names");
}

}  // namespace
}  // namespace osteo
