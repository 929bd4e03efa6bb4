// Movies of small sessions, read back by OpenCV: how many pictures, what is seen in them, what is not in the file.
#include "osteo/assessment/movie/movie.h"

#include <gtest/gtest.h>

#include <opencv2/videoio.hpp>

#include <cmath>
#include <filesystem>
#include <vector>

#include "evidence/scene.h"
#include "osteo/assessment/movie/movie_file.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/rehearsal.h"
#include "rewrite_session.h"
#include "scratch.h"

namespace osteo {
namespace {

// A slab below z = 4; a hole is drilled at x = y = 0 from 0.2 s to 1.5 s, then the hand rests aside until 5 s.
World block() {
  return test::solid_world(
      [](Vec3 p) {
        return std::min({4 - p.z, p.z + 4, 11 - std::abs(p.x), 11 - std::abs(p.y)});
      },
      0.5, 24);
}
const char* const kFromAbove = "{\"eye_mm\":[0,0,104],\"target_mm\":[0,0,4],\"up\":[0,1,0],\"magnification\":8}";
const char* const kFromAside = "{\"eye_mm\":[0,-100,4],\"target_mm\":[0,0,4],\"up\":[0,0,1],\"magnification\":8}";

Script hole() {
  Script s;
  s.axis = {0.6, 0, 0.8};  // the shaft hides nothing at x < 0
  s.waypoints = {{0, {0, 0, 7}, true},   {0.2, {0, 0, 5.5}, true}, {1.5, {0, 0, 0}, true},
                 {1.6, {0, 0, 7}, true}, {1.9, {9, 9, 9}, false},  {5, {9, 9, 9}, false}};
  return s;
}
void record(const std::filesystem::path& file, const std::vector<const char*>& cameras, bool dust = false,
            std::vector<SceneAction> actions = {}) {
  RehearsalOptions o;
  o.actions = std::move(actions);
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  o.follow.dust = dust;
  Rehearsal r(block(), std::make_unique<ScriptedDevice>(hole(), 1000), o, {});
  for (const char* const c : cameras) r.note("camera", c);
  (void)r.run_to_end({});
}

std::vector<cv::Mat> frames_of(const std::filesystem::path& file) {
  cv::VideoCapture in(file.string());
  std::vector<cv::Mat> frames;
  for (cv::Mat m; in.read(m);) frames.push_back(m.clone());
  return frames;
}
// Mean of all channels in a square around a place.
double brightness(const cv::Mat& m, int x, int y, int half) {
  const cv::Scalar s = cv::mean(m(cv::Rect(x - half, y - half, 2 * half + 1, 2 * half + 1)));
  return (s[0] + s[1] + s[2]) / 3;
}
double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * 3);
}
MovieOptions small() {
  MovieOptions o;
  o.width = 160;
  o.height = 120;
  o.fps = 5;
  o.overlay = false;
  return o;
}
ExitCode code_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.code();
  }
  return ExitCode::ok;
}

SessionSurvey survey_with_idle(std::size_t bins, std::size_t from, std::size_t to) {
  SessionSurvey s;
  s.end_tick = bins * 100;
  s.idle.assign(bins, false);
  std::fill(s.idle.begin() + static_cast<long>(from), s.idle.begin() + static_cast<long>(to), true);
  return s;
}

TEST(MovieTimes, EvenlyThroughTheSessionToItsEnd) {
  const SessionSurvey s = survey_with_idle(100, 0, 0);
  const MovieTimes t = movie_times(s, 2, -1, 4, 25, false);
  ASSERT_EQ(t.ticks.size(), 50U);  // 8 s * 25 / 4
  EXPECT_EQ(t.ticks.front(), 2160U);
  EXPECT_EQ(t.ticks.back(), 10000U);
  EXPECT_EQ(t.left_out_s, 0);
  EXPECT_EQ(movie_times(s, 0, 0.01, 1, 30, false).ticks, std::vector<std::uint64_t>{10});
  EXPECT_EQ(movie_times(s, 0, 99, 1, 30, false).ticks.size(), 300U);
  EXPECT_EQ(code_of([&] { (void)movie_times(s, 10, -1, 1, 30, false); }), ExitCode::usage);
  EXPECT_EQ(code_of([&] { (void)movie_times(s, 5, 4, 1, 30, false); }), ExitCode::usage);
  EXPECT_EQ(code_of([&] { (void)movie_times(survey_with_idle(1000000, 0, 0), 0, -1, 0.1, 120, false); }),
            ExitCode::usage);
  EXPECT_EQ(code_of([&] { (void)movie_times({}, 0, -1, 1, 30, false); }), ExitCode::no_input);
}

