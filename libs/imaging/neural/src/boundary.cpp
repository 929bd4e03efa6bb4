// How wide a boundary is in a network's probabilities, and what that says of its place.
#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/trust.h"
#include "osteo/imaging/neural/segment_network.h"
#include "turned.h"

namespace osteo::inline imaging {
namespace {

constexpr double kStepMm = 0.1, kOutside = 0.1, kInside = 0.9;
constexpr std::size_t kMostTenths = 60;  // of a millimetre: from there on nothing can be said
using Point = std::array<double, 3>;     // on the network's grid, in voxels

// Probability of one class on the network's grid.
class Probability {
 public:
  Probability(const NetworkLogits& logits, double temperature, const Context& context)
      : logits_(logits), temperature_(temperature), context_(context) {
    // The logarithm of what a softmax divides by.
    rest_.resize(voxels());
    const std::size_t classes = logits.values.size() / voxels();
    for_voxels([&](std::size_t v) {
      double top = -std::numeric_limits<double>::infinity(), sum = 0;
      for (std::size_t c = 0; c < classes; ++c) top = std::max(top, scaled(c, v));
      for (std::size_t c = 0; c < classes; ++c) sum += std::exp(scaled(c, v) - top);
      rest_[v] = static_cast<float>(top + std::log(sum));
    });
  }

  void take(std::size_t of) {
    p_.resize(voxels());
    for_voxels([&](std::size_t v) {
      p_[v] = static_cast<float>(std::exp(std::min(scaled(of, v) - static_cast<double>(rest_[v]), 0.0)));
    });
  }

  // Linear between voxels; beyond the grid as at its edge.
  [[nodiscard]] double at(const Point& point) const {
    std::array<std::size_t, 3> low{}, high{};
    Point share{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = std::clamp(point[a], 0.0, static_cast<double>(logits_.size[a] - 1));
      low[a] = static_cast<std::size_t>(x);
      high[a] = std::min(low[a] + 1, static_cast<std::size_t>(logits_.size[a] - 1));
      share[a] = x - std::floor(x);
    }
    const auto line = [&](std::size_t z, std::size_t y) {
      const float* const row =
          p_.data() + (z * static_cast<std::size_t>(logits_.size[1]) + y) * static_cast<std::size_t>(logits_.size[2]);
      return static_cast<double>(row[low[2]]) * (1 - share[2]) + static_cast<double>(row[high[2]]) * share[2];
    };
    const auto face = [&](std::size_t z) { return line(z, low[1]) * (1 - share[1]) + line(z, high[1]) * share[1]; };
    return face(low[0]) * (1 - share[0]) + face(high[0]) * share[0];
  }

 private:
  [[nodiscard]] std::size_t voxels() const { return voxels_of(logits_.size); }
  [[nodiscard]] double scaled(std::size_t of, std::size_t v) const {
    return static_cast<double>(float_from_half(logits_.values[of * voxels() + v])) / temperature_;
  }
  template <class Body>
  void for_voxels(const Body& body) const {
    parallel_for(voxels(), 4096, context_.threads, [&](std::size_t begin, std::size_t end) {
      context_.check_cancelled();
      for (std::size_t v = begin; v < end; ++v) body(v);
    });
  }

