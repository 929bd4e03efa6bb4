#include "osteo/geometry/tets/lattice_tets.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "improve.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/union_find.h"
#include "osteo/geometry/distance/distance_map.h"
#include "point_tets.h"

namespace osteo::inline geometry {
namespace {

// How near to a lattice point, as a share of the edge, a cut may come before the point is moved onto it. Labelle and
// Shewchuk, table 1.
constexpr double kLong = 0.24999, kShort = 0.41189;

// Lattice points have coordinates all even or all odd, in half spacings.
struct Lattice {
  Frame frame;                        // at half the spacing
  std::array<int, 3> n{};             // its dims
  std::array<std::size_t, 3> half{};  // points of either kind along each axis
  BigArray<float> value;              // signed distance in half spacings, capped at +-3; even points, then odd ones
  [[nodiscard]] std::size_t at(int x, int y, int z) const {
    const auto h = [](int v) { return static_cast<std::size_t>(v >> 1); };
    return ((static_cast<std::size_t>(z & 1) * half[2] + h(z)) * half[1] + h(y)) * half[0] + h(x);
  }
};

Lattice sample(const TriangleSoup& surface, double spacing_mm, const Context& context) {
  Lattice lattice;
  lattice.frame = frame_around_mm(surface, spacing_mm / 2, 3);
  lattice.n = lattice.frame.dims;
  const Frame& f = lattice.frame;
  const DistanceMapper mapper(surface, f, context.sub(0, 0.4));
  // Only lattice points within reach of the surface.
  VoxelBits wanted(f);
  for (int z = 0; z < f.dims[2]; ++z) {
    for (int y = z & 1; y < f.dims[1]; y += 2) {
      std::uint64_t* const row = &wanted.words[wanted.row(y, z)];
      for (std::size_t w = 0; w < wanted.words_per_row; ++w) {
        row[w] = (z & 1) != 0 ? 0xaaaaaaaaaaaaaaaaULL : 0x5555555555555555ULL;
        const int left = f.dims[0] - static_cast<int>(w) * 64;
        if (left < 64) row[w] &= (1ULL << left) - 1;
      }
    }
  }
  const double reach = 2.1 * spacing_mm / 2;  // an edge is at most 2 half spacings long
  const DistanceMap map = mapper.map_of(wanted, reach, context.sub(0.4, 0.7));
  for (std::size_t a = 0; a < 3; ++a) lattice.half[a] = static_cast<std::size_t>((f.dims[a] + 1) / 2);
  lattice.value.resize(2 * lattice.half[0] * lattice.half[1] * lattice.half[2]);
  for (int z = 0; z < f.dims[2]; ++z) {
    for (int y = z & 1; y < f.dims[1]; y += 2) {
      for (int x = z & 1; x < f.dims[0]; x += 2)
        lattice.value[lattice.at(x, y, z)] = mapper.inside().at(x, y, z) ? -3.0F : 3.0F;
    }
  }
  for (std::size_t b = 0; b < map.bricks.size(); ++b) {
    const Ijk o = map.bricks[b];
    for (int v = 0; v < 512; ++v) {
      if ((map.stored[b * 8 + static_cast<std::size_t>(v >> 6)] >> (v & 63) & 1U) == 0) continue;
      lattice.value[lattice.at(o.i * 8 + (v & 7), o.j * 8 + (v >> 3 & 7), o.k * 8 + (v >> 6))] =
          static_cast<float>(map.distance_mm[b * 512 + static_cast<std::size_t>(v)] / (spacing_mm / 2));
    }
  }
  return lattice;
}

constexpr std::array<std::array<int, 3>, 14> kEdges{{{2, 0, 0},
                                                     {-2, 0, 0},
                                                     {0, 2, 0},
                                                     {0, -2, 0},
                                                     {0, 0, 2},
                                                     {0, 0, -2},
                                                     {1, 1, 1},
                                                     {-1, 1, 1},
                                                     {1, -1, 1},
                                                     {-1, -1, 1},
                                                     {1, 1, -1},
                                                     {-1, 1, -1},
                                                     {1, -1, -1},
                                                     {-1, -1, -1}}};

class Stuffer {
  static constexpr std::uint32_t kNone = 0xffffffffU;

