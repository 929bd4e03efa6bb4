#include "osteo/simulation/haptics/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

std::string file_of(const std::string& ar, const std::string& rest = "") {
  return R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1], "speed_mm_s": [20], "models": [{"force_n": 1, "speed_mm_s": 20, "ar": [)" +
         ar + R"(], "noise_n2": 0.01}])" + rest + "}";
}

TEST(Texture, ItsPowerIsThatOfItsSpectrum) {
  const TextureModel model = parse_texture(file_of("-1.2, 0.7"), "t");
  double due = 0, power = 0;
  for (double hz = 0.5; hz < 500; hz += 1) due += spectrum_n2_per_hz(model.nodes[0], hz, 1000);
  Texture t(model, 3);
  for (int i = 0; i < 300; ++i) static_cast<void>(t.step(1, 20));
  constexpr int kSamples = 200000;
  std::vector<double> heard;
  for (int i = 0; i < kSamples; ++i) {
    heard.push_back(t.step(1, 20));
    power += heard.back() * heard.back() / kSamples;
  }
  EXPECT_NEAR(power / due, 1, 0.03);
  // Of second order in closed form: variance / ((1 - a2) / (1 + a2) ((1 + a2)^2 - a1^2)).
  EXPECT_NEAR(due, 0.01 / ((1 - 0.7) / 1.7 * (1.7 * 1.7 - 1.44)), 1e-4 * due);
  // And the model is found again in what was played.
  const TextureModel::Node found = texture_node(heard, 2);
  EXPECT_NEAR(found.reflection[0], model.nodes[0].reflection[0], 0.01);
  EXPECT_NEAR(found.reflection[1], 0.7, 0.01);
  EXPECT_NEAR(found.noise_n2, 0.01, 3e-4);
}

TEST(Texture, FollowsForceAndSpeed) {
  const TextureModel model = parse_texture(
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1, 3], "speed_mm_s": [20, 60], "models": [
        {"force_n": 1, "speed_mm_s": 20, "ar": [0.1], "noise_n2": 0.01}, {"force_n": 3, "speed_mm_s": 20, "ar": [0.1], "noise_n2": 0.09},
        {"force_n": 1, "speed_mm_s": 60, "ar": [0.1], "noise_n2": 0.04}, {"force_n": 3, "speed_mm_s": 60, "ar": [0.1], "noise_n2": 0.16}]})",
      "t");
  const auto rms = [&](double force, double speed) {
    Texture t(model, 5);
    double power = 0;
    for (int i = 0; i < 20000; ++i) power += std::pow(t.step(force, speed), 2);
    return std::sqrt(power / 20000);
  };
  const double unit = std::sqrt(1 - 0.01);  // 1 - a^2
  EXPECT_NEAR(rms(1, 20) * unit, 0.1, 0.004);
  EXPECT_NEAR(rms(2, 40) * unit, 0.25, 0.01);  // amplitudes are interpolated: of 0.1, 0.2, 0.3, 0.4
  EXPECT_NEAR(rms(9, 900) * unit, 0.4, 0.015);
  EXPECT_NEAR(rms(1, 10) * unit, 0.05, 0.002);  // slower than was recorded: in proportion
  EXPECT_EQ(rms(1, 0), 0);
  EXPECT_EQ(rms(0, 20), 0);
  // The same bits again.
  Texture a(model, 7), b(model, 7), c(model, 8);
  bool other = false;
  for (int i = 0; i < 100; ++i) {
    const double v = a.step(1.5, 33);
    EXPECT_EQ(v, b.step(1.5, 33));
    other = other || v != c.step(1.5, 33);
  }
  EXPECT_TRUE(other);
}

// Between two models that ring at different places nothing grows, for an hour of samples.
TEST(Texture, StaysStableBetweenItsModels) {
  const TextureModel model = parse_texture(
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1], "speed_mm_s": [20, 60], "models": [
        {"force_n": 1, "speed_mm_s": 20, "ar": [-1.9, 0.98], "noise_n2": 0.0001}, {"force_n": 1, "speed_mm_s": 60, "ar": [1.9, 0.98], "noise_n2": 0.0001}]})",
      "t");
  Texture t(model, 1);
  for (int i = 0; i < 200000; ++i) ASSERT_LT(std::abs(t.step(1, 20 + (i % 41))), 10);
}

