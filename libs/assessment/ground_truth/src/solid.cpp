#include "osteo/assessment/ground_truth/solid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"
#include "solids_inside.h"

namespace osteo::inline assessment::truth {
namespace {

using portable::sin_cos;

// Rows of points to triangles. `wrap`: the last column is followed by the first.
class Patch {
 public:
  TriangleSoup soup;
  std::uint32_t add(Vec3 p) {
    soup.points_mm.push_back(p);
    return static_cast<std::uint32_t>(soup.points_mm.size() - 1);
  }
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    soup.triangles.push_back({a, b, c});
    soup.triangles.push_back({a, c, d});
  }
};

// Like a ball: t from pole to pole, p around.
class BallLike : public Solid {
 public:
  using Solid::Solid;
  [[nodiscard]] virtual Vec3 chart(double t, double p) const = 0;
  [[nodiscard]] Vec3 place(double s, const PathParams& path) const override {
    const Phases f(path.seed);
    if (path.closed) {
      const double w = 2 * std::numbers::pi / kCycleS;
      return chart(std::numbers::pi / 2 + 0.9 * sin_cos(w * s + f[0]).sin + 0.1 * sin_cos(4 * w * s + f[1]).sin,
                   w * s + 0.3 * sin_cos(2 * w * s + f[2]).sin);
    }
    return chart(std::numbers::pi / 2 + 0.9 * sin_cos(0.83 * s + f[0]).sin + 0.15 * sin_cos(2.9 * s + f[1]).sin,
                 0.9 * s + 0.4 * sin_cos(1.7 * s + f[2]).sin);
  }
  [[nodiscard]] TriangleSoup mesh(int triangles) const override {
    const int n = std::max(4, static_cast<int>(std::lround(std::sqrt(triangles / 2.0))) + 1);
    Patch m;
    m.add(chart(0, 0));
    for (int r = 1; r < n; ++r)
      for (int c = 0; c < n; ++c) m.add(chart(std::numbers::pi * r / n, 2 * std::numbers::pi * c / n));
    const std::uint32_t last = m.add(chart(std::numbers::pi, 0));
    const auto id = [&](int r, int c) { return static_cast<std::uint32_t>(1 + (r - 1) * n + c % n); };
    for (int c = 0; c < n; ++c) {
      m.soup.triangles.push_back({0, id(1, c), id(1, c + 1)});
      m.soup.triangles.push_back({last, id(n - 1, c + 1), id(n - 1, c)});
      for (int r = 1; r + 1 < n; ++r) m.quad(id(r, c), id(r + 1, c), id(r + 1, c + 1), id(r, c + 1));
    }
    return m.soup;
  }
};

class Sphere final : public BallLike {
 public:
  Sphere() : BallLike("sphere", 40, 0.5) {}
  [[nodiscard]] double clearance_mm(Vec3 x) const override { return length(x) - 30; }
  [[nodiscard]] Vec3 gradient(Vec3 x) const override { return normalized(x); }
  [[nodiscard]] Vec3 chart(double t, double p) const override {
    const auto a = sin_cos(t), b = sin_cos(p);
    return Vec3{a.sin * b.cos, a.sin * b.sin, a.cos} * 30;
  }
};

class Duck final : public BallLike {
 public:
  Duck() : BallLike("duck", 40, 0.5) {}
  [[nodiscard]] double clearance_mm(Vec3 x) const override {
    const double n = length(x);
    return n > 0 ? n - radius(x / n) : -30;
  }
  [[nodiscard]] Vec3 chart(double t, double p) const override {
    const auto a = sin_cos(t), b = sin_cos(p);
    const Vec3 d{a.sin * b.cos, a.sin * b.sin, a.cos};
    return d * radius(d);
  }