 public:
  Stuffer(Lattice& lattice, const Context& context)
      : l_(lattice), context_(context), points_(lattice.value.size(), kNone) {}

  TetMesh run() {
    warp();
    // Each tetrahedron has one long edge between even points and one between odd ones.
    for (int z = 0; z < l_.n[2]; z += 2) {
      context_.progress(0.75 + 0.15 * z / l_.n[2], "cutting tetrahedra");
      for (int y = 0; y < l_.n[1]; y += 2) {
        for (int x = 0; x < l_.n[0]; x += 2) around(x, y, z);
      }
    }
    return std::move(mesh_);
  }

 private:
  struct Corner {
    std::array<int, 3> at;
    float value;
  };
  [[nodiscard]] bool within(const std::array<int, 3>& p) const {
    return p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && p[0] < l_.n[0] && p[1] < l_.n[1] && p[2] < l_.n[2];
  }
  [[nodiscard]] float value(const std::array<int, 3>& p) const {
    return within(p) ? l_.value[l_.at(p[0], p[1], p[2])] : 3.0F;
  }

  // Moves lattice points onto the surface where it passes near, one after another; a moved point has value 0 from then
  // on, so that its edges are cut no more.
  void warp() {
    const float near = 2.0F;
    for (int z = 0; z < l_.n[2]; ++z) {
      for (int y = z & 1; y < l_.n[1]; y += 2) {
        for (int x = z & 1; x < l_.n[0]; x += 2) {
          const std::size_t id = l_.at(x, y, z);
          const float v = l_.value[id];
          if (v == 0 || std::abs(v) > near) continue;
          double best = 1e9;
          Vec3 to;
          for (std::size_t e = 0; e < 14; ++e) {
            const std::array<int, 3> q{x + kEdges[e][0], y + kEdges[e][1], z + kEdges[e][2]};
            const float w = value(q);
            if (w == 0 || (v < 0) == (w < 0)) continue;
            const double share = static_cast<double>(v) / (static_cast<double>(v) - static_cast<double>(w));
            if (share >= (e < 6 ? kLong : kShort)) continue;
            const double distance = share * (e < 6 ? 2.0 : std::sqrt(3.0));
            if (distance < best) {
              best = distance;
              to = Vec3{x + share * kEdges[e][0], y + share * kEdges[e][1], z + share * kEdges[e][2]};
            }
          }
          if (best == 1e9) continue;
          l_.value[id] = 0;
          warped_[id] = to;
        }
      }
    }
  }

  std::uint32_t add(Vec3 lattice_point) {
    const Vec3 p = l_.frame.world_from_index(lattice_point);
    mesh_.points_mm.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    return static_cast<std::uint32_t>(mesh_.points_mm.size() - 1);
  }
  std::uint32_t point(const Corner& c) {
    const std::size_t id = l_.at(c.at[0], c.at[1], c.at[2]);
    if (points_[id] == kNone) {
      const auto w = c.value == 0 ? warped_.find(id) : warped_.end();
      points_[id] = add(w != warped_.end() ? w->second : Vec3{double(c.at[0]), double(c.at[1]), double(c.at[2])});
    }
    return points_[id];
  }
  // Where the surface cuts the edge from a (inside) to b (outside).
  std::uint32_t cut(const Corner& a, const Corner& b) {
    const std::uint64_t ia = l_.at(a.at[0], a.at[1], a.at[2]), ib = l_.at(b.at[0], b.at[1], b.at[2]);
    const auto [it, made] = cuts_.try_emplace(ia << 32 ^ ib, 0);
    if (made) {
      const double t = static_cast<double>(a.value) / (static_cast<double>(a.value) - static_cast<double>(b.value));
      it->second = add(Vec3{a.at[0] + t * (b.at[0] - a.at[0]), a.at[1] + t * (b.at[1] - a.at[1]),
                            a.at[2] + t * (b.at[2] - a.at[2])});
    }
    return it->second;
  }

