#include "slice_judge.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/detail/verdict_codes.h"
#include "pixels.h"

namespace osteo::inline imaging::dicom {
namespace {

constexpr std::size_t kMinSlices = 4;
constexpr int kMinSide = 12;
constexpr float kObjectHu = -500, kAirBelowHu = -800;
// Fewer blocks than this show too little of a body to compare.
constexpr int kMinBlocks = 16;
// How much better, in HU of a block, slices must fit in another order or turned over.
constexpr double kLeastGainHu = 10;
// Of a line of blocks from edge to edge that is of one value.
constexpr int kLostInLine = 8;

// How a picture may be turned over: 1 left and right, 2 up and down, 3 both.
double difference(const SliceFigure& a, const SliceFigure& b, int turned_over = 0) {
  double sum = 0;
  int n = 0;
  for (int j = 0; j < a.rows(); ++j) {
    for (int i = 0; i < a.columns(); ++i) {
      const auto& p = a.at(i, j);
      const auto& q =
          b.at((turned_over & 1) != 0 ? a.columns() - 1 - i : i, (turned_over & 2) != 0 ? a.rows() - 1 - j : j);
      if (std::max(p.hu, q.hu) < kObjectHu) continue;
      sum += std::abs(std::clamp(p.hu, -1000.F, 1500.F) - std::clamp(q.hu, -1000.F, 1500.F));
      ++n;
    }
  }
  return n < kMinBlocks ? 0 : sum / n;
}

class SliceJudge {
 public:
  SliceJudge(Verdict& v, const std::vector<JudgedSlice>& slices, const std::vector<SliceFigure>& figures,
             double block_mm2)
      : verdict_(v), slices_(slices), figures_(figures), block_mm2_(block_mm2), odd_(figures.size(), false) {}

  void run() {
    judge_blank();
    judge_parts();
    // What is missing says nothing about the rest.
    for (std::size_t k = 0; k < figures_.size(); ++k) {
      if (!odd_[k]) sound_.push_back(k);
    }
    if (sound_.size() < kMinSlices) return;
    steps_.resize(sound_.size() - 1);
    for (std::size_t s = 0; s + 1 < sound_.size(); ++s) steps_[s] = difference(figure(s), figure(s + 1));
    judge_repeated();
    if (!judge_exchanged()) judge_reversed();
    judge_sides();
    judge_values();
    judge_foreign();
  }

 private:
  [[nodiscard]] const SliceFigure& figure(std::size_t s) const { return figures_[sound_[s]]; }
  [[nodiscard]] const std::string& name(std::size_t s) const { return slices_[sound_[s]].name; }
  [[nodiscard]] static int object_blocks(const SliceFigure& f) {
    return static_cast<int>(std::count_if(f.blocks().begin(), f.blocks().end(),
                                          [](const auto& b) { return !b.one_value && b.hu > kObjectHu; }));
  }

  [[nodiscard]] std::string listed(const std::vector<std::string>& names) const {
    return names.size() == 1
               ? "'" + names.front() + "'"
               : std::to_string(names.size()) + " slices ('" + names.front() + "' to '" + names.back() + "')";
  }

  // A slice of one value between slices that show a body, or at an end where the body is too large to end between two
  // slices: a ball as large as a head grows by 6 cm2 a mm at most.
  void judge_blank() {
    std::vector<std::string> names;
    const std::size_t n = figures_.size();
    for (std::size_t k = 0; k < n;) {
      if (!figures_[k].blank()) {
        ++k;
        continue;
      }
      std::size_t end = k;
      while (end < n && figures_[end].blank()) ++end;
      const int before = k > 0 ? object_blocks(figures_[k - 1]) : 0, after = end < n ? object_blocks(figures_[end]) : 0;
      const double gap = k > 0     ? slices_[k].along_mm - slices_[k - 1].along_mm
                         : end < n ? slices_[end].along_mm - slices_[end - 1].along_mm
                                   : 0;
      const double beside_mm2 = std::max(before, after) * block_mm2_;
      const bool within = before >= kMinBlocks && after >= kMinBlocks;
      if (within || beside_mm2 > kSliceBlankEndMm2PerMm * std::max(gap, 0.5)) {
        for (std::size_t i = k; i < end; ++i) {
          names.push_back(slices_[i].name);
          odd_[i] = true;
        }
      }
      k = end;
    }
    if (names.empty()) return;
    verdict_.add(
        code::slice_blank, Severity::warning,
        listed(names) + (names.size() == 1 ? " shows" : " show") +
            " nothing, every pixel has the same value, where the slices beside it show a body: bone is missing there",
        "copy the files again from their source, or export the series again", names);
  }

