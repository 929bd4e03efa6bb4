#include "course_svg.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/core/base/param.h"

namespace osteo::inline app::tissue {
namespace {

constexpr double kWidth = 940, kHeight = 380, kTop = 48, kBottom = 44, kLeft = 64, kGap = 76, kRight = 220;
constexpr double kPanel = (kWidth - kLeft - kGap - kRight) / 2;
constexpr const char* kColours[kTissueClasses] = {"#1f6fb2", "#2a9d5c", "#b0761a", "#b3261e"};
constexpr const char* kNames[kTissueClasses] = {"axis edges", "diagonal edges", "faces", "volumes"};

class Drawing {
 public:
  void text(double x, double y, const std::string& s, const char* anchor = "middle", const char* colour = "#222",
            int size = 13) {
    add("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" fill=\"%s\" font-size=\"%d\">%s</text>\n", x, y, anchor, colour,
        size, s.c_str());
  }
  void line(double x0, double y0, double x1, double y1, const char* colour, double width = 1) {
    add("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" stroke-width=\"%.1f\"/>\n", x0, y0, x1, y1,
        colour, width);
  }
  void curve(const std::vector<std::pair<double, double>>& points, const char* colour, double width) {
    svg_ += "<polyline fill=\"none\" stroke=\"" + std::string(colour) + "\" stroke-width=\"" + format_number(width) +
            "\" points=\"";
    for (const auto& [x, y] : points) add("%.1f,%.1f ", x, y);
    svg_ += "\"/>\n";
  }
  [[nodiscard]] std::string done() const {
    char head[200];
    std::snprintf(head, sizeof head,
                  "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" "
                  "font-family=\"sans-serif\">\n<rect width=\"100%%\" "
                  "height=\"100%%\" fill=\"#fff\"/>\n",
                  kWidth, kHeight);
    return head + svg_ + "</svg>\n";
  }

 private:
  template <class... T>
  void add(const char* format, T... values) {
    char buffer[512];
    std::snprintf(buffer, sizeof buffer, format, values...);
    svg_ += buffer;
  }
  std::string svg_;
};

// One panel: steps along x, values from lo to hi along y.
struct Panel {
  double left, steps, lo, hi;
  [[nodiscard]] double x(double step) const { return left + kPanel * (steps > 0 ? step / steps : 0.5); }
  [[nodiscard]] double y(double value) const {
    return kHeight - kBottom - (kHeight - kTop - kBottom) * (value - lo) / (hi - lo);
  }
};

void frame(Drawing& d, const Panel& p, const std::string& what, double tick, bool powers) {
  for (double v = std::ceil(p.lo / tick) * tick; v <= p.hi + 1e-9; v += tick) {
    d.line(p.left, p.y(v), p.left + kPanel, p.y(v), "#e3e3e3");
    char label[32];
    std::snprintf(label, sizeof label, "%.2g", powers ? std::pow(10, v) : std::exp(v));
    d.text(p.left - 8, p.y(v) + 4, label, "end", "#555", 12);
  }
  const int stride = std::max(1, static_cast<int>(std::ceil(p.steps / 10)));
  for (int s = 0; s <= static_cast<int>(p.steps); s += stride)
    d.text(p.x(s), kHeight - kBottom + 18, std::to_string(s), "middle", "#555", 12);
  d.line(p.left, kHeight - kBottom, p.left + kPanel, kHeight - kBottom, "#888");
  d.line(p.left, kTop, p.left, kHeight - kBottom, "#888");
  d.text(p.left + kPanel / 2, kHeight - 8, "accepted steps", "middle", "#555", 12);
  d.text(p.left + kPanel / 2, kTop - 8, what);
}

}  // namespace

std::string course_svg(const Calibration& c, const std::string& title) {
  Drawing d;
  d.text(kLeft, 20, title, "start", "#000", 15);
  if (c.cost.empty() || c.course.size() != c.cost.size()) return d.done();
  const double steps = static_cast<double>(c.cost.size() - 1);
  const auto error = [](double cost) {
    return 0.5 * std::log10(std::max(2 * cost, 1e-12));
  };  // of a share of the truth's RMS
  Panel left{kLeft, steps, 1e9, -1e9};
  for (const double cost : c.cost) {
    left.lo = std::min(left.lo, error(cost));
    left.hi = std::max(left.hi, error(cost));
  }
  left.lo = std::floor(10 * left.lo) / 10 - 0.05;
  left.hi = std::ceil(10 * left.hi) / 10 + 0.05;
  frame(d, left, "distance to the truth (with the pull), of its RMS", left.hi - left.lo > 1.5 ? 0.5 : 0.1, true);
  std::vector<std::pair<double, double>> points;
  for (std::size_t s = 0; s < c.cost.size(); ++s)
    points.push_back({left.x(static_cast<double>(s)), left.y(error(c.cost[s]))});
  d.curve(points, "#222", 2);

  Panel right{kLeft + kPanel + kGap, steps, -0.5, 0.5};
  for (const auto& logs : c.course) {
    for (const double v : logs) {
      right.lo = std::min(right.lo, v - 0.2);
      right.hi = std::max(right.hi, v + 0.2);
    }
  }
  frame(d, right, "factors on the closed form",
        std::log(10.0) * (right.hi - right.lo > 12  ? 2
                          : right.hi - right.lo > 5 ? 1
                                                    : 0.5),
        false);
  const std::size_t parameters = c.course.front().size(), classes = std::min(parameters, kTissueClasses),
                    map = parameters - classes;
  const bool own_maps = map > 0 && c.log_stiffness.size() <= 1;
  for (std::size_t j = 0; j < parameters; ++j) {
    points.clear();
    for (std::size_t s = 0; s < c.course.size(); ++s)
      points.push_back({right.x(static_cast<double>(s)), right.y(c.course[s][j])});
    const bool of_class = j >= map && !own_maps;
    d.curve(points, of_class ? kColours[j - map] : "#b8b8b8", of_class ? 2.2 : 0.7);
  }
  double label = kTop + 14;
  if (map > 0) {
    d.text(kWidth - kRight + 14, label, std::to_string(own_maps ? parameters : map) + " of a map", "start", "#888", 12);
    label += 20;
  }
  for (std::size_t k = 0; k < classes && !own_maps; ++k) {
    char line[96];
    const std::size_t number = c.uncertainty.size() - classes + k;
    const double log = c.uncertainty[number];
    if (log > 2) {
      std::snprintf(line, sizeof line, "%s %.2g, not determined", kNames[k], std::exp(c.course.back()[map + k]));
    } else {
      std::snprintf(line, sizeof line, "%s %.2g, within %.0f %%", kNames[k], std::exp(c.course.back()[map + k]),
                    100 * (std::exp(log) - 1));
    }
    d.text(kWidth - kRight + 14, label, line, "start", kColours[k], 12);
    label += 20;
  }
  return d.done();
}

}  // namespace osteo::inline app::tissue
