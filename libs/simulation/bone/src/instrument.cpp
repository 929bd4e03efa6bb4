#include "osteo/simulation/bone/instrument.h"

#include <algorithm>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

constexpr double kMmPerFrench = 1.0 / 3, kTubeLengthMm = 60, kBladeMm = 1;

Instrument cutting(InstrumentKind kind, const Burr& edge) {
  Instrument i;
  i.kind = kind;
  i.name = edge.name();
  i.head = edge.head();
  i.shaft = edge.shaft();
  i.edge = edge;
  i.falloff_per_rad = edge.falloff_mm3_per_s_per_n_per_rad / edge.rate_mm3_per_s_per_n;
  return i;
}

// A tube or rod that ends in a ball; thinner behind it where `rod_mm` says so.
Instrument rod(InstrumentKind kind, std::string name, double diameter_mm, double rod_mm) {
  const double r = diameter_mm / 2, behind = rod_mm / 2;
  Instrument i;
  i.kind = kind;
  i.name = std::move(name);
  i.head = {0, 0, r, r};
  // Its own dome begins where the head's ball ends, so that little of it is counted twice.
  i.shaft = {r + behind, kTubeLengthMm, behind, behind};
  return i;
}

template <class ShapeOf>
std::vector<CutDepth> cut_depths(ShapeOf shape_of) {
  std::vector<CutDepth> all;
  for (const Instrument& i : instrument_library()) all.emplace_back(shape_of(i));
  return all;
}

}  // namespace

const std::vector<Instrument>& instrument_library() {
  static const std::vector<Instrument> library = [] {
    std::vector<Instrument> all;
    for (const Burr& b : burr_library()) all.push_back(cutting(InstrumentKind::burr, b));
    for (const int french : {5, 7, 8, 10, 12}) {
      const double outer_mm = french * kMmPerFrench, size = french / 10.0;
      Instrument i = rod(InstrumentKind::sucker, "suction tube " + std::to_string(french) + " Fr", outer_mm, outer_mm);
      i.rate = 60 * size * size;
      i.reach_mm = 4 * size;
      all.push_back(std::move(i));
    }
    Instrument water = rod(InstrumentKind::irrigator, "irrigator 2 mm", 2, 2);
    water.rate = 400;
    water.reach_mm = 15;
    all.push_back(std::move(water));
    all.push_back(rod(InstrumentKind::probe, "probe 1 mm", 1, 0.7));
    all.push_back(rod(InstrumentKind::probe, "hook 2 mm", 2, 1));
    Burr teeth{BurrKind::cutting, kBladeMm, 3, 1.35, BurrShape::cylinder};
    teeth.length_mm = 25;
    Instrument saw = cutting(InstrumentKind::saw, teeth);
    saw.shaft.start_radius_mm = saw.shaft.end_radius_mm =
        1.5 * kBladeMm;  // the chuck, which does not follow into the cut
    saw.shaft.start_mm = saw.head.length_mm + saw.head.end_radius_mm + saw.shaft.start_radius_mm;
    saw.speed_share = 0.25;
    all.push_back(std::move(saw));
    return all;
  }();
  return library;
}

int instrument_index(std::string_view name) {
  constexpr std::string_view kOld = "sucker ";  // of 0.1, in scripts and calls
  const std::string wanted =
      name.starts_with(kOld) ? "suction tube " + std::string(name.substr(kOld.size())) : std::string(name);
  const auto& all = instrument_library();
  const auto it = std::find_if(all.begin(), all.end(), [&](const Instrument& i) { return i.name == wanted; });
  if (it != all.end()) return static_cast<int>(it - all.begin());
  std::string names;
  for (const Instrument& i : all) {
    if (i.kind != InstrumentKind::burr) names += ", " + i.name;
  }
  throw Error(ExitCode::usage, "there is no instrument '" + std::string(name) + "'",
              "burrs as in 'cutting 4 mm'" + names);
}

const Instrument& instrument_of(std::uint8_t tool) {
  const auto& all = instrument_library();
  return all[std::min<std::size_t>(tool, all.size() - 1)];
}

const CutDepth& head_cut_depth(std::size_t tool) {
  static const std::vector<CutDepth> all = cut_depths([](const Instrument& i) { return i.head; });
  return all[tool];
}

const CutDepth& shaft_cut_depth(std::size_t tool) {
  static const std::vector<CutDepth> all = cut_depths([](const Instrument& i) { return i.shaft; });
  return all[tool];
}

}  // namespace osteo::inline simulation
