#include "plot.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/param.h"

namespace osteo::report {
namespace {

constexpr double kLeft = 32, kRight = 6, kTop = 13, kBottom = 24, kText = 6.6, kDot = 1.7;

using Colour = sheet::Drawing::Colour;
Colour colour_of(Rgb c) {
  const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround(255 * v)); };
  return {byte(c.r), byte(c.g), byte(c.b)};
}

// Where the segment from a to b leaves the box, by its share: Liang and Barsky 1984. False: it is not in it.
bool clip(std::array<double, 2>& a, std::array<double, 2>& b, std::array<double, 2> lo, std::array<double, 2> hi) {
  double from = 0, to = 1;
  for (std::size_t i = 0; i < 2; ++i) {
    const double d = b[i] - a[i];
    for (const auto& [p, q] : {std::pair{-d, a[i] - lo[i]}, std::pair{d, hi[i] - a[i]}}) {
      if (p == 0) {
        if (q < 0) return false;
      } else if (p < 0) {
        from = std::max(from, q / p);
      } else {
        to = std::min(to, q / p);
      }
    }
  }
  if (from > to) return false;
  const std::array<double, 2> start = a, way{b[0] - a[0], b[1] - a[1]};
  for (std::size_t i = 0; i < 2; ++i) {
    a[i] = start[i] + from * way[i];
    b[i] = start[i] + to * way[i];
  }
  return true;
}

}  // namespace

sheet::Drawing drawing_of(const sheet::Plot& p, double width) {
  const double height = p.height_mm / kPtMm;
  sheet::Drawing d{p.id, p.title, width, height, {}, {}};
  const double right = width - kRight, base = height - kBottom;
  const auto px = [&](double x) { return kLeft + (right - kLeft) * (x - p.x.from) / (p.x.to - p.x.from); };
  const auto py = [&](double y) { return base - (base - kTop) * (y - p.y.from) / (p.y.to - p.y.from); };
  const auto inside = [&](const sheet::Plot::At& a) {
    return a[0] >= p.x.from && a[0] <= p.x.to && a[1] >= p.y.from && a[1] <= p.y.to;
  };
  const Colour quiet = colour_of(ink(Tone::quiet)), plain = colour_of(ink(Tone::plain)), grid{230, 232, 237};
  const auto ticks = [](const sheet::Plot::Axis& axis) {
    std::vector<std::pair<double, std::string>> all = axis.named;
    if (all.empty() && axis.tick > 0) {
      constexpr int kMax = 50;
      const double first = std::ceil(axis.from / axis.tick - 1e-9);
      // As many decimals as tell one tick from the next.
      const double digits = std::pow(10, std::max(0.0, std::ceil(-std::log10(axis.tick) - 1e-9) + 1));
      for (int n = 0; n < kMax && (first + n) * axis.tick <= axis.to + 1e-9 * axis.tick; ++n) {
        const double at = (first + n) * axis.tick;
        all.emplace_back(at, format_number(std::round(at * digits) / digits));
      }
    }
    return all;
  };
  d.text(kLeft, 8, p.title, kText + 0.6, plain, -1, true);
  for (const auto& a : p.areas) {
    std::vector<sheet::Plot::At> corners;
    // Corners are brought to the edge: bands are narrow and lie along an axis.
    for (const auto& c : a.at)
      corners.push_back({std::clamp(px(c[0]), kLeft, right), std::clamp(py(c[1]), kTop, base)});
    if (!corners.empty()) d.area(std::move(corners), colour_of(wash(a.tone)));
  }
  for (const auto& [at, name] : ticks(p.y)) {
    d.line({{kLeft, py(at)}, {right, py(at)}}, grid, 0.5);
    d.text(kLeft - 3, py(at) + 2.3, name, kText, quiet, 1);
  }
  for (const auto& [at, name] : ticks(p.x)) {
    d.line({{px(at), base}, {px(at), base + 2}}, quiet, 0.5);
    d.text(px(at), base + 9, name, kText, quiet, 0);
  }
  d.line({{kLeft, base}, {right, base}}, quiet, 0.7);
  d.line({{kLeft, kTop}, {kLeft, base}}, quiet, 0.7);
  d.text((kLeft + right) / 2, height - 5, p.x.name, kText, quiet, 0);
  if (!p.y.name.empty()) d.text(right, 8, p.y.name, kText, quiet, 1);
  const std::array<double, 2> lo{kLeft, kTop}, hi{right, base};
  for (const auto& b : p.boxes) {
    const double l = px(b.x - b.width / 2), r = px(b.x + b.width / 2), m = px(b.x);
    const std::vector<sheet::Plot::At> box{{l, py(b.q1)}, {r, py(b.q1)}, {r, py(b.q3)}, {l, py(b.q3)}, {l, py(b.q1)}};
    d.area(box, colour_of(wash(Tone::quiet)));
    d.line(box, plain, 0.6);
    d.line({{l, py(b.median)}, {r, py(b.median)}}, plain, 1.3);
    d.line({{m, py(b.lo)}, {m, py(b.q1)}}, plain, 0.6);
    d.line({{m, py(b.q3)}, {m, py(b.hi)}}, plain, 0.6);
  }
  for (const auto& l : p.lines) {
    for (std::size_t i = 1; i < l.at.size(); ++i) {
      std::array<double, 2> a{px(l.at[i - 1][0]), py(l.at[i - 1][1])}, b{px(l.at[i][0]), py(l.at[i][1])};
      if (clip(a, b, lo, hi)) d.line({a, b}, colour_of(ink(l.tone)), 1, l.dashed);
    }
  }
  for (const auto& s : p.points) {
    for (const auto& a : s.at)
      if (inside(a))
        d.marks.emplace_back(sheet::Drawing::Dot{px(a[0]), py(a[1]), kDot, colour_of(ink(s.tone)), s.hollow});
  }
  return d;
}

}  // namespace osteo::report
