#include "outcome_rod.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "osteo/core/base/portable_math.h"
#include "outcome_metal.h"

namespace osteo::inline session::outcome::rods {
namespace {

using planning::EdgeReader;
using planning::Equation;
using planning::Row;

constexpr double kSearchMm = 2.5, kSearchStepMm = 0.5, kSearchDeg = 15, kFarthestMm = 3, kFarthestDeg = 18;
constexpr double kSoftHu = 40;
constexpr double kHeadBlurs = 3.6;  // below its head or plate, which tilt it, a shaft is looked at from there on
constexpr double kMinSeen = 0.4, kMinShaft = 0.6, kHoleContrast = 0.45, kHoleBoneHu = 350, kHoleDepthMm = 1.5;
constexpr double kPatchMm = 2, kMinVoxelsAcross = 1.5;
// What the voxels' own scatter does not show: the kernel is not quite a Gaussian, the bone beside it not quite even.
// With 0.15 degrees intervals of tilts held 90 %; of holes 79 %. Streaks of a plate and of its other screws tilt a
// shaft further: beside one, tilts held 80 % with a factor of 1.
constexpr double kModelDeg = 0.19, kHoleModelDeg = 0.7, kBesidePlate = 2.2;
constexpr double kBottomHu = 400;  // about the bottom of a hole; a hole that ends in marrow or goes through shows none
constexpr int kCoarseRounds = 3, kRing = 8;
const double kInf = std::numeric_limits<double>::infinity();

// What blur leaves of a long cylinder, over the distance from its axis.
class BlurredDisc {
 public:
  BlurredDisc(double radius, double blur) {
    constexpr int kStrips = 48;
    const auto count = static_cast<std::size_t>((radius + 4.5 * blur) / kStepMm) + 2;
    for (std::size_t n = 0; n < count; ++n) {
      const double r = static_cast<double>(n) * kStepMm;
      double sum = 0;
      for (int k = 0; k < kStrips; ++k) {
        const double x = radius * (2 * (k + 0.5) / kStrips - 1), far = (x - r) / blur;
        sum += portable::exp(-far * far / 2) * (2 * share_below(std::sqrt(radius * radius - x * x) / blur) - 1);
      }
      at_.push_back(sum * 2 * radius / kStrips / (blur * std::sqrt(2 * std::numbers::pi)));
    }
  }
  [[nodiscard]] double at(double r) const {
    const double n = r / kStepMm;
    const auto below = static_cast<std::size_t>(n);
    if (below + 1 >= at_.size()) return 0;
    const double t = n - static_cast<double>(below);
    return at_[below] * (1 - t) + at_[below + 1] * t;
  }

 private:
  static constexpr double kStepMm = 0.02;
  std::vector<double> at_;
};

class Search {
 public:
  Search(const EdgeReader& ct, const Image& postop, double metal, double clip)
      : ct_(ct), postop_(postop), metal_(metal), clip_(clip) {}