 private:
  // sin^3 t sin 3p and cos 2t written in the direction's components: no angles.
  static double radius(Vec3 d) {
    const double s2 = d.x * d.x + d.y * d.y;
    return 30 * (1 + 0.12 * d.y * (3 * d.x * d.x - d.y * d.y) + 0.06 * s2 * (2 * d.z * d.z - 1));
  }
};

// Round ends, so that it is smooth everywhere: the axis from z = -20 to 20.
class Cylinder final : public BallLike {
 public:
  Cylinder() : BallLike("cylinder", 40, 0.5) {}
  static constexpr double kRadius = 15, kReach = 20;
  [[nodiscard]] double clearance_mm(Vec3 x) const override {
    const double z = x.z - std::clamp(x.z, -kReach, kReach);
    return std::sqrt(x.x * x.x + x.y * x.y + z * z) - kRadius;
  }
  // t is the share of the profile's length, times pi.
  [[nodiscard]] Vec3 chart(double t, double p) const override {
    const double quarter = kRadius * std::numbers::pi / 2, all = 2 * quarter + 2 * kReach,
                 at = t / std::numbers::pi * all;
    const auto b = sin_cos(p);
    double r = kRadius, z = kReach - (at - quarter);
    if (at < quarter || at > all - quarter) {
      const auto a = sin_cos((at < quarter ? at : all - at) / kRadius);
      r = kRadius * a.sin;
      z = (at < quarter ? 1 : -1) * (kReach + kRadius * a.cos);
    }
    return {r * b.cos, r * b.sin, z};
  }
};

class Torus final : public Solid {
 public:
  Torus() : Solid("torus", 40, 0.5) {}
  static constexpr double kRing = 22, kTube = 10;
  [[nodiscard]] double clearance_mm(Vec3 x) const override {
    const double r = portable::hypot(x.x, x.y) - kRing;
    return portable::hypot(r, x.z) - kTube;
  }
  [[nodiscard]] Vec3 place(double s, const PathParams& path) const override {
    const Phases f(path.seed);
    if (path.closed) {
      const double w = 2 * std::numbers::pi / kCycleS;
      return chart(w * s + 0.3 * sin_cos(3 * w * s + f[0]).sin, w * s + 0.3 * sin_cos(2 * w * s + f[1]).sin);
    }
    return chart(1.1 * s + 0.4 * sin_cos(1.7 * s + f[0]).sin, 0.41 * s + 0.3 * sin_cos(0.9 * s + f[1]).sin);
  }
  [[nodiscard]] TriangleSoup mesh(int triangles) const override {
    const int across = std::max(4, static_cast<int>(std::lround(std::sqrt(triangles / 2.0 * kTube / kRing)))),
              around = std::max(4, triangles / 2 / across);
    Patch m;
    for (int i = 0; i < around; ++i)
      for (int j = 0; j < across; ++j)
        m.add(chart(2 * std::numbers::pi * j / across, 2 * std::numbers::pi * i / around));
    const auto id = [&](int i, int j) { return static_cast<std::uint32_t>(i % around * across + j % across); };
    for (int i = 0; i < around; ++i)
      for (int j = 0; j < across; ++j) m.quad(id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
    return m.soup;
  }

 private:
  [[nodiscard]] static Vec3 chart(double tube, double ring) {
    const auto a = sin_cos(tube), b = sin_cos(ring);
    const double r = kRing + kTube * a.cos;
    return {r * b.cos, r * b.sin, kTube * a.sin};
  }
};

// What a height over a square stands for, with a flat underside.
class Sheet : public Solid {
 public:
  Sheet(std::string name, double stiffness, double thickness, double half = 40)
      : Solid(std::move(name), half, stiffness), thickness_(thickness) {}
  struct Rise {
    double z = 0, x = 0, y = 0;  // height and its slopes
  };
  [[nodiscard]] virtual Rise rise(double x, double y) const = 0;
  [[nodiscard]] double clearance_mm(Vec3 p) const override {
    const Rise r = rise(p.x, p.y);
    // To first order the distance; the underside is far, or parallel.
    const double top = (p.z - r.z) / std::sqrt(1 + r.x * r.x + r.y * r.y);
    return std::max(top, -thickness_ - p.z);
  }
  [[nodiscard]] Vec3 place(double s, const PathParams& path) const override {
    const Phases f(path.seed);
    const double w = 2 * std::numbers::pi / kCycleS;
    const double turn =
        path.closed ? w * s + 0.3 * sin_cos(2 * w * s + f[0]).sin : 0.9 * s + 0.4 * sin_cos(1.7 * s + f[0]).sin;
    const double out = (0.45 + 0.15 * sin_cos((path.closed ? w : 0.83) * s + f[1]).sin) * half_mm();
    const auto a = sin_cos(turn);
    const double x = out * a.cos, y = out * a.sin;
    return {x, y, rise(x, y).z};
  }
  [[nodiscard]] TriangleSoup mesh(int triangles) const override {
    // The top takes nearly all of them.
    const int n = std::max(2, static_cast<int>(std::lround(std::sqrt(triangles / 2.0))));
    const double half = half_mm() * 0.95;
    Patch m;
    std::vector<double> xs = columns(n, half);
    const int nx = static_cast<int>(xs.size()) - 1;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= nx; ++i) {
        const double x = xs[static_cast<std::size_t>(i)], y = -half + 2 * half * j / n;
        m.add({x, y, rise(x, y).z});
      }
    const auto id = [&](int i, int j) { return static_cast<std::uint32_t>(j * (nx + 1) + i); };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < nx; ++i) m.quad(id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
    // Sides and underside: the rim once more below, and a fan.
    std::vector<std::uint32_t> rim, below;
    for (int i = 0; i < nx; ++i) rim.push_back(id(i, 0));
    for (int j = 0; j < n; ++j) rim.push_back(id(nx, j));
    for (int i = nx; i > 0; --i) rim.push_back(id(i, n));
    for (int j = n; j > 0; --j) rim.push_back(id(0, j));
    for (const std::uint32_t r : rim) {
      const Vec3 p = m.soup.points_mm[r];
      below.push_back(m.add({p.x, p.y, -thickness_}));
    }
    const std::uint32_t middle = m.add({0, 0, -thickness_});
    for (std::size_t k = 0; k < rim.size(); ++k) {
      const std::size_t l = (k + 1) % rim.size();
      m.quad(below[k], below[l], rim[l], rim[k]);
      m.soup.triangles.push_back({middle, below[l], below[k]});
    }
    return m.soup;
  }

