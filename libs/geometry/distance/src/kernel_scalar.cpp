#include "kernel.h"

namespace osteo::inline geometry::distance {
namespace {

constexpr int kF = 1, kD = 1;

template <class T>
struct One {
  T v;
  static One load(const T* p) { return {*p}; }
  static One all(T x) { return {x}; }
  void store(T* p) const { *p = v; }
  friend One operator+(One a, One b) { return {a.v + b.v}; }
  friend One operator-(One a, One b) { return {a.v - b.v}; }
  friend One operator*(One a, One b) { return {a.v * b.v}; }
  friend One fma(One a, One b, One c) { return {a.v * b.v + c.v}; }
  friend One fnma(One a, One b, One c) { return {c.v - a.v * b.v}; }
  friend One min(One a, One b) { return {a.v < b.v ? a.v : b.v}; }
  friend One max(One a, One b) { return {a.v > b.v ? a.v : b.v}; }
  friend bool less(One a, One b) { return a.v < b.v; }
  friend bool at_least(One a, One b) { return a.v >= b.v; }
  friend bool at_most(One a, One b) { return a.v <= b.v; }
  friend One select(bool m, One a, One b) { return m ? a : b; }
};
using F = One<float>;
using D = One<double>;

inline bool both(bool a, bool b) {
  return a && b;
}
inline unsigned bits(bool m) {
  return m ? 1U : 0U;
}
inline F root(F a) {
  return {__builtin_sqrtf(a.v)};
}
inline F inverse_root(F a) {
  return {1 / __builtin_sqrtf(a.v)};
}
inline F absolute(F a) {
  return {__builtin_fabsf(a.v)};
}
inline float smallest(F a) {
  return a.v;
}
inline unsigned tail(int left) {
  return left > 0 ? 1U : 0U;
}
inline int compress(std::uint32_t* out, const std::uint32_t* ids, unsigned mask) {
  *out = *ids;
  return static_cast<int>(mask);
}
struct Lanes;
Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids);
inline void load_exact(const ExactTriangle* exact, const std::uint32_t* ids, D* f) {
  const auto* e = reinterpret_cast<const double*>(exact + *ids);
  for (int i = 0; i < 16; ++i) f[i] = {e[i]};
}

}  // namespace

#include "kernel_loops.h"

namespace {
Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids) {
  const auto* r = reinterpret_cast<const float*>(records + *ids);
  Lanes l;
  for (int i = 0; i < 16; ++i) l.f[i] = {r[i]};
  return l;
}
}  // namespace

const Kernel kScalar{filter, measure_voxels, measure_block, closest, collect};

}  // namespace osteo::inline geometry::distance
