// Plates of a plan, in a CT after surgery.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/distance/distance_map.h"
#include "outcome_metal.h"
#include "outcome_parts.h"
#include "section.h"

namespace osteo::inline session::outcome {
namespace plates {
namespace {

using planning::EdgeReader;
using planning::Equation;
using planning::Row;

constexpr double kSearchMm = 3, kSearchDeg = 4, kMarginMm = 3.5, kOnFragmentMm = 5;
constexpr double kFinestMm = 0.2, kPatchMm = 3, kMinSeen = 0.3, kMinFits = 0.6;
constexpr double kSharper = 0.8, kWider = 1.25;  // the blurs between which that of metal is looked for
// What scatter does not show; with 0.02 mm and 0.1 degrees intervals were twice as wide as errors ask for.
constexpr double kModelMm = 0.012, kModelDeg = 0.05;
constexpr std::size_t kMostCells = 8000000, kStarts = 3;
constexpr int kCoarseRounds = 4;

// A plate on a grid of its own: signed distance, and what is left of it under two blurs.
class PlateField {
 public:
  PlateField(const TriangleSoup& surface, double blur, const Context& context) {
    const BoxMm box = bounds_of(surface);
    const Vec3 size = box.hi - box.lo + Vec3{2 * kMarginMm, 2 * kMarginMm, 2 * kMarginMm};
    step_ = std::max(kFinestMm, portable::cbrt(size.x * size.y * size.z / static_cast<double>(kMostCells)));
    frame_.spacing_mm = {step_, step_, step_};
    frame_.origin_mm = box.lo - Vec3{kMarginMm, kMarginMm, kMarginMm};
    for (std::size_t a = 0; a < 3; ++a) frame_.dims[a] = static_cast<int>(size[a] / step_) + 2;
    const DistanceMap map = DistanceMapper(surface, frame_, context).map({}, context);
    mm_.assign(frame_.voxel_count(), static_cast<float>(kMarginMm));
    std::size_t n = 0;
    for (int k = 0; k < frame_.dims[2]; ++k)
      for (int j = 0; j < frame_.dims[1]; ++j)
        for (int i = 0; i < frame_.dims[0]; ++i, ++n)
          if (const auto at = map.find(i, j, k); at >= 0)
            mm_[n] = static_cast<float>(map.distance_mm[static_cast<std::size_t>(at)]);
    sharp_ = blurred(kSharper * blur);
    wide_ = blurred(kWider * blur);
  }
  [[nodiscard]] double mm(Vec3 p) const { return value(mm_, p, kMarginMm); }
  [[nodiscard]] double part(Vec3 p, double mix) const {
    return (1 - mix) * value(sharp_, p, 0) + mix * value(wide_, p, 0);
  }
  [[nodiscard]] Vec3 outwards(Vec3 p) const {
    Vec3 g;
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 step;
      step[a] = step_;
      g[a] = mm(p + step) - mm(p - step);
    }
    return normalized(g);
  }

