// What the window says of links and hands, without a screen.
#include "tutor_panel.h"

#include <gtest/gtest.h>

#include "osteo/core/base/translate.h"

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

TEST(TutorPanel, TheCodeIsApartFromWhatIsStarted) {
  const Invitation i = invitation_of("osteo rehearse CASE --join 127.0.0.1:41234\ncode K7MX-2QPA");
  EXPECT_EQ(i.command, "osteo rehearse CASE --join 127.0.0.1:41234");
  EXPECT_EQ(i.code, "K7MX-2QPA");
  EXPECT_TRUE(invitation_of("").code.empty());
}

// Each time that something comes nearer than before counts once, however long it stays.
TEST(TutorPanel, HarmCountsTimes) {
  WorkDone work;
  const auto tick = [&](std::uint32_t structure, float clearance, std::uint32_t flags, std::uint32_t hand = 0) {
    TickRecord t;
    t.structure = structure;
    t.clearance_mm = clearance;
    t.flags = flags;
    t.hand = hand;
    for (int n = 0; n < 3; ++n) work.tick(t, {});
  };
  EXPECT_TRUE(work.harm().empty());
  tick(6, 3, 0);
  EXPECT_TRUE(work.harm().empty()) << "not near";
  tick(6, 1.5F, 0);
  tick(6, 0, kStructureTouched);
  tick(6, -0.1F, kStructureTouched | kStructureInjured);
  tick(6, 1, 0);
  tick(6, 5, 0);
  tick(6, 1, 0);
  tick(7, 0, kStructureTouched, 1);
  const auto harm = work.harm();
  EXPECT_EQ(harm.at(6), (WorkDone::Harm{2, 1, 1}));
  EXPECT_EQ(harm.at(7), (WorkDone::Harm{1, 1, 0})) << "of the other hand";
  EXPECT_TRUE(harm_lines(harm, nullptr).empty()) << "a case without structures has no names for them";
}

// The runner of sessions names who takes part in English, which notes and messages compare; people read their language.
TEST(TutorPanel, WhoTakesPartIsNamedInTheLanguage) {
  const InLanguage german(Language::german);
  TutorNow::Link link;
  for (const std::string who : {"trainee", "watcher", "instructor", "recorded", "you"}) {
    EXPECT_NE(shown_who(who), who);
    EXPECT_EQ(shown_who(who), tr(who));
    link.who = who + " 2";
    EXPECT_EQ(shown_who(link.who), tr(who) + " 2");
    for (const bool heard : {false, true}) {
      link.heard = heard;
      EXPECT_NE(link_text(link).find(tr(who) + " 2"), std::string::npos) << link_text(link);
    }
  }
  EXPECT_EQ(shown_who("2"), "2");
  EXPECT_EQ(shown_who(""), "");
}

}  // namespace
}  // namespace osteo
