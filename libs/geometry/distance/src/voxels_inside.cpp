#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/union_find.h"
#include "osteo/geometry/distance/voxelize.h"
#include "winding.h"

namespace osteo::inline geometry {

std::vector<Fan> closing_fans(const Ordered& surface, const std::vector<Vec3>& points) {
  std::vector<std::uint32_t> parent(points.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](std::uint32_t i) { return root_of(parent, i); };
  if (surface.open.empty()) return {};
  for (const OpenEdge& e : surface.open) join_sets(parent, e.from, e.to);
  std::vector<Vec3> sum(points.size());
  std::vector<int> count(points.size(), 0);
  for (const OpenEdge& e : surface.open) {
    const std::uint32_t r = root(e.from);
    sum[r] += points[e.from] + points[e.to];
    count[r] += 2;
  }
  std::vector<Fan> fans;
  for (const OpenEdge& e : surface.open) {
    const std::uint32_t r = root(e.from);
    // A little off the centroid, so that no row of voxels lies in a flat opening's fan.
    const Vec3 apex = sum[r] / count[r] + Vec3{0.0317, 0.0171, 0.0233} * length(points[e.to] - points[e.from]);
    fans.push_back({points[e.to], points[e.from], apex, e.count});
  }
  // One apex a fan: the first edge's.
  std::vector<std::int64_t> first(points.size(), -1);
  for (std::size_t i = 0; i < fans.size(); ++i) {
    const std::uint32_t r = root(surface.open[i].from);
    if (first[r] < 0) first[r] = static_cast<std::int64_t>(i);
    fans[i].c = fans[static_cast<std::size_t>(first[r])].c;
  }
  return fans;
}

namespace {

// Where the surface crosses a row of voxels: voxels from `first` on have `delta` more winding.
struct Crossing {
  std::uint32_t row;
  std::int32_t first;
  std::int32_t delta;
};

// Rounding up of what fits an int; std::ceil is a call without SSE 4.1.
int round_up(double x) {
  const int i = static_cast<int>(x);
  return i + (static_cast<double>(i) < x ? 1 : 0);
}

// Scan conversion in index coordinates.
void scan_triangle(const Vec3& a, const Vec3& b, const Vec3& c, int weight, const std::array<int, 3>& dims,
                   std::vector<Crossing>& out) {
  const double lowest = std::min(a.z, std::min(b.z, c.z)), highest = std::max(a.z, std::max(b.z, c.z));
  if (highest < 0 || lowest >= dims[2]) return;
  const int k0 = lowest < 0 ? 0 : static_cast<int>(lowest) + 1;
  const int k1 = highest >= dims[2] - 1 ? dims[2] - 1 : static_cast<int>(highest);
  for (int k = k0; k <= k1; ++k) {
    const LevelCut s = cut(a, b, c, k);
    // Seen along x, an edge that goes up on the far side of y is counter-clockwise: the surface faces +x and the ray
    // leaves.
    const bool leaves = s.y[0] > s.y[1];
    const double y0 = leaves ? s.y[1] : s.y[0], y1 = leaves ? s.y[0] : s.y[1];
    if (!(y1 >= 0) || y0 > dims[1] - 1) continue;
    const double x0 = leaves ? s.x[1] : s.x[0], x1 = leaves ? s.x[0] : s.x[1];
    const int j0 = y0 <= 0 ? 0 : round_up(y0);
    const int j1 = y1 > dims[1] - 1 ? dims[1] : round_up(y1);
    const double slope = y1 > y0 ? (x1 - x0) / (y1 - y0) : 0;
    for (int j = j0; j < j1; ++j) {
      const double at = std::clamp(x0 + (j - y0) * slope, std::min(x0, x1), std::max(x0, x1));
      if (at > dims[0] - 1) continue;
      out.push_back(
          {static_cast<std::uint32_t>(k) * static_cast<std::uint32_t>(dims[1]) + static_cast<std::uint32_t>(j),
           at <= 0 ? 0 : round_up(at), leaves ? -weight : weight});
    }
  }
}

// Voxels near the openings, whose sign the fans' solid angle may decide. Solid angles in turns: share of the full
// sphere.
class Openings {
 public:
  Openings(std::vector<Fan> fans, Vec3 spacing) : fans_(std::move(fans)) {
    for (Fan& f : fans_) {
      for (Vec3* p : {&f.a, &f.b, &f.c}) *p = {p->x * spacing.x, p->y * spacing.y, p->z * spacing.z};
      const Vec3 m = (f.a + f.b + f.c) / 3;
      middle_.push_back(m);
      reach_.push_back(std::max({length(f.a - m), length(f.b - m), length(f.c - m)}));
      area_.push_back(std::abs(f.weight) * length(cross(f.b - f.a, f.c - f.a)) / 2);
    }
  }
  // The fans near a ball, one by one, and the others together: their turns at the ball's centre, and by how much those
  // can differ elsewhere in it.
  struct Near {
    std::vector<std::uint32_t> fans;
    double far_turns = 0, far_error = 0;
    double far_bound = 0;  // of their |turns|
    double bound = 0;      // of |turns| of all
  };
  [[nodiscard]] Near all() const {
    Near n;
    for (std::uint32_t i = 0; i < fans_.size(); ++i) n.fans.push_back(i);
    return n;
  }
  [[nodiscard]] Near narrowed(const Near& from, Vec3 centre, double radius, double most_error) const {
    Near near;
    near.far_turns = from.far_turns;
    near.far_error = from.far_error;
    near.far_bound = near.bound = from.far_bound;
    for (const std::uint32_t i : from.fans) near.bound += bound(i, centre, radius);
    if (near.bound < 0.5) return near;
    std::vector<std::pair<double, std::uint32_t>> errors;
    for (const std::uint32_t i : from.fans) errors.emplace_back(variation(i, centre, radius), i);
    std::sort(errors.begin(), errors.end());
    for (const auto& [e, i] : errors) {
      if (near.fans.empty() && near.far_error + e < most_error) {
        near.far_error += e;
        near.far_turns += turns(fans_[i], centre);
        near.far_bound += bound(i, centre, radius);
      } else {
        near.fans.push_back(i);
      }
    }
    std::sort(near.fans.begin(), near.fans.end());
    return near;
  }
  // |winding - turns| > 1/2 at a point where the closed surface winds `winding` times.
  [[nodiscard]] bool inside(const Near& near, Vec3 p, int winding) const {
    double w = winding - near.far_turns;
    for (const std::uint32_t i : near.fans) w -= turns(fans_[i], p);
    if (std::abs(std::abs(w) - 0.5) <= near.far_error + 1e-9) {
      w = winding;
      for (const Fan& f : fans_) w -= turns(f, p);
    }
    return std::abs(w) > 0.5;
  }
  [[nodiscard]] double bound(const Near& near, Vec3 p) const {
    double sum = near.far_bound;
    for (const std::uint32_t i : near.fans) {
      sum += bound(i, p, 0);
      if (sum >= 0.5) break;
    }
    return sum;
  }

