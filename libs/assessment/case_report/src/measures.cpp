#include "measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/image/components.h"
#include "osteo/simulation/bone/depth_map.h"

namespace osteo::inline assessment::case_report {
namespace {

constexpr double kSpeck_mm3 = 0.5;
constexpr std::size_t kLongestPath = 2'000'000;  // voxels of a part whose length is measured

struct Box {
  std::array<int, 3> lo{std::numeric_limits<int>::max(), std::numeric_limits<int>::max(),
                        std::numeric_limits<int>::max()},
      hi{-1, -1, -1};
};

// The voxels of one part, and which is where.
struct Part {
  std::vector<std::array<int, 3>> voxels;
  std::unordered_map<std::uint64_t, std::uint32_t> number;
  static std::uint64_t name(int i, int j, int k) {
    return static_cast<std::uint64_t>(k) << 42 | static_cast<std::uint64_t>(j) << 21 | static_cast<std::uint64_t>(i);
  }
};

// Shortest ways over neighbouring voxels from one of them; returns the farthest and how far it is.
std::pair<std::uint32_t, double> farthest(const Part& part, Vec3 spacing, std::uint32_t from) {
  std::vector<double> way(part.voxels.size(), std::numeric_limits<double>::infinity());
  using Step = std::pair<double, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
  way[from] = 0;
  open.emplace(0, from);
  std::pair<std::uint32_t, double> last{from, 0};
  while (!open.empty()) {
    const auto [d, v] = open.top();
    open.pop();
    if (d > way[v]) continue;
    if (d > last.second) last = {v, d};
    const auto& at = part.voxels[v];
    for (int n = 0; n < 27; ++n) {
      if (n == 13) continue;
      const int di = n % 3 - 1, dj = n / 3 % 3 - 1, dk = n / 9 - 1;
      if (at[0] + di < 0 || at[1] + dj < 0 || at[2] + dk < 0) continue;
      const auto it = part.number.find(Part::name(at[0] + di, at[1] + dj, at[2] + dk));
      if (it == part.number.end()) continue;
      const double to = d + length({di * spacing.x, dj * spacing.y, dk * spacing.z});
      if (to < way[it->second]) {
        way[it->second] = to;
        open.emplace(to, it->second);
      }
    }
  }
  return last;
}

struct Shell {
  std::vector<Vec3> points_mm;  // voxels with a neighbour of another kind, by their x
};

double nearest(const Shell& a, const Shell& b) {
  double best = std::numeric_limits<double>::infinity();
  for (const Vec3& p : a.points_mm) {
    const auto from =
        std::lower_bound(b.points_mm.begin(), b.points_mm.end(), p.x, [](const Vec3& q, double x) { return q.x < x; });
    for (auto q = from; q != b.points_mm.end() && q->x - p.x < best; ++q) best = std::min(best, length(*q - p));
    for (auto q = from; q != b.points_mm.begin() && p.x - std::prev(q)->x < best; --q)
      best = std::min(best, length(*std::prev(q) - p));
  }
  return best;
}

}  // namespace

std::vector<StructureMeasure> measure_structures(const Labels& labels, const Context& context) {
  const Frame& f = labels.frame;
  std::array<Box, 256> boxes;
  std::array<std::uint64_t, 256> count{};
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) {
        const std::uint8_t v = labels.voxels[at];
        if (v == 0) continue;
        ++count[v];
        const std::array<int, 3> x{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          boxes[v].lo[a] = std::min(boxes[v].lo[a], x[a]);
          boxes[v].hi[a] = std::max(boxes[v].hi[a], x[a]);
        }
      }
    }
  }
  std::vector<StructureMeasure> all;
  std::vector<Shell> shells;
  for (const Structure& s : labels.structures) {
    if (count[s.value] == 0) continue;
    context.check_cancelled();
    StructureMeasure m;
    m.structure = s;
    m.volume_mm3 = static_cast<double>(count[s.value]) * f.voxel_volume_mm3();
    const Box& box = boxes[s.value];
    const std::array<int, 3> n{box.hi[0] - box.lo[0] + 1, box.hi[1] - box.lo[1] + 1, box.hi[2] - box.lo[2] + 1};
    std::vector<std::uint8_t> mask(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
    m.lo_mm = {1e30, 1e30, 1e30};
    m.hi_mm = {-1e30, -1e30, -1e30};
    Shell shell;
    at = 0;
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i, ++at) {
          const int gi = box.lo[0] + i, gj = box.lo[1] + j, gk = box.lo[2] + k;
          if (labels.at(gi, gj, gk) != s.value) continue;
          mask[at] = 1;
          const auto other = [&](int di, int dj, int dk) {
            const int a = gi + di, b = gj + dj, c = gk + dk;
            return a < 0 || b < 0 || c < 0 || a >= f.dims[0] || b >= f.dims[1] || c >= f.dims[2] ||
                   labels.at(a, b, c) != s.value;
          };
          if (!(other(1, 0, 0) || other(-1, 0, 0) || other(0, 1, 0) || other(0, -1, 0) || other(0, 0, 1) ||
                other(0, 0, -1)))
            continue;
          const Vec3 p = f.world_from_index({double(gi), double(gj), double(gk)});
          for (std::size_t a = 0; a < 3; ++a) {
            m.lo_mm[a] = std::min(m.lo_mm[a], p[a]);
            m.hi_mm[a] = std::max(m.hi_mm[a], p[a]);
          }
          shell.points_mm.push_back(p);
        }
      }
    }
    std::sort(shell.points_mm.begin(), shell.points_mm.end(), [](Vec3 a, Vec3 b) { return a.x < b.x; });
    const Components parts = connected_components(mask, n, 1, Connectivity::full);
    const auto largest =
        static_cast<std::uint32_t>(std::max_element(parts.voxels.begin(), parts.voxels.end()) - parts.voxels.begin());
    for (std::uint32_t c = 0; c < parts.voxels.size(); ++c)
      ++(c == largest || static_cast<double>(parts.voxels[c]) * f.voxel_volume_mm3() >= kSpeck_mm3 ? m.parts
                                                                                                   : m.specks);
    Part part;
    Vec3 mean{};
    for (std::size_t r = 0; r < parts.runs.size(); ++r) {
      if (parts.component[r] != largest) continue;
      const Run& run = parts.runs[r];
      const int j = static_cast<int>(run.row) % n[1], k = static_cast<int>(run.row) / n[1];
      for (std::uint32_t i = run.begin; i < run.end; ++i) {
        part.voxels.push_back({static_cast<int>(i), j, k});
        mean += Vec3{double(i), double(j), double(k)};
      }
    }
    mean = mean / static_cast<double>(part.voxels.size());
    const auto& middle = *std::min_element(part.voxels.begin(), part.voxels.end(), [&](const auto& a, const auto& b) {
      const auto d = [&](const auto& x) {
        const Vec3 w{(x[0] - mean.x) * f.spacing_mm.x, (x[1] - mean.y) * f.spacing_mm.y,
                     (x[2] - mean.z) * f.spacing_mm.z};
        return dot(w, w);
      };
      return d(a) < d(b);
    });
    m.middle_mm = f.world_from_index(
        {double(box.lo[0] + middle[0]), double(box.lo[1] + middle[1]), double(box.lo[2] + middle[2])});
    if (part.voxels.size() <= kLongestPath && plausibility_of(m).has_length) {
      for (std::uint32_t v = 0; v < part.voxels.size(); ++v)
        part.number[Part::name(part.voxels[v][0], part.voxels[v][1], part.voxels[v][2])] = v;
      const auto end = farthest(part, f.spacing_mm, 0).first;
      // Between the outer faces of the voxels at both ends.
      m.length_mm =
          farthest(part, f.spacing_mm, end).second + std::min({f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z});
    }
    all.push_back(std::move(m));
    shells.push_back(std::move(shell));
  }
  // Between centres of voxels that touch lies one voxel: that much is no gap.
  const double voxel = std::cbrt(f.voxel_volume_mm3());
  for (std::size_t a = 0; a < all.size(); ++a) {
    for (std::size_t b = a + 1; b < all.size(); ++b) {
      const double gap = std::max(0.0, nearest(shells[a], shells[b]) - voxel);
      all[a].gaps.push_back({all[b].structure.value, gap});
      all[b].gaps.push_back({all[a].structure.value, gap});
    }
  }
  for (StructureMeasure& m : all)
    std::stable_sort(m.gaps.begin(), m.gaps.end(), [](const auto& x, const auto& y) { return x.mm < y.mm; });
  return all;
}

