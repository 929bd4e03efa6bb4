// Each kind of item on three anatomies, where it is violated and where it is kept: cuts are planted by a seed, and what
// is true is sampled from the planted bodies themselves, points a third of a millimetre apart, with no lattice of
// densities and no cavity found by a ball. OSTEO_PLANTED=N plants N in each anatomy, and prints the table that
// docs/validation/evidence.md has.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <optional>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "scene.h"

namespace osteo {
namespace {

using Depth = std::function<double(Vec3)>;

double capsule(Vec3 p, Vec3 a, Vec3 b, double r) {
  const Vec3 way = b - a;
  return length(p - a - way * std::clamp(dot(p - a, way) / dot(way, way), 0.0, 1.0)) - r;
}

// Structures 1 ("main"), 2 ("tube", from a to b) and 3 ("cells", full of bone here).
struct Anatomy {
  const char* name;
  Depth block;  // mm below its face
  Depth main;   // of the structure, negative inside
  Vec3 tube_a, tube_b;
  double tube_mm;
  std::vector<Vec3> cells;
  std::string patches, curve;
  Vec3 shaft, top, angle;  // where shafts go down to, where plates lie, where main and tube are nearest
  double floor;            // of what covers the main structure, there

  // Structures are bone for a millimetre below their faces, and soft inside.
  [[nodiscard]] double bone(Vec3 p) const {
    return std::min({block(p), main(p) + 1, capsule(p, tube_a, tube_b, tube_mm) + 1});
  }
  [[nodiscard]] std::uint8_t at(Vec3 p) const {
    if (capsule(p, tube_a, tube_b, tube_mm) < 0) return 2;
    if (main(p) < 0) return 1;
    for (const Vec3 c : cells)
      if (length(p - c) < 1.2) return 3;
    return 0;
  }
};

const std::vector<Anatomy>& anatomies() {
  static const std::vector<Anatomy> all{
      // A ball under a flat floor, a tube beside it.
      {"ear",
       [](Vec3 p) {
         return std::min({8 - p.z, 12 - std::abs(p.x), 11 - std::abs(p.y), p.z + 6});
       },
       [](Vec3 p) { return length(p) - 3; },
       {-7, -8, 0},
       {-7, 8, 0},
       1.2,
       {{3.5, 0, 3}, {0, 4.5, 0}, {0, -4, 2.5}},
       R"({"name": "window", "structure": "main", "points_mm": [[0, 0, 3]], "within_mm": 3},
          {"name": "wall", "structure": "tube", "points_mm": [[-7, -4, 1.2], [-7, 4, 1.2]], "within_mm": 2})",
       "[[-1, 6, 6.5], [1, 6, 6.5]]",
       {0, 0, 3},
       {8, 0, 8},
       {-4.4, 0, 0},
       3},
      // A vault over brain, with a sinus at its inner face.
      {"vault",
       [](Vec3 p) {
         const double r = length(p - Vec3{0, 0, -20});
         return std::min({26 - r, r - 19, 11.5 - std::abs(p.x), 11.5 - std::abs(p.y)});
       },
       [](Vec3 p) {
         return length(p - Vec3{0, 0, -20}) - 20;
       },
       {6, -9, 0.2},
       {6, 9, 0.2},
       1.3,
       {{-3, 0, 2.5}, {0, 4, 2.5}, {0, -4, 2.5}},
       R"({"name": "window", "structure": "main", "points_mm": [[-2, 0, 0]], "within_mm": 4},
          {"name": "wall", "structure": "tube", "points_mm": [[6, -4, 1.5], [6, 4, 1.5]], "within_mm": 2})",
       "[[-3, 6, 4.5], [-1, 6, 4.5]]",
       {-2, 0, 0},
       {8, 0, 4.5},
       {4.2, 0, 2.6},
       0},
      // A lower jaw's body, with a root in it and its canal below.
      {"jaw",
       [](Vec3 p) {
         return std::min({7 - p.z, p.z + 7, 6 - std::abs(p.x), 11.5 - std::abs(p.y)});
       },
       [](Vec3 p) {
         return capsule(p, {1, 0, 3}, {1, 0, 0}, 1.8);
       },
       {-2, -10, -2.5},
       {-2, 10, -2.5},
       1.2,
       {{1, 4, 3}, {1, -4, 3}, {3.5, 0, 4}},
       R"({"name": "window", "structure": "main", "points_mm": [[1, 0, 4.8]], "within_mm": 2},
          {"name": "wall", "structure": "tube", "points_mm": [[-2, -4, -1.3], [-2, 4, -1.3]], "within_mm": 2})",
       "[[0, 6, 5.5], [2, 6, 5.5]]",
       {1, 0, 4.8},
       {-4, 8, 7},
       {-0.6, 0, -1.4},
       4.8}};
  return all;
}