 private:
  // Solid angle <= area / distance^2, and at most half the sphere.
  [[nodiscard]] double bound(std::uint32_t i, Vec3 centre, double radius) const {
    const double d = length(centre - middle_[i]) - radius - reach_[i], most = 0.5 * std::abs(fans_[i].weight);
    return d > 0 ? std::min(area_[i] / (d * d) / (4 * std::numbers::pi), most) : most;
  }
  // How much the turns can change within the ball: a surface element's solid angle has a gradient of at most 2 area /
  // distance^3.
  [[nodiscard]] double variation(std::uint32_t i, Vec3 centre, double radius) const {
    const double d = length(centre - middle_[i]) - radius - reach_[i];
    return d > 0 ? radius * 2 * area_[i] / (d * d * d) / (4 * std::numbers::pi) : 1e300;
  }
  [[nodiscard]] static double turns(const Fan& f, Vec3 p) {
    return f.weight * solid_angle(f.a, f.b, f.c, p) / (4 * std::numbers::pi);
  }

  std::vector<Fan> fans_;
  std::vector<Vec3> middle_;
  std::vector<double> reach_, area_;
};

struct RowCrossings {
  std::vector<std::uint32_t> first;  // rows + 1
  std::vector<Crossing> items;       // by row, then position
  [[nodiscard]] int winding(std::size_t row, int i) const {
    int w = 0;
    for (std::uint32_t c = first[row]; c < first[row + 1] && items[c].first <= i; ++c) w += items[c].delta;
    return w;
  }
};

RowCrossings scan(const TriangleSoup& soup, const std::vector<Vec3>& points, const std::vector<Fan>& fans,
                  const std::array<int, 3>& dims, const Context& context) {
  constexpr std::size_t kGrain = 16384;
  const std::size_t n = soup.triangles.size();
  std::vector<std::vector<Crossing>> parts((n + kGrain - 1) / kGrain + 1);
  parallel_for(n, kGrain, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    auto& part = parts[begin / kGrain];
    part.reserve(end - begin);
    for (std::size_t t = begin; t < end; ++t) {
      const auto& v = soup.triangles[t];
      scan_triangle(points[v[0]], points[v[1]], points[v[2]], 1, dims, part);
    }
  });
  for (const Fan& f : fans) scan_triangle(f.a, f.b, f.c, f.weight, dims, parts.back());
  RowCrossings rows;
  const std::size_t row_count = static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  rows.first.assign(row_count + 1, 0);
  std::size_t total = 0;
  for (const auto& part : parts) {
    total += part.size();
    for (const Crossing& c : part) ++rows.first[c.row + 1];
  }
  for (std::size_t r = 0; r < row_count; ++r) rows.first[r + 1] += rows.first[r];
  rows.items.resize(total);
  std::vector<std::uint32_t> fill(rows.first.begin(), rows.first.end() - 1);
  for (const auto& part : parts) {
    for (const Crossing& c : part) rows.items[fill[c.row]++] = c;
  }
  parallel_for(row_count, 1024, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      std::sort(rows.items.begin() + rows.first[r], rows.items.begin() + rows.first[r + 1],
                [](const Crossing& x, const Crossing& y) {
                  return x.first != y.first ? x.first < y.first : x.delta > y.delta;
                });
    }
  });
  return rows;
}

