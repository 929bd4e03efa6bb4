// Switches of dust and heat: of the person's own session, and of another's.
#include "simulation_switches.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

using Changes = std::vector<std::pair<Simulated, bool>>;

TEST(SimulationSwitches, WaterBeginsDustInItsSessionAlone) {
  PersonValues person;
  {
    SimulationSwitches switches(person);
    switches.begin({false, false});
    EXPECT_EQ(switches.take_changes(), Changes{});
    switches.use_water();
    EXPECT_EQ(switches.take_changes(), (Changes{{Simulated::dust, true}}));
    EXPECT_TRUE(person.dust) << "as the switch has to show";
    switches.use_water();
    EXPECT_EQ(switches.take_changes(), Changes{}) << "it is there already";
    switches.begin({true, false});  // R: the next goes on as this one was
    EXPECT_EQ(switches.take_changes(), Changes{});
  }
  EXPECT_FALSE(person.dust) << "nobody has chosen it for other sessions";
  EXPECT_FALSE(person.heat);
}

TEST(SimulationSwitches, WhatIsPressedIsThePersonsChoice) {
  PersonValues person;
  {
    SimulationSwitches switches(person);
    switches.begin({false, false});
    person.heat = true;
    EXPECT_EQ(switches.take_changes(), (Changes{{Simulated::heat, true}}));
    switches.use_water();
    EXPECT_EQ(switches.take_changes(), (Changes{{Simulated::dust, true}}));
    person.dust = false;
    EXPECT_EQ(switches.take_changes(), (Changes{{Simulated::dust, false}}));
    person.dust = true;
    EXPECT_EQ(switches.take_changes(), (Changes{{Simulated::dust, true}}));
  }
  EXPECT_TRUE(person.dust) << "this time by its switch";
  EXPECT_TRUE(person.heat);
}

TEST(SimulationSwitches, WaterInASessionOfOneWhoHasChosenDustChangesNothing) {
  PersonValues person;
  person.dust = true;
  {
    SimulationSwitches switches(person);
    switches.begin({true, false});
    switches.use_water();
    EXPECT_EQ(switches.take_changes(), Changes{});
  }
  EXPECT_TRUE(person.dust);
}

TEST(SimulationSwitches, AnothersSessionIsFollowed) {
  PersonValues person;
  person.heat = true;
  {
    SimulationSwitches switches(person);
    for (int session = 0; session < 2; ++session) {  // R of the host begins the second
      switches.begin({true, false});
      EXPECT_FALSE(switches.follow({true, false})) << "nobody has pressed anything";
      EXPECT_TRUE(person.dust);
      EXPECT_FALSE(person.heat);
    }
    EXPECT_FALSE(switches.follow({false, false})) << "the host has";
    EXPECT_FALSE(person.dust);
    person.dust = true;
    EXPECT_TRUE(switches.follow({false, false})) << "in vain";
    EXPECT_FALSE(person.dust);
  }
  EXPECT_FALSE(person.dust);
  EXPECT_TRUE(person.heat) << "the person's own choice";
}

}  // namespace
}  // namespace osteo