namespace {

// Of one side. What is 0 is not judged.
struct Usual {
  std::vector<const char*> words;  // any of them, in lower case
  double from_mm3, to_mm3, from_mm, to_mm;
  int parts;
  const char* source;
};

constexpr const char* kTextbook = tr_later("textbook anatomy");

const std::vector<Usual>& usual() {
  // In this order: "facial nerve" before "nerve". Ranges are wide: what lies outside is worth a look, not wrong.
  static const std::vector<Usual> table{
      {{"facial", "n. vii", "nervus vii"},
       15,
       160,
       25,
       55,
       1,
       tr_later("canal 33.3 +- 2.0 mm, 47 ears (doi 10.15953/j.ctta.2026.163); with the meatal part up to 50")},
      {{"chorda"}, 0.5, 30, 8, 45, 1, kTextbook},
      {{"alveolar", "mandibular nerve", "mandibular canal"}, 100, 900, 40, 100, 1, kTextbook},
      {{"sigmoid", "transverse sinus"}, 1000, 20000, 25, 200, 1, kTextbook},
      {{"carotid"}, 200, 6000, 15, 150, 1, kTextbook},
      {{"ossicle"}, 20, 90, 0, 0, 3, kTextbook},
      {{"malleus", "incus"}, 6, 30, 0, 0, 1, kTextbook},
      {{"stapes"}, 0.5, 6, 0, 0, 1, kTextbook},
      {{"cochlea"}, 40, 130, 0, 0, 1, kTextbook},
      {{"labyrinth", "inner ear"}, 120, 420, 0, 0, 1, kTextbook},
      {{"air cell", "mastoid cell"},
       1000,
       25000,
       0,
       0,
       0,
       tr_later("classes below 5, 5 to 8, above 8 mL (CT series); mean 9 mL of 8 bones (micro-CT)")},
      {{"ear canal", "external canal", "auditory canal"}, 400, 2500, 0, 0, 1, kTextbook},
      {{"tympanic", "middle ear"}, 300, 4000, 0, 0, 1, kTextbook},
  };
  return table;
}

std::string whole(double v) {
  return v >= 10 ? std::to_string(std::lround(v)) : shown_figures(format_number(std::round(v * 10) / 10));
}

}  // namespace