void set_run(std::uint64_t* row, int begin, int end) {
  for (int i = begin; i < end;) {
    const int bit = i % 64, n = std::min(64 - bit, end - i);
    row[i / 64] |= (n == 64 ? ~0ULL : ((1ULL << n) - 1)) << bit;
    i += n;
  }
}

}  // namespace

std::uint64_t VoxelBits::count() const {
  std::uint64_t sum = 0;
  for (const auto w : words) sum += static_cast<std::uint64_t>(std::popcount(w));
  return sum;
}

VoxelBits VoxelBits::dilated() const {
  VoxelBits out(frame);
  const int nx = frame.dims[0], ny = frame.dims[1], nz = frame.dims[2];
  const std::uint64_t last = nx % 64 == 0 ? ~0ULL : (1ULL << (nx % 64)) - 1;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (std::size_t w = 0; w < words_per_row; ++w) {
        const std::size_t at = row(j, k) + w;
        std::uint64_t v = words[at] | words[at] << 1 | words[at] >> 1;
        if (w > 0) v |= words[at - 1] >> 63;
        if (w + 1 < words_per_row) v |= words[at + 1] << 63;
        if (j > 0) v |= words[row(j - 1, k) + w];
        if (j + 1 < ny) v |= words[row(j + 1, k) + w];
        if (k > 0) v |= words[row(j, k - 1) + w];
        if (k + 1 < nz) v |= words[row(j, k + 1) + w];
        out.words[at] = w + 1 == words_per_row ? v & last : v;
      }
    }
  }
  return out;
}

