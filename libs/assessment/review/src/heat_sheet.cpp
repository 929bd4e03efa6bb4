#include "osteo/assessment/review/heat_sheet.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/param.h"

namespace osteo::inline assessment::review {
namespace {

using Rgb = std::array<double, 3>;
constexpr std::array<double, 3> kLinesC{42, 47, kCoagulatedC};
constexpr double kCrumb = 0.1;  // what a burr leaves of a voxel below that is not painted
constexpr double kSideMm = 36;
constexpr int kPixels = 432;

Rgb mixed(const Rgb& a, const Rgb& b, double share) {
  Rgb c{};
  for (std::size_t n = 0; n < 3; ++n) c[n] = a[n] + (b[n] - a[n]) * std::clamp(share, 0.0, 1.0);
  return c;
}

// As the window shows it: amber from 42 C on, red from 57 C on; paler below, so that 39 to 42 C is still seen.
Rgb coloured(const Rgb& bone, double celsius) {
  constexpr Rgb kPale{250, 226, 160}, kAmber{242, 168, 40}, kRed{206, 32, 24}, kDark{92, 0, 24};
  if (celsius < 38) return bone;
  if (celsius < 42) return mixed(bone, kPale, (celsius - 38) / 4);
  if (celsius < kCoagulatedC) return mixed(kAmber, kRed, (celsius - 42) / (kCoagulatedC - 42));
  return mixed(kRed, kDark, (celsius - kCoagulatedC) / 40);
}

std::string tenths(double x) {
  return format_number(std::round(x * 10) / 10);
}

std::string minutes_of(double x) {
  return format_number(x < 1000 ? std::round(x * 100) / 100 : std::round(x));
}

sheet::Plot course_of(const HeatReader& heat, std::uint8_t value, const std::string& name) {
  std::vector<double> c = heat.courses().at(value);
  const double top = *std::max_element(c.begin(), c.end()),
               whole_s = std::max(1.0, static_cast<double>(heat.steps()) * heat.step_s());
  sheet::Plot p;
  p.id = "course-" + std::to_string(value);
  p.title = name + ": its warmest place, C";
  const auto tick = [](double range) {
    double t = std::pow(10.0, std::floor(std::log10(range)));
    while (range / t < 3) t /= 2;
    return t;
  };
  p.x = {0, whole_s, tick(whole_s), "s", {}};
  p.y = {std::min(36.0, std::floor(*std::min_element(c.begin(), c.end()))),
         std::max(48.0, std::ceil(top + 1)),
         top > 60 ? 10.0 : 2.0,
         "C",
         {}};
  sheet::Plot::Line line;
  // Not more points than paper can show; of those in between the highest.
  const std::size_t each = std::max<std::size_t>(1, c.size() / 600);
  for (std::size_t n = 0; n < c.size(); n += each)
    line.at.push_back({static_cast<double>(n) * heat.step_s(),
                       *std::max_element(c.begin() + static_cast<std::ptrdiff_t>(n),
                                         c.begin() + static_cast<std::ptrdiff_t>(std::min(c.size(), n + each)))});
  p.lines.push_back({{{0, 47}, {whole_s, 47}}, Tone::caution, true});
  p.lines.push_back(std::move(line));
  return p;
}

}  // namespace

Picture heat_section(const HeatReader& heat, const StructureMap* structures, Vec3 centre_mm, Vec3 right, Vec3 down,
                     double side_mm, int pixels) {
  const auto n = static_cast<std::size_t>(pixels);
  std::vector<double> celsius(n * n);
  std::vector<std::uint8_t> inside(n * n);
  std::vector<Rgb> rgb(n * n);
  const double step = side_mm / pixels;
  for (std::size_t y = 0; y < n; ++y) {
    for (std::size_t x = 0; x < n; ++x) {
      const Vec3 at = centre_mm + right * ((static_cast<double>(x) + 0.5) * step - side_mm / 2) +
                      down * ((static_cast<double>(y) + 0.5) * step - side_mm / 2);
      const double bone = heat.bone_at(at);
      Rgb c = mixed({24, 27, 32}, {214, 208, 196}, bone);
      celsius[y * n + x] = bone > kCrumb ? heat.peak_c_at(at) : 0;
      if (bone > kCrumb) c = mixed({24, 27, 32}, coloured({214, 208, 196}, celsius[y * n + x]), bone);
      if (structures != nullptr) {
        const StructureMap::Answer a = structures->at(at);
        if (a.structure != 0 && a.distance_mm <= 0) {
          inside[y * n + x] = a.structure;
          const auto own = structures->colour_of(a.structure);
          c = mixed(c, {own[0] * 255, own[1] * 255, own[2] * 255}, 0.35);
        }
      }
      rgb[y * n + x] = c;
    }
  }
  // Lines where two neighbours lie on either side of a temperature, or in different structures.
  std::vector<Rgb> drawn = rgb;
  for (std::size_t y = 0; y + 1 < n; ++y) {
    for (std::size_t x = 0; x + 1 < n; ++x) {
      const std::size_t p = y * n + x;
      for (const std::size_t q : {p + 1, p + n}) {
        for (const double line : kLinesC) {
          if (celsius[p] > 0 && celsius[q] > 0 && (celsius[p] < line) != (celsius[q] < line)) drawn[p] = {40, 16, 8};
        }
        if (inside[p] != inside[q]) {
          const auto own = structures->colour_of(std::max(inside[p], inside[q]));
          drawn[p] = {own[0] * 255, own[1] * 255, own[2] * 255};
        }
      }
    }
  }
  Picture picture{pixels, pixels, std::vector<std::uint8_t>(3 * n * n)};
  for (std::size_t p = 0; p < n * n; ++p) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * p + c] = static_cast<std::uint8_t>(std::lround(drawn[p][c]));
  }
  return picture;
}