 protected:
  // Where the columns of the mesh stand; a solid with edges wants some there.
  [[nodiscard]] virtual std::vector<double> columns(int n, double half) const {
    std::vector<double> xs;
    for (int i = 0; i <= n; ++i) xs.push_back(-half + 2 * half * i / n);
    return xs;
  }

 private:
  double thickness_;
};

class Plane final : public Sheet {
 public:
  Plane(std::string name, double thickness) : Sheet(std::move(name), 0.5, thickness) {}
  [[nodiscard]] Rise rise(double, double) const override { return {}; }
};
class Wedge final : public Sheet {
 public:
  Wedge() : Sheet("wedge", 2, 30) {}
  // Two slopes of 30 degrees, a hyperbola: its radius at the top is r / tan.
  [[nodiscard]] Rise rise(double x, double) const override {
    constexpr double kTan = 0.57735026918962576, kRound = 3 * kTan;
    const double root = std::sqrt(x * x + kRound * kRound);
    return {-kTan * (root - kRound), -kTan * x / root, 0};
  }
};
class Saddle final : public Sheet {
 public:
  Saddle() : Sheet("saddle", 2, 30) {}
  [[nodiscard]] Rise rise(double x, double y) const override { return {(x * x - y * y) / 80, x / 40, -y / 40}; }
};
class Ridge final : public Sheet {
 public:
  Ridge(std::string name, const RidgeProfile& p) : Sheet(std::move(name), 4, 15, 20), profile_(p) {}
  [[nodiscard]] double clearance_mm(Vec3 p) const override { return std::max(profile_.distance(p.x, p.z), -15 - p.z); }
  [[nodiscard]] Rise rise(double x, double) const override { return {profile_.height(x), profile_.slope(x), 0}; }

 protected:
  [[nodiscard]] std::vector<double> columns(int n, double half) const override {
    // A third of them where the sides are.
    const auto a = sin_cos(profile_.degrees * std::numbers::pi / 180);
    const double tan = a.sin / a.cos;
    const double in = std::max(0.0, profile_.top_mm / 2 - profile_.radius_mm * 2),
                 out = profile_.top_mm / 2 + profile_.height_mm / tan + profile_.radius_mm * 2;
    std::vector<double> xs;
    const auto span = [&](double from, double to, int count) {
      for (int i = 0; i < count; ++i) xs.push_back(from + (to - from) * i / count);
    };
    const int some = std::max(2, n / 6), sides = std::max(6, n / 3);
    span(-half, -out, some);
    span(-out, -in, sides);
    span(-in, in, some);
    span(in, out, sides);
    span(out, half, some);
    xs.push_back(half);
    return xs;
  }

