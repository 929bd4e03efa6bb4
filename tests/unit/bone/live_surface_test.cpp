// The live surface through very many edits: closed and manifold after each one, and equal to a rebuild.
#include "osteo/simulation/bone/live_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <unordered_map>

#include "osteo/geometry/mesh/mesh_info.h"

namespace osteo {
namespace {

// Uses of each directed edge over all patches, kept up to date patch by patch: closed, oriented and edge-manifold means
// that each is used once, and its reverse once.
class Edges {
 public:
  void take_in(const SurfacePatch& patch, int sign) {
    for (const auto& t : patch.triangles) {
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint64_t a = patch.vertices[t[e]].key, b = patch.vertices[t[(e + 1) % 3]].key;
        change(a, b, sign);
      }
    }
  }
  [[nodiscard]] std::int64_t wrong() const { return wrong_; }
  [[nodiscard]] std::size_t size() const { return uses_.size(); }

 private:
  struct Key {
    std::uint64_t a, b;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Key& k) const {
      return k.a * 0x9e3779b97f4a7c15ULL ^ (k.b * 0xc2b2ae3d27d4eb4fULL >> 7);
    }
  };
  void change(std::uint64_t a, std::uint64_t b, int sign) {
    // Both directions in one entry.
    const bool forward = a < b;
    auto& n = uses_[forward ? Key{a, b} : Key{b, a}];
    wrong_ -= bad(n);
    n[forward ? 0 : 1] += sign;
    wrong_ += bad(n);
    if (n[0] == 0 && n[1] == 0) uses_.erase(forward ? Key{a, b} : Key{b, a});
  }
  static int bad(const std::array<int, 2>& n) { return (n[0] == 0 && n[1] == 0) || (n[0] == 1 && n[1] == 1) ? 0 : 1; }

  std::unordered_map<Key, std::array<int, 2>, Hash> uses_;
  std::int64_t wrong_ = 0;
};

// A hundred thousand here; OSTEO_EDITS=1e6 asks for more.
TEST(LiveSurface, ClosedManifoldAndEqualToARebuildAfterEveryEdit) {
  const char* const wish = std::getenv("OSTEO_EDITS");
  const auto edits = static_cast<long>(wish != nullptr ? std::atof(wish) : 1e5);
  Frame f;
  f.dims = {16, 16, 16};
  f.spacing_mm = {0.5, 0.5, 0.5};
  BrickGrid bone = BrickGrid::dense(f);
  std::mt19937 random(1);
  constexpr float kValues[] = {0, 0, 0.2F, 0.499F, 0.5F, 0.8F, 1, 1};
  LiveSurface live(bone, {});
  Edges edges;
  for (std::uint32_t b = 0; b < 8; ++b) edges.take_in(live.patch(b), 1);
  std::vector<SurfacePatch> before(8);
  for (std::uint32_t b = 0; b < 8; ++b) before[b] = live.patch(b);
  std::size_t most = 0;
  for (long e = 0; e < edits; ++e) {
    // Now dense, now sparse, now half of it: bridges, diagonals, holes and touching corners of every kind.
    const auto lean = static_cast<std::uint32_t>(e / 5000 % 3);
    // Six voxels across, where eight bricks meet; now and then anywhere, the borders of the grid too.
    const auto near = [&] { return static_cast<int>(random() % 6) + 5; };
    const int i = near(), j = near(), k = near();
    const VoxelKey v = e % 64 == 63 ? static_cast<VoxelKey>(random() % (8 * 512)) : bone.find(i, j, k);
    const auto pick = random() % 8;
    bone.set(v, kValues[lean == 0   ? pick
                        : lean == 1 ? std::max<std::uint32_t>(pick, 3)
                                    : std::min<std::uint32_t>(pick, 5)]);
    live.mark(v);
    for (const std::uint32_t b : live.update()) {
      edges.take_in(before[b], -1);
      before[b] = live.patch(b);
      edges.take_in(before[b], 1);
    }
    ASSERT_EQ(edges.wrong(), 0) << "after edit " << e;
    most = std::max(most, edges.size());
    if (e % 20000 == 19999) {
      const BoneSurface joined = live.joined(), rebuilt = surface_nets(bone);
      ASSERT_EQ(surface_hash(joined.mesh), surface_hash(rebuilt.mesh)) << "after edit " << e;
      const MeshCheck c = check(joined.mesh);
      ASSERT_TRUE(c.watertight() && c.manifold()) << "after edit " << e;
    }
  }
  EXPECT_GT(most, 1000u);
  // All of it removed, voxel by voxel: nothing is left.
  for (VoxelKey v = 0; v < 8 * 512; ++v) {
    bone.set(v, 0);
    live.mark(v);
  }
  live.update();
  EXPECT_TRUE(live.joined().mesh.triangles.empty());
}

}  // namespace
}  // namespace osteo
