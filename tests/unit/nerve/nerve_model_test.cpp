// Nerves alone: thresholds against the published fit, what silences, what fires, the middle line of a tube.
#include "osteo/simulation/nerve/detail/nerve_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/simulation/nerve/stimulator.h"

namespace osteo {
namespace {

const MonitorSetup& setup() {
  static const MonitorSetup s = parse_monitor(default_monitor_json(), "built in");
  return s;
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
std::string refusal(const std::string& json) {
  try {
    static_cast<void>(parse_monitor(json, "m.json"));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    return e.what();
  }
  return "taken";
}

TEST(MonitorSetup, IsReadStrictly) {
  const std::string good(default_monitor_json());
  EXPECT_EQ(setup().nerves.size(), 3u);
  EXPECT_EQ(setup().nerves[0].channels[2].name, "orbicularis oris");
  EXPECT_DOUBLE_EQ(setup().constants.soft_ma_per_mm2, 0.11);
  EXPECT_NE(refusal(with(good, R"("value": 0.11, "unit": "mA/mm2")", R"("value": 0.11, "unit": "mA/mm")"))
                .find("soft_ma_per_mm2 is in mA/mm2"),
            std::string::npos);
  EXPECT_NE(refusal(with(good, R"("bare_ma": { "value": 0.21)", R"("bare_ma": { "value": -1)")).find("m.json' line 5"),
            std::string::npos);
  EXPECT_NE(refusal(with(good, R"("contact_mm")", R"("contact_m")")).find("contact_m"), std::string::npos);
  EXPECT_NE(refusal(with(good, R"("source": "50 or 60, by country")", R"("source": "")")).find("no source"),
            std::string::npos);
  EXPECT_NE(refusal(with(good, R"("name": "mentalis")", R"("name": "frontalis")")).find("two channels"),
            std::string::npos);
  EXPECT_NE(refusal(with(good, R"("distal": [0, 0, -1])", R"("distal": [0, 0, 0])")).find("no direction"),
            std::string::npos);
  EXPECT_NE(refusal(with(good, R"("value": 0.05, "unit": "s")", R"("value": 0.5, "unit": "s")"))
                .find("burst_least_s is more"),
            std::string::npos);
  std::string many;
  for (int i = 0; i < 14; ++i)
    many += R"({ "name": "m)" + std::to_string(i) + R"(", "evoked_uv": 1, "latency_ms": 4, "share": 1 }, )";
  EXPECT_NE(refusal(with(good, R"({ "name": "frontalis")", many + R"({ "name": "frontalis")")).find("more than 16"),
            std::string::npos);
}

// Published: 1, 2 and 3 mA fire a nerve through 2.20, 3.80 and 4.80 mm of soft tissue (PMC10071533).
TEST(Threshold, SoftTissueAsMeasured) {
  const MonitorConstants& c = setup().constants;
  const double measured[][2] = {{2.20, 1}, {3.80, 2}, {4.80, 3}};
  for (const auto& [mm, ma] : measured) EXPECT_NEAR(stimulus_threshold_ma(c, mm, 0, 0.1), ma, 0.05 * ma) << mm;
  EXPECT_NEAR(stimulus_threshold_ma(c, 0, 0, 0.1), 0.21, 1e-9) << "bare, as published";
  const double through_bone = stimulus_threshold_ma(c, 0, 1, 0.1);
  EXPECT_GT(through_bone, 1);
  EXPECT_LT(through_bone, 5);
  EXPECT_LT(stimulus_threshold_ma(c, 2, 0.5, 0.3), stimulus_threshold_ma(c, 2, 0.5, 0.1))
      << "a longer pulse needs less";
  double before = 0;
  for (double d = 0; d < 8; d += 0.05) {
    const double now = stimulus_threshold_ma(c, d, 0, 0.1);
    EXPECT_GT(now, before) << d;
    before = now;
  }
}

TEST(Threshold, SearchFindsIt) {
  for (const double truth : {0.05, 0.21, 0.98, 3.1, 4.9}) {
    ThresholdSearch search(0.5);
    int pulses = 0;
    for (; !search.done() && pulses < 100; ++pulses) search.take(search.current_ma() >= truth);
    ASSERT_TRUE(search.threshold_ma()) << truth;
    EXPECT_GE(*search.threshold_ma(), truth);
    EXPECT_LE(*search.threshold_ma(), 1.1 * truth + 1e-9);
    EXPECT_LE(pulses, 36);
  }
  ThresholdSearch deaf(1);
  for (int i = 0; i < 100 && !deaf.done(); ++i) deaf.take(false);
  EXPECT_TRUE(deaf.done());
  EXPECT_FALSE(deaf.threshold_ma());
  ThresholdSearch loud(1);
  for (int i = 0; i < 100 && !loud.done(); ++i) loud.take(true);
  EXPECT_TRUE(loud.done());
  EXPECT_DOUBLE_EQ(*loud.threshold_ma(), StimulatorSetting::kMinMa);
}

TEST(Stimulator, GivesPulsesWhileItTouches) {
  Stimulator s;
  EXPECT_FALSE(s.pulse(0, 150, true)) << "off";
  s.set({0, 1, 10, 0.1, false});
  int pulses = 0;
  for (std::uint64_t at = 0; at < 30000; at += 150) pulses += s.pulse(at, 150, true) ? 1 : 0;
  EXPECT_EQ(pulses, 10);
  for (std::uint64_t at = 30000; at < 60000; at += 150) EXPECT_FALSE(s.pulse(at, 150, false));
  const StimulatorSetting odd = within_range({0, 100, std::nan(""), -1, false});
  EXPECT_EQ(odd.current_ma, 5);
  EXPECT_EQ(odd.pulses_per_s, 1);
  EXPECT_EQ(odd.width_ms, 0.05);
}

// A tube of 0.7 mm around a quarter of a circle of 12 mm, from above to below.
TriMesh bent_tube() {
  TriMesh mesh;
  constexpr std::size_t kRings = 100, kAround = 16;
  for (std::size_t r = 0; r < kRings; ++r) {
    const double turn = 0.5 * std::numbers::pi * static_cast<double>(r) / (kRings - 1);
    const Vec3 out{std::cos(turn), 0, -std::sin(turn)};
    for (std::size_t a = 0; a < kAround; ++a) {
      const double round = 2 * std::numbers::pi * static_cast<double>(a) / kAround;
      const Vec3 p = out * (12 + 0.7 * std::cos(round)) + Vec3{0, 0.7 * std::sin(round), 0};
      mesh.points_mm.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    }
  }
  const auto at = [](std::size_t r, std::size_t a) { return static_cast<std::uint32_t>(r * kAround + a % kAround); };
  for (std::size_t r = 0; r + 1 < kRings; ++r) {
    for (std::size_t a = 0; a < kAround; ++a) {
      mesh.triangles.push_back({at(r, a), at(r + 1, a), at(r + 1, a + 1)});
      mesh.triangles.push_back({at(r, a), at(r + 1, a + 1), at(r, a + 1)});
    }
  }
  return mesh;
}

TEST(NerveCourse, IsTheMiddleOfATube) {
  for (const double down : {-1.0, 1.0}) {
    const NerveCourse course = course_of(bent_tube(), {0, 0, down}, "nerve");
    ASSERT_GT(course.points.size(), 30u);
    double worst = 0;
    for (const auto& p : course.points) {
      worst = std::max(worst, std::abs(std::hypot(p.at_mm.x, p.at_mm.z) - 12));
      EXPECT_NEAR(p.radius_mm, 0.7, 0.15);
    }
    EXPECT_LT(worst, 0.25);  // at the ends, which go straight on
    EXPECT_EQ(course.points.back().to_distal_mm, 0);
    EXPECT_NEAR(course.points.front().to_distal_mm, 12 * std::numbers::pi / 2, 1.5);
    EXPECT_GT((course.points.back().at_mm.z - course.points.front().at_mm.z) * down, 0)
        << "the far end lies where it was said to";
  }
  EXPECT_TRUE(course_of({}, {0, 0, 1}, "none").points.empty());
}

NerveModel straight() {
  NerveCourse course;
  course.name = "facial nerve";
  for (int i = 0; i <= 40; ++i) course.points.push_back({{0, 0, -0.5 * i}, 0.5 * (40 - i), 0.6});
  return NerveModel(setup().constants, {course}, 7);
}
struct Fired {
  int bursts = 0, trains = 0, injuries = 0;
  double train_s = 0;
};
Fired run(NerveModel& model, NerveStress stress, double seconds, const NerveModel::Warmth& warm = {}) {
  Fired f;
  const std::vector<NerveModel::Warmth> all{warm};
  for (double t = 0; t < seconds; t += 0.005) {
    model.step(0.005, {&stress, 1}, all);
    for (const auto& h : model.happenings()) {
      f.bursts += h.cause == NerveCause::mechanical ? 1 : 0;
      f.trains += h.cause == NerveCause::pressure || h.cause == NerveCause::heat ? 1 : 0;
      f.injuries += h.cause == NerveCause::injury ? 1 : 0;
    }
    for (const auto& d : model.discharges()) f.train_s += d.train ? 0.005 : 0;
  }
  return f;
}

TEST(NerveModel, BurstsBeforeTouchTrainsUnderPressure) {
  NerveModel far = straight(), near = straight(), nearer = straight(), pressed = straight(), at_rest = straight();
  EXPECT_EQ(run(far, {0, 20, 1.05, 1.05, 2, true, true}, 60).bursts, 0);
  const int some = run(near, {0, 20, 0.6, 0.6, 2, true, true}, 60).bursts,
            more = run(nearer, {0, 20, 0.1, 0.1, 2, true, true}, 60).bursts;
  // The hazard: 6 (1 - d)^2 a second, 57.6 and 291.6 in a minute; fewer where four go on already.
  EXPECT_NEAR(some, 57.6, 4 * std::sqrt(57.6));
  EXPECT_GT(more, 200);
  EXPECT_EQ(run(at_rest, {0, 20, 0.1, 0.1, 2, false, false}, 60).bursts, 0);
  const Fired train = run(pressed, {0, 20, 0, 0, 0.5, false, false}, 5);
  EXPECT_GT(train.trains, 0);
  EXPECT_GT(train.train_s, 2);
  NerveModel light = straight(), covered = straight();
  EXPECT_EQ(run(light, {0, 20, 0, 0, 0.2, false, false}, 20).trains, 0) << "below the force";
  EXPECT_EQ(run(covered, {0, 20, 0.05, 0.3, 5, false, false}, 20).trains, 0) << "bone between";
}

TEST(NerveModel, HeatFiresThenSilences) {
  NerveModel model = straight();
  NerveModel::Warmth warm;
  warm.celsius.assign(41, 37);
  warm.cem43_min.assign(41, 0);
  EXPECT_EQ(run(model, {0, 20, 5, 0, 0, false, false}, 10, warm).trains, 0);
  warm.celsius[12] = 44;
  EXPECT_GT(run(model, {0, 20, 5, 0, 0, false, false}, 5, warm).trains, 0);
  EXPECT_EQ(model.integrity(0, 12), 1);
  warm.cem43_min[12] = 100;  // log(100/41)/log(240/41) lost
  EXPECT_EQ(run(model, {0, 20, 5, 0, 0, false, false}, 1, warm).injuries, 1);
  EXPECT_NEAR(model.integrity(0, 12), 1 - std::log(100.0 / 41) / std::log(240.0 / 41), 1e-9);
  warm.cem43_min[12] = 300;
  static_cast<void>(run(model, {0, 20, 5, 0, 0, false, false}, 1, warm));
  EXPECT_EQ(model.integrity(0, 12), 0);
  EXPECT_EQ(model.conducts(0, 3), 0) << "nothing from above gets through";
  EXPECT_EQ(model.conducts(0, 30), 1) << "below it the nerve answers as before";
}

TEST(NerveModel, ACutSilences) {
  NerveModel model = straight();
  EXPECT_GT(model.answer(0, 20, 1, 0.3), 0.5);
  EXPECT_EQ(model.answer(0, 20, 0.2, 0.3), 0);
  const Fired f = run(model, {0, 20, -1.3, 0, 1, true, true}, 10);
  EXPECT_EQ(f.injuries, 1) << "one discharge";
  EXPECT_EQ(f.trains, 0) << "then silence, whatever is pressed there";
  EXPECT_EQ(model.integrity(0, 20), 0);
  EXPECT_EQ(model.answer(0, 10, 5, 0.3), 0) << "above the cut";
  EXPECT_GT(model.answer(0, 30, 5, 0.3), 0.5) << "below it: a nerve that answers there may be cut all the same";
  NerveModel grazed = straight();
  static_cast<void>(run(grazed, {0, 20, -0.3, 0, 0, true, true}, 1));
  EXPECT_NEAR(grazed.integrity(0, 20), 1 - 0.3 / 1.2, 1e-12);
}

TEST(NerveModel, SameSeedSameHistory) {
  const auto history = [](std::uint64_t seed) {
    NerveModel model(setup().constants, straight().courses(), seed);
    const NerveStress stress{0, 20, 0.3, 0.3, 1, true, true};
    std::vector<double> all;
    for (int i = 0; i < 2000; ++i) {
      model.step(0.005, {&stress, 1}, {});
      for (const auto& d : model.discharges()) all.insert(all.end(), {d.hz, d.uv, d.left_s});
    }
    return all;
  };
  EXPECT_EQ(history(3), history(3));
  EXPECT_NE(history(3), history(4));
}

}  // namespace
}  // namespace osteo
