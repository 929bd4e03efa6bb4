// Which triangles can be seen from where the camera rests.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace osteo::inline display {

/// A mesh as the picture shows it. Nothing is owned.
struct VisibleMesh {
  std::span<const float> points_mm;         ///< x, y, z each
  std::span<const int> triangles;           ///< three points each, counter-clockwise seen from outside
  std::array<double, 16> clip_from_mesh{};  ///< rows; OpenGL's clip space
};

/// For each mesh the triangles that win a pixel of a picture of that size, or come near to it: what is behind others or
/// turned away is left out, nothing that can be seen is (but for triangles thinner than a pixel at the edge of others).
/// Two passes of a depth buffer without a graphics card, 0.1 us a triangle. Deterministic.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> visible_triangles(std::span<const VisibleMesh> meshes, int width,
                                                                        int height);

}  // namespace osteo::inline display
