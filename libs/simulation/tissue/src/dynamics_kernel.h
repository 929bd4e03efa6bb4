// The loops of TissueDynamics: compiled once for each instruction set.
#pragma once
#include <cstddef>
#include <cstdint>

namespace osteo::inline simulation::tissue {

/// Plain arrays; x, y, z apart. Elements in order, so that sums are the same whatever runs.
template <class Real>
struct Arrays {
  std::size_t points = 0, edges = 0, faces = 0;
  const Real *x = nullptr, *y = nullptr, *z = nullptr;
  Real *fx = nullptr, *fy = nullptr, *fz = nullptr;
  const std::uint32_t* edge = nullptr;                    // a, then b: two blocks of `edges`
  const Real *edge_k = nullptr, *edge_inverse = nullptr;  // k / rest, 1 / rest
  const std::uint32_t* face = nullptr;                    // three blocks
  const Real *face_k = nullptr, *face_inverse = nullptr;
  struct Voxels {
    std::size_t count = 0;
    const std::uint32_t* node = nullptr;  // eight blocks
    const Real *k = nullptr, *inverse = nullptr;
  } voxels[2];
  struct Volumes {
    std::size_t count = 0;
    const std::uint32_t* node = nullptr;  // four blocks
    const Real *k = nullptr, *inverse = nullptr;
  } tets;
};

template <class Real>
using ForceFunction = void (*)(const Arrays<Real>&);

#define OSTEO_TISSUE_ISA(name)                 \
  namespace name {                             \
  void forces_float(const Arrays<float>& a);   \
  void forces_double(const Arrays<double>& a); \
  }
OSTEO_TISSUE_ISA(base)
OSTEO_TISSUE_ISA(avx2)
OSTEO_TISSUE_ISA(avx512)
#undef OSTEO_TISSUE_ISA

}  // namespace osteo::inline simulation::tissue
