#include "room_layout.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline app {
namespace {

// In heights of text.
constexpr float kPanelEm = 18, kColumnEm = 17, kTrayEm = 5.5F, kStateEm = 5.4F, kPageEm = 34;
constexpr float kBesideEm = 60, kPlanWideEm = 52, kPlanHighEm = 34;
// Of the smallest window that operate fits: its state needs the width, its tray the height.
constexpr double kMinWideEm = 40, kMinHighEm = 26;

}  // namespace

Layout next_layout(Layout layout) {
  return layout == Layout::beside ? Layout::operate : layout == Layout::operate ? Layout::plan : Layout::beside;
}

RoomLayout lay_out(Layout wanted, int width, int height, float em, float column_width) {
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  // Whole pixels: textures and viewports have no others.
  const auto ems = [&](float n) { return std::round(n * em); };
  RoomLayout out;
  out.shown = wanted;
  if (wanted == Layout::beside && w < ems(kBesideEm)) {
    out.shown = Layout::operate;
    out.why = "no room for panel and cuts: a wider window or smaller text (Ctrl -) shows them";
  } else if (wanted == Layout::plan && (w < ems(kPlanWideEm) || h < ems(kPlanHighEm))) {
    out.shown = Layout::operate;
    out.why = "no room for four pictures: a larger window or smaller text (Ctrl -) shows them";
  }
  const float state = std::min(ems(kStateEm), h);
  const float above = h - state;
  switch (out.shown) {
    case Layout::beside: {
      // Squares one below the other use the column's height, where the picture can spare the width.
      const float usual = std::max(kColumnEm * em, std::min(h / 3 - 2 * em, 0.24F * w));
      const float panel = ems(kPanelEm),
                  column = std::round(
                      column_width > 0 ? std::clamp(column_width, std::min(12 * em, 0.3F * w), 0.45F * w) : usual);
      out.panel = {0, 0, panel, h};
      out.column = {w - column, 0, column, h};
      out.view = {panel, 0, w - panel - column, above};
      out.state = {panel, above, w - panel - column, state};
      break;
    }
    case Layout::operate: {
      const float tray = std::min(ems(kTrayEm), w);
      out.tray = {0, 0, tray, h};
      out.view = {tray, 0, w - tray, above};
      out.state = {tray, above, w - tray, state};
      break;
    }
    case Layout::plan: {
      const float tray = ems(kTrayEm), left = std::floor((w - tray) / 2), top = std::floor(above / 2);
      out.tray = {0, 0, tray, h};
      out.view = {tray, 0, left, top};
      out.cuts = {ScreenBox{tray + left, 0, w - tray - left, top}, ScreenBox{tray, top, left, above - top},
                  ScreenBox{tray + left, top, w - tray - left, above - top}};
      out.state = {tray, above, w - tray, state};
      break;
    }
    case Layout::review: {
      const float page = std::min(ems(kPageEm), w);
      out.page = {0, 0, page, h};
      out.view = {page, 0, w - page, h};
      break;
    }
  }
  return out;
}

ScreenBox take_strip(RoomLayout& room, float high) {
  if (room.shown == Layout::review) return {};
  const bool four = !room.cuts[0].empty();
  const float top = room.view.y, bottom = four ? room.cuts[1].bottom() : room.view.bottom();
  const float left = room.view.x, right = four ? room.cuts[0].right() : room.view.right();
  high = std::floor(std::min(high, (bottom - top) / 2));
  if (!(high > 0)) return {};
  if (four) {
    const float upper = std::floor((bottom - top - high) / 2), lower = bottom - top - high - upper;
    room.view.height = room.cuts[0].height = upper;
    for (ScreenBox* const cut : {&room.cuts[1], &room.cuts[2]}) {
      cut->y = top + upper;
      cut->height = lower;
    }
  } else {
    room.view.height -= high;
  }
  return {left, bottom - high, right - left, high};
}

double automatic_scale(double reported_by_monitor, int width, int height) {
  return std::clamp(std::max(reported_by_monitor, std::min(width / 1920.0, height / 1080.0)), 1.0, 4.0);
}

double scale_that_fits(double automatic, double by_hand, int width, int height) {
  const double most = std::min(width / (kMinWideEm * kTextPixels), height / (kMinHighEm * kTextPixels));
  return std::max(0.7, std::min(automatic * by_hand, most));
}

double next_scale(double by_hand, int steps) {
  return std::clamp(by_hand * std::pow(1.1, steps), 0.6, 2.5);
}

}  // namespace osteo::inline app
