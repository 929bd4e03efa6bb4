#include <algorithm>
#include <cmath>
#include <limits>

#include "glyphs.h"
#include "guide_parts.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline session::guide {
namespace {

constexpr double kNodesMm = 0.3, kEngravedMm = 0.5, kMayBeNearerMm = 0.01, kFloorMm = 0.02, kSteepest = 3;
constexpr double kAlongSlopeMm = 0.34, kSlopeEveryMm = 2, kContactMm = 2, kLeastCosine = 0.1;
constexpr std::size_t kMostRows = 4, kContactEvery = 4;  // rows for one where it is steep; cells to a contact
constexpr double kSmallestPixelMm = 0.5, kLargestPixelMm = 1.2, kRimMm = 0.5, kSeenFromAbove = 0.5;
constexpr int kMaxRaises = 12, kMaxTraceSteps = 2000;
constexpr double kTracedMm = 1e-7;

// Lines of characters about a middle; read along x, or along y with its top towards -x.
struct Inscription {
  std::vector<std::string> rows;
  double x = 0, y = 0;
  bool across = false;
  [[nodiscard]] double wide() const { return 6 * static_cast<double>(rows[0].size()) - 1; }
  [[nodiscard]] double high() const { return 9 * static_cast<double>(rows.size()) - 2; }
  [[nodiscard]] bool covers(Vec3 p, double pixel) const {
    const double u = (across ? p.y - y : p.x - x) / pixel + wide() / 2;
    const double down = high() / 2 - (across ? x - p.x : p.y - y) / pixel;
    if (down < 0 || down >= high()) return false;
    const auto row = static_cast<std::size_t>(down / 9);
    return glyph_at(rows[row], u, 7 - (down - 9 * static_cast<double>(row)));
  }
};

// Cells of a grid of rows (y) and columns (x), the holes left out; each cell has an underside and a top.
class Block {
 public:
  Block(const GuideLayout& layout, const Underside& under, const Context& context) : l_(layout), under_(under) {
    add_rows(l_.y0, l_.cut0, context);
    first_cut_ = rows_.size();
    add_rows(l_.cut0, l_.cut1, context);
    last_cut_ = rows_.size();
    if (l_.cut1 < l_.y1) add_rows(l_.cut1, l_.y1, context);
    rows_.push_back(l_.y1);
    // Columns: between each two stations as many as keep to the wanted distance where they are widest apart.
    const std::size_t stations = 2 * l_.openings.size() + 2;
    first_column_.assign(1, 0);
    for (std::size_t k = 0; k + 1 < stations; ++k) {
      double wide = 0;
      for (const double y : {l_.cut0, l_.cut1})
        wide = std::max(wide, station(k + 1, y, l_.top) - station(k, y, l_.top));
      first_column_.push_back(first_column_.back() +
                              std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(wide / kNodesMm))));
    }
    columns_ = first_column_.back() + 1;
    bottom_.resize(rows_.size() * columns_);
    top_.resize(bottom_.size());
  }

  void lay(const Context& context) {
    parallel_for(rows_.size(), 1, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) lay_row(j);
    });
  }

  // Raises what comes too near the bone between the nodes; afterwards measures.
  void keep_gap(GuideBlock& out, const Context& context) {
    for (int round = 0;; ++round) {
      context.check_cancelled();
      const std::vector<double> found = distances(context);
      if (round == kMaxRaises || !raise(found)) {
        measure(found, out);
        return;
      }
    }
  }

  // In the block and the layout (along or across, in one to three lines) that let it be largest.
  bool engrave() {
    double pixel = 0;
    for (std::size_t k = 0; k <= l_.openings.size(); ++k) {
      double lo = -1e9, hi = 1e9;
      for (const double y : {l_.cut0, l_.cut1}) {
        lo = std::max(lo, station(2 * k, y, l_.top));
        hi = std::min(hi, station(2 * k + 1, y, l_.top));
      }
      for (const bool across : {false, true}) {
        for (std::size_t lines = 1; lines <= 3; ++lines) {
          const Inscription i = inscription((lo + hi) / 2, across, lines);
          if (i.rows.empty()) continue;
          const double along = across ? l_.y1 - l_.y0 : hi - lo, up = across ? hi - lo : l_.y1 - l_.y0;
          const double fits =
              std::min({(along - 2 * kRimMm) / i.wide(), (up - 2 * kRimMm) / i.high(), kLargestPixelMm});
          if (fits <= pixel) continue;
          pixel = fits;
          text_ = i;
        }
      }
    }
    if (pixel < kSmallestPixelMm) return false;
    for (Vec3& p : top_)
      if (text_.covers(p, pixel)) p.z = l_.top - kEngravedMm;
    return true;
  }

  [[nodiscard]] TriangleSoup solid() const {
    TriangleSoup s;
    s.points_mm = bottom_;
    s.points_mm.insert(s.points_mm.end(), top_.begin(), top_.end());
    const auto quad = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
      const auto i = [](std::size_t v) { return static_cast<std::uint32_t>(v); };
      s.triangles.push_back({i(a), i(b), i(c)});
      s.triangles.push_back({i(a), i(c), i(d)});
    };
    const std::size_t up = bottom_.size();
    for (std::size_t j = 0; j + 1 < rows_.size(); ++j) {
      for (std::size_t c = 0; c + 1 < columns_; ++c) {
        if (!there(j, c)) continue;
        const std::array<std::size_t, 4> n{at(j, c), at(j, c + 1), at(j + 1, c + 1), at(j + 1, c)};
        quad(n[3], n[2], n[1], n[0]);
        quad(up + n[0], up + n[1], up + n[2], up + n[3]);
        const std::array<bool, 4> beside{j > 0 && there(j - 1, c), c + 2 < columns_ && there(j, c + 1),
                                         j + 2 < rows_.size() && there(j + 1, c), c > 0 && there(j, c - 1)};
        for (std::size_t e = 0; e < 4; ++e)
          if (!beside[e]) quad(n[e], n[(e + 1) % 4], up + n[(e + 1) % 4], up + n[e]);
      }
    }
    return compacted(s);
  }

 private:
  [[nodiscard]] Inscription inscription(double x, bool across, std::size_t lines) const {
    Inscription out{{}, x, (l_.y0 + l_.y1) / 2, across};
    const double u = across ? l_.head.y : l_.head.x, w = across ? -l_.head.x : l_.head.y;
    std::string text = l_.code;
    if (std::max(std::abs(u), std::abs(w)) > kSeenFromAbove)
      text += std::abs(u) > std::abs(w) ? (u > 0 ? '>' : '<') : (w > 0 ? '^' : 'v');
    const std::size_t each = (text.size() + lines - 1) / lines;
    for (std::size_t at = 0; at < text.size(); at += each) out.rows.push_back(text.substr(at, each));
    return out;
  }
  // Between two rows where the underside is steep anywhere, more rows: nodes as far apart along the slope lie further
  // from what is between them the more the bone is bent, and a wall of the bone is met as near as rows are apart.
  void add_rows(double from, double to, const Context& context) {
    const auto n = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil((to - from) / kNodesMm)));
    const auto y = [&](std::size_t k) { return from + (to - from) * static_cast<double>(k) / static_cast<double>(n); };
    const auto places = static_cast<std::size_t>((l_.x1 - l_.x0) / kSlopeEveryMm) + 1;
    std::vector<double> height((n + 1) * places);
    parallel_for(n + 1, 1, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        for (std::size_t p = 0; p < places; ++p)
          height[k * places + p] = under_.height(l_.x0 + (static_cast<double>(p) + 0.5) * kSlopeEveryMm, y(k));
    });
    for (std::size_t k = 0; k < n; ++k) {
      double rise = 0;
      for (std::size_t p = 0; p < places; ++p)
        rise = std::max(rise, std::abs(height[(k + 1) * places + p] - height[k * places + p]));
      const double along = std::sqrt(rise * rise + (y(k + 1) - y(k)) * (y(k + 1) - y(k)));
      const auto parts =
          std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(along / kAlongSlopeMm)), 1, kMostRows);
      for (std::size_t part = 0; part < parts; ++part)
        rows_.push_back(y(k) + (y(k + 1) - y(k)) * static_cast<double>(part) / static_cast<double>(parts));
    }
  }
  [[nodiscard]] std::size_t at(std::size_t row, std::size_t column) const { return row * columns_ + column; }
  [[nodiscard]] const GuideFace& face(std::size_t station) const {
    const GuideOpening& o = l_.openings[(station - 1) / 2];
    return station % 2 == 1 ? o.lower : o.upper;
  }
  [[nodiscard]] bool is_end(std::size_t station) const { return station == 0 || station == 2 * l_.openings.size() + 1; }
  /// Beyond the slots' ends there is no face to keep to: there a column runs on straight.
  [[nodiscard]] double station(std::size_t k, double y, double z) const {
    if (is_end(k)) return k == 0 ? l_.x0 : l_.x1;
    return face(k).x(std::clamp(y, l_.cut0, l_.cut1), z);
  }
  [[nodiscard]] bool there(std::size_t row, std::size_t column) const {
    if (row < first_cut_ || row >= last_cut_) return true;
    const auto k = std::upper_bound(first_column_.begin(), first_column_.end(), column) - first_column_.begin() - 1;
    return k % 2 == 0;
  }

  // Where the underside meets a face: the height is looked up where the face was last found.
  [[nodiscard]] Vec3 foot(std::size_t k, double y) const {
    double x = station(k, y, under_.crest(station(k, y, l_.top)));
    double z = under_.height(x, y);
    for (int n = 0; n < 30; ++n) {
      const double next = station(k, y, z);
      const bool done = std::abs(next - x) < 1e-6;
      x = n < 8 ? next : (x + next) / 2;
      z = under_.height(x, y);
      if (done) break;
    }
    return {station(k, y, z), y, z};
  }

  void lay_row(std::size_t j) {
    const double y = rows_[j];
    const std::size_t stations = first_column_.size();
    for (std::size_t k = 0; k < stations; ++k) {
      bottom_[at(j, first_column_[k])] = foot(k, y);
      top_[at(j, first_column_[k])] = {station(k, y, l_.top), y, l_.top};
    }
    for (std::size_t k = 0; k + 1 < stations; ++k) {
      const std::size_t from = first_column_[k], to = first_column_[k + 1];
      const double bx0 = bottom_[at(j, from)].x, bx1 = bottom_[at(j, to)].x;
      const double tx0 = top_[at(j, from)].x, tx1 = top_[at(j, to)].x;
      for (std::size_t c = from + 1; c < to; ++c) {
        const double t = static_cast<double>(c - from) / static_cast<double>(to - from);
        const double x = bx0 + (bx1 - bx0) * t;
        bottom_[at(j, c)] = {x, y, under_.height(x, y)};
        top_[at(j, c)] = {tx0 + (tx1 - tx0) * t, y, l_.top};
      }
    }
  }

  // At the middles of the underside's triangles, of their diagonal and of their left and near edges.
  [[nodiscard]] std::array<Vec3, 5> places(std::size_t j, std::size_t c) const {
    const Vec3 &a = bottom_[at(j, c)], &b = bottom_[at(j, c + 1)], &d = bottom_[at(j + 1, c + 1)],
               &e = bottom_[at(j + 1, c)];
    // solid() splits the quad along e-b.
    return {(e + b) / 2, (a + b) / 2, (a + e) / 2, (e + d + b) / 3, (e + b + a) / 3};
  }
  [[nodiscard]] std::vector<double> distances(const Context& context) const {
    std::vector<double> out(bottom_.size(), std::numeric_limits<double>::infinity());
    parallel_for(rows_.size() - 1, 1, context.threads, [&](std::size_t begin, std::size_t end) {
      std::uint32_t hint = ClosestPoint::kNone;
      for (std::size_t j = begin; j < end; ++j) {
        for (std::size_t c = 0; c + 1 < columns_; ++c) {
          if (!there(j, c)) continue;
          for (const Vec3& p : places(j, c)) {
            const auto near = under_.bone().at(p, hint);
            hint = near.closest.triangle;
            out[at(j, c)] = std::min(out[at(j, c)], near.signed_mm);
          }
        }
      }
    });
    return out;
  }
  bool raise(const std::vector<double>& found) {
    std::vector<double> by(bottom_.size(), 0);
    bool any = false;
    for (std::size_t j = 0; j + 1 < rows_.size(); ++j) {
      for (std::size_t c = 0; c + 1 < columns_; ++c) {
        const double lacks = there(j, c) ? l_.gap - kMayBeNearerMm - found[at(j, c)] : 0;
        if (lacks <= 0) continue;
        any = true;
        // On a slope a raise widens the gap by its cosine only.
        const Vec3 across =
            cross(bottom_[at(j + 1, c + 1)] - bottom_[at(j, c)], bottom_[at(j + 1, c)] - bottom_[at(j, c + 1)]);
        const double cosine = std::max(kLeastCosine, std::abs(across.z) / std::max(length(across), 1e-12));
        for (const std::size_t n : {at(j, c), at(j, c + 1), at(j + 1, c), at(j + 1, c + 1)})
          by[n] = std::max(by[n], 1.1 * lacks / cosine + 0.001);
      }
    }
    for (std::size_t n = 0; n < by.size(); ++n) bottom_[n].z += by[n];
    // Feet stay in their faces.
    for (std::size_t j = 0; any && j < rows_.size(); ++j) {
      for (std::size_t k = 0; k < first_column_.size(); ++k) {
        Vec3& p = bottom_[at(j, first_column_[k])];
        p.x = station(k, p.y, p.z);
      }
    }
    return any;
  }
  void measure(const std::vector<double>& found, GuideBlock& out) const {
    out.min_gap = std::numeric_limits<double>::infinity();
    std::vector<bool> touched(bottom_.size());  // a node is of up to four cells
    for (std::size_t j = 0; j + 1 < rows_.size(); ++j) {
      for (std::size_t c = 0; c + 1 < columns_; ++c) {
        if (!there(j, c)) continue;
        out.min_gap = std::min(out.min_gap, found[at(j, c)]);
        const std::array<std::size_t, 4> n{at(j, c), at(j, c + 1), at(j + 1, c + 1), at(j + 1, c)};
        const Vec3 &a = bottom_[n[0]], &b = bottom_[n[1]], &d = bottom_[n[2]], &e = bottom_[n[3]];
        const bool seated = std::all_of(n.begin(), n.end(), [&](std::size_t m) {
          return bottom_[m].z > under_.crest(bottom_[m].x) - under_.depth() + kFloorMm;
        });
        const Vec3 across = cross(d - a, e - b);
        const bool steep = across.z * across.z * (1 + kSteepest * kSteepest) < dot(across, across);
        // Walls hold the guide too, though they are but one cell wide and end at the floor.
        const bool some = c % kContactEvery == 0 && (steep || j % kContactEvery == 0);
        const auto touch = [&](const Vec3& p, std::vector<GuideBlock::Contact>& list) {
          const ClosestPoint near = under_.bone().closest(p);
          if (near.distance_mm < kContactMm) list.push_back({p, normalized(p - near.point_mm), near.distance_mm});
        };
        touch(places(j, c)[0], some ? out.contacts : out.others);
        for (const std::size_t m : n) {
          if (!touched[m]) touch(bottom_[m], out.others);
          touched[m] = true;
        }
        if (!seated || steep) continue;
        out.seat_mm2 += length(across) / 2;
        for (const Vec3& p : places(j, c))
          out.seat_off = std::max(out.seat_off, std::abs(under_.bone().closest(p).distance_mm - l_.gap));
      }
    }
  }

  const GuideLayout& l_;
  const Underside& under_;
  std::vector<double> rows_;
  std::size_t first_cut_ = 0, last_cut_ = 0, columns_ = 0;
  std::vector<std::size_t> first_column_;  // of each station
  std::vector<Vec3> bottom_, top_;
  Inscription text_;
};

}  // namespace

