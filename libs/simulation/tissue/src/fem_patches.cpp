// Patches of tetrahedra over which TetOrder::t4_mean averages.
#include <algorithm>
#include <set>

#include "osteo/simulation/tissue/fem.h"
#include "tet_faces.h"

namespace osteo::inline simulation {
namespace {

constexpr std::size_t kTetsAPatch = 8, kFewTets = 4;
constexpr std::uint32_t kNoPatch = 0xffffffffU;

using Lists = std::vector<std::vector<std::uint32_t>>;

// Of each tetrahedron those of the same material (as `same` says) that share a face with it.
template <typename Same>
Lists neighbours_of(const FemBody& body, const Same& same) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> faces;
  for (std::uint32_t e = 0; e < body.tet_count(); ++e) {
    const auto n = body.nodes(e);
    for (const auto& f : kTetFaces) {
      faces.push_back({{n[f[0]], n[f[1]], n[f[2]]}, e});
      std::sort(faces.back().first.begin(), faces.back().first.end());
    }
  }
  std::sort(faces.begin(), faces.end());
  Lists near(body.tet_count());
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    const std::uint32_t a = faces[i].second, b = faces[i + 1].second;
    if (faces[i].first != faces[i + 1].first || !same(a, b)) continue;
    near[a].push_back(b);
    near[b].push_back(a);
  }
  return near;
}

// Greedy: where the fewest neighbours are left a patch begins, and takes the neighbour that shares most faces with it,
// so that patches are round and few tetrahedra are left over; those join a neighbour's patch afterwards.
class Patching {
 public:
  Patching(const FemBody& body, Lists near) : body_(body), near_(std::move(near)), of_(near_.size(), kNoPatch) {
    left_.resize(near_.size());
    for (std::uint32_t e = 0; e < near_.size(); ++e) open_.insert({left_[e] = near_[e].size(), e});
    while (!open_.empty()) grow_one();
    for (std::uint32_t g = 0; g < groups_.size(); ++g) {
      if (groups_[g].size() < kFewTets) join_to_neighbour(g);
    }
  }
  // Those that joined another are empty.
  [[nodiscard]] Lists& groups() { return groups_; }
  // Nodes of both lists of tetrahedra, each once, in order.
  [[nodiscard]] std::vector<std::uint32_t> nodes_of(std::span<const std::uint32_t> tets,
                                                    std::span<const std::uint32_t> more) const {
    std::vector<std::uint32_t> all;
    for (const auto list : {tets, more}) {
      for (const std::uint32_t e : list) all.insert(all.end(), body_.nodes(e).begin(), body_.nodes(e).end());
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

 private:
  void take(std::uint32_t e) {
    of_[e] = static_cast<std::uint32_t>(groups_.size() - 1);
    groups_.back().push_back(e);
    open_.erase({left_[e], e});
    for (const std::uint32_t n : near_[e]) {
      if (of_[n] != kNoPatch) continue;
      open_.erase({left_[n], n});
      open_.insert({--left_[n], n});
    }
  }

  void grow_one() {
    groups_.emplace_back();
    take(open_.begin()->second);
    while (groups_.back().size() < kTetsAPatch) {
      const std::uint32_t best = best_neighbour();
      if (best == kNoPatch) break;
      take(best);
    }
  }

  // Most faces shared with the last group, then fewest neighbours left, then the first.
  [[nodiscard]] std::uint32_t best_neighbour() const {
    std::uint32_t best = kNoPatch;
    std::size_t best_shared = 0;
    for (const std::uint32_t e : groups_.back()) {
      for (const std::uint32_t n : near_[e]) {
        if (of_[n] != kNoPatch) continue;
        std::size_t shared = 0;
        for (const std::uint32_t m : near_[n]) shared += of_[m] == groups_.size() - 1 ? 1 : 0;
        if (best != kNoPatch &&
            (shared < best_shared || (shared == best_shared && std::pair{left_[n], n} >= std::pair{left_[best], best})))
          continue;
        best = n;
        best_shared = shared;
      }
    }
    return best;
  }

  // To the smallest whose nodes and its own are not too many.
  void join_to_neighbour(std::uint32_t g) {
    std::pair<std::size_t, std::uint32_t> smallest{0, kNoPatch};
    for (const std::uint32_t e : groups_[g]) {
      for (const std::uint32_t n : near_[e]) {
        const std::uint32_t other = of_[n];
        if (other == g || nodes_of(groups_[g], groups_[other]).size() > Energy::kMaxNodes) continue;
        if (smallest.second == kNoPatch || std::pair{groups_[other].size(), other} < smallest)
          smallest = {groups_[other].size(), other};
      }
    }
    if (smallest.second == kNoPatch) return;
    auto& to = groups_[smallest.second];
    for (const std::uint32_t e : groups_[g]) of_[e] = smallest.second;
    to.insert(to.end(), groups_[g].begin(), groups_[g].end());
    groups_[g].clear();
  }

  const FemBody& body_;
  Lists near_;
  std::vector<std::uint32_t> of_;  // the group of each tetrahedron
  Lists groups_;
  std::vector<std::size_t> left_;                         // of its neighbours, those in no group
  std::set<std::pair<std::size_t, std::uint32_t>> open_;  // neighbours left, tetrahedron
};

}  // namespace

void FemBody::make_patches() {
  Patching patching(*this, neighbours_of(*this, [&](std::uint32_t a, std::uint32_t b) {
    return material(a).young_mpa == material(b).young_mpa && material(a).poisson == material(b).poisson;
  }));
  for (auto& group : patching.groups()) {
    if (group.empty()) continue;
    std::sort(group.begin(), group.end());
    Patch p;
    p.nodes = patching.nodes_of(group, {});
    for (const std::uint32_t e : group) {
      std::array<std::uint8_t, 4> local{};
      for (std::size_t a = 0; a < 4; ++a)
        local[a] =
            static_cast<std::uint8_t>(std::lower_bound(p.nodes.begin(), p.nodes.end(), nodes(e)[a]) - p.nodes.begin());
      p.local.push_back(local);
      p.mm3 += gauss_[e].weight_mm3;
    }
    p.tets = std::move(group);
    patches_.push_back(std::move(p));
  }
}

}  // namespace osteo::inline simulation
