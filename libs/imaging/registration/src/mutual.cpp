#include "mutual.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/imaging/image/planes.h"

namespace osteo::inline imaging::registration {
namespace {

constexpr int kMaxBins = 48;
constexpr double kMinOverlap = 0.25;

// Points of one scan, around the middle of them, and the bin of the value there.
struct Samples {
  Vec3 centre_mm;
  double radius_mm = 1;  // root mean square distance from the centre: what a turn by one radian moves a point by
  std::vector<float> x, y, z;
  std::vector<std::uint8_t> bin;
  int bins = 32;
};

float scale_of(const Levels& l, int bins) {
  return static_cast<float>(bins - 1) / (l.hi - l.lo);
}

// Half anywhere, half where values change: those hold what there is to align. Between voxels, since points on one
// lattice sampled on another give ripples of their own (J. Pluim et al., Interpolation artefacts in mutual
// information-based image registration, CVIU 2000). With `where`, only points that it puts into `other`.
Samples take_samples(const Levels& from, std::size_t level, std::size_t count, int bins, std::uint64_t seed,
                     const Frame* other = nullptr, const RigidTransform& where = {}) {
  const Level& l = from.levels[level];
  const auto seen = [&](const std::array<float, 3>& p) {
    if (other == nullptr) return true;
    const Vec3 x = other->index_from_world(where(
        l.frame.world_from_index({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])})));
    for (std::size_t a = 0; a < 3; ++a)
      if (!(x[a] >= 0 && x[a] <= other->dims[a] - 1)) return false;
    return true;
  };
  std::mt19937_64 random(seed * 1000003 + level);
  const auto uniform = [&](int n) {
    return static_cast<float>((static_cast<double>(random() >> 11) * 0x1p-53) * std::max(0, n - 1));
  };
  struct Point {
    std::array<float, 3> p;
    float value, slope;
  };
  const auto draw = [&] {
    Point q{};
    for (int tries = 0; tries < 200; ++tries) {
      q.p = {uniform(l.frame.dims[0]), uniform(l.frame.dims[1]), uniform(l.frame.dims[2])};
      if (seen(q.p)) break;
    }
    static_cast<void>(sample(l, q.p[0], q.p[1], q.p[2], q.value));
    for (std::size_t a = 0; a < 3; ++a) {
      auto b = q.p, c = q.p;
      const auto top = static_cast<float>(std::max(0, l.frame.dims[a] - 1));
      b[a] = std::max(0.0F, b[a] - 1);
      c[a] = std::min(top, c[a] + 1);
      float u = 0, v = 0;
      static_cast<void>(sample(l, b[0], b[1], b[2], u));
      static_cast<void>(sample(l, c[0], c[1], c[2], v));
      const auto inside = [&](float w) { return std::clamp(w, from.lo, from.hi); };
      q.slope += (inside(v) - inside(u)) * (inside(v) - inside(u));
    }
    return q;
  };
  std::vector<Point> points;
  std::vector<float> slopes;
  for (std::size_t i = 0; i < count / 2; ++i) {
    points.push_back(draw());
    slopes.push_back(points.back().slope);
  }
  std::nth_element(slopes.begin(), slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() * 4 / 5), slopes.end());
  const float steep = slopes[slopes.size() * 4 / 5];
  for (std::size_t tries = 0; points.size() < count && tries < 8 * count; ++tries) {
    const Point q = draw();
    if (q.slope >= steep) points.push_back(q);
  }
  Samples s;
  s.bins = bins;
  std::vector<Vec3> world;
  for (const Point& q : points) {
    world.push_back(l.frame.world_from_index(
        {static_cast<double>(q.p[0]), static_cast<double>(q.p[1]), static_cast<double>(q.p[2])}));
    s.centre_mm += world.back() * (1.0 / static_cast<double>(points.size()));
    s.bin.push_back(static_cast<std::uint8_t>(
        std::clamp(static_cast<int>((q.value - from.lo) * scale_of(from, bins) + 0.5F), 0, bins - 1)));
  }
  double square = 0;
  for (const Vec3& w : world) {
    const Vec3 d = w - s.centre_mm;
    square += dot(d, d) / static_cast<double>(world.size());
    s.x.push_back(static_cast<float>(d.x));
    s.y.push_back(static_cast<float>(d.y));
    s.z.push_back(static_cast<float>(d.z));
  }
  s.radius_mm = std::max(1.0, std::sqrt(square));
  return s;
}

