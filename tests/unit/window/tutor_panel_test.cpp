// What the window says of links and hands, without a screen.
#include "tutor_panel.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

TEST(TutorPanel, WordsOfALink) {
  TutorNow::Link l{"trainee", true, 12.34, -3.21, 20.4, 0.053, 0.1, false};
  EXPECT_EQ(link_text(l), "trainee: there and back 12.3 ms, 5 % lost, clock -3.2 ms, +20 ppm");
  l.behind_s = 2;
  l.differs = true;
  EXPECT_NE(link_text(l).find("2.0 s behind"), std::string::npos);
  EXPECT_NE(link_text(l).find("differs"), std::string::npos);
  l.heard = false;
  EXPECT_EQ(link_text(l), "trainee: not heard");
}

TEST(TutorPanel, WhoseBurrTakesBone) {
  std::vector<TickRecord> hands(2);
  EXPECT_EQ(who_cuts({"you", "trainee"}, hands), "nobody");
  hands[1].speed_rpm = 1000;
  EXPECT_EQ(who_cuts({"you", "trainee"}, hands), "nobody");
  hands[1].immersed = 4;
  EXPECT_EQ(who_cuts({"you", "trainee"}, hands), "trainee");
  hands[0] = hands[1];
  EXPECT_EQ(who_cuts({"you", "trainee"}, hands), "you and trainee");
}

TEST(TutorPanel, ALinkThatDropsIsToldOnce) {
  LinkWatch watch;
  TutorNow now;
  EXPECT_FALSE(watch.look(now));
  now.links.push_back({"trainee", true});
  EXPECT_EQ(watch.look(now)->shown, "trainee has joined");
  EXPECT_FALSE(watch.look(now));
  now.links[0].heard = false;
  EXPECT_NE(watch.look(now)->shown.find("has dropped"), std::string::npos);
  EXPECT_FALSE(watch.look(now));
  now.links[0].heard = true;
  EXPECT_NE(watch.look(now)->shown.find("is back"), std::string::npos);
  now.links.clear();
  EXPECT_EQ(watch.look(now)->shown, "trainee has left");
}

}  // namespace
}  // namespace osteo