  std::optional<RodFit> find(const Wanted& w, const std::vector<Rod>& taken, double taken_radius, std::string& why,
                             bool& there) const {
    there = true;
    for (double s = -1; s <= w.length + 2; s += 0.5) {
      if (ct_.value(w.planned.world({0, 0, s}))) continue;
      why = "it lies outside the CT's field of view";
      return std::nullopt;
    }
    const Vec3& mm = postop_.frame.spacing_mm;
    if (w.screw->empty && 2 * w.radius < kMinVoxelsAcross * std::max({mm.x, mm.y, mm.z})) {
      why = "the CT's voxels are too large for a hole of this diameter";
      return std::nullopt;
    }
    if (!w.screw->empty && clip_ <= metal_) {
      why = "the CT's values are cut off below those of metal";
      return std::nullopt;
    }
    if (!w.screw->empty && nearest_metal(w) > kNearMetalMm) {
      why = "there is no metal near the planned place";
      there = false;
      return std::nullopt;
    }
    if (w.screw->empty && nearest_metal(w) < 1) {
      why = "there is metal where the plan has an empty hole";
      return std::nullopt;
    }
    const auto start = w.screw->empty ? coarse_hole(w, why, there) : coarse(w, taken, taken_radius);
    if (!start) {
      if (why.empty()) {
        why = taken.empty() ? "the metal near the planned place is no shaft like the planned one"
                            : "the screw near the planned place is that of another";
        there = false;
      }
      return std::nullopt;
    }
    auto fit = w.screw->empty ? fitted<6>(w, *start, why) : fitted<7>(w, *start, why);
    if (!fit) return fit;
    const Vec3 near = w.planned.local(fit->rod.world({0, 0, fit->middle}));
    const double cos = dot(fit->rod.axes.column[2], w.planned.axes.column[2]);
    fit->off = portable::hypot(near.x, near.y);
    fit->plated = !w.screw->empty && other_metal(w, *fit);
    fit->end_seen = !w.screw->empty || bottom_seen(w, fit->rod);
    if (fit->off <= kFarthestMm && portable::acos(std::clamp(cos, -1.0, 1.0)) <= kFarthestDeg * kDeg) return fit;
    why = "nothing like it is near the planned place";
    there = false;
    return std::nullopt;
  }

 private:
  [[nodiscard]] double value(Vec3 p) const { return ct_.value(p).value_or(kSoftHu); }

  [[nodiscard]] double nearest_metal(const Wanted& w) const {
    double nearest = kInf;
    for (double s = 0.2 * w.length; s <= w.length; s += 0.5)
      nearest = std::min(nearest, ct_.metal_mm(w.planned.world({0, 0, s})));
    return nearest;
  }

  // Of places about the planned axis the best one, by a score of each.
  template <class Score>
  std::optional<Rod> best_of(const Wanted& w, const Score& score) const {
    const int steps = static_cast<int>(kSearchMm / kSearchStepMm);
    const double middle = 0.5 * w.length, tilt = kSearchDeg * kDeg / 2;
    std::optional<Rod> best;
    double most = 0;
    for (int x = -steps; x <= steps; ++x) {
      for (int y = -steps; y <= steps; ++y) {
        if (x * x + y * y > steps * steps) continue;
        for (int a = -2; a <= 2; ++a) {
          for (int b = -2; b <= 2; ++b) {
            const Rod r = w.planned.moved(middle, x * kSearchStepMm, y * kSearchStepMm, a * tilt, b * tilt);
            // Of equally good ones the nearest: a thick shaft is as bright beside its axis.
            const double s = score(r) - 0.01 * (x * x + y * y) * kSearchStepMm * kSearchStepMm - 0.01 * (a * a + b * b);
            if (s <= most) continue;
            most = s;
            best = r;
          }
        }
      }
    }
    return best;
  }

