#include "telling.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

constexpr std::string_view kWord = "a word of a person's name or number", kDay = "a person's day of birth",
                           kTelephone = "a person's telephone number";

TEST(Telling, NamesHoweverTheyAreWritten) {
  for (const char* name : {"M\xC3\xBCller^Hans", "M\xFCller^Hans", "Mueller^Hans", "MULLER^HANS", "Mu\xCC\x88ller"}) {
    pacs::Telling notifying;
    notifying.add_name(name);
    for (const char* text :
         {"Mueller special", "MULLER", "for M\xC3\xBCller", "m\xFCller_2", "MUELLER2", "Mu\xCC\x88ller"})
      EXPECT_EQ(notifying.found_in(text), kWord) << name << " in " << text;
    for (const char* text : {"Miller", "Mill", "SOMATOM Force", "Hr40f", ""})
      EXPECT_EQ(notifying.found_in(text), "") << name << " in " << text;
  }
  for (const auto& [name, text] : {std::pair{"Wei\xC3\x9F", "WEISS"},
                                   {"Wei\xDF", "Weiss"},
                                   {"Ha\xC3\xA5konsen", "haakonsen"},
                                   {"Bj\xC3\xB8rn", "BJORN"},
                                   {"Bj\xC3\xB8rn", "Bjoern"},
                                   {"Dvo\xC5\x99\xC3\xA1k", "dvorak"},
                                   {"\xD0\x98\xD0\xB2\xD0\xB0\xD0\xBD", "xx \xD0\x98\xD0\xB2\xD0\xB0\xD0\xBD"},
                                   {"PID-471147", "471147"}}) {
    pacs::Telling notifying;
    notifying.add_name(name);
    EXPECT_EQ(notifying.found_in(text), kWord) << name << " in " << text;
  }
  pacs::Telling none;
  none.add_name("REMOVED^Kim");  // our own dummy; words of three letters are in every text
  EXPECT_EQ(none.found_in("REMOVED kim"), "");
}

TEST(Telling, TheDayOfBirthInAnyOrder) {
  pacs::Telling notifying;
  notifying.add_birth_date("19610504");
  for (const char* text :
       {"1961-05-04", "04.05.1961", "05/04/1961", "4.5.61", "19610504", "610504", "04051961", "born 4 May 1961",
        "May 4th, 1961", "4. Mai 1961", "4 de mayo de 1961", "4 mai 1961", "1961 May 4"})
    EXPECT_EQ(notifying.found_in(text), kDay) << text;
  for (const char* text : {"1961", "04.05.1962", "5.4.6", "4 June 1961", "1961 slices of 4 mm", "10.04.05", "4.5", ""})
    EXPECT_EQ(notifying.found_in(text), "") << text;
  // A version is no date, though its numbers are those of one.
  pacs::Telling young;
  young.add_birth_date("20040504");
  EXPECT_EQ(young.found_in("VA4.5.4"), "");
  EXPECT_EQ(young.found_in("04.05.04"), kDay);
  const std::pair<const char*, const char*> months[] = {
      {"0105", "5 Januar"},      {"0205", "5 f\xC3\xA9vrier"}, {"0305", "5. M\xC3\xA4rz"},
      {"0405", "5 abril"},       {"0605", "5 juin"},           {"0705", "5 juillet"},
      {"0805", "5 ao\xC3\xBBt"}, {"0905", "5 Sept"},           {"1005", "5 ottobre"},
      {"1105", "5 Nov"},         {"1205", "5. Dezember"}};
  for (const auto& [date, text] : months) {
    pacs::Telling one;
    one.add_birth_date(std::string("1970") + date);
    EXPECT_EQ(one.found_in(std::string(text) + " 1970"), kDay) << text;
    EXPECT_EQ(one.found_in(std::string(text) + " 1971"), "") << text;
  }
  pacs::Telling damaged;
  damaged.add_birth_date("1961");
  damaged.add_birth_date("sometime");
  EXPECT_EQ(damaged.found_in("1961-05-04"), "");
}

TEST(Telling, TheTelephoneWithAnyPrefix) {
  pacs::Telling notifying;
  notifying.add_telephone("+49 (30) 9018-2066");
  for (const char* text : {"030/90182066", "call 0049 30 90182066", "9018 2066", "+49-30-90.18.20.66"})
    EXPECT_EQ(notifying.found_in(text), kTelephone) << text;
  for (const char* text : {"90182067", "2066", "9018 and 2066"}) EXPECT_EQ(notifying.found_in(text), "") << text;
  pacs::Telling few;
  few.add_telephone("ext. 1234");
  EXPECT_EQ(few.found_in("1234"), "");
}

}  // namespace
}  // namespace osteo
