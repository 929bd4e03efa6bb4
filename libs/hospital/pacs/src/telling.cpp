#include "telling.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>

namespace osteo::inline hospital::pacs {
namespace {

std::optional<std::u32string> utf8(std::string_view text) {
  std::u32string out;
  for (std::size_t n = 0; n < text.size();) {
    const auto first = static_cast<unsigned char>(text[n++]);
    const int more = first < 0x80 ? 0 : (first >> 5U) == 6 ? 1 : (first >> 4U) == 14 ? 2 : (first >> 3U) == 30 ? 3 : -1;
    if (more < 0) return {};
    char32_t c = more == 0 ? first : first & (0x3FU >> static_cast<unsigned>(more));
    for (int k = 0; k < more; ++k, ++n) {
      if (n >= text.size() || (static_cast<unsigned char>(text[n]) >> 6U) != 2) return {};
      c = (c << 6U) | (static_cast<unsigned char>(text[n]) & 0x3FU);
    }
    out += c;
  }
  return out;
}

// Letters of U+00C0 to U+017F without their marks; what is written with two letters is its first, as below.
constexpr std::string_view kPlain =
    "aaaaaaaceeeeiiiidnooooo ouuuuytsaaaaaaaceeeeiiiidnooooo ouuuuyty"
    "aaaaaaccccccccddddeeeeeeeeeegggggggghhhhiiiiiiiiiijjjjkkkllllllllllnnnnnnnnnoooooooorrrrrrssssssssttttttuuuuuuuuuu"
    "uuww"
    "yyyzzzzzzs";
static_assert(kPlain.size() == 0x180 - 0xC0);

// In small letters without marks. Letters of other scripts stay distinguished.
std::string plain_letters(std::string_view text) {
  std::u32string letters;
  if (auto read = utf8(text)) {
    letters = *std::move(read);
  } else {
    for (const char c : text) letters += static_cast<unsigned char>(c);
  }
  std::string out;
  for (const char32_t c : letters) {
    if (c >= 0x300 && c < 0x370) continue;  // a mark of the letter before
    char plain = ' ';
    if (c < 0x80) {
      plain = static_cast<char>(std::tolower(static_cast<int>(c)));
    } else if (c >= 0xC0 && c < 0x180) {
      plain = kPlain[c - 0xC0];
    } else if (c >= 0x180) {
      // Of another script: its number, in letters that no text has.
      for (std::uint32_t rest = c; rest != 0; rest >>= 4U) out += static_cast<char>(0x80 + (rest & 15U));
      continue;
    }
    out += plain;
  }
  return out;
}

// Mueller, Müller and MULLER are one word: ae, oe, ue and ss are a, o, u and s. A few words that differ become one
// ("Baer" and "bar").
std::string joined(std::string_view word) {
  std::string out;
  for (const char c : word) {
    const char last = out.empty() ? ' ' : out.back();
    if ((c == 'e' && (last == 'a' || last == 'o' || last == 'u')) || (c == 's' && last == 's')) continue;
    out += c;
  }
  return out;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool in_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || static_cast<unsigned char>(c) >= 0x80;
}

// Runs of letters and digits; with `apart` letters and digits are different runs.
std::vector<std::string> runs_of(std::string_view text, bool apart) {
  std::vector<std::string> runs(1);
  for (const char c : text) {
    if (!in_word(c) || (apart && !runs.back().empty() && is_digit(runs.back().back()) != is_digit(c)))
      runs.emplace_back();
    if (in_word(c)) runs.back() += c;
  }
  std::erase(runs, std::string());
  return runs;
}

// Of four letters and more, both as they stand and with letters and digits apart: "mueller2" has the word of a name,
// "pid4711" is one number.
std::set<std::string> words_of(std::string_view text) {
  const std::string plain = plain_letters(text);
  std::set<std::string> words;
  for (const bool apart : {false, true})
    for (const std::string& run : runs_of(plain, apart))
      if (run.size() >= 4) words.insert(joined(run));
  return words;
}

// English, German, French, Spanish and Italian, as plain_letters() leaves them.
int month_of(std::string_view word) {
  constexpr std::array<std::string_view, 12> kBegins = {
      "jan ene gen",  "feb fev",         "mar maer mrz", "apr avr abr", "may mai mag", "jun juin giu",
      "jul juil lug", "aug aut ago aou", "sep set",      "oct okt ott", "nov",         "dec dez dic"};
  for (std::size_t m = kBegins.size(); m-- > 0;)
    for (const std::string& begin : runs_of(kBegins[m], false))
      if (word.starts_with(begin)) return static_cast<int>(m) + 1;
  return 0;
}

int number_of(std::string_view digits) {
  int n = 0;
  for (const char c : digits.substr(0, 8)) n = n * 10 + (c - '0');
  return n;
}

// Digits that stand together as those of a telephone number do: with blanks, dashes, strokes, dots, brackets between.
std::vector<std::string> numbers_of(std::string_view text) {
  std::vector<std::string> numbers(1);
  for (const char c : text) {
    if (is_digit(c))
      numbers.back() += c;
    else if (std::string_view(" -/.()+").find(c) == std::string_view::npos)
      numbers.emplace_back();
  }
  return numbers;
}
constexpr std::size_t kTelephoneDigits = 7;  // the last ones: prefixes are written in many ways

}  // namespace

void Telling::add_name(std::string_view text) {
  words_.merge(words_of(text));
  words_.erase("removed");  // our own dummy, and what others have put there before
}

void Telling::add_birth_date(std::string_view date) {
  if (date.size() < 8 || !std::all_of(date.begin(), date.begin() + 8, is_digit)) return;
  days_.push_back({number_of(date.substr(0, 4)), number_of(date.substr(4, 2)), number_of(date.substr(6, 2))});
}

void Telling::add_telephone(std::string_view text) {
  for (const std::string& number : numbers_of(text))
    if (number.size() >= 6)
      telephones_.push_back(number.substr(number.size() - std::min(number.size(), kTelephoneDigits)));
}

std::string_view Telling::found_in(std::string_view text) const {
  for (const std::string& word : words_of(text))
    if (words_.contains(word)) return "a word of a person's name or number";
  if (!telephones_.empty()) {
    for (const std::string& number : numbers_of(text))
      for (const std::string& known : telephones_)
        if (number.find(known) != std::string::npos) return "a person's telephone number";
  }
  if (days_.empty()) return {};
  constexpr std::string_view kDay = "a person's day of birth";
  const std::vector<std::string> runs = runs_of(plain_letters(text), true);
  const auto notifies = [&](std::string_view a, std::string_view b,
                            std::string_view c) {  // in any order that people use
    return std::ranges::any_of(days_, [&](const Day& born) {
      // "04" may be a year, the 4 of a version is none.
      const auto year = [&](std::string_view s) {
        return is_digit(s[0]) &&
               ((s.size() == 4 && number_of(s) == born.year) || (s.size() == 2 && number_of(s) == born.year % 100));
      };
      const auto day = [&](std::string_view s) { return is_digit(s[0]) && number_of(s) == born.day; };
      const auto month = [&](std::string_view s) {
        return (is_digit(s[0]) ? number_of(s) : month_of(s)) == born.month;
      };
      return (year(a) && month(b) && day(c)) || (year(c) && ((day(a) && month(b)) || (month(a) && day(b))));
    });
  };
  for (std::size_t n = 0; n < runs.size(); ++n) {
    const std::string_view r = runs[n];
    if (is_digit(r[0]) && (r.size() == 8 || r.size() == 6)) {
      const std::size_t y = r.size() - 4;  // digits of the year
      if (notifies(r.substr(0, y), r.substr(y, 2), r.substr(y + 2)) ||
          notifies(r.substr(0, 2), r.substr(2, 2), r.substr(4)))
        return kDay;
    }
    // The month may be a word in any place; "4th" leaves "th" behind the day.
    std::vector<std::string_view> parts;
    for (std::size_t k = n; k < runs.size() && parts.size() < 3; ++k) {
      constexpr std::array<std::string_view, 6> kBetween = {"th", "st", "nd", "rd", "de", "of"};
      if (is_digit(runs[k][0]) || month_of(runs[k]) != 0)
        parts.emplace_back(runs[k]);
      else if (k == n || std::ranges::find(kBetween, runs[k]) == kBetween.end())
        break;
    }
    if (parts.size() == 3 && notifies(parts[0], parts[1], parts[2])) return kDay;
  }
  return {};
}

}  // namespace osteo::inline hospital::pacs
