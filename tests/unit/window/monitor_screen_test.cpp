// The nerve monitor's screen and keys, without a screen.
#include "monitor_screen.h"

#include <gtest/gtest.h>

#include "keys.h"

namespace osteo {
namespace {

MonitorWiring two_channels() {
  MonitorWiring w;
  w.courses.resize(1);
  w.courses[0].name = "facial nerve";
  w.channels = {{0, {"oculi", 250, 4, 0.9}}, {0, {"oris", 550, 3.6, 1}}};
  return w;
}
MonitorSetup setup() {
  return parse_monitor(default_monitor_json(), "built in");
}

MonitorEvent event(MonitorEventKind kind, double at_s, int channel = -1, double uv = 0) {
  MonitorEvent e;
  e.kind = kind;
  e.sample = static_cast<std::uint64_t>(at_s * 30000);
  e.channel = channel;
  e.uv = uv;
  e.seconds = 0.1;
  e.ma = 0.5;
  return e;
}

struct Fed {
  explicit Fed(MonitorScreen& s) : screen(s) {}
  void blocks(std::size_t n, std::int16_t bits) {
    std::vector<std::int16_t> values(300, 0);
    values[2 * 40 + 1] = bits;
    for (std::size_t b = 0; b < n; ++b, at += 150) screen.block({at, 2, values});
  }
  MonitorScreen& screen;
  std::uint64_t at = 0;
};

TEST(MonitorScreen, SweepsAndFreezes) {
  MonitorScreen screen(setup(), two_channels());
  Fed fed(screen);
  fed.blocks(3, 800);
  MonitorScreen::View v = screen.view();
  EXPECT_EQ(v.labels, (std::vector<std::string>{"oculi", "oris"}));
  EXPECT_EQ(v.at, 3u);
  EXPECT_EQ(v.sweep[1][2].most_uv, 200);
  EXPECT_EQ(v.sweep[1][2].least_uv, 0);
  EXPECT_EQ(v.sweep[0][2].most_uv, 0);
  EXPECT_NEAR(v.now_s, 0.015, 1e-9);
  screen.freeze(true);
  fed.blocks(MonitorScreen::kBins, -800);
  EXPECT_TRUE(screen.view().frozen);
  EXPECT_EQ(screen.view().at, 3u);
  screen.freeze(false);
  v = screen.view();
  EXPECT_EQ(v.at, 3u) << "once around";
  EXPECT_EQ(v.sweep[1][2].least_uv, -200);
}

TEST(MonitorScreen, OneLineForWhatAllChannelsHear) {
  MonitorScreen screen(setup(), two_channels());
  Fed fed(screen);
  screen.event(event(MonitorEventKind::activity, 0.001, 0, 110));
  fed.blocks(2, 0);
  EXPECT_TRUE(screen.alarm());
  screen.event(event(MonitorEventKind::burst, 1.000, 0, 150));
  screen.event(event(MonitorEventKind::burst, 1.001, 1, 300));
  screen.event(event(MonitorEventKind::cause, 1.0));
  ASSERT_EQ(screen.log().size(), 1u);
  EXPECT_EQ(screen.log()[0].words, "burst, oris, 100 ms, 300 uV");
  screen.event(event(MonitorEventKind::burst, 1.5, 0, 150));
  screen.event(event(MonitorEventKind::train, 2, 0, 160));
  ASSERT_EQ(screen.log().size(), 3u);
  EXPECT_TRUE(screen.log()[2].alarm);
  fed.blocks(800, 0);
  EXPECT_FALSE(screen.alarm()) << "4 s later";
  for (int i = 0; i < 500; ++i) screen.event(event(MonitorEventKind::burst, 5 + i, 0, 150));
  EXPECT_EQ(screen.log().size(), MonitorScreen::kLines);
  EXPECT_EQ(screen.events(), 503u);
}

TEST(MonitorScreen, AnswersLieOnTheirPulses) {
  MonitorScreen screen(setup(), two_channels());
  Fed fed(screen);
  fed.blocks(1, 0);
  screen.event(event(MonitorEventKind::stimulus, 200.0 / 30000));
  fed.blocks(10, 400);
  screen.event(event(MonitorEventKind::response, 200.0 / 30000, 1, 100));
  const MonitorScreen::View v = screen.view();
  ASSERT_EQ(v.traces[1].size(), 1u);
  EXPECT_EQ(v.traces[1][0].uv.size(), MonitorScreen::kTraceSamples);
  EXPECT_TRUE(v.traces[1][0].answered);
  // The pulse came 50 samples into its block, whose peak at 40 was before it: the next is 140 behind it.
  EXPECT_EQ(v.traces[1][0].uv[140], 100);
  EXPECT_EQ(v.traces[0][0].uv[140], 0);
  for (int i = 0; i < 12; ++i) {
    screen.event(event(MonitorEventKind::stimulus, static_cast<double>(fed.at) / 30000));
    fed.blocks(7, 400);
    screen.event(event(MonitorEventKind::no_response, 0));
  }
  EXPECT_EQ(screen.view().traces[0].size(), MonitorScreen::kTraces);
  EXPECT_FALSE(screen.view().traces[0].back().answered);
  screen.event(event(MonitorEventKind::threshold, 3));
  EXPECT_EQ(screen.threshold_ma(), 0.5);
}

TEST(MonitorScreen, GainsStayWithinTheirSteps) {
  MonitorScreen screen(setup(), two_channels());
  EXPECT_EQ(screen.gain_uv(0), 500);
  screen.change_gain(0, -1);
  EXPECT_EQ(screen.gain_uv(0), 200);
  EXPECT_EQ(screen.gain_uv(1), 500);
  screen.change_gain(0, -100);
  EXPECT_EQ(screen.gain_uv(0), 20);
  screen.change_gain(0, 100);
  EXPECT_EQ(screen.gain_uv(0), 2000);
  screen.change_gain(9, 1);
}

TEST(MonitorKeys, WithCtrlAlone) {
  EXPECT_EQ(find_key('N')->command, Command::sound);
  EXPECT_EQ(find_key('N', kWithCtrl)->command, Command::monitor);
  EXPECT_EQ(find_key('M', kWithCtrl)->command, Command::mute_monitor);
  EXPECT_EQ(find_key('M', kWithShift)->command, Command::mark);
  EXPECT_EQ(key_name(Command::monitor), "Ctrl-N");
  // Ctrl is let go before the letter: nothing stays down.
  Keyboard k;
  k.on('N', Keyboard::Event::pressed, kWithCtrl);
  k.on('N', Keyboard::Event::released, 0);
  ASSERT_EQ(k.frame(false).size(), 1u);
  EXPECT_TRUE(k.frame(false).empty());
  EXPECT_FALSE(k.held(Command::monitor));
}

}  // namespace
}  // namespace osteo
