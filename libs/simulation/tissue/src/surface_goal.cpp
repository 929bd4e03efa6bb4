#include "surface_goal.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline simulation::tissue {
namespace {

constexpr std::size_t kMinPoints = 20, kMinMarkers = 4;
constexpr double kCauchy = 2.385;  // widths of noise: 95 % as good as squares where there are no stray points
// Two thirds of all distances lie below the standard deviation along a line, and below so many of an axis's in space.
// Not the median: what hardly moves is hardly off, and would pass for all of the noise.
constexpr double kTwoThirds = 0.6827, kOfThree = 1.878;
constexpr double kStray = 4;
constexpr double kMinNoise = 0.005;  // of the RMS movement: no fast model is nearer to a body than that

std::string shown(double v) {
  return format_number(std::round(v * 1000) / 1000);
}

Eigen::Vector3d eigen(Vec3 v) {
  return {v.x, v.y, v.z};
}
Vec3 vec(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// A residual whose square is A. Cauchy's loss, and its slope.
double cauchy(double r, double width, double& slope) {
  const double t = r / width, log = std::log1p(t * t);
  if (log < 1e-12) {
    slope = 1;
    return r;
  }
  const double root = std::copysign(std::sqrt(log), t);
  slope = t / ((1 + t * t) * root);
  return width * root;
}

void box_of(std::span<const Vec3> points, Vec3& lo, Vec3& hi) {
  BoxMm box;
  for (const Vec3& p : points) box.include(p);
  lo = box.lo;
  hi = box.hi;
}

}  // namespace

SurfaceGoal::SurfaceGoal(const TissueModel& model, const BodySurface& surface, std::span<const MeasuredPoints> views,
                         bool find_pose, std::size_t most, const Context& context)
    : surface_(surface), rest_(model.rest()), find_pose_(find_pose), context_(context) {
  if (surface.triangles.empty()) throw Error(ExitCode::usage, "the body's surface has no triangle");
  const std::vector<Vec3> rest = moved(rest_);
  Vec3 lo, hi;
  box_of(rest, lo, hi);
  for (const MeasuredPoints& source : views) {
    check(source, lo, hi);
    View v;
    v.source = &source;
    for (std::size_t p = 0; p < source.points_mm.size(); ++p) v.drawn.push_back(p);
    if (source.rest_mm.empty() && v.drawn.size() > most) {
      std::mt19937_64 random(context.seed);
      for (std::size_t k = 0; k < most; ++k) std::swap(v.drawn[k], v.drawn[k + random() % (v.drawn.size() - k)]);
      v.drawn.resize(most);
      std::sort(v.drawn.begin(), v.drawn.end());
    }
    const double usual = value_at_share(source.noise_mm, 0.5);
    for (const std::size_t p : v.drawn) {
      v.weight.push_back(source.noise_mm.empty() ? 1 : source.noise_mm[p] / usual);
      v.centre += source.points_mm[p] / static_cast<double>(v.drawn.size());
    }
    // One parameter of 1 moves the body's rim by a hundredth of its size.
    v.shift = 0.01 * length(hi - lo);
    v.turn = 0.02;
    v.width_mm = 10 * length(hi - lo);
    v.first_row = rows_;
    rows_ += v.rows();
    seen_at_.push_back(seen_.size());
    for (const std::size_t p : v.drawn) {
      Seen s;
      s.before = s.at = source.points_mm[p];
      seen_.push_back(s);
    }
    if (v.markers()) embed(model, v);
    views_.push_back(std::move(v));
  }
  turn_by_.resize(views_.size());
  centre_.resize(views_.size());
  std::vector<double> nowhere(own()), r(rows_);
  residuals(rest_, nowhere.data(), r.data());
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (const double off = error(k, rest_).median_mm; off > 0.5 * length(hi - lo))
      throw Error(ExitCode::usage,
                  views_[k].source->name + ": half of its points lie over " + shown(off) +
                      " mm from the body at rest, which is " + shown(length(hi - lo)) + " mm large",
                  "bring it into the frame of the mesh (LPS mm) first");
  }
}