Procedure procedure_of(const Anatomy& a) {
  return parse_procedure(R"({ "osteotome_procedure": 1, "name": "t", "structures": [ {"name": "main", "role": "expose"},
    {"name": "tube", "role": "keep"}, {"name": "cells", "role": "enter"} ], "patches": [ )" +
                             a.patches + R"( ], "items": [
    {"name": "exposed", "kind": "exposed", "structure": "main", "patch": "window", "cover_mm": 1},
    {"name": "not_violated", "kind": "not_violated", "structure": "main", "threshold": 2},
    {"name": "no_hole", "kind": "no_hole", "structure": "main"},
    {"name": "no_cells_left", "kind": "no_cells_left", "structure": "main", "cells": "cells", "threshold": 0.5, "spread": 0.2},
    {"name": "no_overhang", "kind": "no_overhang", "structure": "main", "within_mm": 8, "towards": [0, 0, 1]},
    {"name": "thinned", "kind": "thinned", "structure": "tube", "patch": "wall", "threshold": 2, "most": 3},
    {"name": "sharp_angle", "kind": "sharp_angle", "structure": "main", "second": "tube", "within_mm": 2, "threshold": 1.5},
    {"name": "followed", "kind": "followed", "structure": "tube", "cover_mm": 1.5, "threshold": 0.5},
    {"name": "margin", "kind": "margin", "curve_mm": )" +
                             a.curve + R"(},
    {"name": "pieces", "kind": "pieces", "threshold": 2, "most": 2},
    {"name": "fixed", "kind": "fixed", "threshold": 2} ] })",
                         "t.json");
}

// What was cut, and how many plates were laid.
struct Planted {
  std::vector<Depth> cuts;  // negative inside
  int plates = 0;
  [[nodiscard]] double left(Vec3 p) const {
    double d = 1e9;
    for (const Depth& c : cuts) d = std::min(d, c(p));
    return d;
  }
};
Planted plant(const Anatomy& a, statistics::Random& random) {
  const auto between = [&](double lo, double hi) { return lo + (hi - lo) * random.uniform(); };
  const auto box = [](Vec3 middle, Vec3 half) {
    return [=](Vec3 p) {
      const Vec3 q = p - middle;
      return std::max({std::abs(q.x) - half.x, std::abs(q.y) - half.y, std::abs(q.z) - half.z});
    };
  };
  Planted all;
  // Deep enough for a ball of 0.5 mm: what is only shaved off is no cavity.
  const double floor = std::min(a.floor + between(-1.8, 2.2), a.top.z - 1.2), r = between(1.2, 6.5);
  all.cuts.push_back([=](Vec3 p) { return std::max(floor - p.z, std::hypot(p.x - a.shaft.x, p.y - a.shaft.y) - r); });
  if (random.uniform() < 0.4)
    all.cuts.push_back(box(a.shaft + Vec3{0, r + 0.5, floor - a.shaft.z + 1}, {2.5, 2.5, 1}));  // under an edge
  if (random.uniform() < 0.7) {
    // A trench on the tube from above.
    const double wall = between(-0.3, 3), half = between(2, 8);
    all.cuts.push_back(box({a.tube_a.x, 0, a.tube_a.z + a.tube_mm + wall + 20}, {1.6, half, 20}));
  }
  if (random.uniform() < 0.3) all.cuts.push_back(box({a.shaft.x, 6.5, a.floor + 7}, {2.5, 4.5, 6.5}));
  if (random.uniform() < 0.4) {
    const double burr = between(0.8, 3.5);
    all.cuts.push_back([=](Vec3 p) { return capsule(p, a.angle - Vec3{0, 14, 0}, a.angle + Vec3{0, 14, 0}, burr); });
  }
  const int slabs = static_cast<int>(random.below(4)) - 1;  // one or two cuts all the way through
  for (int n = 0; n < slabs; ++n) all.cuts.push_back(box({0, n == 0 ? -9.4 : 9.4, 0}, {99, 0.8, 99}));
  all.plates = static_cast<int>(random.below(4));
  return all;
}