 private:
  [[nodiscard]] std::vector<float> blurred(double blur) const {
    std::vector<float> v(mm_.size());
    for (std::size_t n = 0; n < v.size(); ++n)
      v[n] = static_cast<float>(std::clamp(0.5 - static_cast<double>(mm_[n]) / step_, 0.0, 1.0));
    const int reach = static_cast<int>(std::ceil(4 * blur / step_));
    std::vector<double> weight;
    double sum = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double x = k * step_ / blur;
      weight.push_back(portable::exp(-x * x / 2));
      sum += weight.back();
    }
    for (double& w : weight) w /= sum;
    std::size_t stride = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto count = static_cast<std::size_t>(frame_.dims[a]);
      std::vector<double> line(count + 2 * static_cast<std::size_t>(reach));
      for (std::size_t n = 0; n < v.size(); ++n) {
        if (n / stride % count != 0) continue;
        for (std::size_t k = 0; k < count; ++k)
          line[k + static_cast<std::size_t>(reach)] = static_cast<double>(v[n + k * stride]);
        for (std::size_t k = 0; k < count; ++k) {
          double all = 0;
          for (std::size_t w = 0; w < weight.size(); ++w) all += weight[w] * line[k + w];
          v[n + k * stride] = static_cast<float>(all);
        }
      }
      stride *= count;
    }
    return v;
  }
  [[nodiscard]] double value(const std::vector<float>& of, Vec3 p, double outside) const {
    const Vec3 q = (p - frame_.origin_mm) / step_;
    std::array<std::size_t, 3> i{};
    Vec3 t;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(q[a] >= 0 && q[a] < frame_.dims[a] - 1)) return outside;
      i[a] = static_cast<std::size_t>(q[a]);
      t[a] = q[a] - static_cast<double>(i[a]);
    }
    const auto nx = static_cast<std::size_t>(frame_.dims[0]), nxy = nx * static_cast<std::size_t>(frame_.dims[1]);
    const std::size_t at = i[2] * nxy + i[1] * nx + i[0];
    const auto row = [&](std::size_t n) {
      return static_cast<double>(of[n]) * (1 - t.x) + static_cast<double>(of[n + 1]) * t.x;
    };
    const double low = row(at) * (1 - t.y) + row(at + nx) * t.y;
    const double high = row(at + nxy) * (1 - t.y) + row(at + nxy + nx) * t.y;
    return low * (1 - t.z) + high * t.z;
  }

  Frame frame_;
  double step_ = kFinestMm;
  std::vector<float> mm_, sharp_, wide_;
};

struct PlateFit {
  Fit fit;
  double fits = 0;  ///< share of the voxels used that are as the model has them
};

class Finder {
 public:
  Finder(const EdgeReader& ct, const Image& postop, const OutcomeParams& params, const Context& context)
      : ct_(ct), postop_(postop), metal_(params.metal_hu), clip_(clip_of(postop)), context_(context) {}

  std::optional<Fit> find(const PlannedPlate& plate, const RigidTransform& guess, double blur, std::string& why) const {
    const auto places = spread(plate.surface, {});
    double inside = 0, metal = 0;
    for (const SurfacePlace& p : places) {
      inside += ct_.value(guess(p.at)) ? 1 : 0;
      metal += ct_.metal_mm(guess(p.at)) <= kNearMetalMm ? 1 : 0;
    }
    const auto count = static_cast<double>(places.size());
    if (inside < 0.7 * count) {
      why = "it lies outside the CT's field of view";
      return std::nullopt;
    }
    if (metal < 0.5 * count) {
      why = "there is no metal where the plan has it";
      return std::nullopt;
    }
    const PlateField field(plate.surface, blur, context_);
    std::optional<PlateFit> best;
    for (const RigidTransform& start : starts(places, guess)) {
      auto fit = fitted(field, start, plate.surface, blur, why);
      if (fit && (!best || fit->fits * fit->fit.found > best->fits * best->fit.found)) best = std::move(fit);
    }
    if (!best) {
      if (why.empty()) why = "the metal there is not shaped as the planned plate";
      return std::nullopt;
    }
    const RigidTransform moved = best->fit.pose * guess.inverse();
    if (best->fits < kMinFits) {
      why = "the metal there is not shaped as the planned plate";
      return std::nullopt;
    }
    if (length(moved(best->fit.middle) - best->fit.middle) > 2 * kSearchMm) {
      why = "there is no metal where the plan has it";
      return std::nullopt;
    }
    why.clear();
    return best->fit;
  }