using Joint = std::array<float, static_cast<std::size_t>(kMaxBins* kMaxBins)>;

std::size_t fill(const Samples& s, const Levels& to, const Level& level, const IndexMap& m, std::size_t begin,
                 std::size_t end, Joint& joint) {
  const float scale = scale_of(to, s.bins), top = static_cast<float>(s.bins - 1);
  std::size_t inside = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const float x = s.x[i], y = s.y[i], z = s.z[i];
    const auto along = [&](std::size_t r) { return m.row[r][0] * x + m.row[r][1] * y + m.row[r][2] * z + m.shift[r]; };
    float v = 0;
    if (!sample(level, along(0), along(1), along(2), v)) continue;
    ++inside;
    // A value counts for the two bins it lies between, so that the score changes smoothly.
    const float b = std::clamp((v - to.lo) * scale, 0.0F, top);
    const int lower = std::min(static_cast<int>(b), s.bins - 2);
    const float t = b - static_cast<float>(lower);
    float* const row = joint.data() + static_cast<std::size_t>(s.bin[i]) * static_cast<std::size_t>(s.bins) + lower;
    row[0] += 1 - t;
    row[1] += t;
  }
  return inside;
}

double normalized_information(const Joint& joint, int bins, std::size_t inside) {
  const auto n = static_cast<std::size_t>(bins);
  std::array<double, kMaxBins> a{}, b{};
  double both = 0, one = 0, other = 0;
  const auto entropy = [&](double c) {
    const double p = c / static_cast<double>(inside);
    return p > 0 ? -p * portable::log(p) : 0;
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const auto c = static_cast<double>(joint[i * n + j]);
      a[i] += c;
      b[j] += c;
      both += entropy(c);
    }
  for (std::size_t i = 0; i < n; ++i) {
    one += entropy(a[i]);
    other += entropy(b[i]);
  }
  return both > 1e-9 ? (one + other) / both : 1;
}

Match evaluate(const Samples& s, const Levels& to, std::size_t level, const RigidTransform& t, int threads) {
  const Level& l = to.levels[level];
  const IndexMap m = index_map(l.frame, t, s.centre_mm);
  constexpr std::size_t kChunk = 8192;
  const std::size_t chunks = (s.x.size() + kChunk - 1) / kChunk;
  Match match{t, 1, 0};
  std::size_t inside = 0;
  Joint joint{};
  if (chunks == 1 || threads == 1) {
    // In the order of the chunks too: sums of floats depend on it.
    for (std::size_t c = 0; c < chunks; ++c) {
      Joint part{};
      inside += fill(s, to, l, m, c * kChunk, std::min(s.x.size(), (c + 1) * kChunk), part);
      for (std::size_t i = 0; i < joint.size(); ++i) joint[i] += part[i];
    }
  } else {
    std::vector<Joint> parts(chunks);
    std::vector<std::size_t> counts(chunks);
    parallel_for(chunks, 1, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        parts[c].fill(0);
        counts[c] = fill(s, to, l, m, c * kChunk, std::min(s.x.size(), (c + 1) * kChunk), parts[c]);
      }
    });
    for (std::size_t c = 0; c < chunks; ++c) {
      inside += counts[c];
      for (std::size_t i = 0; i < joint.size(); ++i) joint[i] += parts[c][i];
    }
  }
  match.overlap = static_cast<double>(inside) / static_cast<double>(s.x.size());
  // Little overlap is no match, however well it fits; the way back must still lead uphill.
  match.score =
      match.overlap < kMinOverlap ? match.overlap - kMinOverlap + 0.9 : normalized_information(joint, s.bins, inside);
  return match;
}

// What six numbers in mm do to a transform: a shift and a turn about the middle of the points.
using Six = std::array<double, 6>;
RigidTransform moved(const RigidTransform& base, const Samples& s, const Six& p) {
  const Vec3 turn = Vec3{p[3], p[4], p[5]} / s.radius_mm;
  const double angle = length(turn);
  RigidTransform step = angle > 0 ? rotation_about(s.centre_mm, turn / angle, angle) : RigidTransform{};
  step.shift_mm += Vec3{p[0], p[1], p[2]};
  return base * step;
}