// What is true of it, sampled. Nothing: so near the threshold that the samples cannot tell.
class Truth {
 public:
  static constexpr double kStep = 1.0 / 3, kOff = 0.3;

  Truth(const Anatomy& a, const Planted& p) : a_(a) {
    frame_.dims = {kCount, kCount, kCount};
    frame_.spacing_mm = {kStep, kStep, kStep};
    frame_.origin_mm = Vec3{1, 1, 1} * (-(kCount - 1) * kStep / 2);
    const std::size_t n = frame_.voxel_count();
    label_.resize(n), open_.resize(n), left_.resize(n);
    each([&](std::size_t c, Vec3 q) {
      label_[c] = a.at(q);
      const bool bone = a.bone(q) > 0, kept = p.left(q) > 0;
      left_[c] = bone && kept;
      const bool gone = bone && !kept;
      open_[c] = gone && (label_[c] == 0 || label_[c] == 3);
      if (gone) {
        middle_ += q;
        ++gone_;
      }
      // A cell that a face passes through counts by its parts: a sheet thinner than a cell is not a cell thick.
      if (std::abs(a.main(q) + 0.5) < 0.5 + kStep && p.left(q) < kStep)
        violated_mm3_ += share_of_cell(q, [&](Vec3 s) { return a.at(s) == 1 && a.bone(s) > 0 && p.left(s) <= 0; }) *
                         kStep * kStep * kStep;
    });
    middle_ = middle_ / std::max(1.0, gone_);
    to_open_ = squared_distance_mm2(open_, frame_, 1);
    to_gap_ = squared_distance_mm2(left_, frame_, 0);
    for (const std::size_t s : {1U, 2U}) {
      std::vector<std::uint8_t> is(n);
      for (std::size_t c = 0; c < n; ++c) is[c] = label_[c] == s ? 1 : 0;
      to_[s] = squared_distance_mm2(is, frame_, 1);
    }
  }