  const NetworkLogits& logits_;
  double temperature_;
  const Context& context_;
  std::vector<float> rest_, p_;
};

// From a voxel's centre, on the grid whose voxels are `mm` apart.
double width_mm(const Probability& p, const Point& from, const Point& mm) {
  Point way{};
  double length = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    Point before = from, after = from;
    before[a] -= 0.5;
    after[a] += 0.5;
    way[a] = (p.at(before) - p.at(after)) / mm[a];  // outwards, where it falls
    length += way[a] * way[a];
  }
  length = std::sqrt(length);
  if (length < 1e-6) return kWidestMm;
  const auto reach = [&](double sign, const auto& arrived) {
    for (int n = 0; n * kStepMm < kWidestMm; ++n) {
      Point x = from;
      for (std::size_t a = 0; a < 3; ++a) x[a] += sign * n * kStepMm * way[a] / length / mm[a];
      if (arrived(p.at(x))) return n * kStepMm;
    }
    return kWidestMm;
  };
  return std::min(kWidestMm,
                  reach(1, [](double v) { return v <= kOutside; }) + reach(-1, [](double v) { return v >= kInside; }));
}

double calibrated(const std::vector<std::array<double, 2>>& table, double width) {
  const auto next = std::find_if(table.begin(), table.end(), [&](const auto& row) { return row[0] >= width; });
  if (next == table.begin()) return table.front()[1];
  if (next == table.end()) return table.back()[1];
  const auto& before = *(next - 1);
  return before[1] + ((*next)[1] - before[1]) * (width - before[0]) / ((*next)[0] - before[0]);
}

// The network's grid under an image.
struct Under {
  Under(const Frame& frame, const NetworkLogits& logits, const NetworkModel& model)
      : turned(frame, model.transpose), first(logits.first) {
    for (std::size_t a = 0; a < 3; ++a) {
      per_voxel[a] = static_cast<double>(logits.size[a]) / logits.cropped[a];
      mm[a] = logits.image_mm[a] / per_voxel[a];
    }
  }
  [[nodiscard]] Point of(const Axes& n) const {
    Point x{};
    for (std::size_t a = 0; a < 3; ++a) x[a] = (n[a] - first[a] + 0.5) * per_voxel[a] - 0.5;
    return x;
  }
  Turned turned;
  Axes first;
  Point per_voxel{}, mm{};
};

}  // namespace

Labels no_uncertainty(const Frame& frame) {
  Labels none;
  none.frame = frame;
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::fill_n(voxels.get(), frame.voxel_count(), std::uint8_t{0});
  none.voxels = voxels;
  // From green to red by way of lightness, for eyes of every kind (Okabe and Ito).
  constexpr std::array<std::array<std::uint8_t, 3>, kUncertaintyMm.size() + 1> kColours{
      {{0, 158, 115}, {86, 180, 233}, {240, 228, 66}, {213, 94, 0}}};
  for (std::size_t c = 0; c < kColours.size(); ++c) {
    const bool last = c == kUncertaintyMm.size();
    none.structures.push_back(
        {.value = static_cast<std::uint8_t>(c + 1),
         .name = last ? "boundary uncertain by more than " + format_number(kUncertaintyMm.back()) + " mm"
                      : "boundary within " + format_number(kUncertaintyMm[c]) + " mm",
         .rgb = kColours[c]});
  }
  return none;
}

std::optional<BoundaryUncertainty> boundary_uncertainty(const Labels& labels, const NetworkLogits& logits,
                                                        const NetworkModel& model,
                                                        const NetworkCalibration& calibration, const Context& context) {
  const bool known = std::any_of(calibration.structures.begin(), calibration.structures.end(),
                                 [](const auto& s) { return !s.boundary_mm.empty(); });
  if (model.regions || !known) return std::nullopt;
  const Under under(labels.frame, logits, model);
  const Axes& size = under.turned.size;
  const auto label = [&](const Axes& n) { return labels.voxels[under.turned.at(n[0], n[1], n[2])]; };
  const auto at_boundary = [&](const Axes& n) {
    for (std::size_t a = 0; a < 3; ++a) {
      for (const int way : {-1, 1}) {
        Axes next = n;
        next[a] += way;
        if (next[a] >= 0 && next[a] < size[a] && label(next) != label(n)) return true;
      }
    }
    return false;
  };
  const auto classes = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::fill_n(classes.get(), labels.frame.voxel_count(), std::uint8_t{0});
  BoundaryUncertainty result{no_uncertainty(labels.frame), {}};
  Probability probability(logits, calibration.temperature, context);
  for (const StructureCalibration& s : calibration.structures) {
    if (s.boundary_mm.empty()) continue;
    const auto at = std::find(model.values.begin(), model.values.end(), s.value);
    probability.take(static_cast<std::size_t>(at - model.values.begin()));
    parallel_for(static_cast<std::size_t>(size[0]), 1, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      Axes n{};
      for (n[0] = static_cast<int>(begin); n[0] < static_cast<int>(end); ++n[0]) {
        for (n[1] = 0; n[1] < size[1]; ++n[1]) {
          for (n[2] = 0; n[2] < size[2]; ++n[2]) {
            if (label(n) != s.value || !at_boundary(n)) continue;
            const double mm = calibrated(s.boundary_mm, width_mm(probability, under.of(n), under.mm));
            // Tenths for now, rounded up, and 1 more, since 0 is no boundary.
            classes[under.turned.at(n[0], n[1], n[2])] =
                static_cast<std::uint8_t>(1 + std::min<double>(kMostTenths, std::ceil(10 * mm - 1e-6)));
          }
        }
      }
    });
    StructureBoundary row;
    row.name = s.name;
    std::array<std::size_t, kMostTenths + 1> met{};
    std::size_t all = 0;
    for (std::size_t v = 0; v < labels.frame.voxel_count(); ++v) {
      if (labels.voxels[v] != s.value || classes[v] == 0) continue;
      const auto tenths = static_cast<std::size_t>(classes[v] - 1);
      ++met[tenths];
      ++all;
      std::size_t c = 0;
      while (c < kUncertaintyMm.size() && static_cast<double>(tenths) > 10 * kUncertaintyMm[c] + 1e-6) ++c;
      classes[v] = static_cast<std::uint8_t>(c + 1);
      ++row.voxels[c];
    }
    std::size_t below = met[0], tenths = 1;  // 0 would say that nothing is known
    while (tenths < kMostTenths && (below += met[tenths]) * 20 < all * 19) ++tenths;
    row.within_mm = tenths < kMostTenths ? static_cast<double>(tenths) / 10 : std::numeric_limits<double>::infinity();
    if (all > 0) result.structures.push_back(row);
  }
  result.classes.voxels = classes;
  return result;
}