  [[nodiscard]] std::optional<Rod> coarse(const Wanted& w, const std::vector<Rod>& taken, double taken_radius) const {
    const auto metal_at = [&](Vec3 p) {
      for (const Rod& t : taken) {
        const Vec3 q = t.local(p);
        if (portable::hypot(q.x, q.y) < taken_radius + 0.3) return 0.0;
      }
      return std::clamp(value(p) / metal_, 0.0, 1.3);
    };
    auto best = best_of(w, [&](const Rod& r) {
      double sum = 0, least = kInf;
      for (int k = 0; k < 9; ++k) {
        const double v = metal_at(r.world({0, 0, w.length * (0.25 + 0.55 * k / 8)}));
        sum += v / 9;
        least = std::min(least, v);
      }
      return least < 0.5 ? 0 : sum - 0.75;
    });
    if (!best) return best;
    // Onto its middle: of what is metal in each section.
    for (int round = 0; round < 3; ++round) {
      const double middle = 0.5 * w.length, reach = w.radius + 0.8;
      Row<2> at{}, slope{};
      double count = 0, squares = 0;
      for (int k = -4; k <= 4; ++k) {
        const double s = middle + 0.06 * k * w.length;
        double sum = 0, x = 0, y = 0;
        for (double v = -reach; v <= reach; v += 0.25) {
          for (double u = -reach; u <= reach; u += 0.25) {
            if (u * u + v * v > reach * reach) continue;
            const double m = std::max(0.0, metal_at(best->world({u, v, s})) - 0.8);
            sum += m;
            x += m * u;
            y += m * v;
          }
        }
        if (sum <= 0) continue;
        count += 1;
        squares += (s - middle) * (s - middle);
        at = {at[0] + x / sum, at[1] + y / sum};
        slope = {slope[0] + x / sum * (s - middle), slope[1] + y / sum * (s - middle)};
      }
      if (count < 5) break;
      best = best->moved(middle, at[0] / count, at[1] / count, slope[0] / squares, slope[1] / squares);
    }
    // Its end: where the metal ends.
    double s = 0.5 * w.length;
    while (s < w.length + kSearchMm + 1 && value(best->world({0, 0, s})) > metal_) s += 0.1;
    best->tip = s;
    best->hu = 1.5 * metal_;
    return best;
  }

  [[nodiscard]] std::array<double, kRing> ring(const Rod& r, double radius, double s) const {
    std::array<double, kRing> out{};
    for (int k = 0; k < kRing; ++k) {
      const auto [sin, cos] = portable::sin_cos(k * 2 * std::numbers::pi / kRing);
      out[static_cast<std::size_t>(k)] = value(r.world({radius * cos, radius * sin, s}));
    }
    return out;
  }