  [[nodiscard]] std::optional<bool> of(const Procedure& procedure, const ScaleItem& item) const {
    const FacePart part(procedure, item);
    const std::uint8_t s = item.structure == "tube" ? 2 : 1;
    const auto both = [](bool worst, bool best) { return worst == best ? std::optional(worst) : std::nullopt; };
    switch (item.kind) {
      case ItemKind::exposed: {
        const auto share = [&](double cover) { return quantity(s, part, [&](double d) { return d <= cover; }); };
        return both(share(item.cover_mm - kOff) >= item.threshold, share(item.cover_mm + kOff) >= item.threshold);
      }
      case ItemKind::thinned: {
        const auto passes = [&](double off) {
          return quantity(s, part, [&](double d) { return d + off <= item.threshold; }) >= 0.5 &&
                 quantity(s, part, [&](double d) { return d + off <= item.most; }) >= 0.9;
        };
        return both(passes(kOff), passes(-kOff));
      }
      case ItemKind::not_violated:
        return both(violated_mm3_ * 1.3 <= item.threshold, violated_mm3_ * 0.7 <= item.threshold);
      case ItemKind::no_hole: {
        const double mm2 = bare_mm2();
        return both(mm2 * 1.5 < item.threshold, mm2 * 0.5 < item.threshold);
      }
      case ItemKind::no_cells_left: {
        double all = 0, there = 0;
        each([&](std::size_t c, Vec3) {
          if (label_[c] != 3 || mm(to_[1][c]) > item.within_mm) return;
          ++all;
          there += open_[c] != 0 ? 0 : 1;
        });
        return both(there / all + 0.1 <= item.threshold, there / all - 0.1 <= item.threshold);
      }
      case ItemKind::no_overhang:
        return both(seen_share() - 0.02 >= item.threshold, seen_share() + 0.02 >= item.threshold);
      case ItemKind::sharp_angle: {
        double ball = 0;
        each([&](std::size_t c, Vec3) {
          if (left_[c] != 0 && mm(to_[1][c]) <= item.within_mm && mm(to_[2][c]) <= item.within_mm)
            ball = std::max(ball, mm(to_gap_[c]));
        });
        return both(ball + kOff <= item.threshold, ball - kOff <= item.threshold);
      }
      case ItemKind::followed: {
        const auto share = [&](double cover) {
          std::map<int, double> least;
          each([&](std::size_t c, Vec3 q) {
            if (label_[c] != 2 || !beside(c)) return;
            double& d = least.emplace(static_cast<int>(std::floor(q.y)), 1e9).first->second;
            d = std::min(d, mm(to_open_[c]));
          });
          double shown = 0;
          for (const auto& [bin, d] : least) shown += d <= cover ? 1 : 0;
          return shown / static_cast<double>(least.size());
        };
        return both(share(item.cover_mm - kOff) - 0.05 >= item.threshold,
                    share(item.cover_mm + kOff) + 0.05 >= item.threshold);
      }
      case ItemKind::margin: {
        double far = 0, beyond = 0;
        for (double t = 0; t <= 1; t += 0.125) {
          const Vec3 at = item.curve_mm[0] + (item.curve_mm[1] - item.curve_mm[0]) * t;
          far = std::max(far, mm(to_open_[cell(at)]));
          Vec3 out = at - middle_;
          out.z = 0;
          for (double way = 0; way < 12; way += kStep / 2)
            if (inside(at + normalized(out) * way) && open_[cell(at + normalized(out) * way)] != 0)
              beyond = std::max(beyond, way);
        }
        return both(far + kOff <= item.threshold && beyond + kOff <= item.most,
                    far - kOff <= item.threshold && beyond - kOff <= item.most);
      }
      case ItemKind::pieces: {
        const int n = pieces();
        return n >= item.threshold && n <= item.most;
      }
      case ItemKind::fixed:
        return std::nullopt;
    }
    return std::nullopt;
  }