 private:
  [[nodiscard]] std::vector<RigidTransform> starts(const std::vector<SurfacePlace>& places,
                                                   const RigidTransform& guess) const {
    Vec3 middle;
    for (const auto& p : places) middle += guess(p.at) / static_cast<double>(places.size());
    std::vector<RigidTransform> all;
    const int steps = static_cast<int>(kSearchMm);
    for (int turn = 0; turn < 7; ++turn) {
      Vec3 about;
      if (turn > 0) about[static_cast<std::size_t>(turn - 1) / 2] = (turn % 2 == 0 ? 1 : -1) * kSearchDeg * kDeg;
      for (int x = -steps; x <= steps; ++x)
        for (int y = -steps; y <= steps; ++y)
          for (int z = -steps; z <= steps; ++z) all.push_back(small_motion(middle, Vec3(x, y, z), about) * guess);
    }
    std::vector<double> score(all.size());
    parallel_for(all.size(), 16, context_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        for (std::size_t p = 0; p < places.size(); p += 8) {
          const Vec3 at = all[n](places[p].at), out = all[n].rotation * places[p].normal;
          const auto in = ct_.value(at - out * 0.3), beyond = ct_.value(at + out * 1.2);
          if (in && beyond) score[n] += std::clamp(*in, 0.0, metal_) - std::clamp(*beyond, 0.0, metal_);
        }
      }
    });
    std::vector<std::size_t> order(all.size());
    for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return score[a] > score[b]; });
    std::vector<RigidTransform> out;
    for (std::size_t n = 0; n < kStarts; ++n) out.push_back(all[order[n]]);
    return out;
  }

  // A voxel on or beside the plate: what it has, and what is beside the plate there.
  struct Site {
    Vec3 at, local;
    double hu = 0, beside = 0;
  };

  std::vector<Site> sites(const PlateField& field, const RigidTransform& pose, const TriangleSoup& surface, double blur,
                          double& seen) const {
    const double reach = 2 * blur + 0.2, beside = kRingBlurs * blur + kRingMm, bright = kBrightShare * metal_;
    const BoxMm own = bounds_of(surface);
    const Vec3 more{reach, reach, reach};
    const RigidTransform back = pose.inverse();
    std::vector<Site> out;
    double all = 0;
    each_voxel_about(postop_.frame, own.lo - more, own.hi + more, pose, [&](Vec3 x, std::size_t voxel) {
      const Vec3 q = back(x);
      const double mm = field.mm(q);
      if (mm > reach) return;
      all += 1;
      const Vec3 outer = q + field.outwards(q) * (beside - mm);
      if (field.mm(outer) < 0.8 * beside) return;
      const auto there = ct_.value(pose(outer));
      if (!there || *there > bright) return;
      out.push_back({x, q, static_cast<double>(postop_.voxels[voxel]), *there});
    });
    seen = all > 0 ? static_cast<double>(out.size()) / all : 0;
    return out;
  }

  std::optional<PlateFit> fitted(const PlateField& field, const RigidTransform& start, const TriangleSoup& surface,
                                 double blur, std::string& why) const {
    PlateFit out;
    Fit& fit = out.fit;
    fit.pose = start;
    const double as_bone = (1 - kSharper) / (kWider - kSharper);
    double hu = 1.5 * metal_, mix = as_bone;
    for (int round = 0; round < kMetalRounds; ++round) {
      context_.check_cancelled();
      const auto all = sites(field, fit.pose, surface, blur, fit.found);
      if (fit.found < kMinSeen || all.size() < 100) {
        why = "other metal merges with it, or too little of it is seen";
        return std::nullopt;
      }
      fit.middle = {};
      for (const Site& s : all) fit.middle += s.at / static_cast<double>(all.size());
      std::vector<Equation<8>> equations;
      std::vector<double> off;
      for (const Site& s : all) {
        const double part = field.part(s.local, mix), rise = hu - s.beside, model = s.beside + rise * part;
        if (model >= clip_ && s.hu >= clip_) continue;
        Equation<8> e;
        e.rest = (s.hu - std::min(model, clip_)) / kUnitHu;
        if (model < clip_) {
          constexpr double kStepMm = 0.2;
          Vec3 g;
          for (std::size_t a = 0; a < 3; ++a) {
            Vec3 step;
            step[a] = kStepMm;
            g[a] = (field.part(s.local + step, mix) - field.part(s.local - step, mix)) / (2 * kStepMm);
          }
          g = fit.pose.rotation * g * (-rise / kUnitHu);
          const Vec3 m = cross(s.at - fit.middle, g);
          e.slope = {g.x, g.y, g.z,  m.x,
                     m.y, m.z, part, (field.part(s.local, 1) - field.part(s.local, 0)) * rise / kUnitHu};
        }
        e.patch = patch_of(s.local, kPatchMm);
        off.push_back(std::abs(e.rest));
        equations.push_back(e);
      }
      if (equations.size() < 100) return std::nullopt;
      const double used = static_cast<double>(equations.size());
      if (round >= kCoarseRounds) {
        const double limit = std::max(kKeptHu / kUnitHu, 4 * 1.4826 * median_of(off));
        std::erase_if(equations, [&](const Equation<8>& e) { return std::abs(e.rest) > limit; });
      }
      out.fits = static_cast<double>(
                     std::count_if(off.begin(), off.end(), [&](double v) { return v < 0.12 * hu / kUnitHu; })) /
                 used;
      Row<8> hold{}, towards{};
      const double doubt = kBlurDoubtMm / (blur * (kWider - kSharper));
      hold[7] = 1 / (doubt * doubt);
      towards[7] = as_bone - mix;
      const auto solved = planning::least_squares<8>(equations, hold, towards);
      if (!solved) {
        why = "too little of it is seen";
        return std::nullopt;
      }
      const auto& s = solved->step;
      Vec3 shift{s[0], s[1], s[2]}, turn{s[3], s[4], s[5]};
      if (length(shift) > 1) shift = normalized(shift);
      if (length(turn) > 0.1) turn = normalized(turn) * 0.1;
      fit.pose = small_motion(fit.middle, shift, turn) * fit.pose;
      hu = std::max(metal_, hu + kUnitHu * s[6]);
      mix = std::clamp(mix + s[7], 0.0, 1.0);
      fit.quantile = solved->quantile;
      for (std::size_t a = 0; a < 6; ++a)
        for (std::size_t b = 0; b < 6; ++b) fit.covariance[a][b] = solved->covariance[a][b];
      if (round > kCoarseRounds + 2 && length(shift) < 1e-4 && length(turn) < 1e-5) break;
    }
    for (std::size_t a = 0; a < 6; ++a)
      fit.covariance[a][a] += a < 3 ? kModelMm * kModelMm : kModelDeg * kModelDeg * kDeg * kDeg;
    return out;
  }

  const EdgeReader& ct_;
  const Image& postop_;
  double metal_, clip_;
  const Context& context_;
};