 private:
  RidgeProfile profile_;
};

}  // namespace

Phases::Phases(std::uint64_t seed) {
  // Seed 1 is the path that was measured first, all phases 0.
  std::uint64_t state = seed - 1;
  for (double& v : phase_) {
    if (seed == 1) continue;
    state += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    v = static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53 * 2 * std::numbers::pi;
  }
}

Vec3 Solid::gradient(Vec3 at) const {
  const double e = 1e-4;
  const auto slope = [&](Vec3 step) { return (clearance_mm(at + step) - clearance_mm(at - step)) / (2 * e); };
  return {slope({e, 0, 0}), slope({0, e, 0}), slope({0, 0, e})};
}

Vec3 Solid::foot(Vec3 at) const {
  for (int i = 0; i < 30; ++i) {
    const double v = clearance_mm(at);
    if (std::abs(v) < 1e-10) break;
    const Vec3 g = gradient(at);
    const double n = dot(g, g);
    if (!(n > 1e-6)) break;
    at -= g * (v / n);
  }
  return at;
}

// A side from (0, height) down to (run, 0), its two corners rounded by arcs. Mirrored for x < 0.
double RidgeProfile::height(double x) const {
  const double angle = degrees * std::numbers::pi / 180;
  const auto a = portable::sin_cos(angle);
  const double tan = a.sin / a.cos, half_tan = a.sin / (1 + a.cos), cut = radius_mm * half_tan;
  const double d = std::abs(x) - top_mm / 2;  // 0 at the upper corner
  const double run = height_mm / tan;
  // Upper arc, whose centre lies `radius` below the top at d = -cut; lower arc above the plane at d = run + cut.
  if (d <= -cut) return height_mm;
  if (d < -cut + radius_mm * a.sin)
    return height_mm - radius_mm + std::sqrt(radius_mm * radius_mm - (d + cut) * (d + cut));
  if (d >= run + cut) return 0;
  if (d > run + cut - radius_mm * a.sin)
    return radius_mm - std::sqrt(radius_mm * radius_mm - (d - run - cut) * (d - run - cut));
  return height_mm - tan * d;
}
double RidgeProfile::slope(double x) const {
  const double angle = degrees * std::numbers::pi / 180;
  const auto a = portable::sin_cos(angle);
  const double tan = a.sin / a.cos, cut = radius_mm * a.sin / (1 + a.cos), d = std::abs(x) - top_mm / 2,
               run = height_mm / tan;
  const double side = x < 0 ? -1 : 1;
  if (d <= -cut || d >= run + cut) return 0;
  if (d < -cut + radius_mm * a.sin) return -side * (d + cut) / std::sqrt(radius_mm * radius_mm - (d + cut) * (d + cut));
  if (d > run + cut - radius_mm * a.sin) {
    const double e = d - run - cut;
    return side * e / std::sqrt(radius_mm * radius_mm - e * e);
  }
  return -side * tan;
}

double RidgeProfile::distance(double x, double z) const {
  const auto a = portable::sin_cos(degrees * std::numbers::pi / 180);
  const double cut = radius_mm * a.sin / (1 + a.cos), run = height_mm * a.cos / a.sin, d = std::abs(x) - top_mm / 2;
  double best = 1e300;
  const auto line = [&](double x0, double z0, double x1, double z1) {
    const double ux = x1 - x0, uz = z1 - z0,
                 t = std::clamp(((d - x0) * ux + (z - z0) * uz) / (ux * ux + uz * uz), 0.0, 1.0);
    best = std::min(best, portable::hypot(d - x0 - t * ux, z - z0 - t * uz));
  };
  // The arcs turn by the angle of the side: up from the upper centre, down from the lower one.
  const auto arc = [&](double cx, double cz, double way) {
    const double ex = way * (d - cx), ez = way * (z - cz), n = portable::hypot(ex, ez);
    if (n > 0 && ex >= 0 && ez > 0 && ex * a.cos <= ez * a.sin) best = std::min(best, std::abs(n - radius_mm));
  };
  const double up_x = -cut + radius_mm * a.sin, up_z = height_mm - radius_mm + radius_mm * a.cos;
  const double low_x = run + cut - radius_mm * a.sin, low_z = radius_mm - radius_mm * a.cos;
  line(-top_mm / 2 - 1, height_mm, -cut, height_mm);
  arc(-cut, height_mm - radius_mm, 1);
  line(up_x, up_z, low_x, low_z);
  arc(run + cut, radius_mm, -1);
  line(run + cut, 0, run + cut + 1000, 0);
  return z < height(x) ? -best : best;
}

