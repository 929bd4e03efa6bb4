#include "mirror.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "edges.h"
#include "gaps.h"
#include "osteo/core/base/order.h"

namespace osteo::inline imaging::registration {
namespace {

RigidTransform reflection_at(Vec3 point_mm, Vec3 normal) {
  RigidTransform r;
  for (std::size_t c = 0; c < 3; ++c) r.rotation.column[c] -= normal * (2 * normal[c]);
  r.shift_mm = normal * (2 * dot(normal, point_mm));
  return r;
}

// A plane of symmetry of the first scan's body.
struct Plane {
  Vec3 at_mm, normal;
};

// Where the two motions are each other's mirror image. Nothing where they are not: one of them is wrong.
std::optional<Plane> plane_between(const RigidTransform& second_from_first, const RigidTransform& mirrored_from_first,
                                   const RigidTransform& reflection, Vec3 middle_mm) {
  const RigidTransform across = second_from_first.inverse() * reflection * mirrored_from_first;
  const auto& c = across.rotation.column;
  constexpr double kMinTrace = 0.9;  // 1 for a reflection; the rest turns by 18 degrees at the most
  if (c[0].x + c[1].y + c[2].z < kMinTrace) return std::nullopt;
  // Of 1 less a reflection every column lies along the normal; what turns besides goes out with its transpose.
  Mat3 m;
  const Mat3 back = transposed(across.rotation);
  for (std::size_t a = 0; a < 3; ++a) m.column[a] -= (c[a] + back.column[a]) / 2;
  Vec3 normal = m.column[0];
  for (std::size_t a = 1; a < 3; ++a)
    if (length(m.column[a]) > length(normal)) normal = m.column[a];
  for (int n = 0; n < 20; ++n) normal = normalized(m * normal);
  // A reflection moves along its normal alone.
  constexpr double kMostGlideMm = 20;
  const Vec3 moved = across(middle_mm) - middle_mm;
  if (length(moved - normal * dot(moved, normal)) > kMostGlideMm) return std::nullopt;
  return Plane{(middle_mm + across(middle_mm)) / 2, normal};
}

constexpr std::size_t kNuisance = 12, kField = 12, kUnknowns = kNuisance + kField;
using Row = std::array<double, kUnknowns>;

// What moves a place along its normal: a motion, an edge that lies further out, more so where it faces one way than
// where it faces another (thick slices); then a field of second degree that a mirror turns round, u(R x) = -R u(x).
Row row_of(Vec3 x, Vec3 n) {
  const Vec3 arm = cross(x, n);
  return {arm.x,
          arm.y,
          arm.z,
          n.x,
          n.y,
          n.z,
          1,
          n.x * n.x,
          n.y * n.y,
          n.x * n.y,
          n.x * n.z,
          n.y * n.z,
          n.x * x.y,
          n.x * x.z,
          n.x * x.x * x.x,
          n.x * x.y * x.y,
          n.x * x.z * x.z,
          n.x * x.y * x.z,
          n.y * x.x,
          n.z * x.x,
          n.y * x.x * x.y,
          n.y * x.x * x.z,
          n.z * x.x * x.y,
          n.z * x.x * x.z};
}

// Weighted least squares over the first `count` unknowns.
Row fitted(const std::vector<Row>& rows, const std::vector<double>& mm, const std::vector<double>& weight,
           std::size_t count) {
  std::array<std::array<double, kUnknowns + 1>, kUnknowns> m{};
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t i = 0; i < count; ++i) {
      const double w = weight[r] * rows[r][i];
      for (std::size_t j = 0; j < count; ++j) m[i][j] += w * rows[r][j];
      m[i][kUnknowns] += w * mm[r];
    }
  // What nothing determines stays as it is.
  for (std::size_t i = 0; i < count; ++i) m[i][i] += 1e-8 * m[i][i] + 1e-9;
  return solved(m, count);
}

std::vector<double> left_of(const std::vector<Row>& rows, const std::vector<double>& mm, const Row& x) {
  std::vector<double> left = mm;
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t i = 0; i < kUnknowns; ++i) left[r] -= rows[r][i] * x[i];
  return left;
}