  // Rows or columns of one value where the slices before and after show a body, or as much anywhere: what was not sent,
  // or was written over. Air that a scanner cuts off is of one value as well.
  void judge_parts() {
    const int columns = figures_.front().columns(), rows = figures_.front().rows();
    const std::size_t n = figures_.size();
    std::vector<std::string> names;
    std::vector<bool> lost(static_cast<std::size_t>(columns * rows));
    std::vector<std::pair<std::size_t, std::size_t>> run_of(lost.size());
    const std::vector<bool> odd_before = odd_;
    constexpr std::size_t kReach = 12;
    const auto body = [&](std::size_t k, std::size_t b) {
      return !figures_[k].blocks()[b].one_value && figures_[k].blocks()[b].hu > kObjectHu;
    };
    for (std::size_t k = 0; k < n; ++k) {
      if (odd_before[k]) continue;
      int all = 0, gone = 0;
      // A picture that was not written whole ends at once: what is lost begins and ends at the same slices everywhere,
      // which the surface of a body does not.
      std::map<std::pair<std::size_t, std::size_t>, int> runs;
      for (std::size_t b = 0; b < lost.size(); ++b) {
        run_of[b] = {0, 0};
        if (body(k, b)) ++all;
        if (!figures_[k].blocks()[b].one_value) continue;
        const auto next = [&](bool up) {
          for (std::size_t d = 1; d <= kReach && (up ? k + d < n : d <= k); ++d) {
            const std::size_t at = up ? k + d : k - d;
            if (!odd_before[at] && !figures_[at].blocks()[b].one_value) return body(at, b) ? at : n;
          }
          return n;
        };
        const std::size_t before = next(false), after = before < n ? next(true) : n;
        if (after < n) ++runs[run_of[b] = {before, after}];
      }
      if (runs.empty()) continue;
      const auto most =
          std::max_element(runs.begin(), runs.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
      gone = most->second;
      for (std::size_t b = 0; b < lost.size(); ++b) lost[b] = run_of[b] == most->first;
      // Lines of blocks from edge to edge.
      const auto lines = [&](int count, int length, const std::function<std::size_t(int, int)>& at) {
        int found = 0;
        for (int l = 0; l < count; ++l) {
          int in_line = 0;
          bool whole = true;
          for (int i = 0; i < length && whole; ++i) {
            whole = figures_[k].blocks()[at(l, i)].one_value;
            in_line += lost[at(l, i)] ? 1 : 0;
          }
          found += whole && in_line >= kLostInLine ? 1 : 0;
        }
        return found;
      };
      const int of_rows = lines(rows, columns, [&](int l, int i) { return static_cast<std::size_t>(l * columns + i); });
      const int of_columns =
          lines(columns, rows, [&](int l, int i) { return static_cast<std::size_t>(i * columns + l); });
      if (of_rows == 0 && of_columns == 0 && (gone < kMinBlocks || gone < kSlicePartShare * (all + gone))) continue;
      names.push_back(slices_[k].name);
      odd_[k] = true;
    }
    if (names.empty()) return;
    verdict_.add(code::slice_part_missing, Severity::warning,
                 "a part of " + listed(names) +
                     " is of one value where the slices before and after show a body: the picture was not written "
                     "whole, bone is missing there",
                 "copy the files again from their source, or export the series again", names);
  }

  struct Step {
    bool known = false;
    double hu = 0, least = 0;  ///< median; and what three quarters of the blocks step by at least, the same way
  };
  static Step step_of(std::vector<double> steps) {
    if (steps.size() < 2 * kMinBlocks) return {};
    const auto at = [&](std::size_t n) {
      std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(n), steps.end());
      return steps[n];
    };
    const double middle = at(steps.size() / 2);
    return {true, middle, at(middle > 0 ? steps.size() / 4 : steps.size() * 3 / 4)};
  }
  // Of blocks that are air in both slices, or would be without a step, and of blocks well within soft tissue in both:
  // what is tissue in one and air in the other is another place of the body.
  static Step air_step(const SliceFigure& a, const SliceFigure& b) {
    std::vector<double> steps;
    for (std::size_t i = 0; i < a.blocks().size(); ++i) {
      const auto &p = a.blocks()[i], &q = b.blocks()[i];
      if (!p.measured || !q.measured || p.one_value != q.one_value || std::min(p.hu, q.hu) >= kAirBelowHu) continue;
      steps.push_back(static_cast<double>(q.hu) - static_cast<double>(p.hu));
    }
    return step_of(std::move(steps));
  }
  static Step soft_step(const SliceFigure& a, const SliceFigure& b) {
    std::vector<double> steps;
    const auto within = [](const SliceFigure& f, int i, int j) {
      const auto body = [](float hu) { return hu > kObjectHu && hu < -kObjectHu + 100; };
      return body(f.at(i, j).hu) && body(f.at(i - 1, j).hu) && body(f.at(i + 1, j).hu) && body(f.at(i, j - 1).hu) &&
             body(f.at(i, j + 1).hu);
    };
    const auto soft = [](float hu) { return hu > -200 && hu < 200; };
    for (int j = 1; j + 1 < a.rows(); ++j) {
      for (int i = 1; i + 1 < a.columns(); ++i) {
        if ((!soft(a.at(i, j).hu) && !soft(b.at(i, j).hu)) || !within(a, i, j) || !within(b, i, j)) continue;
        steps.push_back(static_cast<double>(b.at(i, j).hu) - static_cast<double>(a.at(i, j).hu));
      }
    }
    return step_of(std::move(steps));
  }
  // Nearly all blocks step alike.
  static bool exceeds(const Step& step, double limit, double least_share) {
    return step.known && std::abs(step.hu) > limit && std::abs(step.least) > least_share * std::abs(step.hu) &&
           step.least * step.hu > 0;
  }