  // The tetrahedra around the three long edges that start at a lattice point.
  void around(int x, int y, int z) {
    const Corner a{{x, y, z}, value({x, y, z})};
    for (int axis = 0; axis < 3; ++axis) {
      std::array<int, 3> q{x, y, z};
      q[static_cast<std::size_t>(axis)] += 2;
      if (!within(q)) continue;
      const Corner b{q, value(q)};
      // The four points of the other lattice around the edge's middle, in a ring.
      std::array<Corner, 4> ring;
      bool inside = true;
      for (int i = 0; i < 4; ++i) {
        constexpr int su[4] = {1, -1, -1, 1}, sv[4] = {1, 1, -1, -1};
        std::array<int, 3> p{x, y, z};
        p[static_cast<std::size_t>(axis)] += 1;
        p[static_cast<std::size_t>((axis + 1) % 3)] += su[i];
        p[static_cast<std::size_t>((axis + 2) % 3)] += sv[i];
        inside &= within(p);
        ring[static_cast<std::size_t>(i)] = {p, inside ? value(p) : 3.0F};
      }
      if (!inside) continue;
      for (std::size_t i = 0; i < 4; ++i) tet({a, b, ring[i], ring[(i + 1) % 4]});
    }
  }

  void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    const auto p = [&](std::uint32_t i) {
      return Vec3{mesh_.points_mm[i][0], mesh_.points_mm[i][1], mesh_.points_mm[i][2]};
    };
    const double volume = dot(cross(p(b) - p(a), p(c) - p(a)), p(d) - p(a));
    if (volume < 0) std::swap(c, d);
    mesh_.tets.push_back({a, b, c, d});
  }

  [[nodiscard]] static bool is_long(const Corner& a, const Corner& b) { return ((a.at[0] ^ b.at[0]) & 1) == 0; }
  // A face with two inside corners a, b and one outside, c, is left with a quadrilateral. Its diagonal goes from the
  // corner this chooses to the other's cut. Both tetrahedra of a face choose alike.
  [[nodiscard]] static bool diagonal_from_first(const Corner& a, const Corner& b, const Corner& c) {
    // One cut on a long and one on a short edge: the diagonal ends in the cut of the long edge. Two short ones: the
    // parity of the corners' coordinates decides.
    if (is_long(a, c)) return false;
    if (is_long(b, c)) return true;
    const auto larger = [](const Corner& p, const Corner& q) {
      int n = 0;
      for (std::size_t i = 0; i < 3; ++i) n += p.at[i] > q.at[i] ? 1 : 0;
      return n;
    };
    return larger(a, b) % 2 != 0 || (larger(a, b) == 0 && larger(b, a) % 2 == 0);
  }