TEST(MovieTimes, IdleTimeIsLeftOutButForItsEdges) {
  // Idle from 3 s to 7 s: 0.4 s are shown at either edge.
  const MovieTimes t = movie_times(survey_with_idle(100, 30, 70), 0, -1, 1, 10, true);
  EXPECT_NEAR(t.left_out_s, 4 - 2 * kRestS, 1e-9);
  ASSERT_EQ(t.ticks.size(), 68U);
  for (const std::uint64_t tick : t.ticks) EXPECT_TRUE(tick <= 3400 || tick >= 6600) << tick;
  EXPECT_TRUE(std::is_sorted(t.ticks.begin(), t.ticks.end()));
  EXPECT_EQ(t.ticks.back(), 10000U);
  EXPECT_EQ(movie_times(survey_with_idle(100, 30, 50), 0, -1, 1, 10, true).left_out_s, 0);  // 2 s are no idle time
  EXPECT_NEAR(movie_times(survey_with_idle(100, 0, 100), 0, -1, 1, 10, true).shown_s, 2 * kRestS, 1e-9);
}

// A movie of a part says of its first picture what the whole one says of it: not the force of what came before.
TEST(Movie, APartTellsNothingOfWhatCameBefore) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {kFromAbove});
  const SessionReader session(scratch / "s.oss");
  MovieOptions o = small();
  o.overlay = true;
  o.width = 640;
  o.height = 480;
  o.to_s = 2.6;
  (void)make_movie(session, block(), {}, o, scratch / "whole.mp4");
  o.from_s = 2;
  (void)make_movie(session, block(), {}, o, scratch / "part.mp4");
  const std::vector<cv::Mat> whole = frames_of(scratch / "whole.mp4"), part = frames_of(scratch / "part.mp4");
  ASSERT_EQ(whole.size(), 13U);
  ASSERT_EQ(part.size(), 3U);
  const cv::Rect strip(0, 440, 640, 40);
  EXPECT_LT(difference(whole[10](strip), part[0](strip)), 1.0);
  EXPECT_GT(difference(whole[4](strip), part[0](strip)), 1.0) << "while drilling it says something else";
}

TEST(Movie, ShowsTheHoleAtItsEndFromWhereTheSurgeonLooked) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {kFromAbove});
  const SessionReader session(scratch / "s.oss");
  const SessionSurvey survey = survey_of(session);
  EXPECT_EQ(survey.end_tick, 5000U);
  ASSERT_EQ(survey.views.size(), 1U);
  ASSERT_TRUE(survey.drilled_mm);
  EXPECT_LT(std::abs(survey.drilled_mm->first.x), 0.1);
  EXPECT_NEAR(survey.handle.x, 0.6, 1e-3);
  EXPECT_FALSE(survey.idle[3]);
  EXPECT_TRUE(survey.idle[30]);

  MovieOptions o = small();
  const MovieFacts whole = make_movie(session, block(), {}, o, scratch / "a.mp4");
  EXPECT_TRUE(whole.repeated);
  EXPECT_TRUE(whole.words.empty());
  EXPECT_EQ(whole.frames, 25U);  // 5 s
  const MovieFileFacts file = read_movie_facts(scratch / "a.mp4");
  EXPECT_EQ(file.frames, 25U);
  EXPECT_EQ(file.width, 160);
  EXPECT_NEAR(file.seconds, 5, 0.05);
  EXPECT_EQ(file.codec, "h264");
  const std::vector<cv::Mat> frames = frames_of(scratch / "a.mp4");
  ASSERT_EQ(frames.size(), 25U);
  // 25 mm in 120 pixels: at 9.6 mm to the side lies bone that nothing touched. The hole is darker than it was; the tool
  // has gone aside.
  o.to_s = 0.01;
  (void)make_movie(session, block(), {}, o, scratch / "begin.mp4");
  const std::vector<cv::Mat> begin = frames_of(scratch / "begin.mp4");
  ASSERT_EQ(begin.size(), 1U);
  EXPECT_NEAR(brightness(begin[0], 34, 60, 4), brightness(frames.back(), 34, 60, 4), 4);
  EXPECT_GT(brightness(frames.back(), 34, 60, 4) - brightness(frames.back(), 80, 60, 2), 12);
  // Idle time left out: drilling and its edges remain.
  o = small();
  o.skip_idle = true;
  const MovieFacts brief = make_movie(session, block(), {}, o, scratch / "b.mp4");
  EXPECT_GT(brief.left_out_s, 1.8);
  EXPECT_NEAR(static_cast<double>(brief.frames), (5 - brief.left_out_s) * 5, 1);
  EXPECT_LT(difference(frames_of(scratch / "b.mp4").back(), frames.back()), 2);
}

