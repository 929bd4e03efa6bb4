// How often surfaces wind around places behind their triangles, by rays, beside the sum of all solid angles.
#include "winding_at.h"

#include <gtest/gtest.h>

#include <random>

#include "meshes.h"
#include "osteo/geometry/distance/voxelize.h"

namespace osteo {
namespace {

using test::box, test::joined, test::moved, test::sphere, test::turned;

std::vector<Layer> layers_of(const TriangleSoup& soup) {
  std::vector<Layer> layers;
  for (const auto& t : soup.triangles) layers.push_back({t, 1});
  return layers;
}

std::vector<PlaceOn> place_on_each(const TriangleSoup& soup) {
  std::vector<PlaceOn> places;
  for (std::uint32_t i = 0; i < soup.triangles.size(); ++i) {
    const auto& t = soup.triangles[i];
    places.push_back({i, soup.points_mm[t[0]] * 0.37 + soup.points_mm[t[1]] * 0.33 + soup.points_mm[t[2]] * 0.30});
  }
  return places;
}

// On a triangle itself the sum is half-way between what is behind and what is before it.
int sum_behind(const TriangleSoup& soup, PlaceOn place) {
  TriangleSoup others = soup;
  others.triangles.erase(others.triangles.begin() + place.layer);
  return static_cast<int>(std::lround(winding_number(others, place.at) + 0.5));
}

TEST(WindingAt, IsTheSumOfSolidAngles) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-1, 1);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    TriangleSoup all;
    for (int body = 0; body < 12; ++body) {
      const Vec3 at{6 * share(random), 6 * share(random), 6 * share(random)};
      TriangleSoup one =
          body % 3 == 0 ? box(at, at + Vec3{4 + share(random), 3, 0.01}) : sphere(3 + share(random), 1, at);
      if (body % 3 == 2) {  // in no plane and along no edge of another
        for (Vec3& p : one.points_mm) p = {p.x + 0.31 * p.y, p.y - 0.17 * p.z, p.z + 0.23 * p.x};
      }
      all = joined(all, body % 4 == 3 ? turned(one) : one);
    }
    all = moved(all, scale, Vec3{0.3, -2, 5} * scale);
    const std::vector<PlaceOn> places = place_on_each(all);
    const auto behind = windings_behind(all.points_mm, layers_of(all), places, {});
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_TRUE(behind[i].has_value()) << i;
      ASSERT_EQ(*behind[i], sum_behind(all, places[i])) << i;
    }
  }
}

TEST(WindingAt, GivesNoAnswerWhereFacesLieOnEachOther) {
  // The lid of the lower box lies within the floor of the upper one: whether a place is before or behind the other face
  // is a matter of rounding.
  const TriangleSoup both = joined(box({0, 0, 0}, {2, 2, 2}), box({-1, -1, 2}, {4, 4, 3}));
  const std::vector<PlaceOn> places = place_on_each(both);
  const auto behind = windings_behind(both.points_mm, layers_of(both), places, {});
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 p = places[i].at;
    const bool on_both = p.z == 2 && p.x <= 2 && p.y <= 2 && p.x >= 0 && p.y >= 0;
    EXPECT_EQ(behind[i].has_value(), !on_both) << i;
    if (!on_both) {
      EXPECT_EQ(behind[i], 1) << i;
    }
  }
  // Apart by more than rounding there is one, however little that is.
  const TriangleSoup apart = joined(box({0, 0, 0}, {2, 2, 2}), box({-1, -1, 2 + 1e-9}, {4, 4, 3}));
  for (const auto w : windings_behind(apart.points_mm, layers_of(apart), place_on_each(apart), {})) EXPECT_EQ(w, 1);
  // So with a triangle as thin as rounding: its place is on its edge.
  TriangleSoup thin;
  thin.points_mm = {{1, 1, 1}, {2, 1, 1}, {1.5, 1 + 1e-13, 1}, {1.5, 1, 2}};
  thin.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  EXPECT_FALSE(windings_behind(thin.points_mm, layers_of(thin), place_on_each(thin), {})[0].has_value());
}

TEST(WindingAt, CountsLayers) {
  // The same body three times over, and one within that takes one away.
  const TriangleSoup both = joined(sphere(4, 2), sphere(1, 2));
  std::vector<Layer> layers = layers_of(both);
  for (std::size_t i = 0; i < layers.size(); ++i) layers[i].net = i < layers.size() / 2 ? 3 : -1;
  const auto behind = windings_behind(both.points_mm, layers, place_on_each(both), {});
  for (std::size_t i = 0; i < behind.size(); ++i) ASSERT_EQ(behind[i], i < layers.size() / 2 ? 3 : 2);
}

TEST(WindingAt, IsTheSumOnRealMeshes) {
  std::size_t closed = 0;
  for (const auto& path : test::real_meshes()) {
    TriangleSoup soup = welded(soup_of(*load_surface(path)));
    std::erase_if(soup.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    if (soup.triangles.size() > 100000 || !is_closed(soup)) continue;
    ++closed;
    std::vector<PlaceOn> some;
    const std::vector<PlaceOn> all = place_on_each(soup);
    for (std::size_t i = 0; i < all.size(); i += all.size() / 40 + 1) some.push_back(all[i]);
    const auto behind = windings_behind(soup.points_mm, layers_of(soup), some, {});
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (behind[i].has_value()) {
        EXPECT_EQ(*behind[i], sum_behind(soup, some[i])) << path << ", triangle " << some[i].layer;
      }
    }
  }
  if (closed == 0) GTEST_SKIP() << "no closed meshes at hand";
}

}  // namespace
}  // namespace osteo
