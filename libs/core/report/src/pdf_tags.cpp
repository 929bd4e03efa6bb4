#include "pdf_tags.h"

#include <glib.h>

#include <cstdlib>
#include <map>
#include <string_view>

#include "layout.h"
#include "osteo/core/base/translate.h"

namespace osteo::report {
namespace {

// A text as PDF writes it: UTF-16 in hexadecimal.
std::string pdf_text(const std::string& text) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  const std::string valid = valid_utf8(text);
  glong n = 0;
  gunichar2* const units = g_utf8_to_utf16(valid.data(), static_cast<glong>(valid.size()), nullptr, &n, nullptr);
  std::string hex = "<FEFF";
  for (glong i = 0; i < n; ++i) {
    for (const int shift : {12, 8, 4, 0}) hex += kHex[units[i] >> shift & 15];
  }
  g_free(units);
  return hex + ">";
}

}  // namespace

// cairo writes the dictionaries that want it as text, and where they begin into a table at the end, which moves along.
void describe(std::string& pdf, const std::vector<std::string>& shown) {
  constexpr std::string_view kStart = "startxref\n", kTable = "xref\n0 ";
  constexpr std::size_t kEntry = 20, kDigits = 10;  // of the table, and of the place in an entry
  const auto number_at = [&](std::size_t at) -> std::size_t { return std::strtoull(pdf.c_str() + at, nullptr, 10); };
  const auto start = pdf.rfind(kStart);
  if (start == std::string::npos) return;
  const std::size_t table = number_at(start + kStart.size());
  if (table >= start || pdf.compare(table, kTable.size(), kTable) != 0) return;
  const std::size_t objects = number_at(table + kTable.size()), entries = pdf.find('\n', table + kTable.size()) + 1;
  if (objects > (start - entries) / kEntry) return;
  std::map<std::size_t, std::string> added;  // where
  std::size_t figure = 0;
  for (std::size_t object = 1; object < objects; ++object) {
    const std::size_t at = number_at(entries + object * kEntry);
    const auto opens = [&](std::string_view words) {
      const std::string begin = std::to_string(object) + " 0 obj\n<< /Type /" + std::string(words) + "\n";
      return pdf.compare(at, begin.size(), begin) == 0 ? at + begin.size() : 0;
    };
    if (at >= table) continue;
    if (const auto to = opens("Catalog"); to > 0) {
      added[to] = std::string("   /Lang (") + tr_of("the language of these texts, as HTML names it", "en") +
                  ")\n   /ViewerPreferences << /DisplayDocTitle true >>\n";
    } else if (const auto in = opens("StructElem\n   /S /Figure"); in > 0 && figure < shown.size()) {
      added[in] = "   /Alt " + pdf_text(shown[figure++]) + "\n";
    } else if (const auto th = opens("StructElem\n   /S /TH"); th > 0) {
      added[th] = "   /A << /O /Table /Scope /Column >>\n";
    }
  }
  const auto moved = [&](std::size_t at) {
    std::size_t by = 0;
    for (const auto& [to, text] : added) by += to <= at ? text.size() : 0;
    return std::to_string(at + by);
  };
  pdf.replace(start + kStart.size(), std::to_string(table).size(), moved(table));
  for (std::size_t object = 1; object < objects; ++object) {
    const std::size_t entry = entries + object * kEntry;
    const std::string place = moved(number_at(entry));
    pdf.replace(entry, kDigits, std::string(kDigits - place.size(), '0') + place);
  }
  for (auto it = added.rbegin(); it != added.rend(); ++it) pdf.insert(it->first, it->second);
}

}  // namespace osteo::report