std::shared_ptr<const Solid> make_ridge(const RidgeProfile& profile) {
  if (!(profile.degrees >= 5 && profile.degrees <= 85 && profile.radius_mm > 0 && profile.height_mm > 0))
    throw Error(ExitCode::usage, "a ridge needs sides of 5 to 85 degrees, a height and a radius");
  return std::make_shared<Ridge>("bump", profile);
}

const std::vector<std::string>& solid_names() {
  static const std::vector<std::string> names{"plane", "sphere", "cylinder", "torus", "duck",
                                              "wedge", "saddle", "bump",     "wall"};
  return names;
}

std::shared_ptr<const Solid> make_solid(std::string_view name) {
  if (name == "plane") return std::make_shared<Plane>("plane", 30);
  if (name == "sphere") return std::make_shared<Sphere>();
  if (name == "cylinder") return std::make_shared<Cylinder>();
  if (name == "torus") return std::make_shared<Torus>();
  if (name == "duck") return std::make_shared<Duck>();
  if (name == "wedge") return std::make_shared<Wedge>();
  if (name == "saddle") return std::make_shared<Saddle>();
  if (name == "bump") return make_ridge({2, 45, 1, 6});
  if (name == "wall") return std::make_shared<Plane>("wall", 2);
  std::string known;
  for (const std::string& n : solid_names()) known += (known.empty() ? "" : ", ") + n;
  throw Error(ExitCode::usage, "there is no solid '" + std::string(name) + "'", "known are " + known);
}

CubicField sampled_field(const Solid& solid, int n, double scale, FieldCurve curve, const Context& context) {
  if (n < 4 || n > 1024) throw Error(ExitCode::usage, "a sampled field has 4 to 1024 points along an edge");
  Frame f;
  f.dims = {n, n, n};
  const double h = 2 * solid.half_mm() / (n - 1);
  f.spacing_mm = Vec3{h, h, h} * scale;
  f.origin_mm = Vec3{-1, -1, -1} * (solid.half_mm() * scale);
  std::vector<float> v(f.voxel_count());
  parallel_for(static_cast<std::size_t>(n), 1, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::size_t at = k * static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
          v[at++] = static_cast<float>(scale * solid.clearance_mm(Vec3{i * h, j * h, static_cast<double>(k) * h} -
                                                                  Vec3{1, 1, 1} * solid.half_mm()));
    }
  });
  return CubicField(f, std::move(v), curve);
}

BrickGrid sampled_bone(const Solid& solid, double h, const Context& context) {
  const int n = static_cast<int>(std::ceil(2 * solid.half_mm() / h / 8)) * 8;
  Frame f;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  const double lo = -n * h / 2 + h / 2;
  f.origin_mm = {lo, lo, lo};
  const auto at = [&](int i) { return lo + i * h; };
  BrickGrid g = BrickGrid::dense(f);
  parallel_for(static_cast<std::size_t>(n), 8, context.threads, [&](std::size_t begin, std::size_t end) {
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const Vec3 x{at(i), at(j), at(k)};
          const double c = solid.clearance_mm(x);
          int in = c < 0 ? 64 : 0;
          // The slope may be as low as a half.
          if (std::abs(c) < 1.8 * h) {
            in = 0;
            for (int s = 0; s < 64; ++s)
              in +=
                  solid.clearance_mm(x + Vec3{(s & 3) - 1.5, (s >> 2 & 3) - 1.5, (s >> 4) - 1.5} * (h / 4)) < 0 ? 1 : 0;
          }
          g.set(g.find(i, j, k), static_cast<float>(in) / 64.0F);
        }
  });
  return g;
}

}  // namespace osteo::inline assessment::truth