Plausibility plausibility_of(const StructureMeasure& m) {
  const std::string name = lower_case(m.structure.name);
  Plausibility p;
  for (const Usual& u : usual()) {
    if (std::none_of(u.words.begin(), u.words.end(), [&](const char* w) { return name.find(w) != std::string::npos; }))
      continue;
    const int sides = m.on_both_sides() ? 2 : 1;
    p.known = true;
    p.source = tr(u.source);
    p.has_length = u.to_mm > 0;
    const auto add = [](std::string& text, const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
    const auto range = [](const char* text, double from, double to) {
      return filled(text, {{"from", whole(from)}, {"to", whole(to)}});
    };
    if (u.to_mm > 0) add(p.expected, range(tr("{from} to {to} mm long"), u.from_mm, u.to_mm));
    if (u.to_mm3 > 0)
      add(p.expected, u.to_mm3 >= 1000 ? range(tr("{from} to {to} mL"), u.from_mm3 / 1000, u.to_mm3 / 1000)
                                       : range(tr("{from} to {to} mm³"), u.from_mm3, u.to_mm3));
    if (u.parts > 0)
      add(p.expected, u.parts == 1 ? std::string(tr("one piece"))
                                   : filled(tr("up to {n} fragments"), {{"n", std::to_string(u.parts)}}));
    if (sides == 2) add(p.expected, tr("each side"));
    const double volume = m.volume_mm3 / sides;
    if (volume < u.from_mm3) add(p.doubt, tr_of("size of a structure", "small"));
    if (u.to_mm3 > 0 && volume > u.to_mm3) add(p.doubt, tr_of("size of a structure", "large"));
    if (u.to_mm > 0 && m.length_mm > 0 && m.length_mm < u.from_mm) add(p.doubt, tr_of("size of a structure", "short"));
    if (u.to_mm > 0 && m.length_mm > u.to_mm) add(p.doubt, tr_of("size of a structure", "long"));
    if (u.parts > 0 && m.parts > u.parts * sides)
      add(p.doubt, filled(tr("in {n} fragments"), {{"n", std::to_string(m.parts)}}));
    p.fits = p.doubt.empty();
    break;
  }
  return p;
}

std::vector<float> thickness_below(const TriMesh& mesh, const BrickGrid& bone, double reach_mm,
                                   const Context& context) {
  std::vector<float> below(mesh.points_mm.size(), static_cast<float>(reach_mm));
  if (mesh.normals.size() != mesh.points_mm.size()) return below;
  parallel_for(below.size(), 1 << 14, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      below[p] = static_cast<float>(
          thickness_mm(bone, from_floats(mesh.points_mm[p]), -from_floats(mesh.normals[p]), reach_mm));
  });
  return below;
}

}  // namespace osteo::inline assessment::case_report