// J. Nelder, R. Mead, A simplex method for function minimization, Computer Journal 1965.
Match simplex(const Samples& s, const Levels& to, std::size_t level, const Match& start, double step_mm, double end_mm,
              int most, int threads) {
  struct Corner {
    Six p{};
    Match m;
  };
  const auto at = [&](const Six& p) { return Corner{p, evaluate(s, to, level, moved(start.to_from, s, p), threads)}; };
  std::array<Corner, 7> c;
  c[0] = at({});
  for (std::size_t i = 0; i < 6; ++i) {
    Six p{};
    p[i] = step_mm;
    c[i + 1] = at(p);
  }
  for (int n = 7; n < most;) {
    std::stable_sort(c.begin(), c.end(), [](const Corner& a, const Corner& b) { return a.m.score > b.m.score; });
    double wide = 0;
    for (std::size_t i = 1; i < 7; ++i)
      for (std::size_t a = 0; a < 6; ++a) wide = std::max(wide, std::abs(c[i].p[a] - c[0].p[a]));
    if (wide < end_mm) break;
    Six middle{};
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t a = 0; a < 6; ++a) middle[a] += c[i].p[a] / 6;
    const auto towards = [&](double t) {
      Six p;
      for (std::size_t a = 0; a < 6; ++a) p[a] = middle[a] + t * (c[6].p[a] - middle[a]);
      return at(p);
    };
    const Corner mirrored = towards(-1);
    ++n;
    if (mirrored.m.score > c[0].m.score) {
      const Corner further = towards(-2);
      ++n;
      c[6] = further.m.score > mirrored.m.score ? further : mirrored;
    } else if (mirrored.m.score > c[5].m.score) {
      c[6] = mirrored;
    } else {
      const bool outside = mirrored.m.score > c[6].m.score;
      const Corner nearer = towards(outside ? -0.5 : 0.5);
      ++n;
      if (nearer.m.score > std::max(outside ? mirrored.m.score : c[6].m.score, c[6].m.score)) {
        c[6] = nearer;
      } else {
        for (std::size_t i = 1; i < 7; ++i) {
          Six p;
          for (std::size_t a = 0; a < 6; ++a) p[a] = c[0].p[a] + 0.5 * (c[i].p[a] - c[0].p[a]);
          c[i] = at(p);
          ++n;
        }
      }
    }
  }
  return std::max_element(c.begin(), c.end(), [](const Corner& a, const Corner& b) { return a.m.score < b.m.score; })
      ->m;
}

// The middle of what is no air: values above the middle between the background's and the rest's mean.
Vec3 middle_of_body(const Levels& l) {
  const Level& c = l.levels.back();
  double cut = 0.5 * static_cast<double>(l.lo + l.hi);
  for (int n = 0; n < 20; ++n) {
    double low = 0, high = 0, lows = 1e-9, highs = 1e-9;
    for (const float v : c.values) {
      const auto w = static_cast<double>(std::clamp(v, l.lo, l.hi));
      (w > cut ? high : low) += w;
      (w > cut ? highs : lows) += 1;
    }
    cut = 0.5 * (low / lows + high / highs);
  }
  Vec3 sum;
  double count = 0;
  for (int k = 0; k < c.frame.dims[2]; ++k)
    for (int j = 0; j < c.frame.dims[1]; ++j)
      for (int i = 0; i < c.frame.dims[0]; ++i) {
        if (static_cast<double>(c.at(i, j, k)) <= cut) continue;
        sum += c.frame.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        ++count;
      }
  return count > 0 ? sum / count : c.frame.centre_mm();
}

