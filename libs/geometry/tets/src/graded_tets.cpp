#include "osteo/geometry/tets/lattice_tets.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline geometry {
namespace {

struct Tet {
  std::array<std::uint32_t, 4> v;
  std::uint8_t tag;    // halve the edge v[0] - v[tag]
  std::uint8_t depth;  // how often halved
};

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
}

class Bisector {
 public:
  explicit Bisector(const Frame& coarse) : frame_(coarse) {
    // Cubes of six tetrahedra along paths from one corner to the opposite one, all the same way round.
    const auto& n = coarse.dims;
    const auto id = [&](int i, int j, int k) {
      return static_cast<std::uint32_t>((k * (n[1] + 1) + j) * (n[0] + 1) + i);
    };
    for (int k = 0; k <= n[2]; ++k) {
      for (int j = 0; j <= n[1]; ++j) {
        for (int i = 0; i <= n[0]; ++i) points.push_back(coarse.world_from_index({i - 0.5, j - 0.5, k - 0.5}));
      }
    }
    constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) {
          for (const auto& path : kPaths) {
            Tet t{{}, 3, 0};
            int at[3] = {i, j, k};
            t.v[0] = id(i, j, k);
            for (std::size_t s = 0; s < 3; ++s) {
              ++at[path[s]];
              t.v[s + 1] = id(at[0], at[1], at[2]);
            }
            tets.push_back(t);
          }
        }
      }
    }
  }

  [[nodiscard]] bool hangs(const Tet& t) const {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) {
        if (middles_.count(edge_key(t.v[i], t.v[j])) != 0) return true;
      }
    }
    return false;
  }

  // Halves tetrahedron `i`; the second half goes to the end.
  void halve(std::size_t i) {
    const Tet t = tets[i];
    const auto [it, made] = middles_.try_emplace(edge_key(t.v[0], t.v[t.tag]), 0);
    if (made) {
      it->second = static_cast<std::uint32_t>(points.size());
      points.push_back((points[t.v[0]] + points[t.v[t.tag]]) * 0.5);
    }
    Tet a = t, b = t;
    a.v[t.tag] = it->second;
    for (std::size_t k = 0; k < t.tag; ++k) b.v[k] = t.v[k + 1];
    b.v[t.tag] = it->second;
    a.tag = b.tag = static_cast<std::uint8_t>(t.tag > 1 ? t.tag - 1 : 3);
    a.depth = b.depth = static_cast<std::uint8_t>(t.depth + 1);
    tets[i] = a;
    tets.push_back(b);
  }

  std::vector<Vec3> points;
  std::vector<Tet> tets;

 private:
  Frame frame_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
};

}  // namespace

TetMesh graded_tets(const TriangleSoup& surface, const GradedOptions& options, const Context& context) {
  const double coarse = options.spacing_mm * std::exp2(options.levels);
  Bisector mesh(frame_around_mm(surface, coarse, 1));
  const SignedDistance distance(surface, context);
  const auto centre = [&](const Tet& t) {
    return (mesh.points[t.v[0]] + mesh.points[t.v[1]] + mesh.points[t.v[2]] + mesh.points[t.v[3]]) / 4;
  };
  const auto reach = [&](const Tet& t, Vec3 c) {
    double r = 0;
    for (const auto v : t.v) r = std::max(r, length(mesh.points[v] - c));
    return r;
  };
  // Whether a tetrahedron may meet the surface: unknown until asked. Halves of one that does not, do not.
  enum : std::uint8_t { kUnknown, kNo, kYes };
  std::vector<std::uint8_t> meets;
  const auto test = [&] {
    meets.resize(mesh.tets.size(), kUnknown);
    parallel_for(mesh.tets.size(), 512, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      std::uint32_t hint = ClosestPoint::kNone;
      for (std::size_t i = begin; i < end; ++i) {
        if (meets[i] != kUnknown) continue;
        const Tet& t = mesh.tets[i];
        const Vec3 c = centre(t);
        const double r = reach(t, c);
        const ClosestPoint p = distance.closest(c, hint, r);
        if (p.triangle != ClosestPoint::kNone) hint = p.triangle;
        meets[i] = p.distance_mm <= r ? kYes : kNo;
      }
    });
  };
  const auto halve = [&](std::size_t i) {
    mesh.halve(i);
    meets.resize(mesh.tets.size(), kUnknown);
    const std::uint8_t known = meets[i] == kNo ? kNo : kUnknown;
    meets[i] = meets.back() = known;
  };
  const int deepest = 3 * options.levels;  // three halvings halve every edge
  test();
  for (int level = 0; level < deepest; ++level) {
    context.progress(0.1 + 0.7 * level / deepest, "halving tetrahedra at the surface");
    const std::size_t count = mesh.tets.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (meets[i] == kYes && mesh.tets[i].depth <= level) halve(i);
    }
    // Neighbours follow until no edge has a point in its middle.
    for (bool again = true; again;) {
      again = false;
      const std::size_t now = mesh.tets.size();
      for (std::size_t i = 0; i < now; ++i) {
        if (mesh.hangs(mesh.tets[i])) {
          halve(i);
          again = true;
        }
      }
    }
    test();
  }
  std::vector<std::uint8_t> kept(mesh.tets.size(), 0);
  parallel_for(mesh.tets.size(), 512, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) kept[i] = distance.inside(centre(mesh.tets[i])) ? 1 : 0;
  });
  TetMesh result;
  std::vector<std::uint32_t> place(mesh.points.size(), 0xffffffffU);
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    if (kept[i] == 0) continue;
    std::array<std::uint32_t, 4> v = mesh.tets[i].v;
    const Vec3 a = mesh.points[v[0]];
    if (dot(cross(mesh.points[v[1]] - a, mesh.points[v[2]] - a), mesh.points[v[3]] - a) < 0) std::swap(v[2], v[3]);
    for (auto& p : v) {
      if (place[p] == 0xffffffffU) {
        place[p] = static_cast<std::uint32_t>(result.points_mm.size());
        const Vec3 q = mesh.points[p];
        result.points_mm.push_back({static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)});
      }
      p = place[p];
    }
    result.tets.push_back(v);
  }
  if (result.tets.empty()) {
    throw Error(ExitCode::failed,
                "no tetrahedron of " + format_number(options.spacing_mm) + " mm has its centre inside the surface",
                "choose a smaller spacing");
  }
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