VoxelBits voxels_inside(const TriangleSoup& soup, const Frame& frame, const Context& context, InsideReport* report) {
  std::uint64_t solid_angles = 0;
  return voxels_inside_counted(soup, frame, context, report, solid_angles);
}

VoxelBits voxels_inside_counted(const TriangleSoup& soup, const Frame& frame, const Context& context,
                                InsideReport* report, std::uint64_t& solid_angles) {
  require_sound(soup);
  if (static_cast<double>(frame.dims[1]) * frame.dims[2] > 4e9)
    throw Error(ExitCode::resources, "the grid has more than 4e9 rows");
  // A closed surface needs no order made: its winding number is whole as it is.
  bool closed = is_closed(soup);
  Ordered mended;
  if (!closed) {
    mended.soup = welded(soup);
    closed = is_closed(mended.soup);
    if (!closed) mended = ordered(soup, context);
  }
  const TriangleSoup& used = mended.soup.triangles.empty() ? soup : mended.soup;
  context.progress(0.3, "telling inside from outside");
  std::vector<Vec3> points(used.points_mm.size());
  const Mat3 back = inverse(frame.direction);
  parallel_for(points.size(), 8192, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 v = back * (used.points_mm[i] - frame.origin_mm);
      points[i] = {v.x / frame.spacing_mm.x, v.y / frame.spacing_mm.y, v.z / frame.spacing_mm.z};
    }
  });
  const std::vector<Fan> fans = closing_fans(mended, points);
  const RowCrossings rows = scan(used, points, fans, frame.dims, context);
  context.progress(0.6);
  VoxelBits bits(frame);
  constexpr std::size_t kRows = 1024;
  const std::size_t row_count = rows.first.size() - 1;
  std::vector<std::int64_t> surplus(row_count / kRows + 1, 0);
  parallel_for(row_count, kRows, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      int winding = 0;
      for (std::uint32_t c = rows.first[r]; c < rows.first[r + 1]; ++c) {
        winding += rows.items[c].delta;
        if (winding == 0) continue;
        const int stop = c + 1 < rows.first[r + 1] ? rows.items[c + 1].first : frame.dims[0];
        set_run(&bits.words[r * bits.words_per_row], rows.items[c].first, stop);
        surplus[begin / kRows] += static_cast<std::int64_t>(winding - 1) * (stop - rows.items[c].first);
      }
    }
  });
  std::uint64_t decided = 0;
  solid_angles = 0;
  if (!fans.empty()) {
    // The fans matter where their turns may reach 1/2: blocks, then smaller blocks, then voxels.
    const Openings openings(fans, frame.spacing_mm);
    const Openings::Near everything = openings.all();
    constexpr int kLarge = 32, kSmall = 8;
    const Vec3 s = frame.spacing_mm;
    const auto blocks = [&](std::size_t a) { return static_cast<std::size_t>((frame.dims[a] + kLarge - 1) / kLarge); };
    const auto narrowed = [&](const Openings::Near& from, int i, int j, int k, int edge, double most_far) {
      const double h = (edge - 1) / 2.0;
      return openings.narrowed(from, {(i + h) * s.x, (j + h) * s.y, (k + h) * s.z}, h * length(s), most_far);
    };
    std::vector<std::uint64_t> decided_in(blocks(1) * blocks(2), 0), angles_in(decided_in.size(), 0);
    // A row of blocks along x is one work item: no word of bits is shared between two.
    parallel_for(blocks(1) * blocks(2), 1, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int large_j = static_cast<int>(b % blocks(1)) * kLarge,
                  large_k = static_cast<int>(b / blocks(1)) * kLarge;
        for (int large_i = 0; large_i < frame.dims[0]; large_i += kLarge) {
          context.check_cancelled();
          const Openings::Near large = narrowed(everything, large_i, large_j, large_k, kLarge, 0.02);
          if (large.bound < 0.5) continue;
          for (int part = 0; part < 64; ++part) {
            const int i0 = large_i + part % 4 * kSmall, j0 = large_j + part / 4 % 4 * kSmall,
                      k0 = large_k + part / 16 * kSmall;
            if (i0 >= frame.dims[0] || j0 >= frame.dims[1] || k0 >= frame.dims[2]) continue;
            const Openings::Near small = narrowed(large, i0, j0, k0, kSmall, 0.1);
            if (small.bound < 0.5) continue;
            for (int k = k0; k < std::min(k0 + kSmall, frame.dims[2]); ++k) {
              for (int j = j0; j < std::min(j0 + kSmall, frame.dims[1]); ++j) {
                for (int i = i0; i < std::min(i0 + kSmall, frame.dims[0]); ++i) {
                  const Vec3 p{i * s.x, j * s.y, k * s.z};
                  if (openings.bound(small, p) < 0.5) continue;
                  const std::size_t r = static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) +
                                        static_cast<std::size_t>(j);
                  std::uint64_t& word = bits.words[r * bits.words_per_row + static_cast<std::size_t>(i) / 64];
                  const std::uint64_t bit = 1ULL << (static_cast<unsigned>(i) % 64);
                  word = openings.inside(small, p, rows.winding(r, i)) ? word | bit : word & ~bit;
                  ++decided_in[b];
                  angles_in[b] += small.fans.size();
                }
              }
            }
          }
        }
      }
    });
    for (const auto d : decided_in) decided += d;
    for (const auto a : angles_in) solid_angles += a;
  }
  if (report != nullptr) {
    *report = {fans.empty(),
               mended.open.size(),
               decided,
               mended.degenerate,
               mended.duplicates,
               mended.flipped,
               std::accumulate(surplus.begin(), surplus.end(), std::int64_t{0})};
  }
  context.progress(1.0);
  return bits;
}