  // Air and soft tissue are as bright in a slice as in the next: a step of either is another scale, which no body has.
  void judge_values() {
    std::vector<Step> air, soft;
    std::vector<double> sizes_air, sizes_soft;
    for (std::size_t s = 0; s + 1 < sound_.size(); ++s) {
      air.push_back(air_step(figure(s), figure(s + 1)));
      soft.push_back(soft_step(figure(s), figure(s + 1)));
      if (air.back().known) sizes_air.push_back(std::abs(air.back().hu));
      if (soft.back().known) sizes_soft.push_back(std::abs(soft.back().hu));
    }
    const double limit_air = std::max(kSliceStepHu, 6 * upper_median(sizes_air)),
                 limit_soft = std::max(kSliceStepHu, 6 * upper_median(sizes_soft));
    std::vector<std::string> names;
    std::string said;
    double most = 0;
    for (std::size_t s = 0; s < air.size(); ++s) {
      if (explained(s)) continue;
      const bool by_air = exceeds(air[s], limit_air, 0.9), by_soft = exceeds(soft[s], limit_soft, 0.75);
      if (!by_air && !by_soft) continue;
      explained_.push_back(s);
      const double hu = by_air && (!by_soft || std::abs(air[s].hu) > std::abs(soft[s].hu)) ? air[s].hu : soft[s].hu;
      names.push_back(name(s + 1));
      if (std::abs(hu) <= most) continue;
      most = std::abs(hu);
      said = std::string(hu == air[s].hu && by_air ? "air" : "soft tissue") + " is " + whole(std::abs(hu)) + " HU " +
             (hu > 0 ? "brighter" : "darker") + " in '" + name(s + 1) + "' than in '" + name(s) + "' beside it";
    }
    if (names.empty()) return;
    verdict_.add(
        code::slice_values_step, Severity::warning,
        said + (names.size() > 1 ? "; the values step at " + std::to_string(names.size()) + " places" : "") +
            ": the rescale slope or intercept of some slices is wrong, and a threshold takes another bone there",
        "compare with the scanner's own pictures, or export the series again", names);
  }