TEST(Texture, TheFileIsCheckedWithItsLine) {
  const auto refused = [](const std::string& text, const std::string& part) {
    try {
      static_cast<void>(parse_texture(text, "t.json"));
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  };
  refused(file_of("-1.2, 1.01"), "not stable");
  refused(file_of("-2.1, 0.9"), "not stable");
  refused(file_of("0.5", ", \"colour\": 1"), "colour");
  refused("{\"osteotome_texture\": 1, \"rate_hz\": 1000,\n\"force_n\": [2, 1], \"speed_mm_s\": [1], \"models\": []}",
          "line 2");
  refused(
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1, 2], "speed_mm_s": [20], "models": [{"force_n": 1, "speed_mm_s": 20, "ar": [0], "noise_n2": 1}]})",
      "one for each");
  refused(
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1], "speed_mm_s": [20], "models": [{"force_n": 2, "speed_mm_s": 20, "ar": [0], "noise_n2": 1}]})",
      "not one of those");
  refused("{}", "osteotome_texture");
  EXPECT_THROW(static_cast<void>(texture_node({1, 2, 3}, 2)), Error);
  EXPECT_THROW(Texture(TextureModel{}, 1), Error);
}

// A spectrum given as numbers is that of the model made from it, and a rational one is found exactly.
TEST(Texture, AModelIsMadeOfASpectrum) {
  const TextureModel model = parse_texture(file_of("-1.2, 0.7"), "t");
  std::vector<double> power;
  for (int i = 0; i <= 4096; ++i) power.push_back(spectrum_n2_per_hz(model.nodes[0], i * 500.0 / 4096, 1000));
  const TextureModel::Node two = node_of_spectrum(power, 1000, 2), many = node_of_spectrum(power, 1000, 30);
  EXPECT_NEAR(two.reflection[0], model.nodes[0].reflection[0], 1e-6);
  EXPECT_NEAR(two.reflection[1], 0.7, 1e-6);
  EXPECT_NEAR(two.noise_n2, 0.01, 1e-6);
  for (double hz = 5; hz < 500; hz += 5)
    EXPECT_NEAR(spectrum_n2_per_hz(many, hz, 1000) / spectrum_n2_per_hz(model.nodes[0], hz, 1000), 1, 1e-3) << hz;
  EXPECT_EQ(node_of_spectrum(std::vector<double>(100, 0), 1000, 5).noise_n2, 0);
  EXPECT_THROW(static_cast<void>(node_of_spectrum(power, 1000, 65)), Error);
  EXPECT_THROW(static_cast<void>(node_of_spectrum({1, 1, 1}, 1000, 2)), Error);
}

TEST(Texture, IsReadAsItWasWritten) {
  const TextureModel model = parse_texture(
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1, 3], "speed_mm_s": [20], "models": [
        {"force_n": 1, "speed_mm_s": 20, "ar": [-1.2, 0.7], "noise_n2": 0.01}, {"force_n": 3, "speed_mm_s": 20, "ar": [0.1, 0.2], "noise_n2": 0.09}]})",
      "t");
  const TextureModel again = parse_texture(texture_json(model, "a test"), "u");
  ASSERT_EQ(again.nodes.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n)
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(again.nodes[n].reflection[i], model.nodes[n].reflection[i], 1e-12);
  EXPECT_EQ(again.forces_n, model.forces_n);
  EXPECT_EQ(again.nodes[1].noise_n2, 0.09);
}

// Played at another rate it has the same spectrum as far as both reach.
TEST(Texture, KeepsItsSpectrumAtAnotherRate) {
  const TextureModel model = parse_texture(file_of("-1.2, 0.7"), "t");
  for (const double rate : {500.0, 2000.0, 4000.0}) {
    const TextureModel other = at_rate(model, rate);
    EXPECT_EQ(other.rate_hz, rate);
    for (double hz = 10; hz < std::min(450.0, 0.45 * rate); hz += 10)
      EXPECT_NEAR(
          10 * std::log10(spectrum_n2_per_hz(other.nodes[0], hz, rate) / spectrum_n2_per_hz(model.nodes[0], hz, 1000)),
          0, 1)
          << rate << " " << hz;
  }
  EXPECT_THROW(static_cast<void>(at_rate(model, 0)), Error);
}