 private:
  static constexpr int kCount = 78;
  // Of a cell around q the share where `is` holds, by 125 samples.
  static double share_of_cell(Vec3 q, const auto& is) {
    constexpr int kEach = 5;
    int n = 0;
    for (int k = 0; k < kEach; ++k)
      for (int j = 0; j < kEach; ++j)
        for (int i = 0; i < kEach; ++i) {
          const Vec3 off{i + 0.5 - kEach / 2.0, j + 0.5 - kEach / 2.0, k + 0.5 - kEach / 2.0};
          n += is(q + off * (kStep / kEach)) ? 1 : 0;
        }
    return static_cast<double>(n) / (kEach * kEach * kEach);
  }
  static double mm(float d2) { return std::sqrt(static_cast<double>(d2)); }
  void each(const auto& f) const {
    std::size_t c = 0;
    for (int k = 0; k < kCount; ++k)
      for (int j = 0; j < kCount; ++j)
        for (int i = 0; i < kCount; ++i) f(c++, frame_.world_from_index({double(i), double(j), double(k)}));
  }
  [[nodiscard]] bool inside(Vec3 p) const {
    const Vec3 x = (p - frame_.origin_mm) / kStep;
    return std::min({x.x, x.y, x.z}) >= 0 && std::max({x.x, x.y, x.z}) <= kCount - 1;
  }
  [[nodiscard]] std::size_t cell(Vec3 p) const {
    const Vec3 x = (p - frame_.origin_mm) / kStep;
    return (static_cast<std::size_t>(x.z + 0.5) * kCount + static_cast<std::size_t>(x.y + 0.5)) * kCount +
           static_cast<std::size_t>(x.x + 0.5);
  }
  static constexpr std::array<std::ptrdiff_t, 6> kBeside{1, -1, kCount, -kCount, kCount* kCount, -kCount* kCount};
  [[nodiscard]] bool beside(std::size_t c) const {
    const auto n = static_cast<std::ptrdiff_t>(label_.size());
    return std::any_of(kBeside.begin(), kBeside.end(), [&](std::ptrdiff_t by) {
      const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(c) + by;
      return to >= 0 && to < n && label_[static_cast<std::size_t>(to)] != label_[c];
    });
  }
  // Samples of a structure's face: f(cell, place, normal, mm2). The normal is that of the solid itself.
  void face(std::uint8_t s, const auto& f) const {
    const auto depth = [&](Vec3 q) { return s == 1 ? a_.main(q) : capsule(q, a_.tube_a, a_.tube_b, a_.tube_mm); };
    each([&](std::size_t c, Vec3 q) {
      if (label_[c] != s || !beside(c)) return;
      constexpr double e = 0.05;
      const Vec3 n = normalized({depth(q + Vec3{e, 0, 0}) - depth(q - Vec3{e, 0, 0}),
                                 depth(q + Vec3{0, e, 0}) - depth(q - Vec3{0, e, 0}),
                                 depth(q + Vec3{0, 0, e}) - depth(q - Vec3{0, 0, e})});
      double mm2 = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        for (const double sign : {1.0, -1.0}) {
          Vec3 to = q;
          to[a] += sign * kStep;
          if (inside(to) && label_[cell(to)] != s) mm2 += std::max(0.0, sign * n[a]) * kStep * kStep;
        }
      }
      f(c, q - n * depth(q), n, mm2);
    });
  }
  // Of the face the share with a cover of which `is` holds; cover from the face itself to the edge of what is open.
  [[nodiscard]] double quantity(std::uint8_t s, const FacePart& part, const auto& is) const {
    double all = 0, sum = 0;
    face(s, [&](std::size_t, Vec3 at, Vec3 n, double mm2) {
      if (!part.has(at, n)) return;
      all += mm2;
      const double d = inside(at) ? std::max(0.0, mm(to_open_[cell(at)]) - kStep / 2) : 1e9;
      sum += is(d) ? mm2 : 0;
    });
    return sum / all;
  }
  [[nodiscard]] double bare_mm2() const {
    std::map<std::size_t, double> bare;
    face(1, [&](std::size_t c, Vec3 at, Vec3, double mm2) {
      if (inside(at) && mm(to_open_[c]) <= kStep * 1.8) bare[c] = mm2;
    });
    double most = 0;
    while (!bare.empty()) {
      double sum = 0;
      std::vector<std::size_t> todo{bare.begin()->first};
      sum += bare.begin()->second;
      bare.erase(bare.begin());
      while (!todo.empty()) {
        const std::size_t c = todo.back();
        todo.pop_back();
        for (int k = -1; k <= 1; ++k)
          for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
              const auto to = bare.find(c + static_cast<std::size_t>(i + kCount * (j + kCount * k)));
              if (to == bare.end()) continue;
              sum += to->second;
              todo.push_back(to->first);
              bare.erase(to);
            }
      }
      most = std::max(most, sum);
    }
    return most;
  }
  [[nodiscard]] double seen_share() const {
    std::vector<Vec3> views{{0, 0, 1}};
    const double off = 15 * std::numbers::pi / 180;
    for (int d = 0; d < 8; ++d) {
      const double t = d * std::numbers::pi / 4;
      views.push_back({std::cos(t) * std::sin(off), std::sin(t) * std::sin(off), std::cos(off)});
    }
    double all = 0, seen = 0;
    each([&](std::size_t c, Vec3 q) {
      if (open_[c] == 0 || mm(to_[1][c]) > 8) return;
      const auto n = static_cast<std::ptrdiff_t>(left_.size());
      const bool wall = std::any_of(kBeside.begin(), kBeside.end(), [&](std::ptrdiff_t by) {
        const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(c) + by;
        return to >= 0 && to < n && left_[static_cast<std::size_t>(to)] != 0;
      });
      if (!wall) return;
      ++all;
      seen += std::any_of(views.begin(), views.end(), [&](Vec3 way) {
        double bone = 0;
        for (double t = kStep; inside(q + way * t); t += kStep / 2) {
          bone = left_[cell(q + way * t)] != 0 ? bone + kStep / 2 : 0;
          if (bone > 0.6) return false;
        }
        return true;
      });
    });
    return seen / all;
  }
  [[nodiscard]] int pieces() const {
    std::vector<std::uint8_t> left = left_;
    int n = 0;
    for (std::size_t from = 0; from < left.size(); ++from) {
      if (left[from] == 0) continue;
      std::size_t size = 0;
      std::vector<std::size_t> todo{from};
      left[from] = 0;
      while (!todo.empty()) {
        const std::size_t c = todo.back();
        todo.pop_back();
        ++size;
        for (const std::ptrdiff_t by : kBeside) {
          const std::size_t to = c + static_cast<std::size_t>(by);
          if (to >= left.size() || left[to] == 0) continue;
          left[to] = 0;
          todo.push_back(to);
        }
      }
      n += static_cast<double>(size) * kStep * kStep * kStep >= kCrumbMm3 ? 1 : 0;
    }
    return n;
  }

 public:
  static constexpr double kCrumbMm3 = 5;  // smaller ones are crumbs, not pieces

 private:
  const Anatomy& a_;
  Frame frame_;
  std::vector<std::uint8_t> label_, open_, left_;
  std::vector<float> to_open_, to_gap_;
  std::array<std::vector<float>, 3> to_;
  Vec3 middle_;
  double gone_ = 0, violated_mm3_ = 0;
};