Underside::Underside(const TriangleSoup& local_bone, double gap, const Context& context)
    : bone_(local_bone, context), box_(bounds_of(local_bone)), gap_(gap) {}

double Underside::traced(double x, double y, double floor) const {
  // Spheres without bone, one below the other.
  double z = box_.hi.z + gap_;
  std::uint32_t hint = ClosestPoint::kNone;
  for (int n = 0; n < kMaxTraceSteps && z > floor; ++n) {
    const ClosestPoint near = bone_.closest({x, y, z}, hint);
    hint = near.triangle;
    const double free = near.distance_mm - gap_;
    if (free < kTracedMm) return z;
    z -= free;
  }
  return std::max(z, floor);
}

double Underside::crest(double x) const {
  const double t = std::clamp(x - x0_, 0.0, static_cast<double>(crest_.size() - 1) - 1e-9);
  const auto n = static_cast<std::size_t>(t);
  const double part = t - static_cast<double>(n);
  return crest_[n] * (1 - part) + crest_[n + 1] * part;
}

void Underside::measure_crest(double x0, double x1, double y0, double y1, double depth, const Context& context) {
  depth_ = depth;
  x0_ = x0;
  const auto n = static_cast<std::size_t>(std::ceil(x1 - x0)) + 1;
  const double nothing = box_.lo.z - 1;
  crest_.assign(n + 1, nothing);
  parallel_for(n + 1, 4, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      for (double y = y0; y <= y1; y += 0.5)
        crest_[k] = std::max(crest_[k], traced(x0 + static_cast<double>(k), y, nothing));
  });
  // Beyond the end of the bone as at its end.
  for (std::size_t k = 1; k <= n; ++k)
    if (crest_[k] <= nothing) crest_[k] = crest_[k - 1];
  for (std::size_t k = n; k-- > 0;)
    if (crest_[k] <= nothing) crest_[k] = crest_[k + 1];
}

GuideBlock build_block(const GuideLayout& layout, const Underside& under, const Context& context) {
  GuideBlock out;
  Block block(layout, under, context);
  block.lay(context);
  context.progress(0.7, "gap");
  block.keep_gap(out, context);
  out.engraved = block.engrave();
  out.solid = block.solid();
  return out;
}

}  // namespace osteo::inline session::guide