void SurfaceGoal::check(const MeasuredPoints& v, Vec3 lo, Vec3 hi) const {
  const bool markers = !v.rest_mm.empty();
  const std::size_t fewest = markers ? kMinMarkers : kMinPoints;
  if (v.points_mm.size() < fewest)
    throw Error(ExitCode::usage, v.name + ": it holds " + std::to_string(v.points_mm.size()) +
                                     (markers ? " markers, " : " points, ") + std::to_string(fewest) + " are needed");
  if ((markers && v.rest_mm.size() != v.points_mm.size()) ||
      (!v.noise_mm.empty() && v.noise_mm.size() != v.points_mm.size()))
    throw Error(ExitCode::usage, v.name + ": not every point has its rest or its noise");
  for (std::size_t p = 0; p < v.points_mm.size(); ++p) {
    if (!std::isfinite(dot(v.points_mm[p], v.points_mm[p])) ||
        (markers && !std::isfinite(dot(v.rest_mm[p], v.rest_mm[p]))))
      throw Error(ExitCode::usage,
                  v.name + ": point " + std::to_string(p) + " has a coordinate that is no finite number");
    if (!v.noise_mm.empty() && !(v.noise_mm[p] > 0 && std::isfinite(v.noise_mm[p])))
      throw Error(ExitCode::usage, v.name + ": point " + std::to_string(p) + " has a noise that is not above 0");
  }
  // By quarters, since stray points may be anywhere.
  double measured = 0, whole = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> x;
    for (const Vec3& p : v.points_mm) x.push_back(p[a]);
    std::sort(x.begin(), x.end());
    measured = std::hypot(measured, 2 * (x[x.size() * 3 / 4] - x[x.size() / 4]));
    whole = std::hypot(whole, hi[a] - lo[a]);
  }
  if (measured > 10 * whole || measured < 0.1 * whole)
    throw Error(ExitCode::usage,
                v.name + ": it is " + shown(measured) + " mm large, the body " + shown(whole) +
                    " mm: not the same body, or not in mm",
                "give it in LPS mm; a view that is smaller than a tenth of the body says too little");
}

void SurfaceGoal::embed(const TissueModel& model, View& view) {
  for (std::size_t k = 0; k < view.drawn.size(); ++k) {
    const Vec3 q = view.source->rest_mm[view.drawn[k]];
    Seen& s = seen_[seen_at_.back() + k];
    double best = -1e300;
    for (const auto& t : model.tets()) {
      const Vec3 o = rest_[t[0]], a = rest_[t[1]] - o, b = rest_[t[2]] - o, c = rest_[t[3]] - o, d = q - o;
      const double six = dot(a, cross(b, c));
      std::array<double, 4> w{0, dot(d, cross(b, c)) / six, dot(a, cross(d, c)) / six, dot(a, cross(b, d)) / six};
      w[0] = 1 - w[1] - w[2] - w[3];
      const double least = std::min({w[0], w[1], w[2], w[3]});
      if (least <= best) continue;
      best = least;
      s.corners = t;
      s.weights = w;
    }
    // A mesh of voxels lies within a voxel of the surface that it was made from.
    if (best < -1)
      throw Error(ExitCode::usage,
                  view.source->name + ": marker " + std::to_string(view.drawn[k]) + " lies outside the body at rest",
                  "x0_mm, y0_mm, z0_mm are where it was before the load, in the frame of the mesh (LPS mm)");
  }
}

std::vector<Vec3> SurfaceGoal::moved(std::span<const Vec3> shape) const {
  std::vector<Vec3> x(surface_.corners.size());
  for (std::size_t p = 0; p < x.size(); ++p)
    for (std::size_t c = 0; c < 4; ++c) x[p] += shape[surface_.corners[p][c]] * surface_.weights[p][c];
  return x;
}

void SurfaceGoal::place(const double* own) {
  if (!find_pose_) return;
  for (std::size_t k = 0; k < views_.size(); ++k, own += 6) {
    const View& v = views_[k];
    const Eigen::Vector3d w = v.turn * Eigen::Vector3d(own[0], own[1], own[2]);
    const double angle = w.norm();
    const Eigen::Matrix3d turn = angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                                           : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    const Vec3 by = Vec3{own[3], own[4], own[5]} * v.shift + v.centre;
    centre_[k] = by;
    for (std::size_t p = 0; p < v.drawn.size(); ++p) {
      Seen& s = seen_[seen_at_[k] + p];
      s.at = vec(turn * eigen(s.before - v.centre)) + by;
    }
    // A little more of a parameter turns what is already turned about this (the left Jacobian of the rotation).
    Eigen::Matrix3d skew;
    skew << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    const double a = angle > 1e-4 ? (1 - std::cos(angle)) / (angle * angle) : 0.5,
                 b = angle > 1e-4 ? (angle - std::sin(angle)) / (angle * angle * angle) : 1.0 / 6;
    const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() + a * skew + b * skew * skew;
    for (int c = 0; c < 3; ++c) turn_by_[k][static_cast<std::size_t>(c)] = vec(left.col(c)) * v.turn;
  }
}