TEST(Movie, CamerasDifferAndOneIsChosenWhereNoneWasNoted) {
  const test::ScratchFolder scratch;
  record(scratch / "above.oss", {kFromAbove});
  record(scratch / "aside.oss", {kFromAside});
  record(scratch / "none.oss", {"{\"eye_mm\":7}"});
  MovieOptions o = small();
  o.from_s = 4.7;
  (void)make_movie(SessionReader(scratch / "above.oss"), block(), {}, o, scratch / "above.mp4");
  (void)make_movie(SessionReader(scratch / "aside.oss"), block(), {}, o, scratch / "aside.mp4");
  const MovieFacts none = make_movie(SessionReader(scratch / "none.oss"), block(), {}, o, scratch / "none.mp4");
  EXPECT_EQ(none.camera, MovieCamera::fixed);
  ASSERT_EQ(none.words.size(), 2U);
  EXPECT_NE(none.words[1].find("no camera notes"), std::string::npos);
  o.camera = MovieCamera::fixed;
  (void)make_movie(SessionReader(scratch / "above.oss"), block(), {}, o, scratch / "fixed.mp4");
  const cv::Mat above = frames_of(scratch / "above.mp4").back(), fixed = frames_of(scratch / "fixed.mp4").back();
  EXPECT_GT(difference(above, frames_of(scratch / "aside.mp4").back()), 10);
  EXPECT_GT(difference(above, fixed), 10);
  EXPECT_LT(difference(fixed, frames_of(scratch / "none.mp4").back()), 1);
}

TEST(Movie, WhatCannotBeRunAgainIsToldAsRecordedWithTheSameBone) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {kFromAbove}, true);
  MovieOptions o = small();
  o.from_s = 4.7;
  (void)make_movie(SessionReader(scratch / "s.oss"), block(), {}, o, scratch / "again.mp4");
  // Structures that the session did not watch: far from all that is seen.
  Anatomy other;
  other.structures = std::make_shared<const StructureMap>(test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        return length(p - Vec3{0, 0, -10}) < 1 ? 1 : 0;
      },
      {{1, "ball", {}}}, 0.5, 24));
  const MovieFacts reported = make_movie(SessionReader(scratch / "s.oss"), block(), other, o, scratch / "told.mp4");
  EXPECT_FALSE(reported.repeated);
  ASSERT_EQ(reported.words.size(), 1U);
  EXPECT_NE(reported.words[0].find("tenth of a second"), std::string::npos);
  EXPECT_NE(reported.words[0].find("dust lies a little elsewhere"), std::string::npos);
  // Dust that begins later is dust, and what never begins is none.
  for (const bool on : {true, false}) {
    const std::filesystem::path file = scratch / (on ? "on.oss" : "off.oss");
    SceneAction later = SceneAction::simulate(Simulated::dust, on);
    later.tick = 1000;
    record(file, {kFromAbove}, false, {later});
    const MovieFacts facts = make_movie(SessionReader(file), block(), other, o, scratch / "later.mp4");
    ASSERT_EQ(facts.words.size(), 1U);
    EXPECT_EQ(facts.words[0].find("dust lies a little elsewhere") != std::string::npos, on);
  }
  EXPECT_LT(difference(frames_of(scratch / "again.mp4").back(), frames_of(scratch / "told.mp4").back()), 3);
  // Cut short: what there is.
  std::filesystem::copy_file(scratch / "s.oss", scratch / "cut.oss");
  std::filesystem::resize_file(scratch / "cut.oss", std::filesystem::file_size(scratch / "cut.oss") * 3 / 4);
  const SessionReader cut(scratch / "cut.oss", Damage::keep);
  const MovieFacts part = make_movie(cut, block(), {}, small(), scratch / "cut.mp4");
  EXPECT_EQ(part.frames, static_cast<std::uint64_t>(std::llround(survey_of(cut).seconds() * 5)));
  // Another bone.
  EXPECT_EQ(code_of([&] {
              (void)make_movie(SessionReader(scratch / "s.oss"),
                               test::solid_world([](Vec3 p) { return 5 - length(p); }, 0.5, 24), {}, small(),
                               scratch / "x.mp4");
            }),
            ExitCode::corrupt);
}

