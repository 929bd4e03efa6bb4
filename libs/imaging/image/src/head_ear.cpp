#include "head_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace osteo::inline imaging {
using namespace anatomy;

HeadAnatomy::Model::Ear HeadAnatomy::Model::ear(Vec3 p) const {
  Ear e;
  // The drum: a plane that faces outward, forward and down; the lateral part of the tube is the canal, the medial the
  // cavity.
  const Vec3 centre{45, 0, -20}, out = normalized({0.78, -0.34, -0.52});
  const double drum = dot(p - centre, out);
  const Vec3 tall{p.x, p.y, -20 + (p.z + 20) * 0.86};
  const double tube = canal.distance(tall, 8);
  e.canal = std::max(tube, 0.12 - drum);
  e.drum = std::max(tube, std::abs(drum) - 0.12);
  // Labyrinth.
  const Vec3 ridge = normalized({0.72, 0.69, 0}), back = normalized({-0.69, 0.72, 0}),
             level = normalized({0, 0.5, 0.87});
  const double k = build.canals;
  double l = ellipsoid(p, {36.4, 3.5, -16.1}, {1.6, 2.7, 2.3});
  l = smin(l, torus(p, {35.5, 4.3, -12.3}, ridge, 3.2 * k, 0.55), 0.5);
  l = smin(l, torus(p, {38.5, 8.6, -16.9}, back, 3.1 * k, 0.55), 0.5);
  l = smin(l, torus(p, {39.3, 6.5, -14.4}, level, 2.7 * k, 0.55), 0.5);
  l = smin(l, cochlea.distance(p, 5), 0.5);
  e.labyrinth = l;
  e.nerve = nerve.distance(p, 6);
  // Tympanic cavity, sheared along the drum, with attic, aditus and antrum.
  const Vec3 sheared{p.x - 0.2 * (p.z + 19.5), p.y, p.z};
  double d = box(sheared, {42.1, -0.3, -19.2}, {2.9, 6.0, 6.2}, 2.2);
  d = std::max(d, drum + 0.12);
  d = smin(d, ellipsoid(p, {43.7, 1.4, -12.6}, {3.3, 5.0, 3.8}), 1.2);
  d = smin(d, cone(p, {44.2, 5.0, -12.4}, {46.2, 10, -12.3}, 2.2, 2.6), 1.5);
  d = smin(d, ellipsoid(p, {47.6, 14.2, -12.9}, {3.5, 6.3, 4.4}), 2);
  d = smin(d, auditory_tube.distance(p, 5), 1.2);
  d = smin(d, ellipsoid(p, {39.8, 3.2, -17.1}, {1.3, 1.8, 1.1}), 0.4);  // niche of the oval window
  // The promontory covers the labyrinth, the facial canal's thin wall the nerve.
  e.cavity = smax(smax(d, 0.6 - e.labyrinth, 0.4), 0.35 - e.nerve, 0.3);
  e.chorda = chorda.distance(p, 4);
  e.meatus = meatus.distance(p, 5);
  e.carotid = carotid.distance(p, 6);
  return e;
}

double HeadAnatomy::Model::ossicles(Vec3 p) const {
  if (length(p - Vec3{43, 2.5, -15.5}) > 14) return length(p - Vec3{43, 2.5, -15.5}) - 9;
  // Malleus: head, neck, short process, handle to the umbo.
  double malleus = length(p - Vec3{43.9, -0.1, -12.7}) - 1.2;
  malleus = smin(malleus, cone(p, {44.0, -0.2, -13.4}, {44.4, -0.4, -15.6}, 0.75, 0.6), 0.5);
  malleus = smin(malleus, cone(p, {44.4, -0.4, -15.6}, {45.5, 0.2, -16.1}, 0.5, 0.4), 0.3);
  malleus = smin(malleus, cone(p, {44.4, -0.4, -15.6}, {43.5, 0.3, -19.6}, 0.6, 0.4), 0.3);
  // Incus: body, short process towards the antrum, long process to the stapes.
  double incus = ellipsoid(p, {44.1, 2.5, -12.6}, {1.15, 1.3, 1.45});
  incus = smin(incus, cone(p, {44.2, 3.2, -12.9}, {44.9, 6.5, -13.6}, 0.9, 0.4), 0.5);
  incus = smin(incus, cone(p, {44.0, 2.9, -13.5}, {42.7, 3.5, -17.0}, 0.75, 0.4), 0.4);
  incus = smin(incus, cone(p, {42.7, 3.5, -17.0}, {41.9, 3.3, -17.3}, 0.4, 0.35), 0.2);
  // Stapes: head, two crura, footplate in the oval window.
  double stapes = length(p - Vec3{41.2, 3.2, -17.3}) - 0.42;
  stapes = std::min(stapes, cone(p, {41.1, 3.2, -17.3}, {39.1, 4.4, -17.0}, 0.25, 0.22));
  stapes = std::min(stapes, cone(p, {41.1, 3.2, -17.3}, {38.9, 2.0, -17.2}, 0.25, 0.22));
  stapes = std::min(stapes, ellipsoid(p, {38.8, 3.2, -17.1}, {0.35, 1.5, 0.75}));
  return std::min({malleus, incus, stapes});
}

