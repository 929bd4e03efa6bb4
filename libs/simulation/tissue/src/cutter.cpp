#include "cutter.h"

#include <algorithm>
#include <map>

namespace osteo::inline simulation::tissue {

Cutter::Cutter(const TissueModel& whole)
    : there_(whole.tets().size(), true), of_point_(whole.point_count()), had_(whole.element_count()) {
  std::map<std::array<std::uint32_t, 4>, std::uint32_t>
      by_points;  // edges, faces and single tetrahedra, sorted, padded with the last
  std::vector<std::uint32_t> voxels;
  const auto key = [](std::span<const std::uint32_t> nodes) {
    std::array<std::uint32_t, 4> k{};
    std::copy(nodes.begin(), nodes.end(), k.begin());
    std::sort(k.begin(), k.begin() + static_cast<std::ptrdiff_t>(nodes.size()));
    for (std::size_t i = nodes.size(); i < 4; ++i) k[i] = k[nodes.size() - 1];
    return k;
  };
  for (std::uint32_t c = 0; c < whole.element_count(); ++c) {
    whole_.push_back(whole.constraints()[c].stiffness);
    if (whole.nodes(c).size() == 8) {
      voxels.push_back(c);
    } else {
      by_points[key(whole.nodes(c))] = c;
    }
  }
  for (std::uint32_t t = 0; t < there_.size(); ++t) {
    first_.push_back(static_cast<std::uint32_t>(constraint_.size()));
    const auto& tet = whole.tets()[t];
    const auto add = [&](std::span<const std::uint32_t> nodes) {
      if (const auto found = by_points.find(key(nodes)); found != by_points.end()) constraint_.push_back(found->second);
    };
    for (std::size_t i = 0; i < 4; ++i) {
      ++of_point_[tet[i]];
      for (std::size_t j = i + 1; j < 4; ++j) {
        const std::uint32_t edge[2] = {tet[i], tet[j]};
        add(edge);
      }
      const std::uint32_t face[3] = {tet[(i + 1) % 4], tet[(i + 2) % 4], tet[(i + 3) % 4]};
      add(face);
    }
    add(tet);
    if (t / 5 < voxels.size()) constraint_.push_back(voxels[t / 5]);
  }
  first_.push_back(static_cast<std::uint32_t>(constraint_.size()));
  for (const std::uint32_t c : constraint_) ++had_[c];
  has_ = had_;
}

void Cutter::cut(TissueModel& model, std::span<const std::uint32_t> tets) {
  for (const std::uint32_t t : tets) {
    if (t >= there_.size() || !there_[t]) continue;
    there_[t] = false;
    for (const std::uint32_t p : model.tets()[t]) --of_point_[p];
    for (std::uint32_t i = first_[t]; i < first_[t + 1]; ++i) {
      const std::uint32_t c = constraint_[i];
      --has_[c];
      const bool voxel = model.constraints()[c].nodes == 8;
      model.set_stiffness(c, voxel ? 0 : whole_[c] * static_cast<double>(has_[c]) / static_cast<double>(had_[c]));
    }
  }
}

}  // namespace osteo::inline simulation::tissue
