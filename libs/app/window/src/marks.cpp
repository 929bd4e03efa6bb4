#include "marks.h"

#include <cmath>

#include "osteo/core/base/json_document.h"

namespace osteo::inline app {
namespace {

// To a micrometre: more would be read as more than it is.
Json list_of(Vec3 v) {
  const auto rounded = [](double x) { return std::round(x * 1000) / 1000; };
  return Json{rounded(v.x), rounded(v.y), rounded(v.z)};
}

}  // namespace

void Ruler::turn(bool on) {
  on_ = on;
  points_.clear();
}

std::optional<double> Ruler::length_mm() const {
  if (points_.size() < 2) return std::nullopt;
  return length(points_[1] - points_[0]);
}

std::optional<std::string> Ruler::click(Vec3 at_mm) {
  if (points_.size() == 2) points_.clear();
  points_.push_back(at_mm);
  if (points_.size() < 2) return std::nullopt;
  return Json{{"from_mm", list_of(points_[0])},
              {"to_mm", list_of(points_[1])},
              {"length_mm", std::round(*length_mm() * 1000) / 1000}}
      .dump();
}

std::optional<std::string> PinnedNotes::pin(Vec3 at_mm, std::string text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return std::nullopt;
  text = text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
  if (text.size() > kMaxBytes) {
    std::size_t end = kMaxBytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // within a letter of UTF-8
    text.resize(end);
  }
  const PinnedNote note{static_cast<int>(notes_.size()) + 1, at_mm, text};
  notes_.push_back(note);
  return Json{{"number", note.number}, {"at_mm", list_of(at_mm)}, {"text", note.text}}.dump();
}

double scale_bar_mm(double pixels_per_mm, double most_pixels) {
  const double most = most_pixels / pixels_per_mm;
  const double decade = std::pow(10, std::floor(std::log10(most)));
  for (const double step : {5.0, 2.0}) {
    if (step * decade <= most) return step * decade;
  }
  return decade;
}

}  // namespace osteo::inline app
