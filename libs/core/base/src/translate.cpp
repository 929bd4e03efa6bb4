#include "osteo/core/base/translate.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "catalogues.h"

namespace osteo {
namespace {

constexpr auto kLanguageNames = enum_names(Language{});
constexpr char kOfContext = '\4';  // as gettext parts context and text

std::atomic<int> chosen{static_cast<int>(Language::english)};
thread_local int english_here = 0;

// By context and text: its forms in the language.
using Catalogue = std::unordered_map<std::string, std::vector<std::string>>;

// What stands between the first quote of a line and its last.
std::string unquoted(std::string_view line) {
  const auto from = line.find('"'), to = line.rfind('"');
  std::string out;
  if (from == std::string_view::npos || to <= from) return out;
  for (std::size_t n = from + 1; n < to; ++n) {
    if (line[n] != '\\' || n + 1 >= to) {
      out += line[n];
      continue;
    }
    const char c = line[++n];
    if (c == 'n') {
      out += '\n';
    } else if (c == 't') {
      out += '\t';
    } else {
      out += c;
    }
  }
  return out;
}

// An entry while its lines are read.
struct Entry {
  std::string context, id;
  std::vector<std::string> forms;
  std::string* now = nullptr;
  bool fuzzy = false;

  void keep(Catalogue& into) {
    // Guesses of msgmerge, and what is not translated yet, are shown in English.
    const bool whole = !forms.empty() && std::none_of(forms.begin(), forms.end(), [](auto& f) { return f.empty(); });
    if (!id.empty() && whole && !fuzzy) into[context.empty() ? id : context + kOfContext + id] = forms;
    *this = {};
  }
};

Catalogue read_catalogue(std::string_view po) {
  Catalogue all;
  Entry entry;
  std::string plural;  // is looked up by the text for one
  while (!po.empty()) {
    const auto end = po.find('\n');
    const std::string_view line = po.substr(0, end);
    po.remove_prefix(end == std::string_view::npos ? po.size() : end + 1);
    if (line.starts_with("#,") && line.find("fuzzy") != std::string_view::npos) entry.fuzzy = true;
    if (line.starts_with('#')) continue;
    if (line.empty()) {
      entry.keep(all);
    } else if (line.starts_with("msgctxt ")) {
      entry.context = unquoted(line);
      entry.now = &entry.context;
    } else if (line.starts_with("msgid_plural ")) {
      plural = unquoted(line);
      entry.now = &plural;
    } else if (line.starts_with("msgid ")) {
      entry.id = unquoted(line);
      entry.now = &entry.id;
    } else if (line.starts_with("msgstr")) {
      entry.forms.push_back(unquoted(line));
      entry.now = &entry.forms.back();
    } else if (line.starts_with('"') && entry.now != nullptr) {
      *entry.now += unquoted(line);
    }
  }
  entry.keep(all);
  return all;
}

const Catalogue& catalogue(Language language) {
  static std::array<Catalogue, kLanguageNames.size()> all;
  static std::array<std::once_flag, kLanguageNames.size()> read;
  const auto n = static_cast<std::size_t>(language);
  std::call_once(read[n], [&] { all[n] = read_catalogue(catalogue_text(language)); });
  return all[n];
}

// As the heads of the catalogues have it ("Plural-Forms"), which the test of the catalogues compares.
std::size_t form_for(Language language, double n) {
  switch (language) {
    case Language::french:
      return n >= 2 ? 1 : 0;
    case Language::chinese:
      return 0;
    case Language::english:
    case Language::german:
    case Language::spanish:
      break;
  }
  return n == 1 ? 0 : 1;
}

const std::vector<std::string>* forms_of(const std::string& key) {
  const Language now = language();
  if (now == Language::english) return nullptr;
  const Catalogue& all = catalogue(now);
  const auto at = all.find(key);
  return at == all.end() ? nullptr : &at->second;
}

// "de_AT.UTF-8@euro"; nothing where there is no catalogue. Traditional Chinese is not simplified Chinese.
const std::string_view* name_for(std::string_view locale) {
  const std::string_view place = locale.substr(0, locale.find_first_of(".@")),
                         tongue = place.substr(0, place.find('_'));
  if (tongue == "zh" && (place == "zh_TW" || place == "zh_HK" || place == "zh_MO" || place.starts_with("zh_Hant")))
    return nullptr;
  const auto at = std::find_if(kLanguageNames.begin(), kLanguageNames.end(),
                               [&](std::string_view name) { return name.substr(0, name.find('_')) == tongue; });
  return at == kLanguageNames.end() ? nullptr : &*at;
}

Language at_name(const std::string_view* name) {
  return name == nullptr ? Language::english : static_cast<Language>(name - kLanguageNames.data());
}

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

void use_language(Language language) {
  chosen = static_cast<int>(language);
}

Language language() {
  return english_here > 0 ? Language::english : static_cast<Language>(chosen.load());
}

Language language_of_environment() {
  std::string_view locale;
  for (const char* const name : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    if (locale.empty()) locale = variable(name);
  }
  const std::string_view plain = locale.substr(0, locale.find('.'));
  if (plain.empty() || plain == "C" || plain == "POSIX") return Language::english;
  std::string_view wanted = variable("LANGUAGE");
  while (!wanted.empty()) {
    const auto end = wanted.find(':');
    if (const std::string_view* const known = name_for(wanted.substr(0, end))) return at_name(known);
    wanted.remove_prefix(end == std::string_view::npos ? wanted.size() : end + 1);
  }
  return at_name(name_for(locale));
}

Language language_named(std::string_view name) {
  const auto at = std::find(kLanguageNames.begin(), kLanguageNames.end(), name);
  return at == kLanguageNames.end() ? language_of_environment() : at_name(&*at);
}

InLanguage::InLanguage(Language language) : before_(static_cast<Language>(chosen.load())) {
  use_language(language);
}
InLanguage::~InLanguage() {
  use_language(before_);
}

EnglishHere::EnglishHere() {
  ++english_here;
}
EnglishHere::~EnglishHere() {
  --english_here;
}

const char* tr(const char* text) {
  const auto* const forms = forms_of(text);
  return forms == nullptr ? text : forms->front().c_str();
}

std::string tr(const std::string& text) {
  const auto* const forms = forms_of(text);
  return forms == nullptr ? text : forms->front();
}

std::string tr_sized(const std::string& name) {
  const auto digit = name.find_first_of("0123456789");
  if (digit == std::string::npos || digit < 2) return tr(name);
  return tr(name.substr(0, digit - 1)) + " " + shown_figures(name.substr(digit));
}

const char* tr_of(const char* context, const char* text) {
  const auto* const forms = forms_of(std::string(context) + kOfContext + text);
  return forms == nullptr ? text : forms->front().c_str();
}

const char* tr_n(const char* one, const char* many, double n) {
  const auto* const forms = forms_of(one);
  if (forms == nullptr) return form_for(Language::english, n) == 0 ? one : many;
  return (*forms)[std::min(form_for(language(), n), forms->size() - 1)].c_str();
}

std::string filled(std::string_view text, std::initializer_list<Place> places) {
  std::string out;
  while (!text.empty()) {
    const auto open = text.find('{');
    out += text.substr(0, open);
    if (open == std::string_view::npos) break;
    text.remove_prefix(open);
    const auto close = text.find('}');
    const std::string_view name = close == std::string_view::npos ? "" : text.substr(1, close - 1);
    const auto* const at = std::find_if(places.begin(), places.end(), [&](const Place& p) { return p.name == name; });
    if (at == places.end()) {
      out += text.front();
      text.remove_prefix(1);
    } else {
      out += at->value;
      text.remove_prefix(close + 1);
    }
  }
  return out;
}

std::string shown_figures(std::string text) {
  const Language now = language();
  if (now == Language::english || now == Language::chinese) return text;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t n = 1; n + 1 < text.size(); ++n) {
    if (text[n] == '.' && digit(text[n - 1]) && digit(text[n + 1])) text[n] = ',';
  }
  return text;
}

std::string shown_number(double value, int decimals) {
  char out[64];
  std::snprintf(out, sizeof out, "%.*f", decimals, value);
  return shown_figures(out);
}

std::string shown_date(const std::string& iso) {
  constexpr std::string_view kForm = "0000-00-00";
  bool is = iso.size() == kForm.size();
  for (std::size_t n = 0; is && n < iso.size(); ++n)
    is = kForm[n] == '-' ? iso[n] == '-' : iso[n] >= '0' && iso[n] <= '9';
  if (!is) return iso;
  const std::string year = iso.substr(0, 4), month = iso.substr(5, 2), day = iso.substr(8);
  switch (language()) {
    case Language::english:
      break;
    case Language::german:
      return day + "." + month + "." + year;
    case Language::spanish:
    case Language::french:
      return day + "/" + month + "/" + year;
    case Language::chinese:
      return year + "年" + month + "月" + day + "日";
  }
  return iso;
}

std::string_view catalogue_text(Language language) {
  const std::string name = std::string(kLanguageNames[static_cast<std::size_t>(language)]) + ".po";
  const auto* const at =
      std::find_if(std::begin(kCatalogues), std::end(kCatalogues), [&](const auto& c) { return c.first == name; });
  return at == std::end(kCatalogues) ? std::string_view() : at->second;
}

}  // namespace osteo