std::vector<UncertainPlace> uncertain_places(const Labels& structures, const Labels& uncertainty, std::size_t most) {
  if (structures.frame != uncertainty.frame)
    throw Error(ExitCode::usage, "structures and their uncertainty are not of one grid");
  constexpr auto kLast = static_cast<std::uint8_t>(kUncertaintyMm.size() + 1);
  constexpr std::size_t kFewest = 4;
  const Frame& f = structures.frame;
  std::vector<bool> met(f.voxel_count(), false);
  std::vector<std::array<int, 3>> open;
  std::vector<UncertainPlace> places;
  const auto visit = [&](int i, int j, int k, std::uint8_t structure) {
    const std::size_t v = structures.offset(i, j, k);
    if (met[v] || uncertainty.voxels[v] != kLast || structures.voxels[v] != structure) return;
    met[v] = true;
    open.push_back({i, j, k});
  };
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i) {
        const std::uint8_t structure = structures.voxels[structures.offset(i, j, k)];
        if (structure == 0) continue;
        open.clear();
        visit(i, j, k, structure);
        std::array<double, 3> middle{};
        for (std::size_t n = 0; n < open.size(); ++n) {
          const std::array<int, 3> at = open[n];
          for (std::size_t a = 0; a < 3; ++a) middle[a] += at[a];
          for (int way = 0; way < 27; ++way) {
            const std::array<int, 3> x{at[0] + way % 3 - 1, at[1] + way / 3 % 3 - 1, at[2] + way / 9 - 1};
            if (x[0] >= 0 && x[1] >= 0 && x[2] >= 0 && x[0] < f.dims[0] && x[1] < f.dims[1] && x[2] < f.dims[2])
              visit(x[0], x[1], x[2], structure);
          }
        }
        if (open.size() < kFewest) continue;
        UncertainPlace place{{}, structure, open.size()};
        double least = std::numeric_limits<double>::infinity();
        for (const std::array<int, 3>& at : open) {
          double away = 0;
          for (std::size_t a = 0; a < 3; ++a) {
            const double d = at[a] - middle[a] / static_cast<double>(open.size());
            away += d * d;
          }
          if (away >= least) continue;
          least = away;
          place.at_mm =
              f.world_from_index({static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])});
        }
        places.push_back(place);
      }
    }
  }
  std::stable_sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.voxels > b.voxels; });
  places.resize(std::min(places.size(), most));
  return places;
}

}  // namespace osteo::inline imaging
