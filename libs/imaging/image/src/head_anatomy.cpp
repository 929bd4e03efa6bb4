#include "osteo/imaging/image/detail/head_anatomy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "head_model.h"

namespace osteo::inline imaging {
using namespace anatomy;
namespace {

// Bone and what lies around it have their mean near 500, so that one threshold finds unbiased boundaries; cancellous
// bone, which lies within a cortex, is above it.
constexpr std::array<double, kTissueCount> kHu{-1000, 40,   960, 960, 960, 1200, 60, 50,    2600,  700,
                                               700,   1500, 30,  50,  50,  50,   60, -1000, -1000, -1000};
constexpr std::array<std::string_view, kTissueCount> kNames{
    "air",          "soft tissue",    "cortical bone",  "cellular bone",  "mandible",   "ossicle",
    "facial nerve", "sigmoid sinus",  "left marker",    "diploe",         "jaw marrow", "tooth",
    "labyrinth",    "chorda tympani", "alveolar nerve", "carotid artery", "dura",       "air cells",
    "ear canal",    "tympanic cavity"};

}  // namespace

HeadAnatomy::Sample HeadAnatomy::Model::sample(Vec3 world) const {
  double margin = 1e9;
  const auto inside = [&](double d, double level = 0) {
    margin = std::min(margin, std::abs(d - level));
    return d < level;
  };
  const auto is = [&](Tissue t) { return Sample{t, margin / kLipschitz}; };
  if (inside(length(world - kMarker) - kMarkerRadius)) return is(Tissue::left_marker);
  const Vec3 p{std::abs(world.x), world.y, world.z};
  const double vault = outer_vault(p);
  const double skin_d = skin(p, vault);
  if (!inside(skin_d)) return is(Tissue::air);
  // The ear's parts lie in a box; beyond it and a rim they decide nothing.
  const Vec3 lo{8, -50, -70}, hi{80, 40, -2};
  const double away = length(Vec3{std::max({lo.x - p.x, p.x - hi.x, 0.0}), std::max({lo.y - p.y, p.y - hi.y, 0.0}),
                                  std::max({lo.z - p.z, p.z - hi.z, 0.0})});
  constexpr double kRim = 4;
  const bool near_ear = away < kRim;
  Ear e;
  if (near_ear) {
    e = ear(p);
  } else {
    margin = std::min(margin, away);
    if (p.z < -60 || p.y < -14) e.carotid = carotid.distance(p, 4);
  }
  const double sinus_d = sinus.distance(p, 8);
  if (near_ear) {
    if (inside(e.nerve)) return is(Tissue::facial_nerve);
    if (inside(e.chorda)) return is(Tissue::chorda_tympani);
    if (inside(ossicles(p))) return is(Tissue::ossicle);
    if (inside(e.cavity)) return is(Tissue::tympanic_cavity);
    if (inside(e.canal)) return is(Tissue::ear_canal);
    if (inside(e.drum)) return is(Tissue::soft);
    if (inside(e.labyrinth)) return is(Tissue::labyrinth);
    if (inside(e.meatus)) return is(Tissue::soft);
  }
  if (inside(sinus_d)) return is(Tissue::sigmoid_sinus);
  if (inside(e.carotid)) return is(Tissue::carotid);
  // Air of the nose and its sinuses.
  const double orbit_d = orbit(p), nasal_d = nasal(p);
  double air = 1e9;
  if (p.y < -10 && p.z < 40) {
    air = ellipsoid(p, {27, -64, -30}, {12.7, 16, 13.5});
    air = std::min(air, ellipsoid(p, {8.5, -84.5, 19}, {7, 4, 7}));
    air = std::min(air, ellipsoid(p, {6.5, -38, -12}, {5.6, 11, 7.5}));
    air = std::min(air, box(p, {8.2, -68, -3}, {3.2, 12, 6}, 2.5));
  } else {
    margin = std::min(margin, std::max({p.y + 10, p.z - 40, 0.0}) + 10);
  }
  const double brain_d = brain(p, vault, sinus_d, e, orbit_d, air);
  if (inside(brain_d)) return inside(brain_d, -0.8) ? is(Tissue::soft) : is(Tissue::dura);
  if (inside(air)) return is(Tissue::air);
  if (inside(nasal_d)) {
    // Septum and conchae: bone within mucosa.
    const double septum = smax(p.x - 0.7, -84 - p.y, 1);
    const double concha =
        std::min(cone(p, {9, -84, -30}, {9, -54, -30}, 2.6, 2.6), cone(p, {6.5, -80, -16}, {6.5, -52, -16}, 2.2, 2.2));
    if (inside(septum) || inside(concha, -1.8)) return is(Tissue::cortical);
    if (inside(septum, 1.0) || inside(concha) || inside(nasal_d, 0) == false || !inside(nasal_d, -1.2))
      return is(Tissue::soft);
    return is(Tissue::air);
  }
  const double tooth_d = tooth(p);
  if (inside(tooth_d)) return is(Tissue::tooth);
  const double jaw = mandible(p);
  if (inside(jaw)) {
    if (inside(alveolar.distance(p, 4))) return is(Tissue::alveolar_nerve);
    const double wall = alveolar.distance(p, 4);
    if (inside(jaw, -2.2) && !inside(wall, 0.5) && !inside(tooth_d, 0.6)) return is(Tissue::jaw_marrow);
    return is(Tissue::mandible);
  }
  const double bone = skull(p, vault, brain_d, orbit_d, nasal_d, air, sinus_d, e);
  if (!inside(bone)) {
    const double throat = smax(smax(portable::hypot(p.x, p.y + 32) - 9, p.z + 36, 4), -150 - p.z, 4);
    const double mouth = smax(ellipsoid(p, {0, -62, -56}, {19, 22, 3}), -85 - p.y, 2);
    return inside(smin(throat, mouth, 3)) ? is(Tissue::air) : is(Tissue::soft);
  }
  if (near_ear) {
    // Openings between the cells and to the antrum go through any wall but those to what must not be opened.
    const double kept = std::min(
        {e.nerve - 0.8, e.chorda - 0.3, e.labyrinth - 1.3, e.canal - 1.0, sinus_d - 0.9, brain_d - 0.8, -bone - 1.5});
    if (inside(in_duct(p)) && !inside(kept)) return is(Tissue::air_cells);
    const double region = cell_region(p, bone, brain_d, sinus_d, e);
    if (inside(region, 0.5)) {
      if (inside(region)) {
        if (inside(in_cell(p))) return is(Tissue::air_cells);
      }
      return is(Tissue::cellular);
    }
    // The petrous bone is dense around what it holds.
    if (inside(e.labyrinth, 2.0) || inside(e.nerve, 0.9) || inside(e.canal, 1.2) || inside(e.cavity, 1.0) ||
        inside(e.meatus, 1.0) || inside(e.carotid, 1.0))
      return is(Tissue::cortical);
  }
  if (inside(bone, -1.6) && !inside(sinus_d, 1.2)) return is(Tissue::diploe);
  return is(Tissue::cortical);
}

HeadAnatomy::HeadAnatomy(std::uint64_t individual) : model_(std::make_shared<const Model>(individual)) {}
HeadAnatomy::Sample HeadAnatomy::sample(Vec3 p) const {
  return model_->sample(p);
}
std::span<const TubePoint> HeadAnatomy::facial_nerve() const {
  return model_->nerve.points();
}
HeadAnatomy::NerveMarks HeadAnatomy::facial_nerve_marks() const {
  return model_->marks;
}
std::span<const TubePoint> HeadAnatomy::chorda_tympani() const {
  return model_->chorda.points();
}
std::span<const TubePoint> HeadAnatomy::sigmoid_sinus() const {
  return model_->sinus.points();
}
std::span<const TubePoint> HeadAnatomy::alveolar_nerve() const {
  return model_->alveolar.points();
}
std::span<const AirCell> HeadAnatomy::air_cells() const {
  return model_->cells;
}

std::string_view tissue_name(Tissue tissue) {
  return kNames[static_cast<std::size_t>(tissue)];
}
double tissue_hu(Tissue tissue) {
  return kHu[static_cast<std::size_t>(tissue)];
}

}  // namespace osteo::inline imaging
