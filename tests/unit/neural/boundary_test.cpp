// The uncertainty of boundaries against widths that are known: of planes whose probability is a logistic curve.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/trust.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo {
namespace {

struct Plane {
  NetworkLogits logits;
  NetworkModel model;
  Labels labels;
};

// A structure below `z_mm` in an image of 0.5 x 1 x 0.8 mm, whose axes the network takes as y, x, z on a grid of
// 0.4 x 0.8 x 0.6 mm; its probability there falls as 1 / (1 + exp(d / w)), w as wide as `w_mm` says at that y.
template <class Width>
Plane plane(double z_mm, const Width& w_mm) {
  Plane p;
  Frame& f = p.labels.frame;
  f.dims = {16, 12, 18};
  f.spacing_mm = {0.5, 1, 0.8};
  const auto voxels = make_voxels<std::uint8_t>(f.voxel_count());
  for (int k = 0; k < 18; ++k) {
    for (int j = 0; j < 12; ++j) {
      for (int i = 0; i < 16; ++i)
        voxels[static_cast<std::size_t>((k * 12 + j) * 16 + i)] = (k + 0.5) * 0.8 < z_mm ? 1 : 0;
    }
  }
  p.labels.voxels = voxels;
  p.model.transpose = {1, 2, 0};  // of z, y, x: the network sees y, x, z
  p.model.values = {0, 1};
  p.model.names = {{1, "sinus"}};
  NetworkLogits& l = p.logits;
  l.cropped = {12, 16, 18};
  l.image_mm = {1, 0.5, 0.8};
  l.grid_mm = {0.4, 0.8, 0.6};
  l.size = {30, 10, 24};
  l.values.assign(std::size_t{2} * 30 * 10 * 24, half_from_double(0));
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 10; ++x) {
      for (int z = 0; z < 24; ++z) {
        const double w = w_mm((y + 0.5) * 0.4);
        l.values[static_cast<std::size_t>(7200 + (y * 10 + x) * 24 + z)] =
            half_from_double(std::clamp((z_mm - (z + 0.5) * 0.6) / w, -40.0, 40.0));
      }
    }
  }
  return p;
}

// States 0.3 mm where the width is at most `most`, and 1.2 where it is more by a hair.
NetworkCalibration step_at(double most) {
  NetworkCalibration c;
  c.structures = {{1, "sinus", 0, 1e6, 0, {{most, 0.3}, {most + 1e-6, 1.2}}}};
  return c;
}

TEST(NetworkBoundary, TheWidthIsThatOfTheProbability) {
  for (const double w : {0.3, 0.5, 0.8}) {
    const Plane p = plane(7.1, [&](double) { return w; });
    const double width = 2 * std::log(9.0) * w;  // from 0.9 to 0.1
    const auto above = boundary_uncertainty(p.labels, p.logits, p.model, step_at(width + 0.3), {}),
               below = boundary_uncertainty(p.labels, p.logits, p.model, step_at(width - 0.1), {});
    ASSERT_TRUE(above && below);
    // One layer of 12 x 16 voxels: the structure's last, and no voxel of the others.
    ASSERT_EQ(above->structures.size(), 1U);
    EXPECT_EQ(above->structures[0].voxels, (std::array<std::size_t, 4>{192, 0, 0, 0})) << w;
    EXPECT_EQ(below->structures[0].voxels, (std::array<std::size_t, 4>{0, 0, 192, 0})) << w;
    EXPECT_EQ(above->structures[0].within_mm, 0.3);
    EXPECT_EQ(below->structures[0].within_mm, 1.2);
    EXPECT_EQ(above->classes.at(3, 5, 8), 1);
    EXPECT_EQ(above->classes.at(3, 5, 7), 0);
    EXPECT_EQ(above->classes.at(3, 5, 9), 0);
  }
}

// A tenth of the boundary is wide: what 95 % of it keep is said, and where it is wide.
TEST(NetworkBoundary, IsToldByPlace) {
  const Plane p = plane(7.1, [](double y) { return y < 2.1 ? 2.0 : 0.3; });
  NetworkCalibration c = step_at(2.5);
  c.structures[0].boundary_mm = {{2.5, 0.5}, {4, 30}};
  const auto got = boundary_uncertainty(p.labels, p.logits, p.model, c, {});
  ASSERT_TRUE(got);
  EXPECT_EQ(got->structures[0].voxels, (std::array<std::size_t, 4>{0, 160, 0, 32}));
  EXPECT_EQ(got->structures[0].within_mm, std::numeric_limits<double>::infinity());
  EXPECT_EQ(got->classes.at(3, 0, 8), 4);
  EXPECT_EQ(got->classes.at(3, 1, 8), 4);
  EXPECT_EQ(got->classes.at(3, 3, 8), 2);
  ASSERT_EQ(got->classes.structures.size(), 4U);
  EXPECT_EQ(got->classes.structures[1].name, "boundary within 0.6 mm");
  EXPECT_EQ(got->classes.structures[3].name, "boundary uncertain by more than 1.2 mm");
}

