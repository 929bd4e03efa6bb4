// What segment-network makes of two methods that agree or differ: classes, doubts and what is reported.
#include "agreement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/imaging/image/phantom.h"

namespace osteo {
namespace {

constexpr std::uint8_t kSinus = 1, kCanal = 2, kWithin12 = 3, kUncertain = 4;
constexpr double kBallMm = 4;

struct Subject {
  Image ct;
  NetworkLabels found;
  Vec3 ball;  ///< outward of the sinus' wall
};

/// The phantom's true sinus and canal, with a ball beside the sinus that is called the sinus as well, by a network that
/// knows its boundaries to 1.2 mm everywhere.
Subject sinus_with_ball(bool ball) {
  static const Phantom phantom = [] {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = 0.5;
    p.individual = 4;
    p.noise_hu = 30;
    return make_phantom(p);
  }();
  Subject s{phantom.ct, {}, {}};
  const auto line = HeadAnatomy(4).sigmoid_sinus();
  s.ball = line.front().at_mm;
  for (const TubePoint& p : line)
    if (p.at_mm.y > 20 && std::abs(p.at_mm.z + 22) < std::abs(s.ball.z + 22)) s.ball = p.at_mm;
  s.ball = s.ball + Vec3{6, 0, 0};
  Labels& l = s.found.structures;
  l.frame = s.ct.frame;
  const std::size_t n = l.frame.voxel_count();
  const auto voxels = make_voxels<std::uint8_t>(n), classes = make_voxels<std::uint8_t>(n);
  std::size_t v = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i, ++v) {
        const auto t = static_cast<Tissue>(phantom.labels.voxels[v]);
        const Vec3 p = l.frame.world_from_index({double(i), double(j), double(k)});
        const std::uint8_t value = t == Tissue::sigmoid_sinus || (ball && length(p - s.ball) < kBallMm) ? kSinus
                                   : t == Tissue::ear_canal                                             ? kCanal
                                                                                                        : 0;
        voxels[static_cast<std::ptrdiff_t>(v)] = value;
        classes[static_cast<std::ptrdiff_t>(v)] = value != 0 ? kWithin12 : 0;
      }
  l.voxels = voxels;
  l.structures = {{.value = kSinus, .name = "sigmoid sinus", .within_mm = 1.2},
                  {.value = kCanal, .name = "ear canal", .within_mm = 1.2}};
  s.found.uncertainty.frame = l.frame;
  s.found.uncertainty.voxels = classes;
  return s;
}

std::string reported(const Context& context, const std::string& key) {
  for (const auto& [name, value] : context.take_report())
    if (name == key) return std::get<std::string>(value);
  return {};
}

TEST(Agreement, ADifferenceIsSaidByNameAndPlaceAndDoubted) {
  Subject s = sinus_with_ball(true);
  std::string warned;
  Context heard;
  heard.on_log([&](LogLevel, std::string_view text) { warned += text; });
  join_with_exact(s.ct, s.found, heard);
  std::string differ, agree;
  for (const auto& [name, value] : heard.take_report()) {
    if (name == "disagreement") differ = std::get<std::string>(value);
    if (name == "agreement") agree = std::get<std::string>(value);
  }
  EXPECT_EQ(differ.find("sigmoid sinus differs from find-structures: "), 0U) << differ;
  EXPECT_NE(differ.find("mm apart over"), std::string::npos) << differ;
  EXPECT_NE(differ.find(" at L "), std::string::npos) << differ;
  EXPECT_EQ(agree.find("ear canal within"), 0U) << agree;
  EXPECT_NE(warned.find("two methods disagree"), std::string::npos) << warned;
  const auto& structures = s.found.structures.structures;
  EXPECT_EQ(structures[0].doubt.find("differs from find-structures, "), 0U) << structures[0].doubt;
  EXPECT_EQ(structures[1].doubt, "");
  std::size_t in = 0, out = 0;
  const Labels& u = s.found.uncertainty;
  for (int k = 0; k < u.frame.dims[2]; ++k)
    for (int j = 0; j < u.frame.dims[1]; ++j)
      for (int i = 0; i < u.frame.dims[0]; ++i) {
        if (u.at(i, j, k) != kUncertain) continue;
        const Vec3 p = u.frame.world_from_index({double(i), double(j), double(k)});
        (length(p - s.ball) < kBallMm + 4 ? in : out) += 1;
      }
  EXPECT_GT(in, 20U);
  EXPECT_EQ(out, 0U);
}

TEST(Agreement, WhatBothDrawIsSaidAndNotDoubted) {
  Subject s = sinus_with_ball(false);
  const Context context;
  join_with_exact(s.ct, s.found, context);
  for (const Structure& is : s.found.structures.structures) {
    EXPECT_EQ(is.doubt, "") << is.name;
    EXPECT_EQ(is.within_mm, 1.2) << is.name;
  }
  EXPECT_NE(reported(context, "agreement").find("sigmoid sinus within"), std::string::npos);
}

TEST(Agreement, WhatGoesWrongInComparingDoesNotLoseWhatTheNetworkFound) {
  Subject s = sinus_with_ball(false);
  s.ct.frame.origin_mm.x += 5;  // not the labels' own any more
  const auto before = s.found.structures.voxels;
  std::string warned;
  Context heard;
  heard.on_log([&](LogLevel, std::string_view text) { warned += text; });
  EXPECT_NO_THROW(join_with_exact(s.ct, s.found, heard));
  EXPECT_NE(warned.find("were not compared"), std::string::npos) << warned;
  EXPECT_EQ(s.found.structures.voxels, before);
  EXPECT_EQ(s.found.structures.structures[0].doubt, "");
  // Whoever ends the run ends it here as well.
  Subject again = sinus_with_ball(false);
  const std::atomic<bool> cancelled{true};
  Context stopped;
  stopped.set_cancel_flag(&cancelled);
  EXPECT_THROW(join_with_exact(again.ct, again.found, stopped), Error);
}

TEST(Agreement, NothingIsDoneWithoutNamesThatAreKnown) {
  Subject s = sinus_with_ball(false);
  for (Structure& is : s.found.structures.structures) is.name = "structure " + std::to_string(is.value);
  const auto before = s.found.structures.voxels;
  const Context context;
  join_with_exact(s.ct, s.found, context);
  EXPECT_EQ(s.found.structures.voxels, before);
  EXPECT_TRUE(context.take_report().empty());
}

}  // namespace
}  // namespace osteo
