#include "edge_fit.h"

namespace osteo::inline session::planning {
namespace {

constexpr double kSampleMm = 0.2, kSmoothMm = 0.5, kMetalReachMm = 3, kFarFromMetalMm = 8;
constexpr int kHalf = 8;  // of the filter, in samples: 1.6 mm
constexpr int kBeyond = 12, kInsideFrom = -11, kInsideTo = -5, kStepFrom = 5, kStepTo = 8;  // from the edge, in samples

// Over a step, minus its height: the derivative of a Gaussian, scaled to a step of 1 that is not blurred otherwise.
const std::array<double, 2 * kHalf + 1>& filter() {
  static const auto weights = [] {
    std::array<double, 2 * kHalf + 1> w{};
    double step = 0;
    for (int k = -kHalf; k <= kHalf; ++k) {
      const double x = k * kSampleMm / kSmoothMm;
      w[static_cast<std::size_t>(k + kHalf)] = -x * std::exp(-x * x / 2);
      if (k < 0) step += w[static_cast<std::size_t>(k + kHalf)];
    }
    for (double& v : w) v /= step;
    return w;
  }();
  return weights;
}

}  // namespace

EdgeReader::EdgeReader(const Image& ct, double min_drop_hu, double metal_hu)
    : ct_(ct), min_drop_(min_drop_hu), metal_(metal_hu) {
  index_ = inverse(ct.frame.direction);
  for (Vec3& c : index_.column)
    c = {c.x / ct.frame.spacing_mm.x, c.y / ct.frame.spacing_mm.y, c.z / ct.frame.spacing_mm.z};
  shift_ = index_ * ct.frame.origin_mm * -1;
  find_metal();
  find_spline();
}

void EdgeReader::find_metal() {
  const auto& f = ct_.frame;
  std::array<int, 3> reach{};
  std::array<double, 3> mm{};
  for (std::size_t a = 0; a < 3; ++a) {
    cell_[a] = std::max(1, static_cast<int>(std::lround(1 / f.spacing_mm[a])));
    cells_[a] = (f.dims[a] + cell_[a] - 1) / cell_[a];
    mm[a] = cell_[a] * f.spacing_mm[a];
    reach[a] = static_cast<int>(kFarFromMetalMm / mm[a]) + 1;
  }
  const auto cell = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(cells_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(cells_[0]) +
           static_cast<std::size_t>(i);
  };
  std::vector<std::array<int, 3>> found;
  std::vector<bool> bright(cell(0, 0, cells_[2]));
  std::size_t n = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++n) {
        if (!(ct_.voxels[n] > metal_)) continue;
        const std::array<int, 3> c{i / cell_[0], j / cell_[1], k / cell_[2]};
        if (bright[cell(c[0], c[1], c[2])]) continue;
        bright[cell(c[0], c[1], c[2])] = true;
        found.push_back(c);
      }
    }
  }
  if (found.empty()) return;
  to_metal_.assign(bright.size(), 255);
  for (const auto& c : found) {
    for (int k = std::max(0, c[2] - reach[2]); k <= std::min(cells_[2] - 1, c[2] + reach[2]); ++k) {
      for (int j = std::max(0, c[1] - reach[1]); j <= std::min(cells_[1] - 1, c[1] + reach[1]); ++j) {
        for (int i = std::max(0, c[0] - reach[0]); i <= std::min(cells_[0] - 1, c[0] + reach[0]); ++i) {
          const double x = (i - c[0]) * mm[0], y = (j - c[1]) * mm[1], z = (k - c[2]) * mm[2];
          std::uint8_t& least = to_metal_[cell(i, j, k)];
          least = std::min(least, static_cast<std::uint8_t>(std::sqrt(x * x + y * y + z * z)));
        }
      }
    }
  }
}

double EdgeReader::metal_mm(Vec3 point) const {
  const Vec3 i = index_ * point + shift_;
  std::size_t at = 0;
  for (std::size_t a = 3; a-- > 0;) {
    if (to_metal_.empty() || !(i[a] >= 0 && i[a] <= ct_.frame.dims[a] - 1))
      return std::numeric_limits<double>::infinity();
    at = at * static_cast<std::size_t>(cells_[a]) + static_cast<std::size_t>(static_cast<int>(i[a]) / cell_[a]);
  }
  const std::uint8_t mm = to_metal_[at];
  return mm > kFarFromMetalMm ? std::numeric_limits<double>::infinity() : mm;
}

std::optional<Vec3> EdgeReader::index_of(Vec3 point) const {
  const Vec3 i = index_ * point + shift_;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(i[a] >= 0 && i[a] <= ct_.frame.dims[a] - 1)) return std::nullopt;
  return i;
}

std::optional<double> EdgeReader::value(Vec3 point) const {
  const auto i = index_of(point);
  return i ? std::optional(sample_linear(ct_, *i)) : std::nullopt;
}