void SurfaceGoal::residuals(std::span<const Vec3> shape, const double* own, double* out) {
  place(own);
  TriangleSoup soup;
  soup.points_mm = moved(shape);
  soup.triangles = surface_.triangles;
  const TriangleTree tree(soup, context_);
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const View& v = views_[k];
    for (std::size_t p = 0; p < v.drawn.size(); ++p) {
      Seen& s = seen_[seen_at_[k] + p];
      const double width = v.width_mm * v.weight[p];
      if (v.markers()) {
        Vec3 x{};
        for (std::size_t c = 0; c < 4; ++c) x += shape[s.corners[c]] * s.weights[c];
        s.left = x - s.at;
        const double off = length(s.left);
        double slope = 1;
        const double value = cauchy(off, width, slope), share = off > 0 ? value / off : 1;
        const Vec3 along = off > 0 ? s.left / off : Vec3{1, 0, 0};
        const double scale = scale_ / v.weight[p];
        for (std::size_t a = 0; a < 3; ++a) {
          Vec3 e{};
          e[a] = 1;
          s.by_left[a] = (e * share + along * (along[a] * (slope - share))) * scale;
          *out++ = s.left[a] * share * scale;
        }
        continue;
      }
      const ClosestPoint near = tree.closest(s.at, s.triangle);
      s.triangle = near.triangle;
      const auto& t = soup.triangles[near.triangle];
      const Vec3 a = soup.points_mm[t[0]], b = soup.points_mm[t[1]] - a, c = soup.points_mm[t[2]] - a,
                 d = near.point_mm - a;
      const double bb = dot(b, b), bc = dot(b, c), cc = dot(c, c), det = bb * cc - bc * bc;
      const double u = det > 0 ? (cc * dot(d, b) - bc * dot(d, c)) / det : 0,
                   w = det > 0 ? (bb * dot(d, c) - bc * dot(d, b)) / det : 0;
      s.share = {1 - u - w, u, w};
      const Vec3 normal = cross(b, c), to = s.at - near.point_mm;
      const double off = length(to), area = length(normal);
      s.out = area > 0 ? normal / area : Vec3{0, 0, 1};
      // Nearest to an edge or a corner: away from that. On the face it is along the normal, also where it lies on it to
      // rounding.
      if (near.feature != Feature::face && off > 1e-9 * v.shift) s.out = to * ((dot(to, s.out) < 0 ? -1 : 1) / off);
      s.left = s.out * -dot(to, s.out);
      const double scale = scale_ / v.weight[p];
      *out++ = cauchy(dot(s.left, s.out), width, s.slope) * scale;
      s.slope *= scale;
    }
  }
}

void SurfaceGoal::along(std::span<const Vec3> du, double* column, std::size_t stride) const {
  const std::vector<Vec3> by = moved(du);
  for (std::size_t k = 0; k < views_.size(); ++k) {
    for (std::size_t p = 0; p < views_[k].drawn.size(); ++p) {
      const Seen& s = seen_[seen_at_[k] + p];
      if (views_[k].markers()) {
        Vec3 x{};
        for (std::size_t c = 0; c < 4; ++c) x += du[s.corners[c]] * s.weights[c];
        for (std::size_t a = 0; a < 3; ++a, column += stride) *column = dot(s.by_left[a], x);
        continue;
      }
      const auto& t = surface_.triangles[s.triangle];
      *column = s.slope * dot(s.out, by[t[0]] * s.share[0] + by[t[1]] * s.share[1] + by[t[2]] * s.share[2]);
      column += stride;
    }
  }
}

void SurfaceGoal::by_own(double* first, std::size_t stride) const {
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const View& v = views_[k];
    for (std::size_t p = 0; p < v.drawn.size(); ++p) {
      const Seen& s = seen_[seen_at_[k] + p];
      for (std::size_t i = 0; i < 6; ++i) {
        Vec3 by{};
        if (i < 3) {
          by = cross(turn_by_[k][i], s.at - centre_[k]);
        } else {
          by[i - 3] = v.shift;
        }
        double* const cell = first + (v.first_row + p * (v.markers() ? 3 : 1)) * stride + 6 * k + i;
        if (v.markers()) {
          for (std::size_t a = 0; a < 3; ++a) cell[a * stride] = -dot(s.by_left[a], by);
        } else {
          *cell = -s.slope * dot(s.out, by);
        }
      }
    }
  }
}

