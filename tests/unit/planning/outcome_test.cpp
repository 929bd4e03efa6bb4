// Outcomes against CTs after surgery of which the truth is known.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iostream>

#include "contour_truth.h"
#include "edge_fit.h"
#include "error_of.h"
#include "osteo/core/base/error.h"
#include "osteo/session/planning/planning.h"
#include "outcome_world.h"

namespace osteo {
namespace {

using namespace testing_planning;

struct Errors {
  std::vector<double> pose_mm, pose_deg, sliding_deg, cut_mm, cut_deg;
  int held[4] = {0, 0, 0, 0}, asked[4] = {0, 0, 0, 0};  ///< shift, turn, off, tilt
  double squares[4] = {0, 0, 0, 0};                     ///< of errors over half-widths
  int unknown_fragments = 0, unknown_cuts = 0, sliding = 0;
  int far[2] = {0, 0}, far_held[2] = {0, 0};  ///< turns of shafts off by over 0.3 degrees, tilts by over 0.5; held
  void ask(int which, const Interval95& m, double truth) {
    held[which] += m.holds(truth) ? 1 : 0;
    squares[which] += (m.value - truth) * (m.value - truth) / (m.half * m.half);
    ++asked[which];
  }
  /// Root mean square of errors over half-widths: 0.51 where 95 % intervals of normal errors are right.
  [[nodiscard]] double over_half(int from, int to) const {
    double sum = 0;
    int n = 0;
    for (int k = from; k <= to; ++k) {
      sum += squares[k];
      n += asked[k];
    }
    return std::sqrt(sum / std::max(1, n));
  }
  void add(const Outcome& o, const Truth& t, const SurgicalPlan& plan) {
    std::size_t cut = 0, reference = 0;
    while (reference + 1 < o.fragments.size() && !o.fragments[reference].reference) ++reference;
    for (std::size_t n = 0; n < o.fragments.size(); ++n) {
      const FragmentOutcome& f = o.fragments[n];
      unknown_fragments += f.known ? 0 : 1;
      if (f.known && !f.reference) {
        const RigidTransform d = t.deviation[reference].inverse() * t.deviation[n];
        Vec3 shift = d(f.middle_mm) - f.middle_mm;
        const Vec3 turn = turn_of(d);
        shift = shift - f.slides_along * dot(shift, f.slides_along);
        sliding += f.slides_along == Vec3{} ? 0 : 1;
        Vec3 off, turned;
        bool turn_held = true;
        for (std::size_t a = 0; a < 3; ++a) {
          off[a] = f.shift_mm[a].value - shift[a];
          turned[a] = f.turn_deg[a].value - turn[a];
          ask(0, f.shift_mm[a], shift[a]);
          ask(1, f.turn_deg[a], turn[a]);
          turn_held = turn_held && f.turn_deg[a].holds(turn[a]);
        }
        if (length(turned) > 0.3) {
          ++far[0];
          far_held[0] += turn_held ? 1 : 0;
        }
        pose_mm.push_back(length(off));
        (f.slides_along == Vec3{} ? pose_deg : sliding_deg).push_back(length(turned));
      }
      for (std::size_t k = 0; k < plan.fragments[n].planes.size(); ++k, ++cut) {
        const CutOutcome& c = o.cuts[cut];
        unknown_cuts += c.known ? 0 : 1;
        if (!c.known) continue;
        const CutPlane& p = plan.plane(c.plane);
        const auto& [at, e] = t.fragments[n].faces[k];
        // The true face's height over the planned one, at the middle that was measured.
        const Vec3 up = p.waste_ahead ? p.normal : -p.normal;
        const Vec3 middle = p.at_mm + c.axes[0] * c.middle[0] + c.axes[1] * c.middle[1];
        const double off = -dot(middle - at, e) / dot(up, e);
        ask(2, c.off_mm, off);
        ask(3, c.tilt_deg[0], t.off_tilt[cut].y);
        ask(3, c.tilt_deg[1], t.off_tilt[cut].z);
        cut_mm.push_back(std::abs(c.off_mm.value - off));
        cut_deg.push_back(std::hypot(c.tilt_deg[0].value - t.off_tilt[cut].y, c.tilt_deg[1].value - t.off_tilt[cut].z));
        if (cut_deg.back() > 0.5) {
          ++far[1];
          far_held[1] += c.tilt_deg[0].holds(t.off_tilt[cut].y) && c.tilt_deg[1].holds(t.off_tilt[cut].z) ? 1 : 0;
        }
      }
    }
  }
};

Outcome measured(const World& w, const SurgicalPlan& plan, const Truth& t, const PostopCt& how, std::uint64_t seed) {
  return measure_outcome(plan, w.bones(), postop_ct(t.fragments, box_of(t, plan, w), how, seed), {});
}

double most(const std::vector<double>& v) {
  return v.empty() ? -1 : *std::max_element(v.begin(), v.end());
}

// A bar of metal on the outer side of the jaw, across a cut.
RigidTransform plate_at(const World& w, const Truth& t, const SurgicalPlan& plan, std::size_t fragment) {
  const CutPlane& p = plan.plane(plan.fragments[fragment].planes[0]);
  Vec3 middle;
  for (const Vec3& q : w.phantom.jaw.points_mm) middle += q / static_cast<double>(w.phantom.jaw.points_mm.size());
  const Vec3 at = t.fragments[fragment].postop_from_ct(p.at_mm);
  Vec3 out = t.fragments[0].postop_from_ct.rotation * (w.phantom.a_mm - middle);
  const Vec3 x = t.fragments[fragment].postop_from_ct.rotation * p.normal;
  out = normalized(out - x * dot(out, x));
  RigidTransform r;
  r.rotation = {{x, cross(out, x), out}};
  r.shift_mm = at + out * 9.0;
  return r;
}

TEST(Outcome, FindsFragmentsAndCuts) {
  Errors errors;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const Truth t = surgery(world(), world().advanced, 1.5, 3, seed);
    const Outcome o = measured(world(), world().advanced, t, {}, seed);
    EXPECT_TRUE(o.fragments[0].reference || o.fragments[1].reference);
    errors.add(o, t, world().advanced);
  }
  EXPECT_EQ(errors.unknown_fragments, 0);
  EXPECT_EQ(errors.unknown_cuts, 0);
  EXPECT_LT(most(errors.pose_mm), 0.2);
  EXPECT_LT(most(errors.pose_deg), 0.3);
  EXPECT_LT(most(errors.cut_mm), 0.3);
  EXPECT_LT(most(errors.cut_deg), 0.5);
}

// Neither too narrow nor so wide that they say nothing; cuts beside metal are where they were too narrow by half.
TEST(Outcome, IntervalsAreAsWideAsErrors) {
  for (const bool metal : {false, true}) {
    Errors errors;
    for (std::uint64_t seed = 5001; seed <= 5003; ++seed) {
      const Truth t = surgery(world(), world().advanced, 1.5, 3, seed);
      PostopCt how;
      if (metal) how.plates.push_back(plate_at(world(), t, world().advanced, 0));
      errors.add(measured(world(), world().advanced, t, how, seed), t, world().advanced);
    }
    EXPECT_GT(errors.asked[3], 8);
    for (const int of : {0, 2}) {  // poses; cuts
      EXPECT_GT(errors.over_half(of, of + 1), 0.25) << of << metal;
      EXPECT_LT(errors.over_half(of, of + 1), 0.75) << of << metal;
    }
  }
}

TEST(Outcome, FindsSegmentsOfAnotherBoneBesideMetal) {
  const SurgicalPlan& plan = world().rebuilt;
  const Truth t = surgery(world(), plan, 0.7, 2, 7);
  PostopCt how;
  how.plates.push_back(plate_at(world(), t, plan, 0));
  const Outcome o = measured(world(), plan, t, how, 7);
  Errors errors;
  errors.add(o, t, plan);
  EXPECT_EQ(errors.unknown_fragments, 0);
  EXPECT_EQ(errors.sliding, 2) << "both segments are of a shaft, which does not show where along itself it lies";
  EXPECT_LT(most(errors.pose_mm), 0.2) << "across it, for those";
  EXPECT_LT(most(errors.pose_deg), 0.3);
  // A shaft is nearly round: how it is turned about itself is known to what its interval says, not to 0.3 degrees.
  EXPECT_LT(most(errors.sliding_deg), 1);
  for (const FragmentOutcome& f : o.fragments) {
    if (f.slides_along == Vec3{}) continue;
    EXPECT_NEAR(length(f.slides_along), 1, 1e-9);
    Vec3 along;
    for (std::size_t a = 0; a < 3; ++a) along[a] = f.shift_mm[a].value;
    EXPECT_NEAR(dot(along, f.slides_along), 0, 1e-9);
  }
  for (const CutOutcome& c : o.cuts) {
    if (c.fragment.find("segment") != std::string::npos) {
      EXPECT_FALSE(c.known) << c.plane;
    }
  }
}

// Read along straight lines between slices of 1 mm, segments were turned about themselves by up to 0.5 degrees without
// any noise.
TEST(Outcome, ThickSlicesDoNotTurnAShaft) {
  const SurgicalPlan& plan = world().rebuilt;
  PostopCt how;
  how.noise_hu = 0;
  how.spacing_mm = {0.45, 0.45, 1};
  Errors errors;
  for (std::uint64_t seed = 401; seed <= 402; ++seed) {
    const Truth t = surgery(world(), plan, 0.7, 3, seed);
    errors.add(measured(world(), plan, t, how, seed), t, plan);
  }
  EXPECT_EQ(errors.sliding, 4);
  EXPECT_LT(most(errors.sliding_deg), 0.25);
}

// Without noise, what is left is of edges beside other faces and other bone: cuts were off by up to 0.25 degrees.
TEST(Outcome, EdgesBesideOtherBoneAreLeftOut) {
  const SurgicalPlan& plan = world().rebuilt;
  PostopCt how;
  how.noise_hu = 0;
  Errors errors;
  for (std::uint64_t seed = 401; seed <= 403; ++seed) {
    const Truth t = surgery(world(), plan, 0.7, 3, seed);
    errors.add(measured(world(), plan, t, how, seed), t, plan);
  }
  EXPECT_EQ(errors.cut_mm.size(), 6U);
  EXPECT_LT(most(errors.cut_mm), 0.015);
  EXPECT_LT(most(errors.cut_deg), 0.1);
}

// Bone gives way to marrow behind a face, and the faster the farther in: taken for an even slope, that tilted faces by
// 0.03 degrees (root mean square) without any noise.
TEST(Outcome, MarrowBehindAFaceDoesNotTiltIt) {
  PostopCt how;
  how.noise_hu = 0;
  how.spacing_mm = {0.5, 0.5, 0.5};
  double squares = 0;
  int n = 0;
  for (std::uint64_t seed = 831; seed <= 832; ++seed) {
    const SurgicalPlan& plan = world().advanced;
    const Truth t = surgery(world(), plan, 1.5, 3, seed);
    const Outcome o = measured(world(), plan, t, how, seed);
    for (std::size_t c = 0; c < 2; ++c) {
      ASSERT_TRUE(o.cuts[c].known);
      for (const double off :
           {o.cuts[c].tilt_deg[0].value - t.off_tilt[c].y, o.cuts[c].tilt_deg[1].value - t.off_tilt[c].z}) {
        squares += off * off;
        ++n;
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / n), 0.02);
}

// Behind a plane across the left of a jaw also lies the right ramus. It is of another fragment, and moved by that.
TEST(Outcome, FragmentsAreOnePiece) {
  const SurgicalPlan& plan = world().rebuilt;
  const Truth t = surgery(world(), plan, 0.7, 2, 1);
  Errors errors;
  errors.add(measured(world(), plan, t, {}, 1), t, plan);
  EXPECT_EQ(errors.unknown_fragments, 0);
  EXPECT_LT(most(errors.pose_mm), 0.05);
  EXPECT_LT(most(errors.pose_deg), 0.1);
  EXPECT_LT(most(errors.cut_mm), 0.1);
  EXPECT_LT(most(errors.cut_deg), 0.5);
}

TEST(Outcome, SaysWhatCannotBeKnown) {
  const SurgicalPlan& plan = world().advanced;
  Truth t = surgery(world(), plan, 0, 0, 3);
  const BoxMm box = box_of(t, plan, world());
  // Without the front: it is not there, and nothing is said of its cut.
  t.fragments.pop_back();
  const Outcome o = measure_outcome(plan, world().bones(), postop_ct(t.fragments, box, {}, 3), {});
  ASSERT_EQ(o.fragments.size(), 2U);
  EXPECT_NE(o.fragments[0].known, o.fragments[1].known);
  for (std::size_t n = 0; n < 2; ++n) {
    if (o.fragments[n].known) continue;
    EXPECT_NE(o.fragments[n].why, "");
    EXPECT_FALSE(o.cuts[n].known);
    EXPECT_NE(o.cuts[n].why, "");
  }
  const auto error_of = [&](const SurgicalPlan& p, const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                            const Image& ct) -> std::string {
    return test::error_of([&] { static_cast<void>(measure_outcome(p, bones, ct, {})); });
  };
  const Image empty = postop_ct({}, box, {}, 4);
  EXPECT_NE(error_of(plan, world().bones(), empty).find("not found"), std::string::npos);
  EXPECT_NE(error_of(plan, {}, empty).find("mandible"), std::string::npos);
  SurgicalPlan all = plan;
  all.fragments[0].planned_from_ct.shift_mm = {1, 0, 0};
  EXPECT_NE(error_of(all, world().bones(), empty).find("moves every fragment"), std::string::npos);
}

TEST(Outcome, TouchingFacesAreNotKnown) {
  // Cut, and nothing moved or removed: face upon face.
  SurgicalPlan plan = world().advanced;
  plan.planes[1].at_mm = plan.planes[0].at_mm;
  plan.fragments[1].planned_from_ct = {};
  Truth t;
  const Vec3 at = plan.planes[0].at_mm, e = plan.planes[0].normal;
  t.fragments = {{&world().jaw, {}, {{at, e}}, {}, {}}, {&world().jaw, {}, {{at, -e}}, {}, {}}};
  const Outcome o = measured(world(), plan, t, {}, 5);
  for (const CutOutcome& c : o.cuts) EXPECT_FALSE(c.known) << c.plane;
}

TEST(EdgeReader, FindsABlurredStepAndKeepsAwayFromMetal) {
  Image ct;
  ct.frame.dims = {40, 40, 40};
  ct.frame.spacing_mm = {0.5, 0.5, 0.5};
  const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
  for (int k = 0, n = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i, ++n)
        voxels[static_cast<std::size_t>(n)] =
            static_cast<std::int16_t>(k > 35 ? 3000 : 40 + 1000 * normal_share((9.87 - 0.5 * i) / 0.4));
  ct.voxels = voxels;
  const planning::EdgeReader reader(ct, 200, 2500);
  for (double from = 9; from < 11; from += 0.37) {
    const auto edge = reader.along({from, 10, 10}, {1, 0, 0}, 2);
    ASSERT_TRUE(edge);
    EXPECT_NEAR(from + edge->at_mm, 9.87, 0.02);
  }
  EXPECT_FALSE(reader.along({10, 10, 10}, {-1, 0, 0}, 2)) << "from soft tissue to bone is no edge of bone";
  EXPECT_FALSE(reader.along({10, 10, 10}, {0, 1, 0}, 2));
  EXPECT_FALSE(reader.along({19, 10, 10}, {1, 0, 0}, 2)) << "outside the CT";
  EXPECT_FALSE(planning::EdgeReader(ct, 200, 900).along({10, 10, 10}, {1, 0, 0}, 2)) << "too bright";
}

// On slices of 1 mm, wherever the edge lies between them. One that lies along them is not to be known better than 0.1
// mm: such slices are too far apart for a blur of 0.45 mm.
TEST(EdgeReader, FindsAnEdgeBetweenThickSlices) {
  double most = 0;
  for (const double tilt : {0.6, 0.9, 1.3}) {
    const Vec3 n{std::sin(tilt), 0, std::cos(tilt)};
    Image ct;
    ct.frame.dims = {40, 12, 24};
    ct.frame.spacing_mm = {0.45, 0.45, 1};
    const Vec3 middle{9, 2.5, 11.35};
    const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
    std::size_t at = 0;
    for (int k = 0; k < 24; ++k)
      for (int j = 0; j < 12; ++j)
        for (int i = 0; i < 40; ++i)
          voxels[at++] = static_cast<std::int16_t>(
              std::lround(40 + 1000 * normal_share(-dot(ct.frame.world_from_index(Vec3(i, j, k)) - middle, n) / 0.45)));
    ct.voxels = voxels;
    const planning::EdgeReader reader(ct, 200, 2500);
    for (double beside = -1; beside <= 1; beside += 0.1) {
      const Vec3 place = middle + Vec3{std::cos(tilt), 0, -std::sin(tilt)} * beside;
      const auto edge = reader.along(place, n, 2);
      ASSERT_TRUE(edge);
      most = std::max(most, std::abs(edge->at_mm));
    }
  }
  EXPECT_LT(most, 0.04);
}

TEST(LeastSquares, IntervalsHoldWithErrorsThatGoTogether) {
  // A line through points in patches; all of a patch are off by the same, so 400 points know no more than 40.
  statistics::Random random(3);
  int held = 0;
  const int runs = 2000;
  for (int run = 0; run < runs; ++run) {
    std::vector<planning::Equation<2>> all;
    for (int patch = 0; patch < 40; ++patch) {
      const double off = gaussian(random);
      for (int n = 0; n < 10; ++n)
        all.push_back({{1, 0.1 * patch + 0.01 * n},
                       2 + 0.5 * (0.1 * patch + 0.01 * n) + off + 0.1 * gaussian(random),
                       {patch, 0, 0}});
    }
    const auto s = planning::least_squares<2>(all);
    ASSERT_TRUE(s);
    held += std::abs(s->step[1] - 0.5) <= s->quantile * std::sqrt(s->covariance[1][1]) ? 1 : 0;
  }
  EXPECT_GT(held, 0.93 * runs);
  EXPECT_LT(held, 0.97 * runs);
}

// What the steps of the cuts' profiles are told from: the bone changes along them, or other bone begins.
TEST(EdgeReader, TellsASlopeAndOtherBoneBeyond) {
  const auto reading = [](auto&& hu) {
    Image ct;
    ct.frame.dims = {60, 20, 20};
    ct.frame.spacing_mm = {0.3, 0.5, 0.5};
    const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
    std::size_t n = 0;
    for (int k = 0; k < 20; ++k)
      for (int j = 0; j < 20; ++j)
        for (int i = 0; i < 60; ++i, ++n) voxels[n] = static_cast<std::int16_t>(std::lround(hu(0.3 * i)));
    ct.voxels = voxels;
    return *planning::EdgeReader(ct, 200, 2500).along({9, 5, 5}, {1, 0, 0}, 2);
  };
  const double b = 0.45, blur = std::hypot(b, 0.5);
  // A + B x inside, blurred: A Phi(-x / b) + B (x Phi(-x / b) - b phi(x / b)).
  const auto sloped = reading([&](double at) {
    const double x = at - 9.2;
    return 1000 * normal_share(-x / b) +
           200 * (x * normal_share(-x / b) - b * std::exp(-x * x / (2 * b * b)) / std::sqrt(2 * 3.14159265358979));
  });
  EXPECT_GT(sloped.at_mm, 0.25) << "pulled by the slope";
  EXPECT_NEAR(sloped.at_mm - sloped.pulled * blur, 0.2, 0.02);
  const auto gap =
      reading([&](double at) { return 1000 * (normal_share((9.2 - at) / b) + normal_share((at - 10.7) / b)); });
  EXPECT_GT(gap.rise_hu, 0.5 * gap.drop_hu);
  const auto marrow = reading([&](double at) { return 300 + 700 * normal_share((9.2 - at) / b); });
  EXPECT_NEAR(marrow.beyond_hu, 300, 10);
  EXPECT_LT(marrow.rise_hu, 10);
  EXPECT_NEAR(planning::EdgeReader::blur_mm(marrow.step_hu, marrow.drop_hu), blur, 0.05);
}

// OSTEO_OUTCOME_SEEDS=100 (or 301-350) test_planning --gtest_filter=Outcome.Benchmark: the table of
// docs/validation/planning.md, by then and after each 20 seeds.
TEST(Outcome, Benchmark) {
  const char* seeds = std::getenv("OSTEO_OUTCOME_SEEDS");
  if (seeds == nullptr) GTEST_SKIP() << "OSTEO_OUTCOME_SEEDS is not set";
  struct Kind {
    bool rebuilt, metal;
    Errors errors;
    ContourErrors contours;
    double processor_s = 0;
  };
  std::array<Kind, 4> kinds{
      {{false, false, {}, {}}, {false, true, {}, {}}, {true, false, {}, {}}, {true, true, {}, {}}}};
  const auto line = [](const char* name, std::vector<double> v) {
    std::sort(v.begin(), v.end());
    if (v.empty()) return;
    std::cout << "  " << name << " n " << v.size() << " median " << v[v.size() / 2] << " p95 " << v[v.size() * 95 / 100]
              << " worst " << v.back() << '\n';
  };
  const char* until = std::strchr(seeds, '-');
  const int first = until == nullptr ? 1 : std::atoi(seeds), last = std::atoi(until == nullptr ? seeds : until + 1);
  for (int seed = first; seed <= last; ++seed) {
    for (Kind& k : kinds) {
      const auto start = std::clock();
      const SurgicalPlan& plan = k.rebuilt ? world().rebuilt : world().advanced;
      const auto s = static_cast<std::uint64_t>(seed + (k.metal ? 5000 : 0));
      const Truth t = surgery(world(), plan, k.rebuilt ? 0.7 : 1.5, 3, s);
      PostopCt how;
      how.noise_hu = 30 + 10 * (seed % 4);
      how.spacing_mm = seed % 2 == 0 ? Vec3{0.6, 0.6, 0.75} : Vec3{0.45, 0.45, 1};
      if (k.metal) how.plates.push_back(plate_at(world(), t, plan, 0));
      try {
        const Outcome o = measured(world(), plan, t, how, s);
        k.errors.add(o, t, plan);
        k.contours.add(o, t, plan);
      } catch (const Error& e) {
        std::cout << "seed " << s << ' ' << e.what() << std::endl;
      }
      k.processor_s += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    }
    if (seed % 20 != 0 && seed != last) continue;
    for (const Kind& k : kinds) {
      const Errors& errors = k.errors;
      std::cout << (k.rebuilt ? "rebuilt" : "advanced") << (k.metal ? " metal" : "") << " seeds " << seed
                << " processor_s " << k.processor_s << " unknown fragments " << errors.unknown_fragments << " cuts "
                << errors.unknown_cuts << " sliding " << errors.sliding << '\n';
      line("pose_mm", errors.pose_mm);
      line("pose_deg", errors.pose_deg);
      line("sliding_deg", errors.sliding_deg);
      line("cut_mm", errors.cut_mm);
      line("cut_deg", errors.cut_deg);
      std::cout << "  turns off by over 0.3 degrees " << errors.far[0] << ", held " << errors.far_held[0]
                << "; tilts by over 0.5 " << errors.far[1] << ", held " << errors.far_held[1] << '\n';
      for (int n = 0; n < 4; ++n)
        std::cout << "  held " << n << ": " << errors.held[n] << " of " << errors.asked[n] << " = "
                  << 100.0 * errors.held[n] / std::max(1, errors.asked[n]) << " %, errors over half-widths "
                  << errors.over_half(n, n) << '\n';
      const ContourErrors& c = k.contours;
      std::cout << "  contours and condyles not known " << c.unknown << '\n';
      line("contour against the plan, mean, off mm", c.plan_mm);
      line("contour against the mirrored side, mean, off mm", c.mirrored_mm);
      line("condyle_mm", c.condyle_mm);
      line("condyle_deg", c.condyle_deg);
      for (int n = 0; n < 6; ++n)
        if (c.asked[n] > 0)
          std::cout << "  contour held " << n << ": " << c.held[n] << " of " << c.asked[n]
                    << ", errors over half-widths " << c.over_half(n) << '\n';
      std::cout << std::flush;
    }
  }
  // 93 to 97 %, and two standard errors of so many; values of one fragment are taken for as good as one.
  for (const Kind& k : kinds) {
    for (int n = 0; n < 4; ++n) {
      const double share = k.errors.held[n] / static_cast<double>(std::max(1, k.errors.asked[n]));
      EXPECT_NEAR(share, 0.95, 0.02 + 2 * std::sqrt(0.95 * 0.05 * (n == 2 ? 1 : 3) / std::max(1, k.errors.asked[n])))
          << (k.rebuilt ? "rebuilt" : "advanced") << (k.metal ? " metal " : " ") << n;
    }
  }
}

}  // namespace
}  // namespace osteo
