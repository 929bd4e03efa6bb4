// Component haptics: a burr that is pressed into a block of bone feels it, and takes it away while it turns.
#include <cstdio>

#include "osteo/simulation/haptics/renderer.h"

int main() {
  osteo::Frame frame{.dims = {40, 40, 40}, .spacing_mm = {0.5, 0.5, 0.5}};
  std::vector<osteo::Ijk> bricks;  // of 8 x 8 x 8 voxels
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i) bricks.push_back({i, j, k});
  osteo::BrickGrid bone(frame, bricks);
  for (int n = 0; n < 40 * 40 * 20; ++n) bone.set(bone.find(n % 40, n / 40 % 40, n / 1600), 1);  // the lower half
  osteo::HapticRenderer renderer(osteo::HapticSetup{}, bone, {}, 1e-3);
  osteo::DeviceSample hand{};
  hand.axis = {0, 0, 1};
  hand.tool = 3;
  hand.position_mm = {10, 10, 11.5F};
  float push_n = 0;
  for (int tick = 0; tick < 100; ++tick) push_n = renderer.step(hand).record.force_n[2];
  hand.pedal = 255;
  const double before = bone.sum();
  for (int tick = 0; tick < 1000; ++tick) renderer.step(hand);
  std::printf("%.2f N, then %.1f mm3 taken away\n", push_n, (before - bone.sum()) * frame.voxel_volume_mm3());
  return push_n > 0.1F && bone.sum() < before ? 0 : 1;
}