constexpr double kShortestPlateMm = 8;

// Plates of one file are rigid each by itself. What faces inwards and lies within another's box is a hollow of that
// one, not a plate.
std::vector<PlannedPlate> plates_in(const PlannedPlate& file) {
  const TriangleSoup& s = file.surface;
  const auto piece = pieces_of(s, std::vector<bool>(s.triangles.size(), true));
  struct Piece {
    BoxMm box;
    double volume = 0;
    std::size_t of = 0;
  };
  std::vector<Piece> all;
  for (std::size_t n = 0; n < piece.size(); ++n) {
    if (piece[n] >= all.size()) all.push_back({{}, 0, all.size()});
    const auto& t = s.triangles[n];
    for (const std::uint32_t p : t) all[piece[n]].box.include(s.points_mm[p]);
    all[piece[n]].volume += dot(s.points_mm[t[0]], cross(s.points_mm[t[1]], s.points_mm[t[2]]));
  }
  const auto holds = [](const BoxMm& a, const BoxMm& b) {
    bool in = true;
    for (std::size_t k = 0; k < 3; ++k) in = in && a.lo[k] < b.lo[k] && a.hi[k] > b.hi[k];
    return in;
  };
  for (Piece& p : all)
    for (std::size_t n = 0; n < all.size() && p.volume < 0; ++n)
      if (all[n].volume > 0 && holds(all[n].box, p.box)) p.of = n;
  std::vector<PlannedPlate> out;
  std::vector<std::size_t> place(all.size(), all.size());
  for (std::size_t n = 0; n < piece.size(); ++n) {
    std::size_t& at = place[all[piece[n]].of];
    if (at == all.size()) {
      at = out.size();
      out.push_back({file.name + " " + std::to_string(out.size() + 1), {s.points_mm, {}}});
    }
    out[at].surface.triangles.push_back(s.triangles[n]);
  }
  if (out.size() == 1) out.front().name = file.name;
  for (PlannedPlate& p : out) p.surface = compacted(p.surface);
  return out;
}

}  // namespace
}  // namespace plates

