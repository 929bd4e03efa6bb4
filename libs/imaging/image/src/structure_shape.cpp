// How long, wide and whole a structure is, and whether its name can have that.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/imaging/image/components.h"
#include "osteo/imaging/image/structures.h"

namespace osteo::inline imaging {
namespace {

constexpr double kBothSidesMm = 90;    // one piece that reaches so far across is of both sides
constexpr double kSidesApartMm = 40;   // as are two whose middles lie so far apart: inner ears lie 70 to 86 mm apart
constexpr double kShareOfASide = 0.2;  // of the voxels: what is less is a part that came off
constexpr double kInOnePiece = 0.75;   // of the voxels: specks beside it are another matter

/// A piece of a structure in a box of its own, with a margin of one voxel: where its voxels stand in `list`, or none.
struct Piece {
  std::array<int, 3> dims{0, 0, 0};
  std::vector<std::int32_t> at;
  std::vector<std::size_t> list;  // voxels of the box
};
constexpr std::int32_t kNoVoxel = -1;

/// Ways along voxels that touch, from one of them: the farthest and how far it is.
std::pair<std::size_t, double> farthest_from(const Piece& piece, Vec3 spacing, std::size_t start) {
  std::vector<double> way(piece.list.size(), std::numeric_limits<double>::infinity());
  using Open = std::pair<double, std::size_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  way[start] = 0;
  open.push({0, start});
  const auto nx = static_cast<std::ptrdiff_t>(piece.dims[0]), ny = static_cast<std::ptrdiff_t>(piece.dims[1]);
  std::pair<std::size_t, double> last{start, 0};
  while (!open.empty()) {
    const auto [done, from] = open.top();
    open.pop();
    if (done > way[from]) continue;
    last = {from, done};
    for (int n = 0; n < 27; ++n) {
      const int i = n % 3 - 1, j = n / 3 % 3 - 1, k = n / 9 - 1;
      const auto there = static_cast<std::ptrdiff_t>(piece.list[from]) + (k * ny + j) * nx + i;
      const std::int32_t to = piece.at[static_cast<std::size_t>(there)];
      if (n == 13 || to == kNoVoxel) continue;
      const double step = length(Vec3{i * spacing.x, j * spacing.y, k * spacing.z});
      auto& best = way[static_cast<std::size_t>(to)];
      if (done + step >= best) continue;
      best = done + step;
      open.push({best, static_cast<std::size_t>(to)});
    }
  }
  return last;
}

Piece piece_of(const Components& all, std::size_t which, int rows) {
  std::array<int, 3> lo{std::numeric_limits<int>::max(), std::numeric_limits<int>::max(),
                        std::numeric_limits<int>::max()},
      hi{-1, -1, -1};
  const auto each = [&](const auto& visit) {
    for (std::size_t r = 0; r < all.runs.size(); ++r) {
      if (all.component[r] != which) continue;
      const Run& run = all.runs[r];
      visit(static_cast<int>(run.begin), static_cast<int>(run.end), static_cast<int>(run.row) % rows,
            static_cast<int>(run.row) / rows);
    }
  };
  each([&](int begin, int end, int j, int k) {
    lo = {std::min(lo[0], begin), std::min(lo[1], j), std::min(lo[2], k)};
    hi = {std::max(hi[0], end - 1), std::max(hi[1], j), std::max(hi[2], k)};
  });
  Piece piece;
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    piece.dims[a] = hi[a] - lo[a] + 3;
    count *= static_cast<std::size_t>(piece.dims[a]);
  }
  piece.at.assign(count, kNoVoxel);
  each([&](int begin, int end, int j, int k) {
    for (int i = begin; i < end; ++i) {
      const std::size_t v = (static_cast<std::size_t>(k - lo[2] + 1) * static_cast<std::size_t>(piece.dims[1]) +
                             static_cast<std::size_t>(j - lo[1] + 1)) *
                                static_cast<std::size_t>(piece.dims[0]) +
                            static_cast<std::size_t>(i - lo[0] + 1);
      piece.at[v] = static_cast<std::int32_t>(piece.list.size());
      piece.list.push_back(v);
    }
  });
  return piece;
}

/// Of the voxels of a value whose place along the world's x lies in [from_x, to_x).
std::vector<Run> runs_of(const Labels& labels, std::uint8_t value, double from_x, double to_x) {
  const Frame& f = labels.frame;
  std::vector<Run> runs;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      const std::size_t row = labels.offset(0, j, k);
      for (int i = 0; i < f.dims[0]; ++i) {
        if (labels.voxels[row + static_cast<std::size_t>(i)] != value) continue;
        const double x = f.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}).x;
        if (x < from_x || x >= to_x) continue;
        const auto at = static_cast<std::uint32_t>(i), line = static_cast<std::uint32_t>(j + k * f.dims[1]);
        if (!runs.empty() && runs.back().row == line && runs.back().end == at)
          ++runs.back().end;
        else
          runs.push_back({at, at + 1, line});
      }
    }
  }
  return runs;
}

