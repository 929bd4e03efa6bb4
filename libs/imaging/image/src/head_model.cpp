#include "head_model.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline imaging {
using namespace anatomy;

namespace {

Build build_of(std::uint64_t individual) {
  Build b;
  if (individual == 0) return b;
  Random r(individual * 0x9e6c63d0876a9a47ULL + 1);
  b.vault = {1 + 0.015 * r.normal(), 1 + 0.025 * r.normal(), 1 + 0.02 * r.normal()};
  b.sinus_back = 1.4 * r.normal();
  b.bulb_up = 0.8 * r.normal();
  b.nerve_back = 0.35 * r.normal();
  b.nerve_out = 0.3 * r.normal();
  b.nerve_long = 0.8 * r.normal();
  b.nerve_thick = 1 + 0.06 * r.normal();
  b.canal_wide = 1 + 0.05 * r.normal();
  b.tegmen_up = 0.6 * (r.normal() + 1.5);
  b.tip_down = 2 * r.normal();
  b.mastoid_out = 0.8 * r.normal();
  b.pneumatisation = 1 + 0.06 * r.normal();
  b.cell_size = 1 + 0.1 * r.normal();
  b.cochlea = 1 + 0.03 * r.normal();
  b.canals = 1 + 0.03 * r.normal();
  b.gonion_out = 1.5 * r.normal();
  b.jaw_height = 1.2 * r.normal();
  return b;
}

// Teeth: widths along the row, across, crown height (Wheeler), root lengths.
constexpr std::array<std::array<double, 4>, 16> kTeeth{{{8.5, 7, 10.5, 13},
                                                        {6.5, 6, 9, 13},
                                                        {7.5, 8, 10, 17},
                                                        {7, 9, 8.5, 14},
                                                        {7, 9, 8.5, 14},
                                                        {10, 11, 7.5, 12},
                                                        {9, 11, 7, 11},
                                                        {8.5, 10, 6.5, 11},
                                                        {5, 6, 9, 12.5},
                                                        {5.5, 6.5, 9.5, 14},
                                                        {7, 7.5, 11, 16},
                                                        {7, 7.5, 8.5, 14},
                                                        {7, 8, 8, 14.5},
                                                        {11, 10.5, 7.5, 14},
                                                        {10.5, 10, 7, 13},
                                                        {10, 9.5, 7, 11}}};

}  // namespace

HeadAnatomy::Model::Model(std::uint64_t individual) : build(build_of(individual)) {
  place_canal();
  place_nerves();
  place_vessels();
  place_jaw();
  place_cochlea();
  for (int row = 0; row < 2; ++row) place_teeth(row);
  place_cells(individual);
}

// The ear canal, and the other passages of the ear: internal meatus and auditory tube.
void HeadAnatomy::Model::place_canal() {
  // The canal's axis: out to the skin through cartilage, S-shaped; the drum cuts it.
  const double w = build.canal_wide;
  canal = Tube({{{39, -1.5, -20.6}, 3.3 * w},
                {{45, 0.4, -20}, 3.6 * w},
                {{51, 2.1, -18.9}, 3.4 * w},
                {{57, 3.1, -18.6}, 3.7 * w},
                {{63, 3.7, -19.2}, 4.0 * w},
                {{70, 4.8, -19.6}, 3.8},
                {{84, 8, -20}, 4.5}});
  meatus = Tube({{{14, 6.2, -16.4}, 2.9}, {{21, 4.2, -15.9}, 2.5}, {{28, 2.6, -15.3}, 2.1}, {{32.6, 1.7, -14.8}, 1.6}});
  auditory_tube = Tube({{{41.2, -4.2, -17.6}, 1.6},
                        {{38.5, -9.5, -19.6}, 1.1},
                        {{33, -18, -23}, 0.8},
                        {{24, -30, -28.5}, 0.8},
                        {{13, -44, -34}, 1.6}});
}