  // A prism between triangles (a0, a1, a2) and (b0, b1, b2), whose sides' diagonals are given: from_low[i]: side i,
  // between i and i + 1, has the diagonal a_i - b_(i+1), else a_(i+1) - b_i.
  void prism(std::array<std::uint32_t, 3> a, std::array<std::uint32_t, 3> b, std::array<bool, 3> from_low) {
    if (from_low[0] == from_low[1] && from_low[1] == from_low[2]) {
      // The diagonals run in a circle: only a point in the middle helps.
      Vec3 m;
      for (const auto i : {a[0], a[1], a[2], b[0], b[1], b[2]})
        m += Vec3{mesh_.points_mm[i][0], mesh_.points_mm[i][1], mesh_.points_mm[i][2]} / 6;
      mesh_.points_mm.push_back({static_cast<float>(m.x), static_cast<float>(m.y), static_cast<float>(m.z)});
      const auto c = static_cast<std::uint32_t>(mesh_.points_mm.size() - 1);
      emit(a[0], a[1], a[2], c);
      emit(b[0], b[1], b[2], c);
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (from_low[i]) {
          emit(a[i], a[j], b[j], c);
          emit(a[i], b[j], b[i], c);
        } else {
          emit(a[i], a[j], b[i], c);
          emit(a[j], b[j], b[i], c);
        }
      }
      return;
    }
    // The corner of a that two diagonals meet in, and the corner of b: a path of three tetrahedra.
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      // Diagonals at a_i: side i from a_i, side k (between k and i) from a_i.
      if (!from_low[i] || from_low[k]) continue;
      emit(a[i], b[0], b[1], b[2]);
      if (from_low[j]) {  // a_j - b_k
        emit(a[i], a[j], b[j], b[k]);
        emit(a[i], a[j], a[k], b[k]);
      } else {  // a_k - b_j
        emit(a[i], a[k], b[j], b[k]);
        emit(a[i], a[j], a[k], b[j]);
      }
      return;
    }
  }

  void tet(std::array<Corner, 4> c) {
    std::array<Corner, 4> neg, zero, pos;
    std::size_t n = 0, o = 0, p = 0;
    for (const Corner& v : c) {
      if (v.value < 0) {
        neg[n++] = v;
      } else if (v.value > 0) {
        pos[p++] = v;
      } else {
        zero[o++] = v;
      }
    }
    if (n == 0) return;
    if (p == 0) return emit(point(c[0]), point(c[1]), point(c[2]), point(c[3]));
    if (n == 1) {
      std::array<std::uint32_t, 3> other{};
      std::size_t k = 0;
      for (std::size_t i = 0; i < o; ++i) other[k++] = point(zero[i]);
      for (std::size_t i = 0; i < p; ++i) other[k++] = cut(neg[0], pos[i]);
      return emit(point(neg[0]), other[0], other[1], other[2]);
    }
    if (n == 2 && p == 1) {  // pyramid over a, b, cut b, cut a with the zero corner on top
      const Corner &a = neg[0], &b = neg[1];
      const std::uint32_t pa = point(a), pb = point(b), ca = cut(a, pos[0]), cb = cut(b, pos[0]), top = point(zero[0]);
      if (diagonal_from_first(a, b, pos[0])) {
        emit(pa, pb, cb, top);
        emit(pa, cb, ca, top);
      } else {
        emit(pa, pb, ca, top);
        emit(pb, cb, ca, top);
      }
      return;
    }
    if (n == 2) {  // wedge: triangles (a, cut a-p, cut a-q) and (b, cut b-p, cut b-q)
      const Corner &a = neg[0], &b = neg[1];
      const bool first_p = diagonal_from_first(a, b, pos[0]), first_q = diagonal_from_first(a, b, pos[1]);
      const std::array<std::uint32_t, 3> ta{point(a), cut(a, pos[0]), cut(a, pos[1])},
          tb{point(b), cut(b, pos[0]), cut(b, pos[1])};
      // Side 0: a - b over p. Side 2: over q. Side 1, cut p to cut q, lies on the surface: no neighbour, so the one
      // that makes no circle, and of two the shorter.
      const bool s0 = first_p, s2 = !first_q;
      bool s1 = !s0;
      if (s0 != s2) s1 = length2(ta[1], tb[2]) <= length2(ta[2], tb[1]);
      return prism(ta, tb, {s0, s1, s2});
    }
    // Three inside: prism between (a, b, c) and their cuts.
    std::array<std::uint32_t, 3> in{}, out{};
    std::array<bool, 3> low{};
    for (std::size_t i = 0; i < 3; ++i) {
      in[i] = point(neg[i]);
      out[i] = cut(neg[i], pos[0]);
      low[i] = diagonal_from_first(neg[i], neg[(i + 1) % 3], pos[0]);
    }
    prism(in, out, low);
  }

  [[nodiscard]] double length2(std::uint32_t i, std::uint32_t j) const {
    double sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double d = static_cast<double>(mesh_.points_mm[i][a]) - static_cast<double>(mesh_.points_mm[j][a]);
      sum += d * d;
    }
    return sum;
  }

  Lattice& l_;
  const Context& context_;
  TetMesh mesh_;
  std::unordered_map<std::size_t, Vec3> warped_;
  std::vector<std::uint32_t> points_;  // by lattice point
  std::unordered_map<std::uint64_t, std::uint32_t> cuts_;
};

}  // namespace