void require_plates(const SurgicalPlan& plan) {
  for (const PlannedPlate& plate : plan.plates) {
    require_sound(plate.surface);
    if (plate.surface.triangles.empty())
      throw Error(ExitCode::usage, "the surface of '" + plate.name + "' is empty", "give the plate's own surface");
    if (!is_closed(plate.surface))
      throw Error(ExitCode::usage, "the surface of '" + plate.name + "' is not closed",
                  "'osteo mesh-repair' closes surfaces");
    planning::require_size_mm(bounds_of(plate.surface), plate.name, plates::kShortestPlateMm);
  }
}

void find_plates(Outcome& out, const SurgicalPlan& plan, const std::vector<std::optional<Fit>>& fits,
                 const std::vector<std::vector<SurfacePlace>>& places, const planning::EdgeReader& ct,
                 const Image& postop, const OutcomeParams& params, const Context& context) {
  using namespace plates;
  if (plan.plates.empty()) return;
  const Finder finder(ct, postop, params, context);
  std::size_t reference = 0;
  while (!out.fragments[reference].reference) ++reference;
  std::vector<PlannedPlate> all;
  for (const PlannedPlate& file : plan.plates)
    for (PlannedPlate& plate : plates_in(file)) all.push_back(std::move(plate));
  for (const PlannedPlate& plate : all) {
    std::string why;
    const Fit& base = *fits[reference];
    const BoxMm box = bounds_of(plate.surface);
    std::optional<Fit> fit;
    if (length(box.hi - box.lo) < kShortestPlateMm)
      why = "this piece of the surface is too small for a plate";
    else
      fit = finder.find(plate, base.pose, blur_of(base), why);
    const auto on = spread(plate.surface, {});
    Vec3 middle;
    for (const SurfacePlace& p : on) middle += p.at / static_cast<double>(on.size());
    // The reference first; then what the plate lies on.
    std::vector<std::size_t> against{reference};
    for (std::size_t n = 0; n < fits.size(); ++n) {
      const RigidTransform& to = plan.fragments[n].planned_from_ct;
      const bool near = n != reference && std::any_of(places[n].begin(), places[n].end(), [&](const SurfacePlace& b) {
                          const Vec3 p = to(b.at);
                          return std::any_of(on.begin(), on.end(),
                                             [&](const SurfacePlace& o) { return length(o.at - p) < kOnFragmentMm; });
                        });
      if (near) against.push_back(n);
    }
    for (const std::size_t n : against) {
      PlateOutcome& o = out.plates.emplace_back();
      o.against = plan.fragments[n].name;
      o.pose.name = plate.name;
      o.pose.middle_mm = middle;
      o.pose.why = why;
      if (!fit) continue;
      o.pose.found = fit->found;
      o.pose.postop_from_ct = fit->pose;
      if (!fits[n] || fits[n]->found < kMinFound) {
        o.pose.why = "that fragment is not found";
        continue;
      }
      Fit of = *fits[n];
      of.pose = of.pose * plan.fragments[n].planned_from_ct.inverse();
      deviation(o.pose, {}, *fit, of, params);
      judge(o.pose, params);
    }
  }
}

}  // namespace osteo::inline session::outcome
