// OpenIGTLink's bytes: against published ones, and against everything that can be wrong with them.
#include "osteo/network/wire/igtl.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace osteo {
namespace {

std::vector<IgtlMessage> parsed(IgtlParser& parser, std::span<const std::uint8_t> bytes) {
  std::vector<IgtlMessage> all;
  parser.feed(bytes, [&](const IgtlMessage& m) { all.push_back(m); });
  return all;
}

TEST(Igtl, ChecksumIsThatOfEcma182) {
  const std::string digits = "123456789";  // the check value of the catalogues of CRCs
  EXPECT_EQ(igtl_crc64({reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size()}), 0x6C40DF5F0B497347ULL);
  EXPECT_EQ(igtl_crc64({}), 0u);
}

TEST(Igtl, TransformIsColumnByColumnInBigEndian) {
  const IgtlPose pose{{{Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, -1, 0}}}, Vec3{10, -20.5, 30}};
  const WireBytes m = igtl_transform("Tool", 1.5, pose);
  ASSERT_EQ(m.size(), 58u + 48);
  EXPECT_EQ(m[1], 1);  // version
  EXPECT_EQ(std::string(m.begin() + 2, m.begin() + 11), "TRANSFORM");
  EXPECT_EQ(m[11], 0);
  EXPECT_EQ(std::string(m.begin() + 14, m.begin() + 18), "Tool");
  EXPECT_EQ(m[37], 1);     // seconds
  EXPECT_EQ(m[38], 0x80);  // and half of one
  EXPECT_EQ(m[49], 48);    // body
  const std::uint8_t ten[] = {0x41, 0x20, 0, 0}, minus_20_5[] = {0xC1, 0xA4, 0, 0};
  EXPECT_TRUE(std::equal(ten, ten + 4, m.begin() + 58 + 36));
  EXPECT_TRUE(std::equal(minus_20_5, minus_20_5 + 4, m.begin() + 58 + 40));
  EXPECT_EQ(m[58], 0x3F);          // R11
  EXPECT_EQ(m[58 + 5 * 4], 0x3F);  // R32: the second column's third
}

TEST(Igtl, WhatIsWrittenIsReadAsItWas) {
  WireBytes all;
  const auto add = [&](const WireBytes& m) { all.insert(all.end(), m.begin(), m.end()); };
  const IgtlPose pose{{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, Vec3{1, 2, 3}};
  std::vector<std::int16_t> samples{1, -2, 32764, -32768, 5, 6};
  add(igtl_transform("Tool", 0.25, pose));
  add(igtl_sensor("Force", 0, kIgtlNewton, std::array{1.5, -2.25, 0.0}));
  add(igtl_samples("NerveSignal", 149 / 30000.0, 2, samples));
  add(igtl_string("NerveEvent", 0, "{\"event\":\"train\"}"));
  add(igtl_status("Osteotome", 0, IgtlStatus::ok, 0, "", "fine"));
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, all.size()}) {
    IgtlParser parser(1 << 16);
    int seen = 0;
    for (std::size_t at = 0; at < all.size(); at += piece) {
      ASSERT_TRUE(parser.feed(std::span(all).subspan(at, std::min(piece, all.size() - at)), [&](const IgtlMessage& m) {
        ++seen;
        if (m.type == "TRANSFORM") {
          const auto p = igtl_pose_in(m);
          ASSERT_TRUE(p);
          EXPECT_EQ(p->axes, pose.axes);
          EXPECT_EQ(p->at_mm, pose.at_mm);
          EXPECT_EQ(m.time_s, 0.25);
          EXPECT_TRUE(is_rigid(*p));
        }
        if (m.type == "SENSOR") {
          EXPECT_EQ(igtl_sensor_in(m), (std::vector<double>{1.5, -2.25, 0}));
        }
        if (m.type == "NDARRAY") {
          const auto s = igtl_samples_in(m);
          ASSERT_TRUE(s);
          EXPECT_EQ(s->channels, 2u);
          EXPECT_EQ(s->values, samples);
          EXPECT_EQ(std::llround(m.time_s * 30000), 149);
        }
        if (m.type == "STRING") {
          EXPECT_EQ(igtl_string_in(m), "{\"event\":\"train\"}");
        }
      }));
    }
    EXPECT_EQ(seen, 5) << piece;
    EXPECT_EQ(parser.damaged(), 0u);
  }
}

// The number of a sample is to be had from the header's time for as long as sessions go.
TEST(Igtl, TimesTellEverySampleApart) {
  for (const std::uint64_t sample : {1ull, 29999ull, 30000ull * 3600 + 1, 30000ull * 86400 * 30 + 7}) {
    IgtlParser parser(64);
    const auto m = parsed(parser, igtl_string("x", static_cast<double>(sample) / 30000, ""));
    ASSERT_EQ(m.size(), 1u);
    EXPECT_EQ(static_cast<std::uint64_t>(std::llround(m[0].time_s * 30000)), sample);
  }
}