// The facial nerve and its chorda tympani.
void HeadAnatomy::Model::place_nerves() {
  const Build& b = build;
  const double t = b.nerve_thick, y = b.nerve_back, x = b.nerve_out, z = -b.nerve_long;
  nerve = Tube({{{14, 5.6, -15.2}, 0.75 * t},
                {{20, 4.2, -15.0}, 0.7 * t},
                {{27, 2.6, -14.4}, 0.6 * t},
                {{33.2, 1.2, -13.6}, 0.5 * t},
                {{36.4, -2.0, -12.4}, 0.85 * t},
                {{39.7, 2.5, -14.4}, 0.65 * t},
                {{41.3, 6.6, -16.2}, 0.7 * t},
                {{42.5 + 0.5 * x, 7.5 + 0.6 * y, -18.3}, 0.75 * t},
                {{43.2 + x, 7.8 + y, -22}, 0.8 * t},
                {{43.8 + x, 8.8 + y, -27}, 0.85 * t},
                {{44.6 + x, 9.6 + y, -32.5 + z}, 0.9 * t},
                {{46 + x, 7.5, -38.5 + z}, 0.9 * t},
                {{51, -3, -45}, 0.9 * t}});
  const auto& line = nerve.points();
  double arc = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) arc += length(line[i].at_mm - line[i - 1].at_mm);
    if (i == 3 * 6) marks.fundus_mm = arc;
    if (i == 4 * 6) marks.geniculate_mm = arc;
    if (i == 6 * 6 + 3) marks.second_genu_mm = arc;
    if (i == 10 * 6) marks.foramen_mm = arc;
  }
  chorda = Tube({{{43.6 + x, 8.6 + y, -25.5}, 0.3},
                 {{44.6, 7.0 + 0.5 * y, -22.2}, 0.25},
                 {{45.2, 5.0, -18.4}, 0.25},
                 {{44.2, 2.0, -15.6}, 0.25},
                 {{43.6, -2.2, -15.4}, 0.25},
                 {{42.6, -6.5, -17}, 0.25},
                 {{42, -10, -20}, 0.25}});
}

void HeadAnatomy::Model::place_vessels() {
  const Build& b = build;
  const double s = b.sinus_back, u = b.bulb_up;
  sinus = Tube({{{3, 79.5 * b.vault.y, -8}, 4.5},
                {{22, 74.5 * b.vault.y, -6}, 4.5},
                {{41, 57.5 * b.vault.y, -4}, 4.6},
                {{53.5, 38 + s, -6.5}, 4.8},
                {{54, 28 + s, -13}, 5},
                {{51.5, 23.6 + s, -21}, 5},
                {{48, 24 + s, -28}, 5},
                {{43, 24.5 + 0.5 * s, -34}, 4.8},
                {{38, 18, -34.5}, 4.6},
                {{34.6, 10, -28.2 + u}, 4.6},
                {{34, 8, -36}, 4.5},
                {{35, 6, -52}, 5},
                {{37, 4, -90}, 5.5},
                {{38, 4, -140}, 5.5}});
  carotid = Tube({{{32, -2, -140}, 2.8},
                  {{31, -3, -80}, 2.8},
                  {{31.5, -4.5, -44}, 2.7},
                  {{32.5, -6.5, -32}, 2.6},
                  {{32.0, -8.5, -26.5}, 2.5},
                  {{26, -12.5, -23.5}, 2.5},
                  {{17, -19, -19}, 2.4},
                  {{11, -22, -11}, 2.3},
                  {{10.5, -30, -6}, 2.2}});
}

// The lower jaw, and the cheek's arch above it.
void HeadAnatomy::Model::place_jaw() {
  const Build& b = build;
  arch_tube = Tube({{{47, -68, -19}, 6.0},
                    {{55, -60, -19.5}, 4.2},
                    {{61.5, -46, -19.5}, 3.2},
                    {{65, -30, -18}, 3.0},
                    {{64, -16, -15}, 3.6},
                    {{62, -4, -12}, 3.8},
                    {{60, 6, -10.5}, 3}});
  alveolar = Tube({{{43.5 + 0.7 * b.gonion_out, -26, -58}, 1.5},
                   {{43 + 0.7 * b.gonion_out, -30, -70}, 1.4},
                   {{41.2 + 0.5 * b.gonion_out, -40, -84}, 1.3},
                   {{36.5, -56, -92}, 1.3},
                   {{29.5, -70, -95}, 1.3},
                   {{25.5, -77.2, -94}, 1.3},
                   {{27.5, -82, -91}, 1.4}});
  const double g = b.gonion_out;
  jaw_line = Tube({{{-7, -88.7, 0}},
                   {{7, -88.7, 0}},
                   {{20, -82, 0}},
                   {{31, -67, 0}},
                   {{39.5 + 0.4 * g, -45, 0}},
                   {{45.5 + g, -22, 0}}})
                 .points();
}

