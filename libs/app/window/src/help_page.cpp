#include "help_page.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "keys.h"
#include "osteo/core/base/translate.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// In heights of text. What a column needs at least to be read without a break in each second word, and what more would
// only part keys and words.
constexpr float kMinColumnEm = 25, kMaxColumnEm = 34, kKeysEm = 9.6F, kGapEm = 1.2F;
constexpr int kMaxColumns = 4;

float high(const char* text, float wide) {
  return ImGui::CalcTextSize(text, nullptr, false, wide).y;
}

void wrapped(const char* text, ImVec2 at, float wide, Colour colour) {
  ImGui::GetWindowDrawList()->AddText(ImGui::GetFont(), em(), at, im_colour32(colour), text, nullptr, wide);
}

}  // namespace

std::vector<HelpColumn> into_columns(const std::vector<HelpRow>& rows, std::size_t lower, float low, float height) {
  std::vector<HelpColumn> all;
  HelpColumn now;
  float taken = 0;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const float needed = rows[n].height + (rows[n].heading && n + 1 < rows.size() ? rows[n + 1].height : 0);
    const bool ends = n > now.from && !rows[n - 1].heading && taken + needed > (all.size() < lower ? low : height);
    if (ends) {
      now.to = n;
      all.push_back(now);
      now.from = n;
      taken = 0;
    }
    taken += rows[n].height;
  }
  if (!rows.empty()) all.push_back({now.from, rows.size()});
  return all;
}

void HelpPage::turn(int by) {
  page_ = std::clamp(page_ + by, 0, pages_ - 1);
}

void HelpPage::draw(int width, int height, const std::function<void()>& steps) {
  if (!open_) return;
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float e = em(), line = 0.25F * e;
  const ImVec2 pad = ImGui::GetStyle().WindowPadding;
  const float room = w - e - 2 * pad.x;
  const int columns = std::clamp(static_cast<int>((room + kGapEm * e) / ((kMinColumnEm + kGapEm) * e)), 1, kMaxColumns);
  const auto count = static_cast<float>(columns);
  const float column = std::min((room - (count - 1) * kGapEm * e) / count, kMaxColumnEm * e);
  const float keys_wide = std::min(kKeysEm * e, column / 2), text_wide = column - keys_wide - 0.5F * e;

  const std::vector<HelpLine>& lines = help_lines();
  std::vector<HelpRow> rows;
  for (const HelpLine& l : lines) {
    const bool heading = l.keys[0] == '\0';
    rows.push_back(
        {heading ? 1.9F * e
                 : std::max(high(shown_keys(l).c_str(), keys_wide), high(shown_text(l).c_str(), text_wide)) + line,
         heading});
  }
  // Title, what turns the pages, and above the first page's keys what a new user does first.
  const float title = ImGui::GetFrameHeight() + ImGui::GetStyle().ItemSpacing.y,
              foot = ImGui::GetFrameHeightWithSpacing();
  const float above = !steps            ? 0
                      : steps_high_ > 0 ? steps_high_
                                        : (room > 70 * e ? 6 : 9) * e;  // known from the second picture on
  const float most = h - e - title - foot - 2 * pad.y;
  const std::vector<HelpColumn> packed = into_columns(rows, static_cast<std::size_t>(columns), most - above, most);
  pages_ =
      static_cast<int>((packed.size() + static_cast<std::size_t>(columns) - 1) / static_cast<std::size_t>(columns));
  page_ = std::clamp(page_, 0, pages_ - 1);

  const float wide = std::min(w - e, count * column + (count - 1) * kGapEm * e + 2 * pad.x);
  float keys_high = 0;
  for (std::size_t c = 0; c < packed.size(); ++c) {
    float sum = c < static_cast<std::size_t>(columns) ? above : 0;
    for (std::size_t n = packed[c].from; n < packed[c].to; ++n) sum += rows[n].height;
    keys_high = std::max(keys_high, sum);
  }
  const float tall = std::min(h - e, title + keys_high + foot + 2 * pad.y);
  ImGui::SetNextWindowPos({std::floor((w - wide) / 2), std::floor((h - tall) / 2)});
  ImGui::SetNextWindowSize({wide, tall});
  ImGui::Begin(
      tr("Mouse and keys"), &open_,
      ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoScrollbar);
  const float began = ImGui::GetCursorPosY();
  if (steps && page_ == 0) {
    steps();
    ImGui::Separator();
    steps_high_ = ImGui::GetCursorPosY() - began;
  }
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  for (int c = 0; c < columns; ++c) {
    const std::size_t which = static_cast<std::size_t>(page_ * columns + c);
    if (which >= packed.size()) break;
    ImVec2 at{corner.x + static_cast<float>(c) * (column + kGapEm * e), corner.y};
    for (std::size_t n = packed[which].from; n < packed[which].to; ++n) {
      if (rows[n].heading) {
        wrapped(shown_text(lines[n]).c_str(), {at.x, at.y + 0.6F * e}, column, theme().quiet);
      } else {
        wrapped(shown_keys(lines[n]).c_str(), at, keys_wide, palette::kSkyBlue);
        wrapped(shown_text(lines[n]).c_str(), {at.x + keys_wide + 0.5F * e, at.y}, text_wide, theme().text);
      }
      at.y += rows[n].height;
    }
  }
  ImGui::SetCursorPosY(tall - foot - pad.y);  // at the same place on each page
  if (pages_ > 1) {
    if (ImGui::SmallButton(tr("back (Left)"))) turn(-1);
    ImGui::SameLine();
    ImGui::TextUnformatted(
        filled(tr("page {n} of {all}"), {{"n", std::to_string(page_ + 1)}, {"all", std::to_string(pages_)}}).c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton(tr("on (Right)"))) turn(1);
    ImGui::SameLine();
  }
  ImGui::TextDisabled(tr("F1 or Esc closes this"));
  ImGui::End();
}

}  // namespace osteo::inline app
