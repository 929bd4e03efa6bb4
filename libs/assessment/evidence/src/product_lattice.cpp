#include "product_lattice.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline assessment {

CellBlock block_around(const CellBlock& a, const CellBlock& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  CellBlock c;
  for (std::size_t x = 0; x < 3; ++x) {
    c.lo[x] = std::min(a.lo[x], b.lo[x]);
    c.hi[x] = std::max(a.hi[x], b.hi[x]);
  }
  return c;
}

CellBlock common_block(const CellBlock& a, const CellBlock& b) {
  CellBlock c;
  for (std::size_t x = 0; x < 3; ++x) {
    c.lo[x] = std::max(a.lo[x], b.lo[x]);
    c.hi[x] = std::max(c.lo[x], std::min(a.hi[x], b.hi[x]));
  }
  return c;
}

CellBlock block_of(const BitMask& mask) {
  CellBlock b;
  const int ny = mask.dims()[1];
  for (std::size_t r = 0; r < mask.rows(); ++r) {
    const std::span<const std::uint64_t> row = mask.row(r);
    int first = -1, last = -1;
    for (std::size_t w = 0; w < row.size(); ++w) {
      if (row[w] == 0) continue;
      const int base = static_cast<int>(w) * 64;
      if (first < 0) first = base + std::countr_zero(row[w]);
      last = base + 63 - std::countl_zero(row[w]);
    }
    if (first < 0) continue;
    const int j = static_cast<int>(r) % ny, k = static_cast<int>(r) / ny;
    b = block_around(b, {{first, j, k}, {last + 1, j + 1, k + 1}});
  }
  return b;
}

double block_slack_mm(const StructureMap& structures, double cell_mm, int edge) {
  const double lattice_mm = std::max(2 * structures.label_spacing_mm()[1], 0.3);
  return std::sqrt(3.0) * ((edge - 1) / 2.0 * cell_mm + lattice_mm);
}

namespace {

// One structure's cells, in blocks that are taken apart where its face may go through.
class Labeller {
 public:
  Labeller(const Frame& lattice, const StructureMap& structures, const std::vector<std::size_t>& number, std::size_t s,
           const CellBlock& within, std::vector<std::uint8_t>& label)
      : lattice_(lattice), structures_(structures), number_(number), s_(s), within_(within), label_(label) {
    for (std::size_t e = 0; e < kEdges.size(); ++e)
      slack_mm_[e] = block_slack_mm(structures, lattice.spacing_mm.x, kEdges[e]);
  }
  static constexpr std::array<int, 2> kEdges{16, 4};

  void visit(std::array<int, 3> at, std::size_t level) const {
    const int edge = kEdges[level];
    const double middle = (edge - 1) / 2.0;
    const double d =
        structures_.distance_mm(s_, lattice_.world_from_index({at[0] + middle, at[1] + middle, at[2] + middle}));
    if (d > slack_mm_[level]) return;
    CellBlock block{at, {at[0] + edge, at[1] + edge, at[2] + edge}};
    block = common_block(block, within_);
    if (d < -slack_mm_[level]) {
      inside(block);
    } else if (level + 1 < kEdges.size()) {
      const int step = kEdges[level + 1];
      for (int k = at[2]; k < block.hi[2]; k += step)
        for (int j = at[1]; j < block.hi[1]; j += step)
          for (int i = at[0]; i < block.hi[0]; i += step) visit({i, j, k}, level + 1);
    } else {
      each_cell(block, [&](int i, int j, int k) { one(i, j, k); });
    }
  }

 private:
  [[nodiscard]] std::uint8_t& label(int i, int j, int k) const {
    return label_[(static_cast<std::size_t>(k) * static_cast<std::size_t>(lattice_.dims[1]) +
                   static_cast<std::size_t>(j)) *
                      static_cast<std::size_t>(lattice_.dims[0]) +
                  static_cast<std::size_t>(i)];
  }
  void one(int i, int j, int k) const {
    const Vec3 at = lattice_.world_from_index({double(i), double(j), double(k)});
    const double d = structures_.distance_mm(s_, at);
    if (d >= 0) return;
    std::uint8_t& l = label(i, j, k);
    if (l == 0 || d < structures_.distance_mm(number_[l], at)) l = structures_.values()[s_];
  }
  // So deep inside that no other structure is near: each voxel of labels is of one alone.
  void inside(const CellBlock& block) const {
    each_cell(block, [&](int i, int j, int k) { label(i, j, k) = structures_.values()[s_]; });
  }
  const Frame& lattice_;
  const StructureMap& structures_;
  const std::vector<std::size_t>& number_;
  std::size_t s_;
  const CellBlock& within_;
  std::vector<std::uint8_t>& label_;
  std::array<double, kEdges.size()> slack_mm_{};
};

}  // namespace