double winding_number(const TriangleSoup& soup, Vec3 p) {
  double sum = 0;
  for (const auto& t : soup.triangles)
    sum += solid_angle(soup.points_mm[t[0]], soup.points_mm[t[1]], soup.points_mm[t[2]], p);
  return sum / (4 * std::numbers::pi);
}

Frame frame_around_mm(const TriangleSoup& soup, double spacing_mm, int margin) {
  require_sound(soup);
  if (soup.triangles.empty()) throw Error(ExitCode::failed, "the surface has no triangles");
  const auto [lo, hi] = bounds_of(soup);
  Frame f;
  f.spacing_mm = {spacing_mm, spacing_mm, spacing_mm};
  for (std::size_t a = 0; a < 3; ++a) {
    const double n = std::ceil((hi[a] - lo[a]) / spacing_mm - 1e-9);
    if (n > 100000) {
      throw Error(ExitCode::usage,
                  "voxels of " + format_number(spacing_mm) + " mm would make a grid of " + format_number(n) +
                      " voxels along an axis",
                  "choose larger voxels");
    }
    f.dims[a] = std::max(1, static_cast<int>(n)) + 2 * margin;
    f.origin_mm[a] = lo[a] + spacing_mm * (0.5 - margin);
  }
  return f;
}

Frame frame_around(const TriangleSoup& soup, int resolution, int margin) {
  require_sound(soup);
  const auto [lo, hi] = bounds_of(soup);
  const double longest = std::max({0.0, hi.x - lo.x, hi.y - lo.y, hi.z - lo.z});
  return frame_around_mm(soup, longest > 0 ? longest / resolution : 1.0, margin);
}

}  // namespace osteo::inline geometry