  // A slice that fits the one beside it better when it is turned over.
  void judge_sides() {
    std::vector<std::string> names;
    int how = 0;
    for (std::size_t s = 0; s + 1 < sound_.size(); ++s) {
      if (explained(s) || steps_[s] <= kLeastGainHu) continue;
      for (int turned_over = 1; turned_over <= 3; ++turned_over) {
        const double d = difference(figure(s), figure(s + 1), turned_over);
        if (!(d > 0) || steps_[s] < kSliceMirrorRatio * d || steps_[s] - d < kLeastGainHu) continue;
        names.push_back(name(s + 1));
        explained_.push_back(s);
        how = turned_over;
        break;
      }
    }
    if (names.empty()) return;
    static constexpr const char* kHow[] = {"", "left and right", "up and down", "both ways (half a turn)"};
    verdict_.add(code::slice_mirrored, Severity::warning,
                 "from '" + names.front() + "' on the pictures fit those before only when turned over, " + kHow[how] +
                     (names.size() > 1 ? ", until '" + names[1] + "'" : "") +
                     ": some slices are mirrored, and left is not left in them",
                 "compare with the scanner's own pictures, or export the series again", names);
  }

  // The same picture at two places beside each other: noise alone makes two of them differ. Where most are alike, as
  // made ones may be, it says nothing.
  void judge_repeated() {
    if (upper_median(steps_) <= 0) return;
    std::vector<std::string> names;
    for (std::size_t s = 0; s + 1 < sound_.size(); ++s) {
      const auto &a = figure(s).blocks(), &b = figure(s + 1).blocks();
      const bool same = std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
        return p.hu == q.hu && p.one_value == q.one_value;
      });
      if (!same || object_blocks(figure(s)) < kMinBlocks) continue;
      names.push_back(name(s + 1));
      explained_.push_back(s);
    }
    if (names.empty()) return;
    verdict_.add(code::slice_repeated, Severity::warning,
                 listed(names) + (names.size() == 1 ? " shows" : " show") +
                     " the same picture as the slice before, to the last value: what lies there is not in the scan",
                 "copy the files again from their source, or export the series again", names);
  }

  // Up to eight slices that fit neither the slice before nor the one after, which fit each other: of another place or
  // another scan, turned by a quarter, moved sideways. Where a body changes fast, slices farther apart fit worse still.
  void judge_foreign() {
    constexpr std::size_t kMost = 8;
    std::vector<std::string> names;
    const std::size_t n = sound_.size();
    for (std::size_t s = 1; s + 1 < n; ++s) {
      if (explained(s - 1) || steps_[s - 1] <= kLeastGainHu) continue;
      for (std::size_t end = s + 1; end < n && end - s <= kMost; ++end) {
        const double before = steps_[s - 1], after = steps_[end - 1], worse = std::min(before, after);
        if (explained(end - 1)) break;
        if (worse <= kLeastGainHu) continue;
        const double across = difference(figure(s - 1), figure(end));
        if (!(across > 0) || worse < kSliceForeignRatio * across || worse - across < kLeastGainHu) continue;
        for (std::size_t i = s; i < end; ++i) names.push_back(name(i));
        s = end;
        break;
      }
    }
    if (names.empty()) return;
    verdict_.add(code::slice_foreign, Severity::warning,
                 listed(names) + (names.size() == 1 ? " fits" : " fit") +
                     " neither the slice before nor the one after, which fit each other: another place of the body, "
                     "or moved or turned in the picture",
                 "compare with the scanner's own pictures, or export the series again", names);
  }

  // Slices that fit a neighbour badly, the worst first.
  [[nodiscard]] std::vector<std::size_t> ill_fitting() const {
    const std::size_t n = sound_.size();
    const double usual = upper_median(steps_);
    std::vector<std::pair<double, std::size_t>> odd;
    for (std::size_t s = 0; s < n; ++s) {
      double step = 0;
      if (s > 0) step = std::max(step, steps_[s - 1]);
      if (s + 1 < n) step = std::max(step, steps_[s]);
      if (step > 1.1 * usual) odd.emplace_back(step, s);
    }
    std::sort(odd.rbegin(), odd.rend());
    if (odd.size() > 24) odd.resize(24);
    std::vector<std::size_t> slices;
    for (const auto& o : odd) slices.push_back(o.second);
    return slices;
  }

