// The drill brought to the bone while another hand leads this one: let go on the way, led again when it is there.
#include "lead_pause.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "bar.h"
#include "osteo/simulation/haptics/guide.h"
#include "rehearsal_control.h"

namespace osteo {
namespace {

// Far to the side, and as strong as it is let be.
class Leader final : public Device {
 public:
  explicit Leader(std::shared_ptr<std::atomic<bool>> pulls) : pulls_(std::move(pulls)) {}
  DeviceSample read(std::uint64_t, double, Vec3) noexcept override {
    DeviceSample s;
    s.position_mm = {60, 40, 60};
    s.axis = {0, 0, 1};
    s.buttons = *pulls_ ? kLeadStrength : 0;
    return s;
  }
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }

 private:
  std::shared_ptr<std::atomic<bool>> pulls_;
};

struct LedSessionRunner {
  std::shared_ptr<std::atomic<bool>> pulls = std::make_shared<std::atomic<bool>>(true);
  std::unique_ptr<Rehearsal> running;
  std::vector<bool> asked;  // of lead()

  WindowActions actions() {
    WindowActions a;
    a.save = [this] {
      if (running) running->stop();
      running.reset();
    };
    a.begin = [this](bool, const HandView& view) {
      World world(test::bar(0.5, 0.2));
      const HandPose pose =
          PathPlanner(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
      const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
      RehearsalOptions o;
      o.follow.surface = false;
      o.haptics.device = SpringHand::traits();
      o.haptics.more_devices = {SpringHand::traits()};
      HandGuide guide;
      guide.stiffness_n_per_mm = 1;
      guide.most_n = 6;
      o.actions = {action_of(guide)};
      std::vector<std::unique_ptr<Device>> hands;
      hands.push_back(std::make_unique<MouseDevice>(start));
      hands.push_back(std::make_unique<Leader>(pulls));
      running = std::make_unique<Rehearsal>(std::move(world), std::move(hands), o, Context{});
      running->start();
      return start;
    };
    a.rehearsal = [this] { return running.get(); };
    a.folder = [] { return std::filesystem::path(); };
    a.failure = [] { return std::optional<Error>(); };
    a.stop = [] { return false; };
    a.tutor = [this] {
      TutorNow n;
      n.title = "lesson";
      n.leads = true;
      n.guiding = *pulls;
      n.pull = *pulls ? 1 : 0;
      return n;
    };
    a.lead = [this](bool on) {
      asked.push_back(on);
      *pulls = on;
    };
    return a;
  }
};

const ViewAxes kAbove{{0, 0, 120}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}};

bool arrives(RehearsalControl& control) {
  HandInput input;
  input.seconds = 1 / 60.0;
  for (int n = 0; n < 4000; ++n) {
    control.watch();
    control.look_from(kAbove);
    control.hold(input);
    if (!control.leading()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(LeadPause, TheDrillGetsToTheBoneThoughAHandIsLed) {
  LedSessionRunner lesson;
  RehearsalControl control(lesson.actions(), burr_index(BurrKind::cutting, 4, BurrShape::ball), [](Rehearsal&) {});
  control.look_from(kAbove);
  ASSERT_TRUE(control.begin(true, false));
  control.command({Command::bring, 0}, Vec3{0, 0, -1});
  EXPECT_EQ(lesson.asked, (std::vector<bool>{false}));
  EXPECT_NE(control.message().find("let go"), std::string::npos) << control.message();
  ASSERT_TRUE(arrives(control));
  EXPECT_EQ(control.message(), "drill brought to the bone; your hand is led again");
  EXPECT_EQ(lesson.asked, (std::vector<bool>{false, true}));
  // Who had let go stays so.
  *lesson.pulls = false;
  control.command({Command::lift, 0}, {});
  ASSERT_TRUE(arrives(control));
  EXPECT_EQ(control.message(), "drill lifted out");
  EXPECT_EQ(lesson.asked.size(), 2U);
  // A session that ends on the way leaves the wish as it was.
  *lesson.pulls = true;
  control.command({Command::bring, 0}, Vec3{0, 0, -1});
  EXPECT_FALSE(*lesson.pulls);
  ASSERT_TRUE(control.begin(true, true));
  EXPECT_TRUE(*lesson.pulls);
  lesson.running->stop();
}

}  // namespace
}  // namespace osteo
