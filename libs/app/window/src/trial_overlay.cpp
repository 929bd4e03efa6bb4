#include "trial_overlay.h"

#include <imgui.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {

void TrialOverlay::begin(const ScopeView& start, Vec3 middle_mm) {
  ScopeView from = start;
  from.focus_mm = middle_mm;
  trial_.emplace(camera_targets(from, kTargets, 1));
}

void TrialOverlay::draw(const ScopeView& view, const PictureArea& area) const {
  if (!running()) return;
  const ScopeView& t = *trial_->target();
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const bool close = close_to(view, t, {});
  const ImU32 ink = close ? IM_COL32(120, 230, 140, 255) : IM_COL32(255, 205, 90, 255);
  // The nearer ring is smaller as seen from the target, so that both are seen there.
  const auto ring = [&](double nearer_mm, double share) {
    constexpr int kAround = 64;
    std::array<ImVec2, kAround> points;
    for (int n = 0; n < kAround; ++n) {
      const double a = 2 * std::numbers::pi * n / kAround, r = share * t.field_mm() / 2;
      const auto p =
          view.pixel(t.focus_mm + t.back * nearer_mm + t.right() * (r * std::cos(a)) + t.up * (r * std::sin(a)), area);
      if (!p) return;
      points[static_cast<std::size_t>(n)] = {static_cast<float>((*p)[0]), static_cast<float>((*p)[1])};
    }
    list->AddPolyline(points.data(), kAround, ink, ImDrawFlags_Closed, 2.5F);
  };
  list->PushClipRect({static_cast<float>(area.x), static_cast<float>(area.y)},
                     {static_cast<float>(area.x + area.width), static_cast<float>(area.y + area.height)});
  ring(0, 0.96);
  ring(t.field_mm() / 2, 0.3);
  const auto middle = view.pixel(t.focus_mm, area), top = view.pixel(t.focus_mm + t.up * (0.48 * t.field_mm()), area);
  if (middle && top) {
    const ImVec2 m{static_cast<float>((*middle)[0]), static_cast<float>((*middle)[1])};
    list->AddLine(m, {static_cast<float>((*top)[0]), static_cast<float>((*top)[1])}, ink, 2);  // up
    list->AddCircleFilled(m, 4, ink);
  }
  const std::string words = filled(
      close ? tr("view {n} of {all}, {times}x: {seconds} s, hold") : tr("view {n} of {all}, {times}x: {seconds} s"),
      {{"n", std::to_string(trial_->results().size() + 1)},
       {"all", std::to_string(trial_->count())},
       {"times", shown_number(t.magnification, 1)},
       {"seconds", shown_number(trial_->seconds(), 1)}});
  const ImVec2 at{static_cast<float>(area.x) + 16, static_cast<float>(area.y) + 16},
      size = ImGui::CalcTextSize(words.c_str());
  list->AddRectFilled({at.x - 8, at.y - 6}, {at.x + size.x + 8, at.y + size.y + 6}, IM_COL32(10, 14, 20, 170), 4);
  list->AddText(at, ink, words.c_str());
  list->PopClipRect();
}

std::optional<LocalText> TrialOverlay::advance(const ScopeControl& control, double seconds,
                                               const std::filesystem::path& csv) {
  if (!running()) return std::nullopt;
  const bool reached = trial_->advance(control, seconds);
  if (!reached) return std::nullopt;
  try {
    write_file(csv, trial_csv(trial_->results()));
  } catch (const Error& e) {
    return LocalText::untranslated(e.what());
  }
  const TrialSummary s = summary_of(trial_->results());
  return LocalText([&] {
    return filled(running() ? tr("view {n} of {all} reached in {seconds} s")
                            : tr("view {n} of {all} reached in {seconds} s; times are in camera-trial.csv"),
                  {{"n", std::to_string(s.targets)},
                   {"all", std::to_string(trial_->count())},
                   {"seconds", shown_number(trial_->results().back().seconds, 1)}});
  });
}

}  // namespace osteo::inline app