double HeadAnatomy::Model::cell_region(Vec3 p, double bone, double brain_d, double sinus_d, const Ear& e) const {
  const double f = build.pneumatisation;
  double d = ellipsoid(p, {52.5, 19, -24}, Vec3{14, 18, 23} * f);
  d = smin(d, ellipsoid(p, {54, 3, -10}, Vec3{9, 8, 4} * f), 4);
  d = smax(d, bone + 1.7, 1.5);
  d = smax(d, 1.2 - e.canal, 1);
  d = smax(d, 0.6 - e.cavity, 0.5);
  d = smax(d, 1.5 - e.labyrinth, 1);
  d = smax(d, 1.0 - e.nerve, 0.5);
  d = smax(d, 0.4 - e.chorda, 0.3);
  d = smax(d, 1.0 - sinus_d, 1);
  d = smax(d, 0.9 - brain_d, 1);
  return smax(d, 43 - p.x, 1);
}

std::optional<std::size_t> HeadAnatomy::Model::lattice_index(Vec3 p) const {
  const Vec3 q = (p - lattice_lo) / kPitch;
  const std::array<int, 3> i{static_cast<int>(std::floor(q.x)), static_cast<int>(std::floor(q.y)),
                             static_cast<int>(std::floor(q.z))};
  for (std::size_t a = 0; a < 3; ++a)
    if (i[a] < 0 || i[a] >= lattice[a]) return std::nullopt;
  return static_cast<std::size_t>((i[2] * lattice[1] + i[1]) * lattice[0] + i[0]);
}

// Where the difference of the distances to the two nearest balls exceeds the wall: a foam of round cells of all sizes.
double HeadAnatomy::Model::in_cell(Vec3 p) const {
  const auto at = lattice_index(p);
  if (!at) return 1;
  double first = 1e9, second = 1e9;
  const AirCell* in = nullptr;
  for (const auto c : near_cells[*at]) {
    const AirCell& cell = cells[c];
    const double f = length(p - cell.centre_mm) - cell.radius_mm;
    if (f < first) {
      second = in != nullptr ? smin(first, second, 0.4) : 1e9;
      first = f;
      in = &cell;
    } else {
      second = smin(second, f, 0.4);
    }
  }
  if (in == nullptr) return 1;
  return smax(0.5 * (in->wall_mm - (second - first)), first - 0.8 * in->radius_mm - 1.0, 0.4);
}

double HeadAnatomy::Model::in_duct(Vec3 p) const {
  const auto at = lattice_index(p);
  double d = 0.8;
  if (!at) return d;
  for (const auto c : near_ducts[*at])
    d = std::min(d, cone(p, ducts[c].a, ducts[c].b, ducts[c].radius, ducts[c].radius));
  return d;
}