TEST(Igtl, ExtendedHeaderAndMetadataAreSteppedOver) {
  const IgtlPose pose{{}, Vec3{4, 5, 6}};
  const WireBytes plain = igtl_transform("T", 0, pose);
  WireBytes body{0, 12, 0, 4, 0, 0, 0, 3, 0, 0, 0, 1};  // extended header: 12 bytes, metadata of 4 and 3
  body.insert(body.end(), plain.begin() + 58, plain.end());
  body.insert(body.end(), {0, 0, 9, 9, 9, 9, 9});
  WireBytes m = igtl_message("TRANSFORM", "T", 0, body);
  m[1] = 2;
  IgtlParser parser(4096);
  std::optional<IgtlPose> got;
  parser.feed(m, [&](const IgtlMessage& message) { got = igtl_pose_in(message); });
  ASSERT_TRUE(got);
  EXPECT_EQ(got->at_mm, pose.at_mm);
  // One that lies of its lengths is dropped, and the stream goes on.
  body[1] = 200;
  WireBytes lies = igtl_message("TRANSFORM", "T", 0, body);
  lies[1] = 2;
  EXPECT_TRUE(parsed(parser, lies).empty());
  EXPECT_EQ(parser.damaged(), 1u);
  EXPECT_EQ(parsed(parser, plain).size(), 1u);
}

TEST(Igtl, DamagedLongAndForeignMessages) {
  IgtlParser parser(1000);
  WireBytes wrong = igtl_string("x", 0, "hello");
  wrong.back() ^= 1;
  EXPECT_TRUE(parsed(parser, wrong).empty());
  EXPECT_EQ(parser.damaged(), 1u);
  EXPECT_TRUE(parsed(parser, igtl_string("x", 0, std::string(2000, 'a'))).empty());
  EXPECT_EQ(parser.passed_over(), 1u);
  EXPECT_EQ(parsed(parser, igtl_string("x", 0, "again")).size(), 1u);
  EXPECT_FALSE(parser.feed(WireBytes(58, 'G'), [](const IgtlMessage&) { FAIL(); }));
  EXPECT_FALSE(parser.feed(igtl_string("x", 0, "late"), [](const IgtlMessage&) { FAIL(); }));
  IgtlParser lied(1000);
  WireBytes huge = igtl_string("x", 0, "");
  std::fill(huge.begin() + 42, huge.begin() + 50, 0xff);
  EXPECT_FALSE(lied.feed(huge, [](const IgtlMessage&) { FAIL(); }));
}

TEST(Igtl, MatricesThatAreNoPoses) {
  const IgtlPose good{{}, Vec3{1, 2, 3}};
  EXPECT_TRUE(is_rigid(good));
  IgtlPose p = good;
  p.axes.column[0] = Vec3{2, 0, 0};
  EXPECT_FALSE(is_rigid(p)) << "scaled";
  p = good;
  p.axes.column[2] = Vec3{0, 0, -1};
  EXPECT_FALSE(is_rigid(p)) << "mirrored";
  p = good;
  p.axes.column[1] = normalized(Vec3{0.1, 1, 0});
  EXPECT_FALSE(is_rigid(p)) << "sheared";
  p = good;
  p.at_mm.x = 1e6;
  EXPECT_FALSE(is_rigid(p)) << "far";
  p.at_mm.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_rigid(p));
  IgtlParser parser(100);
  p.at_mm.x = std::numeric_limits<double>::infinity();
  parser.feed(igtl_transform("T", 0, p), [](const IgtlMessage& m) { EXPECT_FALSE(igtl_pose_in(m)); });
  EXPECT_EQ(parser.messages(), 1u);
}

// 20,000 streams of what may come: messages with bytes changed, cut off, doubled, in pieces of any size. Nothing is
// read that was not sent whole.
TEST(Igtl, WhateverComesIsTakenOrLeft) {
  std::mt19937 random(20);
  const auto upto = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n)(random); };
  std::uint64_t taken = 0, left = 0;
  for (int round = 0; round < 20000; ++round) {
    WireBytes all;
    for (std::size_t n = 1 + upto(3); n > 0; --n) {
      std::vector<std::int16_t> samples(2 * upto(20), 7);
      WireBytes m = upto(1) != 0 ? igtl_samples("s", 1, 2, samples) : igtl_transform("t", 1, {});
      switch (upto(4)) {
        case 0:
          m[upto(m.size() - 1)] ^= static_cast<std::uint8_t>(1 + upto(254));
          break;
        case 1:
          m.resize(upto(m.size()));
          break;
        case 2:
          for (std::size_t i = 0; i < 8; ++i) m[42 + i] = static_cast<std::uint8_t>(upto(255));
          break;
        default:
          break;
      }
      all.insert(all.end(), m.begin(), m.end());
    }
    IgtlParser parser(512);
    bool goes_on = true;
    for (std::size_t at = 0; at < all.size() && goes_on;) {
      const std::size_t n = std::min(all.size() - at, 1 + upto(90));
      goes_on = parser.feed(std::span(all).subspan(at, n), [&](const IgtlMessage& m) {
        EXPECT_LE(m.content.size(), 512u);
        static_cast<void>(igtl_pose_in(m));
        static_cast<void>(igtl_sensor_in(m));
        static_cast<void>(igtl_string_in(m));
        if (const auto s = igtl_samples_in(m)) {
          EXPECT_EQ(s->values.size() * 2 + 6, m.content.size());
        }
      });
      at += n;
    }
    taken += parser.messages();
    left += parser.damaged() + parser.passed_over() + (goes_on ? 0 : 1);
  }
  EXPECT_GT(taken, 10000u);
  EXPECT_GT(left, 5000u);
}

}  // namespace
}  // namespace osteo
