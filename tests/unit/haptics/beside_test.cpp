// Contact that is felt while another thread changes the bone: a trainee's hand in a copy of the instructor's session.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

#include "osteo/simulation/haptics/renderer.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr float kLess = 0.25F, kMore = 1;

// Each density is old or new, whichever instruction reads it, and is read once: what is felt lies between what all
// densities at their least and at their most give. Under the thread sanitizer each read that is none by itself is told.
TEST(Beside, DensitiesAreReadWhileTheyAreWritten) {
  const auto box = [](Vec3 p) { return p.z < 0; };
  DeviceSample pose;
  pose.position_mm = {0.1F, 0.05F, 0.5F};
  pose.axis = {0.6F, 0, 0.8F};  // the shaft is near bone too
  pose.tool = 3;
  const std::size_t methods = EnumNames<ContactMethod>::values.size();
  for (std::size_t m = 0; m < methods; ++m) {
    const auto method = static_cast<ContactMethod>(m);
    auto bone = test::solid(0.4, 6, box, {}, 2);
    std::vector<VoxelKey> voxels;
    for (std::uint32_t v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v)
      if (bone.value(v) > 0) voxels.push_back(v);
    const auto fill = [&](float density) {
      for (const VoxelKey v : voxels) bone.set(v, density);
    };
    HapticSetup setup;
    setup.params.contact.method = method;
    setup.params.effects.held_shaft = true;
    const auto felt = [&] {
      HapticRenderer renderer(setup, bone, {}, 1e-3);
      static_cast<void>(renderer.step(pose));
      return renderer.contact().bone_mm3;
    };
    fill(kLess);
    const double least = felt();
    fill(kMore);
    const double most = felt();
    HapticRenderer renderer(setup, bone, {}, 1e-3);
    std::atomic<bool> stop{false};
    std::thread writer([&] {
      while (!stop) {
        fill(kLess);
        fill(kMore);
      }
    });
    for (int t = 0; t < 200; ++t) {
      static_cast<void>(renderer.step(pose));
      const double now = renderer.contact().bone_mm3;
      EXPECT_TRUE(std::isfinite(now));
      if (method == ContactMethod::proxy) continue;  // it keeps farther off where there is more bone
      EXPECT_GE(now, least * (1 - 1e-6)) << m;
      EXPECT_LE(now, most * (1 + 1e-6)) << m;
    }
    stop = true;
    writer.join();
  }
}

// Two densities at a time are read by one instruction, which wants its place: rows of each brick begin at multiples of
// eight bytes, however the brick came to be.
TEST(Beside, RowsOfABrickBeginAtMultiplesOfEightBytes) {
  const auto even = [](const BrickGrid& g) {
    for (std::uint32_t b = 0; b < g.brick_count(); ++b)
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(g.values_of_brick(b)) % 8, 0U) << b;
  };
  BrickGrid made = test::solid(
      0.5, 6, [](Vec3 p) { return p.z < 0; }, {}, 2);
  even(made);
  const BrickGrid copied = made;
  even(copied);
  BrickGrid shared = made.sharing();
  shared.own_brick(1);
  shared.empty_bricks(std::array{std::uint32_t{0}, std::uint32_t{2}});
  even(shared);
}

}  // namespace
}  // namespace osteo