// To a tenth of a millimetre, rounded up; never 0, which says that nothing is known.
TEST(NetworkBoundary, OfAStructureItIsToldInTenths) {
  const Plane p = plane(7.1, [](double y) { return y < 0.5 ? 2.0 : 0.3; });
  NetworkCalibration c = step_at(2.5);
  for (const auto& [mm, want] : {std::pair{0.0, 0.1}, {0.31, 0.4}, {0.9, 0.9}, {5.95, INFINITY}, {80.0, INFINITY}}) {
    c.structures[0].boundary_mm = {{2.5, mm}, {4, mm}};
    EXPECT_EQ(boundary_uncertainty(p.labels, p.logits, p.model, c, {})->structures[0].within_mm, want) << mm;
  }
}

TEST(NetworkBoundary, TemperatureWidensIt) {
  const Plane p = plane(7.1, [](double) { return 0.3; });
  NetworkCalibration c = step_at(2);  // 1.3 wide as it is, 2.6 with a temperature of 2
  EXPECT_EQ(boundary_uncertainty(p.labels, p.logits, p.model, c, {})->structures[0].within_mm, 0.3);
  c.temperature = 2;
  EXPECT_EQ(boundary_uncertainty(p.labels, p.logits, p.model, c, {})->structures[0].within_mm, 1.2);
}

TEST(NetworkBoundary, NothingIsSaidWhereNothingIsKnown) {
  Plane p = plane(7.1, [](double) { return 0.3; });
  NetworkCalibration c = step_at(2);
  c.structures[0].boundary_mm.clear();
  EXPECT_FALSE(boundary_uncertainty(p.labels, p.logits, p.model, c, {}));
  p.model.regions = true;
  EXPECT_FALSE(boundary_uncertainty(p.labels, p.logits, p.model, step_at(2), {}));
  p.model.regions = false;
  // A structure that has no voxel has no row; one whose probability is flat is as wide as can be.
  const Plane none = plane(-1, [](double) { return 0.3; });
  EXPECT_TRUE(boundary_uncertainty(none.labels, none.logits, none.model, step_at(2), {})->structures.empty());
  std::fill(p.logits.values.begin(), p.logits.values.end(), half_from_double(0));
  EXPECT_EQ(boundary_uncertainty(p.labels, p.logits, p.model, step_at(kWidestMm - 0.01), {})->structures[0].within_mm,
            1.2);
}

// Two stretches of one structure, of which one touches another structure's, a single voxel, and one of another class.
TEST(NetworkBoundary, UncertainPlacesAreListedByTheirSize) {
  Labels structures;
  structures.frame.dims = {12, 6, 5};
  structures.frame.spacing_mm = {0.5, 1, 2};
  structures.frame.origin_mm = {10, 20, 30};
  const std::size_t n = structures.frame.voxel_count();
  const auto labels = make_voxels<std::uint8_t>(n), classes = make_voxels<std::uint8_t>(n);
  std::fill_n(labels.get(), n, std::uint8_t{0});
  std::fill_n(classes.get(), n, std::uint8_t{0});
  const auto put = [&](int i, int j, int k, int structure, int of) {
    labels[structures.offset(i, j, k)] = static_cast<std::uint8_t>(structure);
    classes[structures.offset(i, j, k)] = static_cast<std::uint8_t>(of);
  };
  for (int i = 0; i < 5; ++i) put(i, i % 2, 1, 3, 4);  // by corners: one place
  for (int i = 0; i < 7; ++i) put(i, 2, 1, 7, 4);      // beside it, another structure's
  for (int i = 0; i < 4; ++i) put(11, i, 4, 3, 4);     // of the first again, far away
  for (int i = 0; i < 6; ++i) put(11, i, 0, 3, 3);     // less uncertain
  put(6, 5, 4, 3, 4);                                  // too small
  structures.voxels = labels;
  Labels uncertainty = no_uncertainty(structures.frame);
  uncertainty.voxels = classes;
  const auto places = uncertain_places(structures, uncertainty, 9);
  ASSERT_EQ(places.size(), 3U);
  EXPECT_EQ(places[0].structure, 7);
  EXPECT_EQ(places[0].voxels, 7U);
  EXPECT_LT(length(places[0].at_mm - Vec3{11.5, 22, 32}), 1e-9);
  EXPECT_EQ(places[1].structure, 3);
  EXPECT_EQ(places[1].voxels, 5U);
  EXPECT_EQ(places[2].voxels, 4U);
  EXPECT_EQ(uncertain_places(structures, uncertainty, 1).size(), 1U);
  uncertainty.frame.spacing_mm.x = 0.6;
  EXPECT_THROW(static_cast<void>(uncertain_places(structures, uncertainty, 9)), Error);
}

TEST(NetworkBoundary, SameForAnyNumberOfThreads) {
  const Plane p = plane(7.1, [](double y) { return 0.1 + y / 10; });
  std::vector<std::uint8_t> first;
  for (const int threads : {1, 2, 5}) {
    Context context;
    context.threads = threads;
    const auto got = boundary_uncertainty(p.labels, p.logits, p.model, step_at(2), context);
    const std::vector<std::uint8_t> classes(got->classes.span().begin(), got->classes.span().end());
    if (first.empty()) first = classes;
    EXPECT_EQ(classes, first) << threads;
  }
}

}  // namespace
}  // namespace osteo