Sheet heat_sheet(const HeatReader& heat, const StructureMap* structures, const HeatOfCutting& by,
                 const std::string& code) {
  Sheet s;
  s.title = "Heat of a rehearsal";
  s.code = code;
  s.footer = "Osteotome: for rehearsal and teaching, not for clinical decisions";
  const auto add = [&](auto block) { s.blocks.push_back({std::move(block)}); };
  const auto left = heat.warmest_left();
  const HeatLedger l = heat.ledger();
  const bool hot = left && left->peak_c >= 47;
  add(sheet::Band{left ? tenths(left->peak_c) + " C" : "cool",
                  left ? "the highest that bone has had which is still there; " + tenths(heat.hottest_c()) +
                             " C where it was drilled away"
                       : "no bone that is left was warmer than the body",
                  hot ? Tone::caution : Tone::plain});
  add(
      sheet::Paragraph{"How much of a burr's work becomes heat in bone is known within a factor of ten at best, and "
                       "temperatures follow it in "
                       "proportion. Nothing clinical follows from this page.",
                       Tone::quiet});
  if (left) {
    const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    const auto section = [&](const char* id, Vec3 right, Vec3 down, const char* words) {
      return sheet::Image{id, heat_section(heat, structures, left->at_mm, right, down, kSideMm, kPixels), words};
    };
    add(sheet::Heading{"Sections of " + format_number(kSideMm) + " mm through the warmest bone that is left"});
    add(sheet::Pictures{{section("axial", x, y, "axial, from below: left of the picture is the patient's right"),
                         section("coronal", x, z * -1.0, "coronal, from the front"),
                         section("sagittal", y, z * -1.0, "sagittal, from the patient's left")},
                        56});
    add(sheet::Paragraph{
        "Colour: the highest temperature of each place, pale from 38, amber from 42, red from 57 C on; lines at 42, 47 "
        "and 57 C. Outlines: structures."});
  }
  if (structures != nullptr) {
    const auto found = heat.structures();
    add(sheet::Heading{"Critical structures"});
    if (found.empty()) {
      add(sheet::Paragraph{"None became warm."});
    } else {
      sheet::Table t;
      t.head = {"structure", "highest, C", "minutes at 43 C", "over 16 such minutes", ""};
      t.widths = {34, 16, 18, 20, 12};
      std::vector<std::pair<double, std::uint8_t>> order;
      for (const auto& [value, w] : found) {
        const bool bad = w.worst.coagulated, much = w.worst.cem43_min > kBoneLimitCem43;
        t.rows.push_back({{structures->name_of(value)},
                          {tenths(w.worst.peak_c)},
                          {minutes_of(w.worst.cem43_min)},
                          {tenths(100 * w.share_over_limit) + " % of its face"},
                          {bad    ? "coagulated"
                           : much ? "too warm"
                                  : "",
                           bad || much ? Tone::bad : Tone::plain}});
        order.emplace_back(-w.worst.peak_c, value);
      }
      add(std::move(t));
      std::sort(order.begin(), order.end());
      sheet::Columns two;
      two.columns.resize(2);
      for (std::size_t n = 0; n < std::min<std::size_t>(4, order.size()); ++n) {
        const std::uint8_t value = order[n].second;
        if (heat.courses().contains(value))
          two.columns[n % 2].push_back({course_of(heat, value, structures->name_of(value))});
      }
      if (!two.columns[0].empty()) {
        add(std::move(two));
        // docs/validation/heat.md, AMovingPointAtWorkingSpeeds: 4.9 % and, ahead of it and behind, 7.0 %.
        add(sheet::Paragraph{
            "For the heat that is assumed, the highest temperatures are right within 1 %, two cells (" +
                tenths(2 * by.cell_mm) +
                " mm) and more from the burr. While a burr passes at up to 25 mm/s, the temperature "
                "of a moment is right within 7 % of the highest there; nearer than two cells it is "
                "the mean of a cell.",
            Tone::quiet});
      }
    }
  }
  add(sheet::Heading{"By assumption"});
  add(sheet::Facts{{{"cutting burrs", format_number(by.cutting_share) + " of their work"},
                    {"diamond burrs", format_number(by.diamond_w_per_n) + " W for each newton"},
                    {"water", tenths(by.water_c) + " C, " + format_number(by.film_w_per_m2_k) + " W/(m2 K)"},
                    {"into bone", tenths(l.added_j) + " J, of which " + tenths(l.chips_j) + " left with chips and " +
                                      tenths(l.cooled_j) + " went into water"}},
                   2});
  return s;
}

}  // namespace osteo::inline assessment::review