TEST(Movie, OverlayIsWrittenAlongTheLowerEdgeOnly) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {kFromAbove});
  const SessionReader session(scratch / "s.oss");
  MovieOptions o = small();
  o.to_s = 0.01;
  (void)make_movie(session, block(), {}, o, scratch / "plain.mp4");
  o.overlay = true;
  (void)make_movie(session, block(), {}, o, scratch / "words.mp4");
  const cv::Mat plain = frames_of(scratch / "plain.mp4").front(), words = frames_of(scratch / "words.mp4").front();
  const cv::Rect above(0, 0, 160, 96), strip(0, 104, 160, 16);
  EXPECT_LT(difference(plain(above), words(above)), 1.5);
  EXPECT_GT(difference(plain(strip), words(strip)), 20);
}

TEST(MovieFile, HoldsPicturesAndTheirTimesAndNothingElse) {
  const test::ScratchFolder scratch;
  for (const char* const name : {"a.mp4", "a.webm"}) {
    MovieFile file(scratch / name, 64, 66, 25);
    for (int n = 0; n < 30; ++n) {
      Picture p{64, 66, {}};
      p.rgb.assign(64 * 66 * 3, static_cast<std::uint8_t>(8 * n));
      file.add(p);
    }
    file.finish();
    const MovieFileFacts facts = read_movie_facts(scratch / name);
    EXPECT_EQ(facts.frames, 30U) << name;
    EXPECT_EQ(facts.tags, 0U) << name;
    EXPECT_NEAR(facts.seconds, 1.2, 0.05) << name;
    const std::string bytes = read_text(scratch / name);
    for (const char* const word : {"x264", "Lavc", "libvpx", "creation", "options:"})
      EXPECT_EQ(bytes.find(word), std::string::npos) << name << ": " << word;
    const std::vector<cv::Mat> frames = frames_of(scratch / name);
    ASSERT_EQ(frames.size(), 30U) << name;
    EXPECT_NEAR(brightness(frames[3], 32, 32, 5), 24, 4) << name;
    EXPECT_NEAR(brightness(frames[29], 32, 32, 5), 232, 4) << name;
  }
  // A browser can begin before the end has come: the index stands before the pictures.
  const std::string bytes = read_text(scratch / "a.mp4");
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));
}

TEST(MovieFile, WhatCannotBeMadeIsSaid) {
  const test::ScratchFolder scratch;
  const auto open = [&](const std::string& name, int w, int h, int fps) {
    return code_of([&] { const MovieFile file(scratch / name, w, h, fps); });
  };
  EXPECT_EQ(open("a.avi", 64, 64, 25), ExitCode::usage);
  EXPECT_EQ(open("a.mp4", 63, 64, 25), ExitCode::usage);
  EXPECT_EQ(open("a.mp4", 64, 100000, 25), ExitCode::usage);
  EXPECT_EQ(open("a.mp4", 64, 64, 0), ExitCode::usage);
  EXPECT_EQ(open("no/a.mp4", 64, 64, 25), ExitCode::cannot_write);
  EXPECT_EQ(code_of([&] { (void)read_movie_facts(scratch / "none.mp4"); }), ExitCode::no_input);
  write_file(scratch / "text.mp4", "no movie");
  EXPECT_EQ(code_of([&] { (void)read_movie_facts(scratch / "text.mp4"); }), ExitCode::corrupt);
  // A disk that is full.
  std::filesystem::create_symlink("/dev/full", scratch / "full.webm");
  EXPECT_EQ(code_of([&] {
              MovieFile file(scratch / "full.webm", 640, 480, 25);
              Picture p{640, 480, {}};
              p.rgb.resize(640 * 480 * 3);
              for (std::size_t n = 0; n < p.rgb.size(); ++n)
                p.rgb[n] = static_cast<std::uint8_t>(n * 2654435761U >> 13);
              for (int n = 0; n < 60; ++n) file.add(p);
              file.finish();
            }),
            ExitCode::cannot_write);
}

}  // namespace
}  // namespace osteo
