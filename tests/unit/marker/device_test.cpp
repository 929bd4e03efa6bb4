// The pen as a hand: pictures are handed in one by one, so nothing hangs on the machine's speed.
#include "osteo/simulation/marker/device.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <opencv2/videoio.hpp>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "render.h"

namespace osteo {
namespace {

using test::pen_pose;

// What a camera would be: pictures come when the test gives them, and it can be unplugged.
struct Feed {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<GrayPicture> waiting;
  bool plugged = true;

  void give(const GrayPicture& p) {
    const std::lock_guard lock(mutex);
    waiting.push_back(p);
    changed.notify_all();
  }
  void plug(bool in) {
    const std::lock_guard lock(mutex);
    plugged = in;
    changed.notify_all();
  }
};

class FedSource final : public PictureSource {
 public:
  explicit FedSource(std::shared_ptr<Feed> feed) : feed_(std::move(feed)) {}
  bool next(GrayPicture& picture) override {
    std::unique_lock lock(feed_->mutex);
    feed_->changed.wait(lock, [&] { return !feed_->waiting.empty() || !feed_->plugged; });
    if (feed_->waiting.empty()) return false;
    picture = std::move(feed_->waiting.front());
    feed_->waiting.pop_front();
    return true;
  }
  [[nodiscard]] bool live() const override { return true; }

 private:
  std::shared_ptr<Feed> feed_;
};

class PenHand : public ::testing::Test {
 protected:
  PenHand() {
    camera_.fps = 0.25;  // a picture holds for ten seconds: a busy machine is not a lost pen
    camera_.latency_ms = 0;
    look_.samples = 2;
    link_ = std::make_shared<PenLink>(
        [feed = feed_]() -> std::unique_ptr<PictureSource> {
          const std::lock_guard lock(feed->mutex);
          if (!feed->plugged) throw Error(ExitCode::no_input, "there is no camera at '/dev/video9'");
          return std::make_unique<FedSource>(feed);
        },
        camera_, Pen{});
  }
  ~PenHand() override { feed_->plug(false); }