  std::optional<Rod> coarse_hole(const Wanted& w, std::string& why, bool& there) const {
    const double beside = w.radius + kRingBlurs * w.planned.blur + kRingMm;
    double most_bone = 0;
    const auto score = [&](const Rod& r) {
      double dark = 0, bone = 0;
      for (int k = 0; k < 12; ++k) {
        const double s = w.length * (0.02 + 0.9 * k / 11);
        auto all = ring(r, beside, s);
        std::nth_element(all.begin(), all.begin() + 1, all.end());  // one side may be open
        const double b = all[1];
        if (b < kHoleBoneHu || b > kBrightShare * metal_) continue;
        dark += b - value(r.world({0, 0, s}));
        bone += b - kSoftHu;
      }
      most_bone = std::max(most_bone, bone);
      return bone * w.length / 12 < kHoleDepthMm * kHoleBoneHu ? 0 : dark / bone - kHoleContrast;
    };
    auto best = best_of(w, score);
    if (best) {
      best->tip = w.length;
      best->hu = kSoftHu;
      return best;
    }
    if (most_bone * w.length / 12 < kHoleDepthMm * kHoleBoneHu) {
      why = "the CT does not show enough bone about it";
    } else {
      why = "the bone there is not drilled";
      there = false;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool other_metal(const Wanted& w, const RodFit& fit) const {
    const Rod& r = fit.rod;
    const auto all = ring(r, w.radius + kRingBlurs * r.blur + kRingMm, r.tip - std::min(fit.shaft_mm, w.length) - 0.8);
    return std::count_if(all.begin(), all.end(), [&](double v) { return v > kBrightShare * metal_; }) > 2;
  }

  [[nodiscard]] bool bottom_seen(const Wanted& w, const Rod& r) const {
    const double beside = w.radius + kRingBlurs * r.blur + kRingMm;
    for (const double s : {r.tip - 0.5, r.tip + 0.5}) {
      const auto all = ring(r, beside, s);
      if (*std::min_element(all.begin(), all.end()) < kBottomHu) return false;
    }
    return true;
  }

  // A voxel of the shaft or beside it: where it lies, what it has, and what bone or soft tissue has beside it there.
  struct Site {
    Vec3 at;
    double hu = 0, beside = 0;
  };

  std::vector<Site> sites(const Wanted& w, const Rod& r, double top, double& seen) const {
    const double reach = w.radius + 2 * r.blur + 0.2, beside = w.radius + kRingBlurs * r.blur + kRingMm;
    const double bottom = r.tip + 3 * r.blur + 0.3, bright = kBrightShare * metal_;
    std::vector<Site> out;
    double all = 0;
    each_voxel_about(
        postop_.frame, {-reach, -reach, top}, {reach, reach, bottom}, [&](Vec3 q) { return r.world(q); },
        [&](Vec3 x, std::size_t voxel) {
          const Vec3 q = r.local(x);
          const double mm = portable::hypot(q.x, q.y);
          if (mm > reach || q.z < top || q.z > bottom) return;
          all += 1;
          const auto around = ring(r, beside, q.z);
          double mean = 0;
          for (const double v : around) mean += std::min(v, bright) / kRing;
          const Vec3 out_to = mm > 1e-6 ? Vec3{q.x / mm * beside, q.y / mm * beside, q.z} : Vec3{beside, 0, q.z};
          const double there = value(r.world(out_to)), t = std::min(1.0, mm / w.radius);
          if (t > 0.5 ? there > bright : mean > 0.6 * bright + 0.4 * kSoftHu) return;
          out.push_back({x, static_cast<double>(postop_.voxels[voxel]), t * std::min(there, bright) + (1 - t) * mean});
        });
    seen = all > 0 ? static_cast<double>(out.size()) / all : 0;
    return out;
  }

  // Shift and tilt along two axes, tip, HU; for N = 7 the blur too.
  template <std::size_t N>
  std::optional<RodFit> fitted(const Wanted& w, Rod r, std::string& why) const {
    RodFit fit;
    const bool metal = N == 7;
    const double planned_blur = r.blur;
    const double clip = metal ? clip_ : kInf;
    for (int round = 0; round < kMetalRounds; ++round) {
      double top = -0.5;
      if (metal) {
        double run = 1.2;  // how far metal goes on from the tip to the head
        while (run < w.length && value(r.world({0, 0, r.tip - run})) > 0.8 * metal_) run += 0.1;
        fit.shaft_mm = run;
        if (run < kMinShaft * w.length) {
          why = "the metal there is much shorter than the planned screw";
          return std::nullopt;
        }
        top = r.tip - std::min(run, w.length) + kHeadBlurs * r.blur;
      }
      const auto all = sites(w, r, top, fit.seen);
      if (fit.seen < kMinSeen || all.size() < 40) {
        why = metal ? "other metal merges with it" : "the CT shows too little of it beside metal";
        return std::nullopt;
      }
      fit.middle = metal ? 0.5 * (top + r.tip) : 0.5 * std::min(w.length, r.tip);
      constexpr double kBlurStepMm = 0.02;
      const BlurredDisc disc(w.radius, r.blur), wider(w.radius, r.blur + kBlurStepMm);
      const auto part = [&](Vec3 q, double tip, const BlurredDisc& d, double blur) {
        return d.at(portable::hypot(q.x, q.y)) * share_below((tip - q.z) / blur);
      };
      std::vector<Equation<N>> equations;
      std::vector<double> off;
      for (const Site& s : all) {
        const Vec3 q = r.local(s.at);
        const double here = part(q, r.tip, disc, r.blur), rise = r.hu - s.beside;
        const double model = s.beside + rise * here;
        if (model >= clip && s.hu >= clip) continue;
        Equation<N> e;
        e.rest = (s.hu - std::min(model, clip)) / kUnitHu;
        constexpr double kStepMm = 0.02;
        const auto along = [&](Vec3 step) {
          return (part(q - step * kStepMm, r.tip, disc, r.blur) - part(q + step * kStepMm, r.tip, disc, r.blur)) /
                 (2 * kStepMm) * rise / kUnitHu;
        };
        const double x = along({1, 0, 0}), y = along({0, 1, 0});
        e.slope[0] = x;
        e.slope[1] = y;
        e.slope[2] = x * (q.z - fit.middle);
        e.slope[3] = y * (q.z - fit.middle);
        e.slope[4] = (part(q, r.tip + kStepMm, disc, r.blur) - part(q, r.tip - kStepMm, disc, r.blur)) / (2 * kStepMm) *
                     rise / kUnitHu;
        e.slope[5] = here;
        if constexpr (N == 7)
          e.slope[6] = (part(q, r.tip, wider, r.blur + kBlurStepMm) - here) / kBlurStepMm * rise / kUnitHu;
        if (model >= clip) e.slope = {};
        e.patch = patch_of(q, kPatchMm);
        off.push_back(std::abs(e.rest));
        equations.push_back(e);
      }
      if (equations.size() < 30) {
        why = "too little of it is seen";
        return std::nullopt;
      }
      std::size_t kept = equations.size();
      if (round >= kCoarseRounds) {
        const double limit = std::max(kKeptHu / kUnitHu, 4 * 1.4826 * median_of(off));
        std::erase_if(equations, [&](const Equation<N>& e) { return std::abs(e.rest) > limit; });
        kept = equations.size();
      }
      Row<N> hold{}, towards{};
      hold[4] = 0.01;
      if constexpr (N == 7) {
        hold[6] = 1 / (kBlurDoubtMm * kBlurDoubtMm);
        towards[6] = planned_blur - r.blur;
      } else {
        hold[5] = 0.25;  // of a hole the HU is that of soft tissue, to 200
        towards[5] = (kSoftHu - r.hu) / kUnitHu;
      }
      const auto solved = planning::least_squares<N>(equations, hold, towards);
      if (!solved) {
        why = "too little of it is seen";
        return std::nullopt;
      }
      const auto& step = solved->step;
      const auto within = [](double v, double most) { return std::clamp(v, -most, most); };
      r.tip += within(step[4], 1);
      r.hu += kUnitHu * step[5];
      if constexpr (N == 7) r.blur = std::clamp(r.blur + within(step[6], 0.1), 0.2, 1.5);
      r = r.moved(fit.middle, within(step[0], 0.5), within(step[1], 0.5), within(step[2], 0.1), within(step[3], 0.1));
      fit.rod = r;
      fit.quantile = solved->quantile;
      for (std::size_t a = 0; a < 5; ++a)
        for (std::size_t b = 0; b < 5; ++b) fit.covariance[a][b] = solved->covariance[a][b];
      if (static_cast<double>(kept) < 0.6 * static_cast<double>(off.size()) || (metal && r.hu < metal_)) {
        why = metal ? "the metal there is not shaped as the planned screw" : "what is there is not shaped as a hole";
        return std::nullopt;
      }
      if (round > kCoarseRounds + 2 && std::abs(step[0]) + std::abs(step[1]) + std::abs(step[4]) < 1e-4 &&
          std::abs(step[2]) + std::abs(step[3]) < 1e-5)
        break;
    }
    return fit;
  }

  const EdgeReader& ct_;
  const Image& postop_;
  double metal_, clip_;
};

}  // namespace

double RodFit::model_tilt(bool empty) const {
  return (empty ? kHoleModelDeg : plated ? kBesidePlate * kModelDeg : kModelDeg) * kDeg;
}

RodFinder::RodFinder(const EdgeReader& ct, const Image& postop, const OutcomeParams& params)
    : ct_(ct), postop_(postop), metal_(params.metal_hu), clip_(clip_of(postop)) {}

std::optional<RodFit> RodFinder::find(const Wanted& w, const std::vector<Rod>& taken, double taken_radius,
                                      std::string& why, bool& there) const {
  return Search(ct_, postop_, metal_, clip_).find(w, taken, taken_radius, why, there);
}

}  // namespace osteo::inline session::outcome::rods
