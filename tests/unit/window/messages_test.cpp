// The queue of what is told, by a clock of its own.
#include "messages.h"

#include <gtest/gtest.h>

#include "state_facts.h"

namespace osteo {
namespace {

using Rank = Message::Rank;

struct Told {
  Messages messages;
  Messages::Clock::time_point now{};
  std::string after(double seconds) {
    now += std::chrono::duration_cast<Messages::Clock::duration>(std::chrono::duration<double>(seconds));
    const auto shown = messages.shown(now);
    return shown ? shown->text : "";
  }
  void say(const char* text, Rank rank = Rank::information) { messages.say({rank, text}, now); }
};

TEST(Messages, WhatIsSaidStaysFourSeconds) {
  Told t;
  EXPECT_EQ(t.after(1), "");
  t.say("saved");
  EXPECT_EQ(t.after(0), "saved");
  EXPECT_EQ(t.after(3.9), "saved");
  EXPECT_EQ(t.after(0.2), "");
  EXPECT_EQ(t.messages.last(), "saved") << "for who asks later";
  // A picture that took long does not swallow it.
  t.after(60);
  t.say("kept");
  EXPECT_EQ(t.after(0.5), "kept");
}

TEST(Messages, AHigherRankGoesFirstAndTheLowerReturns) {
  Told t;
  t.say("saved");
  EXPECT_EQ(t.after(0), "saved");
  EXPECT_EQ(t.after(1), "saved");
  t.messages.causes({{Rank::harm, "the burr touches a nerve"}});
  EXPECT_EQ(t.after(0), "the burr touches a nerve");
  EXPECT_EQ(t.after(5), "the burr touches a nerve") << "as long as its cause lasts";
  t.messages.causes({});
  EXPECT_EQ(t.after(0), "saved") << "for the rest of its time";
  EXPECT_EQ(t.after(2.9), "saved");
  EXPECT_EQ(t.after(0.2), "");
}

TEST(Messages, WhatHasWaitedTooLongIsNotToldLate) {
  Told t;
  t.say("saved");
  t.messages.causes({{Rank::harm, "harm"}});
  EXPECT_EQ(t.after(10.5), "harm");
  t.messages.causes({});
  EXPECT_EQ(t.after(0), "");
}

TEST(Messages, OfOneRankTheLastIsMeant) {
  Told t;
  t.say("motion 1:2");
  t.say("motion 1:4");
  EXPECT_EQ(t.after(0), "motion 1:4");
  t.say("no bone under the mouse", Rank::hindrance);
  t.say("motion 1:8");
  EXPECT_EQ(t.after(0), "no bone under the mouse");
  EXPECT_EQ(t.after(4), "motion 1:8") << "it comes after it";
}

// Something that lasts for the whole session lets what is said pass.
TEST(Messages, ALastingInformationLetsPassWhatIsSaid) {
  Told t;
  t.messages.causes({{Rank::information, "the voxels are coarse for this burr"}});
  EXPECT_EQ(t.after(0), "the voxels are coarse for this burr");
  t.say("saved");
  EXPECT_EQ(t.after(0), "saved");
  EXPECT_EQ(t.after(4.1), "the voxels are coarse for this burr");
}

TEST(Messages, CausesFollowFromWhatTheBurrDoes) {
  StateFacts f;
  EXPECT_TRUE(causes_of(f).empty());
  f.warning = "the shaft touches bone";
  EXPECT_EQ(causes_of(f).at(0), (Message{Rank::hindrance, f.warning}));
  f.alarm = true;
  EXPECT_EQ(causes_of(f).at(0).rank, Rank::harm);
  f.alarm = false;
  f.lasts = true;
  EXPECT_EQ(causes_of(f).at(0).rank, Rank::information);
}

}  // namespace
}  // namespace osteo