// Shift of the second against the first where their shadows along the three axes fit best, by phase correlation of sums
// along them.
Vec3 shift_of_shadows(const Levels& from, const Levels& to) {
  const Level &a = from.levels.back(), &b = to.levels.back();
  const double h = b.frame.spacing_mm.x;
  // On one upright lattice around the middle of each, as large as both.
  double reach = 0;
  for (const Level* l : {&a, &b})
    for (std::size_t c = 0; c < 3; ++c) reach = std::max(reach, 0.5 * l->frame.dims[c] * l->frame.spacing_mm.x);
  const int n = std::max(8, 2 * static_cast<int>(std::ceil(1.2 * reach / h)));
  const auto shadows = [&](const Level& l, float air) {
    std::array<PlaneImage, 3> s;
    for (PlaneImage& p : s) p = {n, n, std::vector<float>(static_cast<std::size_t>(n) * static_cast<std::size_t>(n))};
    const IndexMap m = index_map(l.frame, {}, l.frame.centre_mm());
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const auto mm = [&](int x) { return static_cast<float>((x - 0.5 * (n - 1)) * h); };
          const auto along = [&](std::size_t r) {
            return m.row[r][0] * mm(i) + m.row[r][1] * mm(j) + m.row[r][2] * mm(k) + m.shift[r];
          };
          float v = 0;
          if (!sample(l, along(0), along(1), along(2), v)) continue;
          v = std::max(0.0F, v - air);
          s[0].values[static_cast<std::size_t>(k * n + j)] += v;
          s[1].values[static_cast<std::size_t>(k * n + i)] += v;
          s[2].values[static_cast<std::size_t>(j * n + i)] += v;
        }
    return s;
  };
  const auto sa = shadows(a, from.lo), sb = shadows(b, to.lo);
  std::array<PlaneMatch, 3> m;
  for (std::size_t c = 0; c < 3; ++c) m[c] = match_by_phase(sa[c], sb[c]);
  // Each axis is seen twice: the clearer one counts.
  const auto clearer = [](const PlaneMatch& p, double x, const PlaneMatch& q, double y) {
    return p.score >= q.score ? x : y;
  };
  const Vec3 found = Vec3{clearer(m[1], m[1].dx, m[2], m[2].dx), clearer(m[0], m[0].dx, m[2], m[2].dy),
                          clearer(m[0], m[0].dy, m[1], m[1].dy)} *
                     h;
  return b.frame.centre_mm() - a.frame.centre_mm() + found;
}

std::vector<RigidTransform> starts(const Samples& s, const Levels& from, const Levels& to) {
  std::vector<RigidTransform> all;
  // Where the files put them; where the bodies' middles meet; where their shadows fit.
  struct Place {
    Vec3 shift;
    int reach;
  };
  const Vec3 bodies = middle_of_body(to) - middle_of_body(from);
  constexpr double kShiftMm = 25, kTurn = 13 * std::numbers::pi / 180;
  for (const Place& place : {Place{{}, 2}, Place{bodies, 1}, Place{shift_of_shadows(from, to), 1}}) {
    for (int a = 0; a < 125; ++a) {
      const Vec3 turn = Vec3{a % 5 - 2.0, a / 5 % 5 - 2.0, a / 25 - 2.0} * kTurn;
      const double angle = length(turn);
      if (angle > 3 * kTurn) continue;  // corners of the cube: beyond 40 degrees
      const RigidTransform r = angle > 0 ? rotation_about(s.centre_mm, turn / angle, angle) : RigidTransform{};
      for (int k = -place.reach; k <= place.reach; ++k)
        for (int j = -place.reach; j <= place.reach; ++j)
          for (int i = -place.reach; i <= place.reach; ++i) {
            RigidTransform t = r;
            t.shift_mm += place.shift + Vec3{i * kShiftMm, j * kShiftMm, k * kShiftMm};
            all.push_back(t);
          }
    }
  }
  return all;
}

double apart(const RigidTransform& a, const RigidTransform& b, const Samples& s) {
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c)
    for (const double side : {-1.0, 1.0}) {
      Vec3 p = s.centre_mm;
      p[c] += side * s.radius_mm;
      most = std::max(most, length(a(p) - b(p)));
    }
  return most;
}

// The best that do not lie beside a better one.
std::vector<Match> best_of(std::vector<Match> all, std::size_t count, double apart_mm, const Samples& s) {
  std::stable_sort(all.begin(), all.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  std::vector<Match> kept;
  for (const Match& m : all) {
    if (kept.size() == count) break;
    if (std::none_of(kept.begin(), kept.end(),
                     [&](const Match& k) { return apart(k.to_from, m.to_from, s) < apart_mm; }))
      kept.push_back(m);
  }
  return kept;
}

struct Plan {
  std::size_t points;
  int bins;
  std::size_t kept;
  int most;
};
Plan plan_of(double h) {
  if (h > 6) return {3000, 24, 32, 160};
  if (h > 3) return {8000, 32, 6, 200};
  if (h > 1.5) return {24000, 40, 2, 250};
  return {80000, kMaxBins, 1, 300};
}

}  // namespace