void HeadAnatomy::Model::place_cells(std::uint64_t seed) {
  Random random(seed * 0xd1342543de82ef95ULL + 77);
  const Vec3 lo{40, -8, -50}, hi{70, 40, -4};
  const auto region = [&](Vec3 p) {
    const double vault = outer_vault(p), sinus_d = sinus.distance(p, 8), orbit_d = orbit(p), nasal_d = nasal(p);
    const Ear e = ear(p);
    const double brain_d = brain(p, vault, sinus_d, e, orbit_d, 1e9);
    return cell_region(p, skull(p, vault, brain_d, orbit_d, nasal_d, 1e9, sinus_d, e), brain_d, sinus_d, e);
  };
  // Large ones first; each try smaller. Sizes are log-normal about their place's: small around the antrum, large in the
  // tip and behind.
  const Vec3 antrum{47.6, 14.2, -12.9};
  for (int i = 0; i < 14000; ++i) {
    const Vec3 p{random.uniform(lo.x, hi.x), random.uniform(lo.y, hi.y), random.uniform(lo.z, hi.z)};
    const double shrink = mix(1.5, 0.42, std::min(1.0, i / 9000.0)), draw = portable::exp(0.28 * random.normal()),
                 wall = random.uniform(0.35, 0.7);
    const double local = mix(0.85, 1.6, std::clamp((length(p - antrum) - 8) / 22, 0.0, 1.0));
    const double r = std::clamp(1.4 * build.cell_size * local * draw * shrink, 0.55, 3.2);
    bool free = true;
    for (const AirCell& c : cells) {
      if (length(p - c.centre_mm) < 0.86 * (r + c.radius_mm) + 0.2) {
        free = false;
        break;
      }
    }
    if (!free || region(p) > -0.3 * r) continue;
    cells.push_back({p, r, wall});
  }
  // Openings: each cell to the neighbour that is one step nearer to the antrum, so that all air is one.
  const std::size_t n = cells.size();
  std::vector<double> cost(n);
  std::vector<int> to(n, -1);
  std::vector<char> done(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double gap = std::max(0.0, ear(cells[i].centre_mm).cavity - cells[i].radius_mm);
    cost[i] = gap < 2.2 ? gap * gap : 1e6 + gap;
  }
  for (std::size_t round = 0; round < n; ++round) {
    std::size_t best = n;
    for (std::size_t i = 0; i < n; ++i)
      if (done[i] == 0 && (best == n || cost[i] < cost[best])) best = i;
    done[best] = 1;
    for (std::size_t i = 0; i < n; ++i) {
      const double gap =
          length(cells[i].centre_mm - cells[best].centre_mm) - cells[i].radius_mm - cells[best].radius_mm;
      const double c = cost[best] + (0.5 + std::max(0.0, gap)) * (0.5 + std::max(0.0, gap));
      if (done[i] == 0 && gap < 2.5 && c < cost[i]) {
        cost[i] = c;
        to[i] = static_cast<int>(best);
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 from = cells[i].centre_mm;
    Vec3 end = antrum + (from - antrum) * 0.5;
    double other = 1;
    if (to[i] >= 0) {
      end = cells[static_cast<std::size_t>(to[i])].centre_mm;
      other = cells[static_cast<std::size_t>(to[i])].radius_mm;
    }
    ducts.push_back({from, end, std::clamp(0.42 * std::min(cells[i].radius_mm, other), 0.35, 0.8)});
  }
  // Lattice: a cell matters in a box if it can be among the nearest two anywhere in it.
  lattice_lo = lo - Vec3{4, 4, 4};
  for (std::size_t a = 0; a < 3; ++a) lattice[a] = static_cast<int>(std::ceil((hi[a] - lo[a] + 8) / kPitch));
  near_cells.resize(static_cast<std::size_t>(lattice[0]) * static_cast<std::size_t>(lattice[1]) *
                    static_cast<std::size_t>(lattice[2]));
  near_ducts.resize(near_cells.size());
  const double half = 0.5 * kPitch * std::sqrt(3.0);
  std::vector<double> f(n);
  std::size_t at = 0;
  for (int k = 0; k < lattice[2]; ++k)
    for (int j = 0; j < lattice[1]; ++j)
      for (int i = 0; i < lattice[0]; ++i, ++at) {
        const Vec3 centre = lattice_lo + Vec3{i + 0.5, j + 0.5, k + 0.5} * kPitch;
        double first = 1e9, second = 1e9;
        for (std::size_t c = 0; c < n; ++c) {
          f[c] = length(centre - cells[c].centre_mm) - cells[c].radius_mm;
          if (f[c] < first) {
            second = first;
            first = f[c];
          } else {
            second = std::min(second, f[c]);
          }
        }
        if (first > 6) continue;
        for (std::size_t c = 0; c < n; ++c)
          if (f[c] <= second + 2 * half + 0.8) near_cells[at].push_back(static_cast<std::uint16_t>(c));
        for (std::size_t c = 0; c < n; ++c)
          if (cone(centre, ducts[c].a, ducts[c].b, ducts[c].radius, ducts[c].radius) < half + 0.8)
            near_ducts[at].push_back(static_cast<std::uint16_t>(c));
      }
}

}  // namespace osteo::inline imaging
