#include "view_layout.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

// Of the design, docs/design/window.md, in pixels at scale 1.
constexpr float kStrip = 56, kState = 64, kInset = 16, kCutGap = 8, kGrid = 8, kChoice = 40, kPage = 544, kSide = 288;
constexpr float kThreeCutsWide = 1200, kPlanWide = 832, kPlanHigh = 544, kSideWide = 960, kMinCut = 96, kMaxCut = 272,
                kBesideCut = 208;
// Below the cuts' foot the scale bar, with what the microscope says above it where there is room beside it.
constexpr float kScaleHigh = 80, kBarHigh = 48;
// With less width than this a state has two rows, and beside a list four pictures need less height.
constexpr float kOneRow = 904, kTwoRows = 120, kPlanBesideHigh = 480, kPageShare = 0.6F;
// Of the smallest window that operate fits, text of twice the size in 1024 x 700: its state needs the width, its strip
// the height.
constexpr double kMinWideEm = 32, kMinHighEm = 21.875;

// In the view's upper right corner, no larger than it has room for.
void stack_over(ViewLayout& layout, float wished, std::size_t count) {
  float side = wished;
  const float u = layout.unit, gap = std::round(kCutGap * u), inset = std::round(kInset * u);
  const auto n = static_cast<float>(count);
  const float scale = (layout.view.width > kNarrow * u ? kScaleHigh : kBarHigh) * u;
  side = std::min(side, (layout.view.height - 2 * inset - gap * (n - 1) - kChoice * u - scale) / n);
  side = std::floor(std::min(side, 0.4F * layout.view.width));
  // One that can be read rather than three that cannot.
  if (count > 1 && side < kMinCut * u) return stack_over(layout, wished, 1);
  layout.over = {};
  if (side < 0.6F * kMinCut * u) return;
  for (std::size_t c = 0; c < count; ++c)
    layout.over[c] = {layout.view.right() - inset - side, layout.view.y + inset + static_cast<float>(c) * (side + gap),
                      side, side};
}

// In that corner too; where the burr's card has it alone, above the scale bar.
void place_tile(ViewLayout& layout) {
  layout.cut_tile = {};
  const float u = layout.unit, side = std::round(kChoice * u), inset = std::round(kInset * u);
  if (layout.shown != Layout::operate || !layout.over[0].empty() || layout.view.height < side + 2 * inset) return;
  const bool above = layout.view.width >= (kBesideCut + kChoice) * u;
  layout.cut_tile = {layout.view.right() - inset - side,
                     above ? layout.view.y + inset : layout.view.bottom() - std::round(kScaleHigh * u) - side, side,
                     side};
}

}  // namespace

Layout next_layout(Layout layout) {
  return layout == Layout::operate ? Layout::plan : Layout::operate;
}

double ViewLayout::picture_share(int width, int height) const {
  float left = view.width * view.height;
  for (const ScreenBox& b : over) left -= b.width * b.height;
  return static_cast<double>(left) / (static_cast<double>(width) * height);
}

ViewLayout lay_out(Layout wanted, int width, int height, float em, float cut_side) {
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  ViewLayout out;
  const float u = out.unit = em / static_cast<float>(kTextPixels);
  // Whole pixels: textures and viewports have no others.
  const auto whole = [&](float n) { return std::round(n * u); };
  out.shown = wanted;
  const bool beside = w >= whole(kSideWide);
  if (wanted == Layout::plan && (w < whole(kPlanWide) || h < whole(beside ? kPlanBesideHigh : kPlanHigh))) {
    out.shown = Layout::operate;
    out.why = [] { return tr("no room for four pictures: a larger window or smaller text (Ctrl -) shows them"); };
  }
  if (out.shown == Layout::review) {
    const float page = std::min(whole(kPage), std::floor(kPageShare * w));  // the bone is beside it in any case
    out.page = {0, 0, page, h};
    out.view = {page, 0, w - page, h};
    return out;
  }
  const float tray = std::min(whole(kStrip), w);
  out.two_rows = w - tray < whole(kOneRow);
  const float state = std::min(whole(out.two_rows ? kTwoRows : kState), h), above = h - state;
  out.tray = {0, 0, tray, h};
  out.state = {tray, above, w - tray, state};
  out.view = {tray, 0, w - tray, above};
  if (out.shown == Layout::plan) {
    const float side = beside ? whole(kSide) : 0, from = tray + side;
    const float left = std::floor((w - from) / 2), top = std::floor(above / 2);
    out.side = {tray, 0, side, side > 0 ? above : 0};
    out.view = {from, 0, left, top};
    out.cuts = {ScreenBox{from + left, 0, w - from - left, top}, ScreenBox{from, top, left, above - top},
                ScreenBox{from + left, top, w - from - left, above - top}};
    return out;
  }
  const std::size_t count = w >= kThreeCutsWide * u ? 3 : 1;
  const float spare = out.view.width * out.view.height - static_cast<float>(kPictureShare) * w * h;
  const float most = std::sqrt(std::max(0.0F, spare) / static_cast<float>(count)), grid = kGrid * u;
  const float usual = std::clamp(std::floor(most / grid) * grid, kMinCut * u, kMaxCut * u);
  stack_over(out, cut_side > 0 ? std::max(cut_side, kMinCut * u) : usual, count);
  place_tile(out);
  return out;
}