std::vector<RigidTransform> anywhere(const Levels& from, const Levels& to, const Context& context) {
  const std::size_t coarsest = std::min(from.levels.size(), to.levels.size()) - 1;
  const Plan plan = plan_of(to.levels[coarsest].frame.spacing_mm.x);
  return starts(take_samples(from, coarsest, plan.points, plan.bins, context.seed), from, to);
}

Match search(const Levels& from, const Levels& to, const std::vector<RigidTransform>& starts, const SearchWidth& width,
             std::size_t stop, const Context& context) {
  const std::size_t depth = std::min(from.levels.size(), to.levels.size());
  std::vector<Match> matches;
  for (std::size_t level = depth; level-- > stop;) {
    context.progress(static_cast<double>(depth - level - 1) / static_cast<double>(depth), "registration");
    const double h = to.levels[level].frame.spacing_mm.x;
    const Plan plan = plan_of(h);
    const Samples s = take_samples(from, level, plan.points, plan.bins, context.seed);
    const std::size_t kept = std::clamp<std::size_t>(width.times * plan.kept, 1, width.most);
    if (matches.empty()) {
      const Samples few = take_samples(from, level, plan.points / 2, plan.bins, context.seed + 1);
      matches.resize(starts.size());
      parallel_for(starts.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
        context.check_cancelled();
        for (std::size_t i = begin; i < end; ++i) matches[i] = evaluate(few, to, level, starts[i], 1);
      });
      matches = best_of(std::move(matches), kept, 5, s);
    } else {
      matches = best_of(std::move(matches), kept, h, s);
    }
    // Many starts side by side, or the points of one.
    const bool many = matches.size() > 2;
    parallel_for(matches.size(), 1, many ? context.threads : 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        context.check_cancelled();
        matches[i] = simplex(s, to, level, matches[i], 0.75 * h, 0.02 * h, plan.most, many ? 1 : context.threads);
      }
    });
    std::stable_sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  }
  return matches.front();
}

Match refine(const Levels& from, const Levels& to, const RigidTransform& guess, std::size_t start,
             const Context& context) {
  Match m{guess, 0, 0};
  for (std::size_t level = std::min({start + 1, from.levels.size(), to.levels.size()}); level-- > 0;) {
    const double h = to.levels[level].frame.spacing_mm.x;
    const Plan plan = plan_of(h);
    const Samples s =
        take_samples(from, level, plan.points, plan.bins, context.seed, &to.levels[level].frame, m.to_from);
    m = simplex(s, to, level, m, 0.5 * h, 0.01 * h, plan.most, context.threads);
  }
  return m;
}

double likeness(const Levels& from, const Levels& to, const RigidTransform& to_from, const Context& context) {
  const std::size_t level = std::min({std::size_t{1}, from.levels.size() - 1, to.levels.size() - 1});
  const Samples s = take_samples(from, level, 20000, kMaxBins, context.seed);
  const IndexMap m = index_map(to.levels[level].frame, to_from, s.centre_mm);
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const auto along = [&](std::size_t r) {
      return m.row[r][0] * s.x[i] + m.row[r][1] * s.y[i] + m.row[r][2] * s.z[i] + m.shift[r];
    };
    float value = 0;
    if (!sample(to.levels[level], along(0), along(1), along(2), value)) continue;
    const auto u = static_cast<double>(s.bin[i]),
               v = static_cast<double>((std::clamp(value, to.lo, to.hi) - to.lo) * scale_of(to, s.bins));
    ++n;
    a += u;
    b += v;
    aa += u * u;
    bb += v * v;
    ab += u * v;
  }
  const double va = n * aa - a * a, vb = n * bb - b * b;
  return va > 0 && vb > 0 ? (n * ab - a * b) / std::sqrt(va * vb) : 0;
}

}  // namespace osteo::inline imaging::registration