  static bool soon(const std::function<bool()>& what) {
    for (int i = 0; i < 6000; ++i) {
      if (what()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  GrayPicture seen(const RigidTransform& pose) { return renderer_.picture(pose, look_); }
  // Given and looked at.
  void give(const GrayPicture& picture, int times = 1) {
    const std::uint64_t before = link_->pictures();
    for (int i = 0; i < times; ++i) feed_->give(picture);
    ASSERT_TRUE(soon([&] { return link_->pictures() >= before + static_cast<std::uint64_t>(times); }));
    // Handed on, too.
    ASSERT_TRUE(soon([&] {
      PenLink::State s;
      return link_->latest(s);
    }));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::unique_ptr<MarkerDevice> device() {
    return std::make_unique<MarkerDevice>(link_, camera_, start_, to_scene_, 1.0, nullptr);
  }
  static DeviceSample run(MarkerDevice& d, int ticks) {
    DeviceSample s;
    for (int t = 0; t < ticks; ++t) s = d.read(0, 1e-3, {});
    return s;
  }

  CameraModel camera_ = test::webcam(640, 480);
  test::Look look_;
  test::Renderer renderer_{camera_, test::pen_faces()};
  std::shared_ptr<Feed> feed_ = std::make_shared<Feed>();
  std::shared_ptr<PenLink> link_;
  HandGoal start_{{100, 20, 30}, {0, 0, 1}, 0, 4};
  Mat3 to_scene_ = controller_from_camera(CameraPlace::facing);
};

TEST_F(PenHand, WaitsUntilThePenIsSeenThenFollowsItAndDrills) {
  const auto d = device();
  HandTuning keys;
  keys.pedal = 255;
  d->tune(keys);
  DeviceSample s = run(*d, 50);
  EXPECT_EQ(s.age_ms, 255);
  EXPECT_EQ(s.pedal, 0);  // no pen, no drill, whatever is pressed
  EXPECT_LT(length(from_floats(s.position_mm) - start_.position_mm), 1e-4);

  const RigidTransform here = pen_pose(320, 20, 5, 5), there = pen_pose(320, 20, 5, 5, {12, -5, 0});
  give(seen(here));
  s = run(*d, 3000);
  EXPECT_EQ(s.age_ms, 0);
  EXPECT_EQ(s.pedal, 255);
  EXPECT_EQ(s.tool, 4);
  EXPECT_LT(length(from_floats(s.position_mm) - start_.position_mm), 0.05);  // it takes hold where the tool is
  EXPECT_GT(dot(from_floats(s.axis), to_scene_ * here.rotation.column[2]), std::cos(0.03));

  std::this_thread::sleep_for(std::chrono::milliseconds(350));  // a gap: the filter begins again, without a speed
  give(seen(there));
  s = run(*d, 3000);
  const Vec3 moved = from_floats(s.position_mm) - start_.position_mm;
  EXPECT_LT(length(moved - to_scene_ * Vec3{12, -5, 0}), 1.5);  // as true as pictures of this size are
  keys.pedal = 0;
  d->tune(keys);
  EXPECT_EQ(run(*d, 1).pedal, 0);

  // The clutch: the pen moves alone.
  keys.clutch = true;
  d->tune(keys);
  std::this_thread::sleep_for(std::chrono::milliseconds(350));
  give(seen(here));
  const DeviceSample held = run(*d, 2000);
  EXPECT_LT(length(from_floats(held.position_mm) - from_floats(s.position_mm)), 0.1);
}

TEST_F(PenHand, UnpluggedTheDrillStopsAndSeenAgainNothingJumps) {
  const auto d = device();
  HandTuning keys;
  keys.pedal = 255;
  d->tune(keys);
  give(seen(pen_pose(320, 20, 5, 5)));
  DeviceSample last = run(*d, 3000);
  ASSERT_EQ(last.pedal, 255);
  feed_->plug(false);
  ASSERT_TRUE(soon([&] { return !link_->connected() && link_->trouble().find("/dev/video9") != std::string::npos; }))
      << link_->trouble();
  DeviceSample s = run(*d, 500);
  EXPECT_EQ(s.age_ms, 255);
  EXPECT_EQ(s.pedal, 0);
  EXPECT_LT(length(from_floats(s.position_mm) - from_floats(last.position_mm)), 0.01);
  // Bone may push it out: nothing pulls it back.
  for (int t = 0; t < 300; ++t) s = d->read(0, 1e-3, {0, 0, 1});
  EXPECT_GT(s.position_mm[2], last.position_mm[2] + 1);

  feed_->plug(true);
  ASSERT_TRUE(soon([&] { return link_->connected(); }));
  give(seen(pen_pose(300, 70, -25, 20, {-50, 30, 0})));
  const Vec3 pushed_mm = from_floats(s.position_mm);
  last = s;
  for (int t = 0; t < 1500; ++t) {
    s = d->read(0, 1e-3, {});
    ASSERT_LT(length(from_floats(s.position_mm) - from_floats(last.position_mm)), 0.05) << t;
    ASSERT_GT(dot(from_floats(s.axis), from_floats(last.axis)), std::cos(0.0025)) << t;
    last = s;
  }
  EXPECT_EQ(s.age_ms, 0);
  EXPECT_EQ(link_->trouble(), "");
  EXPECT_LT(length(from_floats(s.position_mm) - pushed_mm), 0.3);  // where bone had pushed it
}

TEST_F(PenHand, SaysWhatIsWrong) {
  const auto says = [&](const std::string& what) {
    return soon([&] { return link_->trouble().find(what) != std::string::npos; });
  };
  give(GrayPicture{640, 480, std::vector<std::uint8_t>(640 * 480, 4)}, 5);
  EXPECT_TRUE(says("too dark")) << link_->trouble();
  give(GrayPicture{640, 480, std::vector<std::uint8_t>(640 * 480, 150)}, 5);
  EXPECT_TRUE(says("sees no marker of pen 1")) << link_->trouble();
  test::Renderer other(camera_, test::pen_faces(3));
  give(other.picture(pen_pose(320, 20, 5, 5), look_), 5);
  EXPECT_TRUE(says("another pen")) << link_->trouble();
  GrayPicture turned = seen(pen_pose(320, 20, 5, 5));
  mirror(turned);
  give(turned, 14);
  EXPECT_TRUE(says("mirrored")) << link_->trouble();
  // Not the size it was calibrated at: said at each try.
  feed_->give(GrayPicture{320, 240, std::vector<std::uint8_t>(320 * 240, 4)});
  EXPECT_TRUE(says("calibrated at 640 x 480")) << link_->trouble();
}

TEST(Pictures, WhatIsNotACameraIsSaid) {
  const auto code = [](const std::string& from) {
    try {
      static_cast<void>(open_pictures(from));
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::ok;
  };
  EXPECT_EQ(code("/dev/video97"), ExitCode::no_input);
  EXPECT_EQ(code("97"), ExitCode::no_input);
  EXPECT_EQ(code("/nowhere/at/all.avi"), ExitCode::no_input);
}

TEST(Pictures, AVideoStandsForACamera) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "pen.avi").string();
  {
    cv::VideoWriter out(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, {320, 240});
    ASSERT_TRUE(out.isOpened());
    for (int i = 0; i < 5; ++i) out.write(cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(40 * i)));
  }
  const auto video = open_pictures(path);
  EXPECT_FALSE(video->live());
  EXPECT_NEAR(video->fps(), 25, 1e-6);
  GrayPicture p;
  int pictures = 0;
  for (; video->next(p); ++pictures) {
    ASSERT_EQ(p.width, 320);
    EXPECT_NEAR(p.pixels[5000], 40 * pictures, 3);
  }
  EXPECT_EQ(pictures, 5);
  // One that ends is not begun again: the hand is gone, and it is said.
  PenLink link([&] { return open_pictures(path); }, test::webcam(320, 240), Pen{});
  for (int i = 0; i < 6000 && link.trouble() != "the video has ended"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(link.trouble(), "the video has ended");
  EXPECT_EQ(link.pictures(), 5U);
  PenLink::State s;
  ASSERT_TRUE(link.latest(s));
  EXPECT_EQ(s.of_ns, 0);

  const std::string text = (folder.path() / "text.avi").string();
  write_file(text, "not a video");
  EXPECT_THROW(static_cast<void>(open_pictures(text)), Error);
  EXPECT_THROW(static_cast<void>(open_pictures((folder.path()).string())), Error);  // no picture in it
}

TEST(Controller, TheCameraLiesOnItRightHanded) {
  for (const CameraPlace place : {CameraPlace::facing, CameraPlace::above, CameraPlace::behind})
    EXPECT_EQ(determinant(controller_from_camera(place)), 1);
  // What is up in the picture is up, away, up.
  EXPECT_EQ(controller_from_camera(CameraPlace::facing) * (Vec3{0, -1, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(controller_from_camera(CameraPlace::above) * (Vec3{0, -1, 0}), (Vec3{0, 1, 0}));
  EXPECT_EQ(controller_from_camera(CameraPlace::behind) * (Vec3{0, 0, 1}), (Vec3{0, 1, 0}));
}

}  // namespace
}  // namespace osteo