ScreenBox take_strip(ViewLayout& layout, float high) {
  if (layout.shown == Layout::review) return {};
  const bool four = layout.shown == Layout::plan;
  const float top = layout.view.y, bottom = four ? layout.cuts[1].bottom() : layout.view.bottom();
  const float left = layout.view.x, right = four ? layout.cuts[0].right() : layout.view.right();
  high = std::floor(std::min(high, (bottom - top) / 2));
  if (!(high > 0)) return {};
  if (four) {
    const float upper = std::floor((bottom - top - high) / 2), lower = bottom - top - high - upper;
    layout.view.height = layout.cuts[0].height = upper;
    for (ScreenBox* const cut : {&layout.cuts[1], &layout.cuts[2]}) {
      cut->y = top + upper;
      cut->height = lower;
    }
  } else {
    layout.view.height -= high;
    const auto shown =
        std::count_if(layout.over.begin(), layout.over.end(), [](const ScreenBox& b) { return !b.empty(); });
    if (shown > 0) stack_over(layout, layout.over[0].width, static_cast<std::size_t>(shown));
    place_tile(layout);
  }
  return {left, bottom - high, right - left, high};
}

ScreenBox take_column(ViewLayout& layout, float wide) {
  if (layout.shown == Layout::review) return {};
  const bool four = layout.shown == Layout::plan;
  const float left = layout.view.x, right = four ? layout.cuts[0].right() : layout.view.right();
  const float bottom = four ? layout.cuts[1].bottom() : layout.view.bottom();
  wide = std::floor(std::min(wide, (right - left) / 2));
  if (!(wide > 0)) return {};
  if (four) {
    const float first = std::floor((right - left - wide) / 2), second = right - left - wide - first;
    layout.view.width = layout.cuts[1].width = first;
    for (ScreenBox* const cut : {&layout.cuts[0], &layout.cuts[2]}) {
      cut->x = left + first;
      cut->width = second;
    }
  } else {
    layout.view.width -= wide;
    // One cut beside a column: the bone has the picture.
    if (!layout.over[0].empty()) stack_over(layout, layout.over[0].width, 1);
    // Nor that one, where the burr's card has no room beside it: it is a tile away.
    if (layout.over[0].x - left < kBesideCut * layout.unit) layout.over = {};
    place_tile(layout);
  }
  return {right - wide, layout.view.y, wide, bottom - layout.view.y};
}

double automatic_scale(double reported_by_monitor, int width, int height) {
  return std::clamp(std::max(reported_by_monitor, std::min(width / 1920.0, height / 1080.0)), 1.0, 4.0);
}

double scale_that_fits(double automatic, double by_hand, int width, int height) {
  const double most = std::min(width / (kMinWideEm * kTextPixels), height / (kMinHighEm * kTextPixels));
  return std::max(0.7, std::min(automatic * by_hand, most));
}

int em_that_fits(double fixed, double reported_by_monitor, double by_hand, int width, int height) {
  const double automatic = fixed > 0 ? fixed : automatic_scale(reported_by_monitor, width, height);
  return static_cast<int>(std::lround(kTextPixels * scale_that_fits(automatic, by_hand, width, height)));
}

double next_scale(double by_hand, int steps) {
  return std::clamp(by_hand * std::pow(1.1, steps), 0.6, 2.5);
}

}  // namespace osteo::inline app