  // Slices between two others that fit better in reverse order.
  void judge_reversed() {
    const std::size_t n = sound_.size();
    const std::vector<std::size_t> odd = ill_fitting();
    double best = kSliceOrderRatio;
    std::size_t from = n, to = n;
    for (const std::size_t i : odd) {
      for (const std::size_t j : odd) {
        if (i < 1 || j + 1 >= n || j < i + 2) continue;
        const double as_stored = steps_[i - 1] + steps_[j];
        const double first = difference(figure(i - 1), figure(j));
        if (!(first > 0) || as_stored - first < kLeastGainHu || as_stored <= best * first) continue;
        const double second = difference(figure(i), figure(j + 1));
        const double reversed = first + second;
        if (!(second > 0) || as_stored - reversed < kLeastGainHu || as_stored <= best * reversed) continue;
        best = as_stored / reversed;
        from = i;
        to = j;
      }
    }
    if (from == n) return;
    std::vector<std::string> names;
    for (std::size_t s = from; s <= to; ++s) names.push_back(name(s));
    explained_.push_back(from - 1);
    explained_.push_back(to);
    verdict_.add(
        code::slice_order, Severity::warning,
        listed(names) + " fit the slices beside them better in reverse order: their positions seem to be reversed",
        "compare with the scanner's own pictures, or export the series again", names);
  }

  // Two slices that fit better in each other's place.
  bool judge_exchanged() {
    const std::size_t n = sound_.size();
    const std::vector<std::size_t> odd = ill_fitting();
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (const std::size_t a : odd)
      for (const std::size_t b : odd)
        if (a < b) pairs.emplace_back(a, b);
    for (std::size_t s = 0; s + 1 < n; ++s) pairs.emplace_back(s, s + 1);
    double best = kSliceOrderRatio;
    std::pair<std::size_t, std::size_t> at{n, n};
    for (const auto& [i, j] : pairs) {
      const auto taken = [&](std::size_t s) { return s == i ? j : s == j ? i : s; };
      double as_stored = 0, exchanged = 0;
      // Sums only grow: most pairs are out after one difference, or none.
      const auto out = [&] {
        return as_stored - exchanged < kLeastGainHu || (exchanged > 0 && as_stored / exchanged <= best);
      };
      std::vector<std::size_t> places{i, j};
      if (i > 0) places.push_back(i - 1);
      if (j > 0) places.push_back(j - 1);
      std::sort(places.begin(), places.end());
      places.erase(std::unique(places.begin(), places.end()), places.end());
      for (const std::size_t s : places) as_stored += s + 1 < n ? steps_[s] : 0;
      for (auto s = places.begin(); s != places.end() && !out(); ++s) {
        if (*s + 1 < n) exchanged += difference(figure(taken(*s)), figure(taken(*s + 1)));
      }
      if (exchanged <= 0 || out()) continue;
      best = as_stored / exchanged;
      at = {i, j};
    }
    if (at.first == n) return false;
    for (const std::size_t s : {at.first, at.second}) {
      explained_.push_back(s);
      if (s > 0) explained_.push_back(s - 1);
    }
    verdict_.add(code::slice_order, Severity::warning,
                 "'" + name(at.first) + "' and '" + name(at.second) +
                     "' fit the slices beside them better in each other's place: their positions seem to be exchanged",
                 "compare with the scanner's own pictures, or export the series again",
                 {name(at.first), name(at.second)});
    return true;
  }

  [[nodiscard]] bool explained(std::size_t s) const {
    return std::find(explained_.begin(), explained_.end(), s) != explained_.end();
  }
  static std::string whole(double v) { return format_number(std::round(v)); }

  Verdict& verdict_;
  const std::vector<JudgedSlice>& slices_;
  const std::vector<SliceFigure>& figures_;
  double block_mm2_;
  std::vector<bool> odd_;               // shows nothing, or not all
  std::vector<std::size_t> sound_;      // the others
  std::vector<double> steps_;           // difference of a sound slice from the next
  std::vector<std::size_t> explained_;  // steps that are told already
};

