// The cavity by words of bits against distance transforms and a flood, cell by cell; bone on a lattice over the seam of
// a region.
#include "cavity.h"

#include <gtest/gtest.h>

#include <random>

#include "osteo/geometry/distance/binary_distance.h"
#include "scene.h"

namespace osteo {
namespace {

using Bytes = std::vector<std::uint8_t>;

Frame lattice(std::array<int, 3> dims, double h) {
  Frame f;
  f.dims = dims;
  f.spacing_mm = {h, h, h};
  return f;
}

TEST(Cavity, GrownIsADistanceTransformAgainstAThreshold) {
  std::mt19937 random(3);
  for (const std::array<int, 3> dims : {std::array{70, 13, 11}, std::array{64, 9, 8}, std::array{129, 5, 6}}) {
    const Frame f = lattice(dims, 1);
    Bytes mask(f.voxel_count());
    for (std::uint8_t& v : mask) v = random() % 97 == 0 ? 1 : 0;
    mask.front() = mask.back() = 1;
    const std::vector<float> d2 = squared_distance_mm2(mask, f, 1);
    for (const int most2 : {0, 1, 2, 5, 6, 16, 69}) {
      Bytes near(mask.size());
      for (std::size_t c = 0; c < near.size(); ++c) near[c] = d2[c] <= static_cast<float>(most2) ? 1 : 0;
      EXPECT_EQ(grown(BitMask(dims, mask), most2, {}).bytes(), near) << most2;
    }
  }
}

// From cell to cell by faces.
void flood(const Frame& f, std::vector<std::size_t> queue, const std::function<bool(std::size_t)>& enter) {
  const auto nx = static_cast<std::size_t>(f.dims[0]), nxy = nx * static_cast<std::size_t>(f.dims[1]);
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const std::size_t c = queue[q], i = c % nx, j = c % nxy / nx, k = c / nxy;
    const auto visit = [&](bool there, std::size_t to) {
      if (there && enter(to)) queue.push_back(to);
    };
    visit(i > 0, c - 1);
    visit(i + 1 < nx, c + 1);
    visit(j > 0, c - nx);
    visit(j + 1 < static_cast<std::size_t>(f.dims[1]), c + nx);
    visit(k > 0, c - nxy);
    visit(k + 1 < static_cast<std::size_t>(f.dims[2]), c + nxy);
  }
}

// As its definition says, on distances of every cell.
Bytes by_distances(const Bytes& solid, const Bytes& gone, const Bytes& closed, const Frame& f) {
  const double h = f.spacing_mm.x, room = 0.5 + h / 2;
  const std::size_t n = f.voxel_count();
  const auto to_solid = squared_distance_mm2(solid, f, 1), to_gone = squared_distance_mm2(gone, f, 1);
  const auto fits = [&](std::size_t c) { return to_solid[c] >= static_cast<float>(room * room * (1 - 1e-6)); };
  const auto at_face = [&](std::size_t c) {
    const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]),
               nz = static_cast<std::size_t>(f.dims[2]);
    const std::size_t i = c % nx, j = c / nx % ny, k = c / (nx * ny);
    return i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1;
  };
  Bytes outside(n, 0), inside(n, 0);
  const auto enter_outside = [&](std::size_t c) {
    if (outside[c] != 0 || !fits(c) || gone[c] != 0 || closed[c] != 0) return false;
    outside[c] = 1;
    return true;
  };
  std::vector<std::size_t> seeds;
  for (std::size_t c = 0; c < n; ++c) {
    if (at_face(c) && enter_outside(c)) seeds.push_back(c);
  }
  flood(f, seeds, enter_outside);
  const auto enter_inside = [&](std::size_t c) {
    if (inside[c] != 0 || outside[c] != 0 || !fits(c) || to_gone[c] > 4) return false;
    inside[c] = 1;
    return true;
  };
  const auto beside_outside = squared_distance_mm2(outside, f, 1);
  seeds.clear();
  for (std::size_t c = 0; c < n; ++c) {
    if (gone[c] != 0 && (at_face(c) || beside_outside[c] <= static_cast<float>(h * h * 1.001)) && enter_inside(c))
      seeds.push_back(c);
  }
  flood(f, seeds, enter_inside);
  const auto swept = squared_distance_mm2(inside, f, 1);
  const auto most = static_cast<float>(room * room * (1 + 1e-6));
  Bytes cavity(n, 0);
  for (std::size_t c = 0; c < n; ++c) {
    const bool was_outside = gone[c] == 0 && closed[c] == 0 && beside_outside[c] < most;
    cavity[c] = swept[c] < most && solid[c] == 0 && !was_outside ? 1 : 0;
  }
  return cavity;
}