// What the field explains beyond a motion and edges that lie further out, root mean square. Far edges count less
// (P. Huber, Robust estimation of a location parameter, Annals of Mathematical Statistics 1964).
double field_mm(const std::vector<Row>& rows, const std::vector<double>& mm) {
  std::vector<double> weight(rows.size(), 1.0), size(rows.size());
  for (int round = 0; round < 6; ++round) {
    const std::vector<double> left = left_of(rows, mm, fitted(rows, mm, weight, kUnknowns));
    for (std::size_t r = 0; r < left.size(); ++r) size[r] = std::abs(left[r]);
    const double far = std::max(3 * upper_median(size), 1e-3);
    for (std::size_t r = 0; r < left.size(); ++r) weight[r] = size[r] < far ? 1 : far / size[r];
  }
  const auto sum = [&](std::size_t count) {
    const std::vector<double> left = left_of(rows, mm, fitted(rows, mm, weight, count));
    double square = 0;
    for (std::size_t r = 0; r < left.size(); ++r) square += weight[r] * left[r] * left[r];
    return square;
  };
  double all = 0;
  for (const double w : weight) all += w;
  return std::sqrt(std::max(0.0, sum(kNuisance) - sum(kUnknowns)) / all);
}

}  // namespace

Mirrored in_a_mirror(const Image& image) {
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (std::abs(image.frame.direction.column[a].x) > std::abs(image.frame.direction.column[axis].x)) axis = a;
  const auto& d = image.frame.dims;
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < d[2]; ++k)
    for (int j = 0; j < d[1]; ++j)
      for (int i = 0; i < d[0]; ++i)
        v[at++] = image.at(axis == 0 ? d[0] - 1 - i : i, axis == 1 ? d[1] - 1 - j : j, axis == 2 ? d[2] - 1 - k : k);
  return {{image.frame, v}, reflection_at(image.frame.centre_mm(), image.frame.direction.column[axis])};
}

std::vector<RigidTransform> starts_from_mirror(const RigidTransform& other_from_first, const RigidTransform& reflection,
                                               Vec3 middle_mm) {
  constexpr double kStep = 0.18, kStepMm = 10;  // slopes of 10 degrees
  constexpr int kTurns = 3, kShifts = 9;
  const RigidTransform there = reflection * other_from_first;
  std::vector<RigidTransform> starts;
  for (int y = -kTurns; y <= kTurns; ++y)
    for (int z = -kTurns; z <= kTurns; ++z) {
      const Vec3 normal = normalized({1, y * kStep, z * kStep});
      for (int s = -kShifts; s <= kShifts; ++s)
        starts.push_back(there * reflection_at(middle_mm + normal * (s * kStepMm), normal));
    }
  return starts;
}

Unevenness unevenness(const Levels& first, const Levels& second, const RigidTransform& second_from_first,
                      const Levels& mirrored, const RigidTransform& mirrored_from_first,
                      const RigidTransform& reflection, const Context& context) {
  constexpr double kScaleMm = 60;
  constexpr std::size_t kMinPlaces = 300;
  const auto plane =
      plane_between(second_from_first, mirrored_from_first, reflection, first.levels.front().frame.centre_mm());
  if (!plane) return {};
  const Vec3 u = any_perpendicular(plane->normal), v = cross(plane->normal, u);
  const auto along = [&](Vec3 a) { return Vec3{dot(a, plane->normal), dot(a, u), dot(a, v)}; };
  std::vector<Vec3> at, normal;
  std::vector<double> straight, other;
  Vec3 middle;
  for (const TwoOffsets& o : offsets_of_two(first, second, second_from_first, mirrored, mirrored_from_first, context)) {
    if (!o.one_mm || !o.other_mm) continue;
    at.push_back(along(o.at_mm - plane->at_mm) / kScaleMm);
    normal.push_back(along(o.normal));
    middle += at.back();
    straight.push_back(*o.one_mm);
    other.push_back(*o.other_mm);
  }
  if (at.size() < kMinPlaces) return {};
  middle = middle / static_cast<double>(at.size());
  std::vector<Row> rows;
  // Along the plane from their middle; across it from the plane, which the field knows.
  for (std::size_t i = 0; i < at.size(); ++i) rows.push_back(row_of(at[i] - Vec3{0, middle.y, middle.z}, normal[i]));
  return {true, field_mm(rows, straight), field_mm(rows, other)};
}

}  // namespace osteo::inline imaging::registration