TetMesh stuffed_tets(const TriangleSoup& surface, const StuffingOptions& options, const Context& context) {
  Lattice lattice = sample(surface, options.spacing_mm, context);
  TetMesh mesh = Stuffer(lattice, context).run();
  if (mesh.tets.empty()) {
    throw Error(
        ExitCode::failed,
        "no point of the lattice is inside the surface at a spacing of " + format_number(options.spacing_mm) + " mm",
        "choose a smaller spacing");
  }
  if (options.target_dihedral_deg > 0)
    improve_tets(mesh, surface, options.target_dihedral_deg, options.spacing_mm, context.sub(0.9, 1.0));
  context.progress(1.0);
  return mesh;
}

std::uint64_t open_hinges(TetMesh& mesh) {
  // Two tetrahedra of a point belong together when they share a face at it.
  const PointTets of_points(mesh);
  const auto &first = of_points.first, &around = of_points.tets;
  struct Side {
    std::uint32_t a, b, local;  // the face's other two points; which of the point's tetrahedra
  };
  std::vector<Side> sides;
  std::vector<std::uint32_t> parent;
  std::vector<std::array<std::uint32_t, 3>> changes;  // tetrahedron, old point, new point
  std::uint64_t made = 0;
  const std::size_t points = mesh.points_mm.size();
  for (std::uint32_t v = 0; v < points; ++v) {
    const std::uint32_t n = first[v + 1] - first[v];
    sides.clear();
    parent.resize(n);
    std::iota(parent.begin(), parent.end(), 0U);
    for (std::uint32_t k = 0; k < n; ++k) {
      std::array<std::uint32_t, 3> other{};
      std::size_t c = 0;
      for (const auto w : mesh.tets[around[first[v] + k]]) {
        if (w != v) other[c++] = w;
      }
      std::sort(other.begin(), other.end());
      sides.push_back({other[0], other[1], k});
      sides.push_back({other[0], other[2], k});
      sides.push_back({other[1], other[2], k});
    }
    std::sort(sides.begin(), sides.end(),
              [](const Side& x, const Side& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
      if (sides[i].a == sides[i + 1].a && sides[i].b == sides[i + 1].b)
        join_sets(parent, sides[i].local, sides[i + 1].local);
    }
    const std::uint32_t stays = n > 0 ? root_of(parent, 0U) : 0;
    std::unordered_map<std::uint32_t, std::uint32_t> own;
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t r = root_of(parent, k);
      if (r == stays) continue;
      const auto [at, fresh] = own.try_emplace(r, static_cast<std::uint32_t>(mesh.points_mm.size()));
      if (fresh) {
        const auto place = mesh.points_mm[v];
        mesh.points_mm.push_back(place);
        ++made;
      }
      changes.push_back({around[first[v] + k], v, at->second});
    }
  }
  for (const auto& [t, from, to] : changes) std::replace(mesh.tets[t].begin(), mesh.tets[t].end(), from, to);
  return made;
}

KeptThin stuffed_tets_keeping(const TriangleSoup& surface, const StuffingOptions& options, double volume,
                              double most_lost, int halvings, const Context& context) {
  KeptThin best;
  StuffingOptions now = options;
  for (int halving = 0;; ++halving) {
    try {
      TetMesh mesh = stuffed_tets(surface, now, context);
      best = {std::move(mesh), now.spacing_mm, 0};
    } catch (const Error& e) {
      // Nothing inside at that spacing: a finer one may find it.
      if (e.code() != ExitCode::failed || halving >= halvings) throw;
    }
    const double got = best.mesh.tets.empty() ? 0 : volume_mm3(best.mesh);
    now.spacing_mm /= 2;
    const Frame next = frame_around_mm(surface, now.spacing_mm / 2, 3);
    const bool fits = 0.25 * static_cast<double>(next.dims[0]) * next.dims[1] * next.dims[2] < 4e7;
    if (got >= (1 - most_lost) * volume || halving >= halvings || (!fits && !best.mesh.tets.empty())) break;
  }
  best.hinges = open_hinges(best.mesh);
  return best;
}

}  // namespace osteo::inline geometry
