// D. Morris 2006, section 7.4.1: for each voxel the triangle nearest to its middle; in that voxel its plane is the
// surface.
#include <chrono>
#include <cmath>

#include "osteo/assessment/ground_truth/point_renderer.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline assessment::truth {
namespace {

class VoxelRenderer final : public PointRenderer {
 public:
  VoxelRenderer(const TriangleSoup& mesh, int n, double half, const RenderSettings& s, const Context& context)
      : n_(n), lo_(-half * s.unit), edge_(2 * half * s.unit / n), stiffness_(s.stiffness_n_per_mm / s.unit) {
    const auto begin = std::chrono::steady_clock::now();
    const TriangleTree tree(mesh, context);
    const auto across = static_cast<std::size_t>(n);
    voxels_.resize(across * across * across);
    parallel_for(across, 1, context.threads, [&](std::size_t from, std::size_t to) {
      for (std::size_t k = from; k < to; ++k) {
        std::uint32_t hint = ClosestPoint::kNone;
        for (std::size_t j = 0; j < across; ++j)
          for (std::size_t i = 0; i < across; ++i) {
            const auto middle = [&](std::size_t c) { return lo_ + (static_cast<double>(c) + 0.5) * edge_; };
            hint = tree.closest({middle(i), middle(j), middle(k)}, hint).triangle;
            const auto& t = mesh.triangles[hint];
            const Vec3 a = mesh.points_mm[t[0]];
            const Vec3 normal = normalized(cross(mesh.points_mm[t[1]] - a, mesh.points_mm[t[2]] - a));
            voxels_[(k * across + j) * across + i] = {to_floats(a), to_floats(normal)};
          }
      }
    });
    setup_s_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    memory_bytes_ = voxels_.size() * sizeof(Voxel);
    grain_mm_ = 2 * half / n;
  }
  void place(Vec3) override {}
  Rendered render(Vec3 device) override {
    Rendered r{{}, device, false, 1};
    std::size_t at = 0;
    for (const std::size_t axis : {2, 1, 0}) {
      const double c = std::floor((device[axis] - lo_) / edge_);
      if (!(c >= 0 && c < n_)) return r;
      at = at * static_cast<std::size_t>(n_) + static_cast<std::size_t>(c);
    }
    const Voxel& v = voxels_[at];
    const Vec3 normal = from_floats(v.normal);
    const double depth = dot(from_floats(v.point) - device, normal);
    if (depth <= 0) return r;
    r.contact = true;
    r.force_n = normal * (depth * stiffness_);
    r.contact_mm = device + normal * depth;
    return r;
  }

 private:
  struct Voxel {
    std::array<float, 3> point, normal;
  };
  int n_;
  double lo_, edge_, stiffness_;
  std::vector<Voxel> voxels_;
};

}  // namespace

std::unique_ptr<PointRenderer> make_voxel_renderer(const TriangleSoup& mesh, int voxels, double half,
                                                   const RenderSettings& settings, const Context& context) {
  return std::make_unique<VoxelRenderer>(mesh, voxels, half, settings, context);
}

}  // namespace osteo::inline assessment::truth