// Bone with pores of many sizes, some of them spaces that are to be opened, and ways drilled through it.
TEST(Cavity, IsThatOfDistancesAndAFloodCellByCell) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  std::size_t reached = 0;
  Context one_thread;
  one_thread.threads = 1;
  for (const double h : {0.5, 0.4, 0.25}) {
    for (int round = 0; round < 4; ++round) {
      const Frame f = lattice({70, 34, 30}, h);
      const std::size_t n = f.voxel_count();
      Bytes before(n, 0), after(n, 0), closed(n, 0);
      struct Ball {
        Vec3 at;
        double r;
      };
      std::vector<Ball> pores, holes;
      for (int p = 0; p < 60; ++p)
        pores.push_back({{u(random) * 70, u(random) * 34, 4 + u(random) * 24}, 1.5 + 4 * u(random)});
      for (int p = 0; p < 5; ++p)
        holes.push_back({{u(random) * 70, u(random) * 34, 6 + u(random) * 20}, 3 + 4 * u(random)});
      for (std::size_t c = 0; c < n; ++c) {
        const Vec3 x{double(c % 70), double(c / 70 % 34), double(c / (70 * 34))};
        const auto in = [&](const std::vector<Ball>& balls) {
          for (std::size_t b = 0; b < balls.size(); ++b) {
            if (length(x - balls[b].at) < balls[b].r) return static_cast<int>(b) + 1;
          }
          return 0;
        };
        const int pore = in(pores);
        before[c] = pore == 0 && x.z > 4 ? 1 : 0;
        closed[c] = pore != 0 && pore % 2 == 0 ? 1 : 0;
        // Some of the balls are open to the face above, as a burr leaves them.
        bool drilled = false;
        for (const Ball& b : holes) drilled = drilled || (std::hypot(x.x - b.at.x, x.y - b.at.y) < b.r && x.z < b.at.z);
        after[c] = before[c] != 0 && !drilled ? 1 : 0;
      }
      Bytes gone(n);
      for (std::size_t c = 0; c < n; ++c) gone[c] = before[c] != 0 && after[c] == 0 ? 1 : 0;
      const auto bits = [&](const Bytes& b) { return BitMask(f.dims, b); };
      const Bytes cavity = cavity_of(bits(after), bits(gone), bits(closed), h, 0.5, 2, {}).bytes();
      EXPECT_EQ(cavity, by_distances(after, gone, closed, f)) << h << ' ' << round;
      EXPECT_EQ(cavity, cavity_of(bits(after), bits(gone), bits(closed), h, 0.5, 2, one_thread).bytes());
      reached += static_cast<std::size_t>(std::count(cavity.begin(), cavity.end(), 1));
    }
  }
  EXPECT_GT(reached, 1000U);  // and not because nothing was reached
}

// Bone of density 0.7 with a finer region in it: no crack where they meet.
TEST(Cavity, BoneHasNoSeamWhereARegionMeetsTheRest) {
  Frame coarse;
  coarse.dims = {32, 32, 32};
  coarse.spacing_mm = {0.5, 0.5, 0.5};
  Frame fine = coarse;
  fine.dims = {40, 40, 40};
  fine.spacing_mm = {0.2, 0.2, 0.2};
  const Vec3 corner = coarse.world_from_index({7.5, 7.5, 7.5});
  fine.origin_mm = corner + Vec3{0.1, 0.1, 0.1};
  const auto all = [](double h) { return [h](Vec3) { return 0.2 * h; }; };  // a density of 0.7
  World world(test::soft_solid(coarse, all(0.5)));
  world.add_region(test::soft_solid(fine, all(0.2)));
  Frame l = fine;
  l.dims = {60, 60, 60};
  l.origin_mm = corner - Vec3{2, 2, 2};
  EXPECT_EQ(solid_cells(world, l, {}).count(), l.voxel_count());
}

}  // namespace
}  // namespace osteo