// Of a two by two table.
struct Count {
  int violated_failed = 0, violated_passed = 0, kept_passed = 0, kept_failed = 0, draws = 0;
  [[nodiscard]] double kappa() const {
    const double tp = violated_failed, fn = violated_passed, tn = kept_passed, fp = kept_failed, n = tp + fn + tn + fp;
    const double same = (tp + tn) / n, chance = ((tp + fn) * (tp + fp) + (tn + fp) * (tn + fn)) / (n * n);
    return (same - chance) / (1 - chance);
  }
};

TEST(Anatomies, EachItemFailsWhereItIsViolatedAndPassesWhereItIsKept) {
  const char* const asked = std::getenv("OSTEO_PLANTED");
  const int each = asked != nullptr ? std::atoi(asked) : 3;
  std::map<std::string, Count> counts;
  for (const Anatomy& a : anatomies()) {
    const StructureMap structures = test::structure_map([&](Vec3 p) { return a.at(p); },
                                                        {{1, "main", {}}, {2, "tube", {}}, {3, "cells", {}}}, 0.4, 26);
    const Procedure procedure = procedure_of(a);
    statistics::Random random(11);
    for (int n = 0; n < each; ++n) {
      const Planted planted = plant(a, random);
      test::Drilled c =
          test::drilled([&](Vec3 p) { return a.bone(p); }, [&](Vec3 p) { return planted.left(p); }, 0.5, 26);
      c.after.act(SceneAction::split(Truth::kCrumbMm3));
      int plates = 0;
      for (int k = 0; k < planted.plates; ++k) {
        const Vec3 at = a.top + Vec3{0, 3.0 * (k - 1), 0};
        const std::uint32_t body = c.after.bodies().front().body->id;
        plates += c.after.act(SceneAction::attach(0, {{}, at}, body)).done ? 1 : 0;
      }
      const Product product(c.before, c.after, structures, procedure, c.removed);
      const Truth truth(a, planted);
      for (const ScaleItem& item : procedure.items) {
        const Product::Result r = product.evaluate(item, {0, 0, 1}, {});
        EXPECT_TRUE(r.measured) << item.name << ": " << r.word;
        const std::optional<bool> is =
            item.kind == ItemKind::fixed ? std::optional(plates >= item.threshold) : truth.of(procedure, item);
        Count& count = counts[item.name];
        if (!is || !r.measured || std::abs(r.margin) < Product::kDraw) {
          ++count.draws;
          continue;
        }
        ++(*is ? (r.pass ? count.kept_passed : count.kept_failed)
               : (r.pass ? count.violated_passed : count.violated_failed));
        EXPECT_EQ(r.pass, *is) << a.name << " " << n << ", " << item.name << ": " << r.value << ", margin " << r.margin
                               << " " << r.word;
      }
    }
  }
  for (const auto& [name, n] : counts) {
    if (asked == nullptr) continue;
    std::printf("| `%s` | %d of %d | %d of %d | %.2f | %d |\n", name.c_str(), n.violated_failed,
                n.violated_failed + n.violated_passed, n.kept_passed, n.kept_passed + n.kept_failed, n.kappa(),
                n.draws);
  }
}

}  // namespace
}  // namespace osteo
