// Small fixed vectors and matrices. World vectors are LPS millimetres unless a name says otherwise.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace osteo {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  constexpr double& operator[](std::size_t i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr double operator[](std::size_t i) const { return i == 0 ? x : i == 1 ? y : z; }
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(double s, Vec3 a) { return a * s; }
  friend constexpr Vec3 operator/(Vec3 a, double s) { return {a.x / s, a.y / s, a.z / s}; }
  Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  Vec3& operator-=(Vec3 b) { return *this = *this - b; }
  friend constexpr bool operator==(Vec3, Vec3) = default;
};

constexpr double dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) {
  return std::sqrt(dot(a, a));
}
/// The zero vector stays zero.
inline Vec3 normalized(Vec3 a) {
  const double n = length(a);
  return n > 0 ? a / n : Vec3{};
}
/// Some unit vector at right angles to the unit vector `a`.
inline Vec3 any_perpendicular(Vec3 a) {
  return normalized(std::abs(a.x) < 0.7 ? cross(a, Vec3{1, 0, 0}) : cross(a, Vec3{0, 1, 0}));
}

/// To and from records, which keep single precision.
inline std::array<float, 3> to_floats(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
inline Vec3 from_floats(const std::array<float, 3>& f) {
  return {static_cast<double>(f[0]), static_cast<double>(f[1]), static_cast<double>(f[2])};
}

/// Column vectors: for a direction matrix, column 0 is where the first index axis points.
struct Mat3 {
  std::array<Vec3, 3> column{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};

  friend constexpr Vec3 operator*(const Mat3& m, Vec3 v) {
    return m.column[0] * v.x + m.column[1] * v.y + m.column[2] * v.z;
  }
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;
};

constexpr double determinant(const Mat3& m) {
  return dot(m.column[0], cross(m.column[1], m.column[2]));
}
constexpr Mat3 transposed(const Mat3& m) {
  const auto& c = m.column;
  return {{Vec3{c[0].x, c[1].x, c[2].x}, Vec3{c[0].y, c[1].y, c[2].y}, Vec3{c[0].z, c[1].z, c[2].z}}};
}
/// The matrix must not be singular.
constexpr Mat3 inverse(const Mat3& m) {
  const double d = determinant(m);
  const auto& c = m.column;
  return transposed({{cross(c[1], c[2]) / d, cross(c[2], c[0]) / d, cross(c[0], c[1]) / d}});
}

}  // namespace osteo
