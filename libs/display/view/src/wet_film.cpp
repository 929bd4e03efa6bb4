#include "osteo/display/view/detail/wet_film.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace osteo::inline display {
namespace {

constexpr int kSteps = 16;  // of a film

}  // namespace

std::uint64_t WetFilm::key(int bi, int bj, int bk) {
  constexpr int kMiddle = 1 << 20;  // dust lies outside of the bone's box too
  return static_cast<std::uint64_t>(bi + kMiddle) << 42 | static_cast<std::uint64_t>(bj + kMiddle) << 21 |
         static_cast<std::uint64_t>(bk + kMiddle);
}

bool WetFilm::update(const Dust& dust) {
  bone_ = &dust.bone();
  frame_ = bone_->frame();
  Bricks now;
  Cells* cells = nullptr;
  std::uint64_t last = 0;
  dust.visit_liquid([&](Ijk c, double full, double) {
    const Ijk b{c.i >> 3, c.j >> 3, c.k >> 3};
    const std::uint64_t name = key(b.i, b.j, b.k);
    const auto wet = static_cast<std::uint8_t>(std::lround(kSteps * std::min(1.0, full / Dust::kFilm)));
    if (wet == 0) return;
    if (cells == nullptr || name != last) {
      auto& made = now[name];
      if (!made) made = std::make_unique<Cells>();
      cells = made.get();
      last = name;
    }
    (*cells)[BrickGrid::offset_in_brick(c.i, c.j, c.k)] = wet;
  });
  return take(std::move(now));
}

bool WetFilm::take(Bricks now) {
  std::vector<std::uint64_t> differ;
  for (const auto& [name, is] : now) {
    const auto was = bricks_.find(name);
    if (was == bricks_.end() || *was->second != *is) differ.push_back(name);
  }
  for (const auto& [name, was] : bricks_) {
    if (!now.contains(name)) differ.push_back(name);
  }
  bricks_ = std::move(now);
  if (differ.empty()) return false;
  changed_.clear();
  constexpr std::uint64_t kStepK = 1, kStepJ = 1ULL << 21, kStepI = 1ULL << 42;
  for (const std::uint64_t name : differ) {
    for (std::uint64_t i = 0; i < 3; ++i)
      for (std::uint64_t j = 0; j < 3; ++j)
        for (std::uint64_t k = 0; k < 3; ++k)
          changed_.insert(name + (i * kStepI + j * kStepJ + k * kStepK) - (kStepI + kStepJ + kStepK));
  }
  return true;
}

double WetFilm::at(Vec3 world_mm) const {
  if (bricks_.empty()) return 0;
  const Vec3 x = bone_->frame().index_from_world(world_mm);
  const int i0 = static_cast<int>(std::floor(x.x)), j0 = static_cast<int>(std::floor(x.y)),
            k0 = static_cast<int>(std::floor(x.z));
  const double f[3] = {x.x - i0, x.y - j0, x.z - k0};
  double wet = 0, all = 0;
  for (int c = 0; c < 8; ++c) {
    const int i = i0 + (c & 1), j = j0 + (c >> 1 & 1), k = k0 + (c >> 2);
    if (bone_->at(i, j, k) >= 0.5F) continue;  // no water is in bone
    const double w =
        ((c & 1) != 0 ? f[0] : 1 - f[0]) * ((c >> 1 & 1) != 0 ? f[1] : 1 - f[1]) * ((c >> 2) != 0 ? f[2] : 1 - f[2]);
    all += w;
    const auto brick = bricks_.find(key(i >> 3, j >> 3, k >> 3));
    if (brick != bricks_.end()) wet += w * (*brick->second)[BrickGrid::offset_in_brick(i, j, k)];
  }
  return all > 1e-6 ? wet / (kSteps * all) : 0;
}

bool WetFilm::changed_near(Vec3 world_mm) const {
  if (changed_.empty()) return false;
  const Vec3 x = frame_.index_from_world(world_mm);
  const auto brick = [](double v) { return static_cast<int>(std::floor(v + 0.5)) >> 3; };
  return changed_.contains(key(brick(x.x), brick(x.y), brick(x.z)));
}

}  // namespace osteo::inline display