std::vector<double> SurfaceGoal::squares() const {
  std::vector<double> all;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    for (std::size_t p = 0; p < views_[k].drawn.size(); ++p) {
      const Vec3 l = left(k, p) / views_[k].weight[p];
      all.push_back(dot(l, l) / (views_[k].markers() ? 3 : 1));
    }
  }
  return all;
}

void SurfaceGoal::widen_by_noise(std::span<const Vec3> shape) {
  // Where the surface moves: what is held is on its place whatever the factors are.
  const std::vector<Vec3> x = moved(shape), rest = moved(rest_);
  std::vector<double> by(x.size());
  double most = 0, sum = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    by[p] = length(x[p] - rest[p]);
    most = std::max(most, by[p]);
    sum += by[p] * by[p];
  }
  const double least = std::max(1e-4 * views_[0].shift, kMinNoise * std::sqrt(sum / static_cast<double>(x.size())));
  for (std::size_t k = 0; k < views_.size(); ++k) {
    View& v = views_[k];
    std::vector<double> off, anywhere;
    for (std::size_t p = 0; p < v.drawn.size(); ++p) {
      const Seen& s = seen_[seen_at_[k] + p];
      anywhere.push_back(length(s.left) / v.weight[p]);
      double here = 0;
      if (v.markers()) {
        for (std::size_t c = 0; c < 4; ++c) here = std::max(here, length(shape[s.corners[c]] - rest_[s.corners[c]]));
      } else {
        for (const std::uint32_t c : surface_.triangles[s.triangle]) here = std::max(here, by[c]);
      }
      if (here >= 0.1 * most) off.push_back(anywhere.back());
    }
    if (off.size() < 10) off = std::move(anywhere);
    v.sigma_mm = std::max(value_at_share(std::move(off), kTwoThirds) / (v.markers() ? kOfThree : 1), least);
    v.width_mm = kCauchy * v.sigma_mm * (v.markers() ? std::sqrt(3.0) : 1);
  }
}

void SurfaceGoal::align(std::span<const Vec3> shape, double* own) {
  if (!find_pose_) return;
  std::vector<double> r(rows_), j(rows_ * this->own());
  const auto width = static_cast<Eigen::Index>(this->own());
  for (int n = 0; n < 15; ++n) {
    residuals(shape, own, r.data());
    widen_by_noise(shape);
    residuals(shape, own, r.data());
    by_own(j.data(), this->own());
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> m(
        j.data(), static_cast<Eigen::Index>(rows_), width);
    const Eigen::Map<const Eigen::VectorXd> v(r.data(), static_cast<Eigen::Index>(rows_));
    Eigen::MatrixXd h = m.transpose() * m;
    // What a flat view leaves open stays.
    h.diagonal().array() += 1e-6 * h.trace() + 1e-300;
    const Eigen::VectorXd step = h.ldlt().solve(m.transpose() * v);
    for (Eigen::Index i = 0; i < width; ++i) own[i] -= std::clamp(step[i], -10.0, 10.0);
    if (step.norm() < 1e-4) break;
  }
  residuals(shape, own, r.data());
}

MeasuredError SurfaceGoal::error(std::size_t view, std::span<const Vec3> shape) const {
  MeasuredError e;
  const View& v = views_[view];
  std::vector<double> off;
  for (std::size_t p = 0; p < v.drawn.size(); ++p) off.push_back(length(left(view, p)));
  e.median_mm = value_at_share(off, 0.5);
  const double limit = kStray * value_at_share(off, kTwoThirds);
  double sum = 0, used = 0;
  for (const double d : off) {
    if (d > limit) continue;
    sum += d * d;
    ++used;
  }
  e.rms_mm = used > 0 ? std::sqrt(sum / used) : 0;
  const std::vector<Vec3> x = moved(shape), rest = moved(rest_);
  double by = 0;
  for (std::size_t p = 0; p < x.size(); ++p) by += dot(x[p] - rest[p], x[p] - rest[p]);
  e.moved_rms_mm = std::sqrt(by / static_cast<double>(x.size()));
  return e;
}

}  // namespace osteo::inline simulation::tissue