std::vector<std::uint8_t> label_cells(const Frame& lattice, const StructureMap& structures,
                                      const std::vector<CellBlock>& within, const Context& context) {
  std::vector<std::uint8_t> label(lattice.voxel_count());
  std::vector<std::size_t> number(256);
  for (std::size_t s = 0; s < structures.values().size(); ++s) number[structures.values()[s]] = s;
  constexpr int kEdge = Labeller::kEdges[0];
  for (std::size_t s = 0; s < structures.values().size(); ++s) {
    const CellBlock& b = within[s];
    if (b.empty()) continue;
    const Labeller labeller(lattice, structures, number, s, b, label);
    const auto layers = static_cast<std::size_t>((b.hi[2] - b.lo[2] + kEdge - 1) / kEdge);
    parallel_for(layers, 1, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t l = begin; l < end; ++l)
        for (int j = b.lo[1]; j < b.hi[1]; j += kEdge)
          for (int i = b.lo[0]; i < b.hi[0]; i += kEdge)
            labeller.visit({i, j, b.lo[2] + static_cast<int>(l) * kEdge}, 0);
    });
  }
  return label;
}

CavityDistance::CavityDistance(const BitMask& cavity, const Frame& lattice, CellBlock part, const Context& context)
    : dims_(lattice.dims) {
  const CellBlock all{{0, 0, 0}, dims_}, there = block_of(cavity);
  if (there.empty()) return;
  part_ = block_around(common_block(part, all), there);
  Frame f = lattice;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = part_.hi[a] - part_.lo[a];
  std::vector<std::uint8_t> mask(f.voxel_count());
  std::size_t at = 0;
  for (int k = part_.lo[2]; k < part_.hi[2]; ++k) {
    for (int j = part_.lo[1]; j < part_.hi[1]; ++j, at += static_cast<std::size_t>(f.dims[0])) {
      if (k < there.lo[2] || k >= there.hi[2] || j < there.lo[1] || j >= there.hi[1]) continue;
      for (int i = there.lo[0]; i < there.hi[0]; ++i)
        mask[at + static_cast<std::size_t>(i - part_.lo[0])] = cavity.at(i, j, k) ? 1 : 0;
    }
  }
  mm_ = squared_distance_mm2(mask, f, 1, context);
  for (float& d : mm_) d = std::sqrt(d);
}

double CavityDistance::at(int i, int j, int k) const {
  const std::array<int, 3> c{i, j, k};
  std::size_t v = 0;
  for (std::size_t a = 3; a-- > 0;) {
    if (c[a] < part_.lo[a] || c[a] >= part_.hi[a]) return kFarMm;
    v = v * static_cast<std::size_t>(part_.hi[a] - part_.lo[a]) + static_cast<std::size_t>(c[a] - part_.lo[a]);
  }
  return static_cast<double>(mm_[v]);
}

double CavityDistance::linear(Vec3 index) const {
  std::array<int, 3> lo{};
  std::array<float, 3> u{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double c = std::clamp(index[a], 0.0, static_cast<double>(dims_[a] - 1) - 1e-9);
    lo[a] = std::min(static_cast<int>(c), std::max(0, dims_[a] - 2));
    u[a] = static_cast<float>(c - lo[a]);
  }
  float d[8];
  for (int c = 0; c < 8; ++c) {
    const double corner = at(std::min(lo[0] + (c & 1), dims_[0] - 1), std::min(lo[1] + (c >> 1 & 1), dims_[1] - 1),
                             std::min(lo[2] + (c >> 2), dims_[2] - 1));
    if (corner >= kFarMm) return kFarMm;
    d[c] = static_cast<float>(corner);
  }
  return static_cast<double>(mix_linear(d, u[0], u[1], u[2]));
}

CellBlock Product::Lattice::near(std::uint8_t value, double mm) const {
  CellBlock b;
  const double more = mm / cell_mm;
  for (std::size_t a = 0; a < 3; ++a) {
    const double last = dims[a];
    b.lo[a] = static_cast<int>(std::clamp(std::floor(faces[value].lo[a] - more), 0.0, last));
    b.hi[a] = static_cast<int>(std::clamp(std::ceil(faces[value].hi[a] + more) + 1, 0.0, last));
  }
  return b;
}

}  // namespace osteo::inline assessment