/// Where the left and the right of a structure part along the world's x; nothing when it is of one side.
std::optional<double> between_sides(const Labels& labels, std::uint8_t value) {
  const Frame& f = labels.frame;
  std::vector<Run> runs = runs_of(labels, value, -1e9, 1e9);
  if (runs.empty()) return std::nullopt;
  const Components all = connected_components(std::move(runs), f.dims, Connectivity::full);
  double low = std::numeric_limits<double>::infinity(), high = -low, total = 0;
  std::vector<std::pair<double, double>> pieces(all.voxels.size(), {0, 0});  // middle along x, voxels
  for (std::size_t r = 0; r < all.runs.size(); ++r) {
    const Run& run = all.runs[r];
    const auto x = [&](double i) {
      return f
          .world_from_index({i, static_cast<double>(static_cast<int>(run.row) % f.dims[1]),
                             static_cast<double>(static_cast<int>(run.row) / f.dims[1])})
          .x;
    };
    const double begin = x(run.begin), end = x(run.end - 1.0), voxels = run.end - run.begin;
    low = std::min({low, begin, end});
    high = std::max({high, begin, end});
    total += voxels;
    pieces[all.component[r]].first += 0.5 * (begin + end) * voxels;
    pieces[all.component[r]].second += voxels;
  }
  for (auto& [middle, voxels] : pieces) middle /= voxels;
  std::sort(pieces.begin(), pieces.end());
  double below = 0;
  for (std::size_t n = 0; n + 1 < pieces.size(); ++n) {
    below += pieces[n].second;
    const bool both = below >= kShareOfASide * total && total - below >= kShareOfASide * total;
    if (both && pieces[n + 1].first - pieces[n].first > kSidesApartMm)
      return 0.5 * (pieces[n].first + pieces[n + 1].first);
  }
  if (high - low > kBothSidesMm) return 0.5 * (low + high);
  return std::nullopt;
}

std::string tenths(double x) {
  return format_number(std::round(x * 10) / 10);
}

std::string reason(const StructureShape& s, const StructureLimits& limits) {
  const auto is = [&](const std::string& what, const std::string& bound) {
    return what + ", no " + std::string(limits.name) + " has " + bound;
  };
  const auto volume = format_number(std::round(s.volume_mm3)) + " mm3";
  if (s.volume_mm3 > limits.volume_mm3) return is(volume, "more than " + format_number(limits.volume_mm3));
  if (!s.cut_off && s.volume_mm3 < limits.least_mm3) return is(volume, "less than " + format_number(limits.least_mm3));
  if (limits.one_piece && s.largest_share < kInOnePiece)
    return format_number(std::round(100 * s.largest_share)) + " % of its volume in one piece, and the " +
           std::string(limits.name) + " is one";
  for (const bool wide : {false, true}) {
    const auto& between = wide ? limits.width_mm : limits.length_mm;
    const double mm = wide ? s.width_mm : s.length_mm;
    const std::string what = tenths(mm) + (wide ? " mm of width" : " mm of length");
    if (between[1] == 0) continue;
    if (mm > between[1]) return is(what, "more than " + format_number(between[1]));
    if (mm < between[0] && !s.cut_off) return is(what, "less than " + format_number(between[0]));
  }
  return {};
}

}  // namespace

StructureShape shape_of(const Labels& labels, std::uint8_t value, double from_x, double to_x) {
  const Frame& f = labels.frame;
  StructureShape shape;
  std::vector<Run> runs = runs_of(labels, value, from_x, to_x);
  double count = 0;
  for (const Run& run : runs) {
    count += run.end - run.begin;
    const int j = static_cast<int>(run.row) % f.dims[1], k = static_cast<int>(run.row) / f.dims[1];
    shape.cut_off = shape.cut_off || run.begin == 0 || static_cast<int>(run.end) == f.dims[0] || j == 0 ||
                    j == f.dims[1] - 1 || k == 0 || k == f.dims[2] - 1;
  }
  if (runs.empty()) return shape;
  const Components all = connected_components(std::move(runs), f.dims, Connectivity::full);
  const auto largest =
      static_cast<std::size_t>(std::max_element(all.voxels.begin(), all.voxels.end()) - all.voxels.begin());
  const auto in_it = static_cast<double>(all.voxels[largest]);
  shape.volume_mm3 = count * f.voxel_volume_mm3();
  shape.largest_share = in_it / count;
  const Piece piece = piece_of(all, largest, f.dims[1]);
  const std::size_t end = farthest_from(piece, f.spacing_mm, 0).first;
  shape.length_mm = farthest_from(piece, f.spacing_mm, end).second;
  shape.width_mm = 2 * std::sqrt(in_it * f.voxel_volume_mm3() / (std::numbers::pi * std::max(shape.length_mm, 1e-9)));
  return shape;
}

std::string implausible_shape(const Labels& labels, const Structure& structure) {
  const auto limits = structure_limits(structure.name);
  if (!limits) return {};
  const std::optional<double> middle = between_sides(labels, structure.value);
  std::string why;
  if (middle) {
    why = reason(shape_of(labels, structure.value, -1e9, *middle), *limits);
    if (why.empty()) why = reason(shape_of(labels, structure.value, *middle, 1e9), *limits);
  } else if (const StructureShape shape = shape_of(labels, structure.value); shape.volume_mm3 > 0) {
    why = reason(shape, *limits);
  }
  return why.empty() ? why : structure.name + " has " + why + ": look at it, or at its name";
}

}  // namespace osteo::inline imaging