/// A row of pixels to what is kept of each column. A band has at most some hundred rows: sums stay far below 2^31.
void add_row(const std::int16_t* row, std::size_t n, std::int32_t* sum, std::int32_t* padding, std::int16_t* lowest,
             std::int16_t* highest) {
  for (std::size_t x = 0; x < n; ++x) {
    sum[x] += row[x];
    padding[x] += row[x] == kNoValue ? 1 : 0;
  }
  for (std::size_t x = 0; x < n; ++x) {
    lowest[x] = std::min(lowest[x], row[x]);
    highest[x] = std::max(highest[x], row[x]);
  }
}

}  // namespace

SliceFigure::SliceFigure(const std::int16_t* hu, int columns, int rows)
    : columns_(std::clamp(columns / 4, 1, kSide)),
      rows_(std::clamp(rows / 4, 1, kSide)),
      blocks_(static_cast<std::size_t>(columns_ * rows_)) {
  std::vector<int> first(static_cast<std::size_t>(columns_) + 1);
  for (int i = 0; i <= columns_; ++i)
    first[static_cast<std::size_t>(i)] = static_cast<int>(static_cast<std::int64_t>(i) * columns / columns_);
  // Columns of pixels first, many at once; then the blocks of a band out of its columns.
  const auto width = static_cast<std::size_t>(columns);
  std::vector<std::int32_t> sum(width), padding(width);
  std::vector<std::int16_t> lowest(width), highest(width);
  const std::int16_t any = hu[0];
  for (int j = 0; j < rows_; ++j) {
    std::fill(sum.begin(), sum.end(), 0);
    std::fill(padding.begin(), padding.end(), 0);
    std::fill(lowest.begin(), lowest.end(), std::int16_t{32767});
    std::fill(highest.begin(), highest.end(), std::int16_t{-32768});
    const int begin = static_cast<int>(static_cast<std::int64_t>(j) * rows / rows_),
              end = static_cast<int>(static_cast<std::int64_t>(j + 1) * rows / rows_);
    for (int y = begin; y < end; ++y)
      add_row(hu + static_cast<std::size_t>(y) * width, width, sum.data(), padding.data(), lowest.data(),
              highest.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(columns_); ++i) {
      Block& b = blocks_[static_cast<std::size_t>(j * columns_) + i];
      std::int64_t total = 0, none = 0;
      std::int16_t lo = 32767, hi = -32768;
      for (auto x = static_cast<std::size_t>(first[i]); x < static_cast<std::size_t>(first[i + 1]); ++x) {
        total += sum[x];
        none += padding[x];
        lo = std::min(lo, lowest[x]);
        hi = std::max(hi, highest[x]);
      }
      const std::int64_t count = static_cast<std::int64_t>(end - begin) * (first[i + 1] - first[i]),
                         seen = count - none;
      b.one_value = lo == hi;
      b.measured = seen > 0;
      if (seen > 0) b.hu = static_cast<float>(total - none * kNoValue) / static_cast<float>(seen);
      blank_ = blank_ && b.one_value && lo == any;
    }
  }
}

void judge_slices(Verdict& verdict, const std::vector<JudgedSlice>& slices, const std::vector<SliceFigure>& figures,
                  double picture_mm2) {
  if (figures.size() != slices.size()) return;
  // A lattice may end before the last slices, which are then not read.
  const auto end =
      std::find_if(figures.begin(), figures.end(), [](const SliceFigure& f) { return f.blocks().empty(); });
  const auto n = static_cast<std::size_t>(end - figures.begin());
  if (n < kMinSlices || figures.front().columns() < kMinSide || figures.front().rows() < kMinSide) return;
  const double block_mm2 = picture_mm2 / static_cast<double>(figures.front().blocks().size());
  if (n == figures.size()) return SliceJudge(verdict, slices, figures, block_mm2).run();
  const std::vector<JudgedSlice> read_slices(slices.begin(), slices.begin() + static_cast<std::ptrdiff_t>(n));
  const std::vector<SliceFigure> read(figures.begin(), end);
  SliceJudge(verdict, read_slices, read, block_mm2).run();
}

}  // namespace osteo::inline imaging::dicom