// Cochlea: 2.5 turns about the modiolus, which points forward and outward. The radius shrinks as the spiral rises.
void HeadAnatomy::Model::place_cochlea() {
  const Build& b = build;
  const Vec3 base{34.2, -2.4, -19.0}, axis = normalized({0.66, -0.72, -0.2});
  const Vec3 e1 = normalized(Vec3{0.73, 0.68, 0} - axis * dot(axis, Vec3{0.73, 0.68, 0})), e2 = cross(axis, e1);
  std::vector<TubePoint> spiral{{{36.8, 2.9, -17.0}, 1.1}};
  constexpr int kPoints = 30;
  for (int i = 0; i <= kPoints; ++i) {
    const double turns = 2.5 * i / kPoints, f = turns / 2.5;
    const portable::SinCos a = portable::sin_cos_turns(turns);
    const double r = b.cochlea * (3.6 * (1 - f) * (1 - 0.25 * f) + 0.7);
    spiral.push_back({base + axis * (3.4 * f * b.cochlea) + e1 * (r * a.cos) - e2 * (r * a.sin), mix(1.0, 0.55, f)});
  }
  cochlea = Tube(spiral);
}

// Of the upper jaw (row 0) or the lower one (1), along an ellipse from the middle to the back.
void HeadAnatomy::Model::place_teeth(int row) {
  const double rx = row == 0 ? 28.5 : 26.5, ry = row == 0 ? 44 : 41, y0 = -46;
  double angle = 0.25, total = 0;  // in turns from the front: x = rx sin, y = y0 - ry cos
  for (int i = 0; i < 8; ++i) total += kTeeth[static_cast<std::size_t>(row * 8 + i)][0];
  double quarter = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps; ++i) {
    const portable::SinCos a = portable::sin_cos_turns((i + 0.5) * 0.25 / kSteps);
    quarter += portable::hypot(rx * a.cos, ry * a.sin) * 0.25 * 6.283185307179586 / kSteps;
  }
  const double fit = std::min(1.0, quarter / total);
  double done = 0, walked = 0;
  angle = 0;
  for (int i = 0; i < 8; ++i) {
    const auto& d = kTeeth[static_cast<std::size_t>(row * 8 + i)];
    const double middle = done + 0.5 * d[0] * fit;
    for (; walked < middle && angle < 0.25; angle += 0.25 / kSteps) {
      const portable::SinCos a = portable::sin_cos_turns(angle);
      walked += portable::hypot(rx * a.cos, ry * a.sin) * 0.25 * 6.283185307179586 / kSteps;
    }
    done += d[0] * fit;
    const portable::SinCos a = portable::sin_cos_turns(angle);
    const double ty = y0 - ry * a.cos, occlusal = -69 + 0.1 * (ty + 90);
    Tooth& tooth = teeth[static_cast<std::size_t>(row * 8 + i)];
    tooth.up = row == 0 ? 1 : -1;
    tooth.half = {0.5 * d[0] * fit - 0.12, 0.5 * d[1], 0.5 * d[2]};
    tooth.centre = {rx * a.sin, ty + (row == 0 ? 0.0 : 1.0),
                    occlusal + tooth.up * ((row == 0 ? 1.2 : 2.4) + 0.5 * d[2])};
    tooth.along = normalized({rx * a.cos, ry * a.sin, 0});
    tooth.root = d[3];
  }
}

}  // namespace osteo::inline imaging
