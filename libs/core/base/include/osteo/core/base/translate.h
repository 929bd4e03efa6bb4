// Texts of windows, reports and review pages in the language of who reads them, from gettext's catalogues. They are
// part of the program, so that they are there wherever it runs; the process' locale stays C, so that files stay as they
// are.
#pragma once
#include <array>
#include <initializer_list>
#include <string>
#include <string_view>

namespace osteo {

enum class Language : int { english, german, spanish, french, chinese };
constexpr std::array<std::string_view, 5> enum_names(Language /*of*/) {
  return {"en", "de", "es", "fr", "zh_CN"};
}

/// Of all texts from now on, in all threads. English until it is called: what is not for people's eyes never asks.
void use_language(Language language);
/// Of this thread's texts now.
[[nodiscard]] Language language();
/// As gettext has it: LANGUAGE (several, by colons, the first that is known), where LC_ALL, LC_MESSAGES and LANG, the
/// first that is set, do not say C. What has no catalogue is English.
[[nodiscard]] Language language_of_environment();
/// By its name in enum_names; any other, such as "auto": that of the environment.
[[nodiscard]] Language language_named(std::string_view name);

/// While it lives, all texts are in this language; then again as before. For a command that makes a page for people.
class InLanguage {
 public:
  explicit InLanguage(Language language);
  ~InLanguage();
  InLanguage(const InLanguage&) = delete;
  InLanguage& operator=(const InLanguage&) = delete;

 private:
  Language before_;
};

/// While it lives, this thread's texts and numbers are English: for what is written into files.
class EnglishHere {
 public:
  EnglishHere();
  ~EnglishHere();
  EnglishHere(const EnglishHere&) = delete;
  EnglishHere& operator=(const EnglishHere&) = delete;
};

/// The text in the language; where the catalogue lacks it, as it is. A literal as argument is found by
/// tests/papers/catalogues.py --update. The result stays valid as long as `text` does.
[[nodiscard]] const char* tr(const char* text);
[[nodiscard]] std::string tr(const std::string& text);  ///< of a table's text, which tr_later() has marked
/// Of a name that ends with a size, "cutting 4 mm": what stands before it is in the catalogue.
[[nodiscard]] std::string tr_sized(const std::string& name);
/// Of a word that says more than one thing: `context` tells which.
[[nodiscard]] const char* tr_of(const char* context, const char* text);
/// One form for one, others for many, by the language's rule.
[[nodiscard]] const char* tr_n(const char* one, const char* many, double n);
/// Marks a text of a table for the catalogues, and leaves it as it is.
[[nodiscard]] constexpr const char* tr_later(const char* text) {
  return text;
}

/// A named place of a text: "{mm} mm of {structure}" has two. Their order is the language's.
struct Place {
  std::string_view name;
  std::string value;
};
/// The text with its places filled. A place without a value stays as it stands.
[[nodiscard]] std::string filled(std::string_view text, std::initializer_list<Place> places);

/// As the language writes numbers: 1.5 or 1,5, and no marks between thousands. Never for files.
[[nodiscard]] std::string shown_number(double value, int decimals);
/// Of a text that is nothing but numbers and units, written as C does: with the language's decimal mark.
[[nodiscard]] std::string shown_figures(std::string text);

/// Of a date as files have it, 2026-11-27: as the language writes it on paper; any other text as it is.
[[nodiscard]] std::string shown_date(const std::string& iso);

/// All of a catalogue, as it was written: for fonts that have to hold its letters. Empty for English.
[[nodiscard]] std::string_view catalogue_text(Language language);

}  // namespace osteo
