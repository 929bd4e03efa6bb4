// Texts in other languages: the catalogues that are built in, how one is chosen, and that nothing else changes by it.
#include "osteo/core/base/translate.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <string>
#include <thread>

#include "osteo/core/base/json_document.h"

namespace osteo {
namespace {

// English again, whatever a test does.
struct Translate : testing::Test {
  ~Translate() override {
    use_language(Language::english);
    for (const char* const name : kVariables) ::unsetenv(name);
  }
  static constexpr const char* kVariables[] = {"LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG"};
  static Language environment(const char* language, const char* lang, const char* lc_all = "") {
    ::setenv("LANGUAGE", language, 1);
    ::setenv("LANG", lang, 1);
    ::setenv("LC_ALL", lc_all, 1);
    ::unsetenv("LC_MESSAGES");
    return language_of_environment();
  }
};

TEST_F(Translate, IsEnglishUntilSomeoneSaysOtherwise) {
  ::setenv("LANG", "de_DE.UTF-8", 1);
  const char* const text = "the rotating burr touches {structure}";
  EXPECT_EQ(tr(text), text) << "the same pointer";
  EXPECT_STREQ(tr_n("one", "many", 1), "one");
  EXPECT_STREQ(tr_n("one", "many", 0), "many");
  EXPECT_EQ(shown_number(1.25, 2), "1.25");
  EXPECT_EQ(shown_date("2026-11-27"), "2026-11-27");
}

TEST_F(Translate, SaysItInEachLanguage) {
  const std::pair<Language, const char*> kEnds[] = {
      {Language::german, "Ende"}, {Language::spanish, "Fin"}, {Language::french, "Fin"}, {Language::chinese, "结束"}};
  for (const auto& [language, word] : kEnds) {
    use_language(language);
    EXPECT_STREQ(tr("End"), word);
    EXPECT_EQ(tr(std::string("End")), word);
    EXPECT_STREQ(tr("no catalogue has this"), "no catalogue has this");
    EXPECT_STRNE(tr_of("seen from", "left"), "left");
    EXPECT_FALSE(catalogue_text(language).empty());
  }
  use_language(Language::german);
  // One word that says two things, and a name with its size.
  EXPECT_STREQ(tr_of("look", "clear"), "klar");
  EXPECT_STREQ(tr("clear"), "frei");
  EXPECT_EQ(tr_sized("diamond 3 mm"), "Diamant 3 mm");
  EXPECT_EQ(tr_sized("diamond cylinder 2.5 mm"), "Diamant, Zylinder 2,5 mm");
}

TEST_F(Translate, PluralsGoByTheLanguage) {
  const auto says = [](Language language, double n) {
    use_language(language);
    return std::string(tr_n("touch of a structure", "touches of structures", n));
  };
  EXPECT_EQ(says(Language::german, 1), "Berührung einer Struktur");
  EXPECT_EQ(says(Language::german, 0), "Berührungen von Strukturen");
  EXPECT_EQ(says(Language::french, 0), "contact avec une structure") << "0 is one of one in French";
  EXPECT_EQ(says(Language::french, 2), "contacts avec des structures");
  EXPECT_EQ(says(Language::chinese, 1), says(Language::chinese, 5));
}

TEST_F(Translate, TakesTheEnvironmentAsGettextDoes) {
  EXPECT_EQ(environment("", "de_AT.UTF-8"), Language::german);
  EXPECT_EQ(environment("", "de_DE@euro"), Language::german);
  EXPECT_EQ(environment("", "es_MX.UTF-8", "fr_CA.UTF-8"), Language::french) << "LC_ALL goes before LANG";
  EXPECT_EQ(environment("it:es:de", "it_IT.UTF-8"), Language::spanish) << "the first that there is";
  EXPECT_EQ(environment("en", "de_DE.UTF-8"), Language::english);
  EXPECT_EQ(environment("de", "C"), Language::english) << "LANGUAGE says nothing in the locale C";
  EXPECT_EQ(environment("de", "C.UTF-8"), Language::english);
  EXPECT_EQ(environment("de", ""), Language::english);
  EXPECT_EQ(environment("", "it_IT.UTF-8"), Language::english);
  EXPECT_EQ(environment("", "zh_CN.UTF-8"), Language::chinese);
  EXPECT_EQ(environment("", "zh_SG.UTF-8"), Language::chinese);
  EXPECT_EQ(environment("", "zh_TW.UTF-8"), Language::english) << "is written with other characters";
  environment("", "fr_FR.UTF-8");
  EXPECT_EQ(language_named("es"), Language::spanish);
  EXPECT_EQ(language_named("auto"), Language::french);
}

TEST_F(Translate, PlacesAreFilledInTheOrderOfTheText) {
  EXPECT_EQ(filled("{b} of {a}, {b}", {{"a", "1"}, {"b", "2"}}), "2 of 1, 2");
  EXPECT_EQ(filled("{a} and {nobody}", {{"a", "{b}"}, {"b", "x"}}), "{b} and {nobody}") << "values are not looked into";
  EXPECT_EQ(filled("an open { and }", {{"a", "1"}}), "an open { and }");
  EXPECT_EQ(filled("", {}), "");
}

TEST_F(Translate, NumbersAndDatesAreTheLanguages) {
  use_language(Language::german);
  EXPECT_EQ(shown_number(-0.5, 1), "-0,5");
  EXPECT_EQ(shown_figures("1.5 mm, 20 N."), "1,5 mm, 20 N.");
  EXPECT_EQ(shown_date("2026-11-27"), "27.11.2026");
  EXPECT_EQ(shown_date("tomorrow"), "tomorrow");
  use_language(Language::french);
  EXPECT_EQ(shown_date("2026-11-27"), "27/11/2026");
  use_language(Language::chinese);
  EXPECT_EQ(shown_number(0.5, 1), "0.5");
  EXPECT_EQ(shown_date("2026-11-27"), "2026年11月27日");
}

TEST_F(Translate, FilesStayAsTheyAre) {
  use_language(Language::german);
  EXPECT_NE((Json{{"mm", 0.5}}).dump().find("0.5"), std::string::npos);
  EXPECT_STREQ(std::setlocale(LC_ALL, nullptr), "C") << "the process' locale is nobody's to set";
  {
    const EnglishHere files;
    EXPECT_STREQ(tr("End"), "End");
    EXPECT_EQ(shown_number(0.5, 1), "0.5");
    // Other threads go on in the language.
    std::string other;
    std::thread([&] { other = tr("End"); }).join();
    EXPECT_EQ(other, "Ende");
  }
  EXPECT_STREQ(tr("End"), "Ende");
  {
    const InLanguage theirs(Language::spanish);
    EXPECT_STREQ(tr("End"), "Fin");
  }
  EXPECT_STREQ(tr("End"), "Ende");
}

}  // namespace
}  // namespace osteo