// Across the motion, along the surface, with the file's own power; still where nothing slides or touches.
TEST(Texture, ShakesAcrossTheMotion) {
  const TextureModel model = parse_texture(file_of("-1.2, 0.7"), "t");
  double due = 0, power = 0;
  for (double hz = 0.5; hz < 500; hz += 1) due += spectrum_n2_per_hz(model.nodes[0], hz, 1000);
  const Vec3 normal = normalized(Vec3{1, 2, 3}), along = normalized(cross(normal, {0, 0, 1}));
  SlidingTexture t(model, 1, 1e-3);
  constexpr int kTicks = 60000;
  for (int i = 0; i < kTicks + 500; ++i) {
    const Vec3 f = t.step(along * (0.03 * i), normal, 1);  // 30 mm/s
    EXPECT_NEAR(dot(f, normal), 0, 1e-9);
    EXPECT_NEAR(dot(f, along), 0, 1e-9);
    if (i >= 500) power += dot(f, f) / kTicks;
  }
  EXPECT_NEAR(power / due, 1, 0.05);
  EXPECT_TRUE(t.step({}, normal, 0) == Vec3{});
  SlidingTexture still(model, 1, 1e-3);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(still.step({1, 2, 3}, normal, 1) == Vec3{});
}

// The Penn toolkit's layout, of made-up numbers: a square of four models in two triangles.
std::string hatt(const std::string& from = "", const std::string& to = "") {
  std::string x =
      R"(<?xml version="1.0" encoding="utf-8"?><modelSet texture="1"><material>made up</material><AccelUnits>m/s^2</AccelUnits>
<SpeedUnits>mm/s</SpeedUnits><ForceUnits>N</ForceUnits><SampleRate>1000</SampleRate><mu>0.4</mu><numMod>4</numMod><numTri>2</numTri>)";
  for (const char* tri : {"1 2 3", "2 4 3"}) {
    x += "<tri type=\"array\">";
    for (int i = 0; i < 5; i += 2) x += std::string("<value>") + tri[i] + "</value>";
    x += "</tri>";
  }
  for (int m = 0; m < 4; ++m)
    x += "<model><modNum>" + std::to_string(m + 1) +
         "</modNum><ARcoeff><value>1.0</value><value>-0.5</value></ARcoeff><MAcoeff><value>1</value><value>0.25</"
         "value></MAcoeff><var>" +
         (m % 2 == 0 ? "0" : "4") + "</var><gain>3</gain><speedMod>" + (m % 2 == 0 ? "0" : "120") +
         "</speedMod><forceMod>" + (m < 2 ? "0" : "2") + "</forceMod></model>\n";
  x += "</modelSet>";
  if (!from.empty()) x.replace(x.find(from), from.size(), to);
  return x;
}

TEST(Texture, ReadsTheLayoutOfThePennToolkit) {
  const TextureModel t = parse_hatt(hatt(), "made-up.xml", 0.1);
  EXPECT_EQ(t.rate_hz, 1000);
  ASSERT_EQ(t.nodes.size(), 30U);
  EXPECT_EQ(t.forces_n.back(), 2);
  EXPECT_EQ(t.speeds_mm_s.back(), 120);
  // gain^2 var |1 + 0.25 z|^2 / |1 - 0.5 z|^2 at full speed, times the mass; half the amplitude at half the speed,
  // whatever the force.
  for (double hz = 10; hz < 500; hz += 30) {
    const auto norm = [&](double c) { return 1 + c * c + 2 * c * std::cos(2 * 3.14159265358979 * hz / 1000); };
    const double due = 0.01 * 9 * 2 * 4 / 1000 * norm(0.25) / norm(-0.5);
    for (std::size_t f = 0; f < 5; ++f) {
      EXPECT_NEAR(spectrum_n2_per_hz(t.nodes[f * 6 + 5], hz, 1000) / due, 1, 0.01) << hz;
      EXPECT_NEAR(spectrum_n2_per_hz(t.nodes[f * 6 + 2], hz, 1000) / due, 0.25, 0.003) << hz;
    }
  }
  const auto refused = [](const std::string& text, const std::string& part) {
    try {
      static_cast<void>(parse_hatt(text, "made-up.xml"));
      ADD_FAILURE() << part;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("made-up.xml"), std::string::npos) << e.what();
    }
  };
  refused(hatt("m/s^2", "g"), "AccelUnits");
  refused(hatt("<value>3</value>", "<value>9</value>"), "not there");
  refused(hatt("<numMod>4", "<numMod>5"), "numMod");
  refused(hatt("<value>-0.5</value>", "<value>-1</value>"), "rings");
  refused(hatt("<value>1.0</value>", "<value>2</value>"), "begin with 1");
  refused(hatt("<var>0</var>", ""), "var");
  refused(hatt("<gain>3", "<gain>loud"), "gain");
  refused(hatt("</modelSet>", ""), "XML");
  refused("<other/>", "modelSet");
  EXPECT_THROW(static_cast<void>(parse_hatt(hatt(), "x", 0)), Error);
}

}  // namespace
}  // namespace osteo