// A cubic B-spline through the voxels. Along straight lines between them, an edge lies where its phase in the grid has
// it: on slices of 1 mm a shaft was turned about itself by 0.4 degrees without any noise. Cubic convolution needs no
// coefficients, but leaves 1.3 to 3 times as much of that error.
void EdgeReader::find_spline() {
  constexpr double kPole = -0.26794919243112270647;  // root of 3, less 2
  constexpr std::size_t kFades = 16;                 // its power is below a millionth of a millionth of 10^4 HU
  const auto voxels = ct_.span();
  spline_.assign(voxels.begin(), voxels.end());
  std::size_t stride = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto count = static_cast<std::size_t>(ct_.frame.dims[a]), block = stride * count;
    for (std::size_t from = 0; count > 1 && from < spline_.size(); from += block) {
      float* const v = spline_.data() + from;
      const auto add = [&](std::size_t to, std::size_t of, double share, double all) {
        for (std::size_t n = 0; n < stride; ++n)
          v[to * stride + n] = static_cast<float>(
              all * (static_cast<double>(v[to * stride + n]) + share * static_cast<double>(v[of * stride + n])));
      };
      double power = kPole;
      for (std::size_t k = 1; k < std::min(count, kFades); ++k, power *= kPole) add(0, k, power, 1);
      for (std::size_t k = 1; k < count; ++k) add(k, k - 1, kPole, 1);
      add(count - 1, count - 2, kPole, 6 * kPole / (kPole * kPole - 1));
      // -6 z (c - d / 6) is what it is with coefficients that are scaled already.
      for (std::size_t k = count - 1; k-- > 0;) add(k, k + 1, -1.0 / 6, -6 * kPole);
    }
    stride = block;
  }
}

double EdgeReader::spline(Vec3 index) const {
  std::array<std::array<std::size_t, 4>, 3> at{};
  std::array<std::array<double, 4>, 3> weight{};
  for (std::size_t a = 0; a < 3; ++a) {
    const int last = ct_.frame.dims[a] - 1, below = static_cast<int>(index[a]);
    const double t = index[a] - below, u = 1 - t;
    weight[a] = {u * u * u / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * u * u + 3 * u * u * u) / 6,
                 t * t * t / 6};
    for (int n = 0; n < 4; ++n) {  // mirrored at the ends
      const int k = std::abs(below + n - 1);
      at[a][static_cast<std::size_t>(n)] = static_cast<std::size_t>(std::max(0, k > last ? 2 * last - k : k));
    }
  }
  const auto columns = static_cast<std::size_t>(ct_.frame.dims[0]), rows = static_cast<std::size_t>(ct_.frame.dims[1]);
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 4; ++j) {
      const float* const row = spline_.data() + (at[2][k] * rows + at[1][j]) * columns;
      double along = 0;
      for (std::size_t i = 0; i < 4; ++i) along += weight[0][i] * static_cast<double>(row[at[0][i]]);
      sum += weight[2][k] * weight[1][j] * along;
    }
  }
  return sum;
}

double EdgeReader::blur_mm(double step_hu, double drop_hu) {
  return kSmoothMm * std::max(1.0, step_hu / drop_hu);
}

std::optional<EdgeReader::Edge> EdgeReader::along(Vec3 point, Vec3 direction, double reach_mm) const {
  const int reach = static_cast<int>(std::ceil(reach_mm / kSampleMm)),
            metal = static_cast<int>(kMetalReachMm / kSampleMm);
  const int ends = std::max(reach + kHalf + kBeyond, metal);
  std::vector<double> profile;
  profile.reserve(static_cast<std::size_t>(2 * ends + 1));
  for (int k = -ends; k <= ends; ++k) {
    const auto i = index_of(point + direction * (k * kSampleMm));
    if (!i) return std::nullopt;
    profile.push_back(spline(*i));
    if (std::abs(k) <= metal && profile.back() > metal_) return std::nullopt;
  }
  const auto drop = [&](int at) {
    double sum = 0;
    for (int k = -kHalf; k <= kHalf; ++k)
      sum += filter()[static_cast<std::size_t>(k + kHalf)] * profile[static_cast<std::size_t>(at + k + ends)];
    return sum;
  };
  int best = 0;
  double most = min_drop_;
  for (int k = -reach; k <= reach; ++k) {
    const double d = drop(k);
    if (!(d > most)) continue;
    most = d;
    best = k;
  }
  if (most <= min_drop_ || std::abs(best) == reach) return std::nullopt;
  const double before = drop(best - 1), after = drop(best + 1), bend = before - 2 * most + after;
  if (bend >= 0) return std::nullopt;
  Edge out{(best + (before - after) / (2 * bend)) * kSampleMm, most, 0, 0, 0, 0};
  const auto at = [&](int k) { return profile[static_cast<std::size_t>(best + k + ends)]; };
  for (int k = 1; k <= kBeyond; ++k) out.rise_hu = std::max(out.rise_hu, -drop(best + k));
  for (int k = kStepFrom; k <= kStepTo; ++k) out.step_hu += (at(-k) - at(k)) / (kStepTo - kStepFrom + 1);
  for (int k = kStepFrom; k <= kBeyond; ++k) out.beyond_hu += at(k) / (kBeyond - kStepFrom + 1);
  double slope = 0, squares = 0;
  for (int k = kInsideFrom; k <= kInsideTo; ++k) {
    const double x = (k - 0.5 * (kInsideFrom + kInsideTo)) * kSampleMm;
    slope += x * (at(k) - at(k - kInsideFrom + kStepFrom));
    squares += x * x;
  }
  out.pulled = slope / squares * kSmoothMm / most;  // A is the drop times the blur over the filter's part of it
  return out;
}

}  // namespace osteo::inline session::planning
