// A label map beside what is found without training: compare_with_ear().
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>

#include "agreement_surface.h"
#include "label_line.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::inline imaging {
namespace {

using namespace segment;

constexpr double kBothEarsMm = 90;  // what is labelled reaches so far across: it is of both ears

std::string plain(std::string_view name) {
  std::string low = lower_case(std::string(name));
  std::replace(low.begin(), low.end(), '_', ' ');
  std::replace(low.begin(), low.end(), '-', ' ');
  return low;
}

/// What of an ear is compared: the names of label maps, and how far outlines of two methods may lie apart. Chosen so
/// that true labels of a phantom do not differ (EarAgreement.OfTrueLabelsNothingDiffers).
struct Kind {
  std::vector<std::string_view> names;  // the first is looked for; the others are of the same air
  EarStructure what;
  Tolerance tolerance;
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {{"ear canal"}, EarStructure::ear_canal, {1.5, 10, Tolerance::Open::ends, 6}},
      {{"sigmoid sinus"}, EarStructure::sigmoid_sinus, {2, 20, Tolerance::Open::ends, 9}},
      {{"labyrinth"}, EarStructure::labyrinth, {1, 6, Tolerance::Open::nowhere}},
      {{"air cells", "tympanic cavity"}, EarStructure::air_cells, {1.5, 30, Tolerance::Open::box}}};
  return all;
}

std::vector<const Structure*> named(const Labels& labels, std::string_view name) {
  std::vector<const Structure*> all;
  for (const Structure& s : labels.structures)
    if (plain(s.name).find(name) != std::string::npos) all.push_back(&s);
  return all;
}

std::size_t row_of(const Frame& f, int j, int k) {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(f.dims[1]) + static_cast<std::size_t>(j)) *
         static_cast<std::size_t>(f.dims[0]);
}

/// All voxels of a frame that `is` says yes to, with a margin. Nothing where there are none.
std::optional<MaskBox> box_of(const Frame& f, double margin_mm, const std::function<bool(std::size_t)>& is) {
  std::array<int, 3> lo{f.dims}, hi{-1, -1, -1};
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      const std::size_t row = row_of(f, j, k);
      for (int i = 0; i < f.dims[0]; ++i) {
        if (!is(row + static_cast<std::size_t>(i))) continue;
        const std::array<int, 3> p{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], p[a]);
          hi[a] = std::max(hi[a], p[a]);
        }
      }
    }
  }
  if (hi[0] < 0) return std::nullopt;
  MaskBox box;
  box.frame = f;
  for (std::size_t a = 0; a < 3; ++a) {
    const int margin = static_cast<int>(std::ceil(margin_mm / f.spacing_mm[a]));
    box.lo[a] = std::max(0, lo[a] - margin);
    box.frame.dims[a] = std::min(f.dims[a] - 1, hi[a] + margin) - box.lo[a] + 1;
  }
  box.frame.origin_mm = f.world_from_index(
      {static_cast<double>(box.lo[0]), static_cast<double>(box.lo[1]), static_cast<double>(box.lo[2])});
  box.in.resize(box.frame.voxel_count());
  return box;
}

/// The voxel of the whole frame.
std::size_t whole(const MaskBox& box, const Frame& f, std::size_t v) {
  const auto p = box.place(v);
  return row_of(f, p[1] + box.lo[1], p[2] + box.lo[2]) + static_cast<std::size_t>(p[0] + box.lo[0]);
}

class Comparison {
 public:
  Comparison(const Image& ct, const Labels& labels, const Context& context)
      : ct_(ct), labels_(labels), context_(context), voxels_(make_voxels<std::uint8_t>(ct.frame.voxel_count())) {
    std::copy_n(labels.voxels.get(), ct.frame.voxel_count(), voxels_.get());
    out_.apart.assign(ct.frame.voxel_count(), 0);
    quiet_.threads = context.threads;
    quiet_.on_progress([this](double, std::string_view) { context_.check_cancelled(); });
  }

  EarComparison run() {
    std::vector<const Kind*> known;
    for (const Kind& k : kinds()) {
      const bool there = std::all_of(k.names.begin(), k.names.end(),
                                     [&](std::string_view name) { return !named(labels_, name).empty(); });
      if (there) known.push_back(&k);
    }
    if (!known.empty()) {
      find(known);
      for (const Kind* k : known) compare(*k);
    }
    out_.fused = labels_;
    out_.fused.voxels = voxels_;
    return std::move(out_);
  }

 private:
  [[nodiscard]] Vec3 place(std::size_t v) const {
    const auto nx = static_cast<std::size_t>(ct_.frame.dims[0]), ny = static_cast<std::size_t>(ct_.frame.dims[1]);
    return ct_.frame.world_from_index(
        {static_cast<double>(v % nx), static_cast<double>(v / nx % ny), static_cast<double>(v / nx / ny)});
  }

  /// The ears that are labelled, by where their parts lie; both where that does not tell it.
  struct Ears {
    std::vector<Side> sides;
    bool both = false;  ///< both are there; else the second is looked for where the first is not found
    double middle_x = 0;
  };
  Ears ears(const std::vector<const Kind*>& known) const {
    constexpr std::array<std::string_view, 5> kInward{"labyrinth", "facial nerve", "tympanic cavity", "carotid",
                                                      "ossicle"};
    std::array<bool, 256> counts{}, canal{}, inward{};
    for (const Kind* k : known)
      for (const std::string_view name : k->names)
        for (const Structure* s : named(labels_, name)) counts[s->value] = true;
    for (const Structure* s : named(labels_, "ear canal")) canal[s->value] = true;
    for (const std::string_view name : kInward)
      for (const Structure* s : named(labels_, name)) inward[s->value] = true;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    std::array<double, 2> sum{}, count{};
    for (std::size_t v = 0; v < ct_.frame.voxel_count(); ++v) {
      const std::uint8_t value = labels_.voxels[v];
      if (!counts[value] && !canal[value] && !inward[value]) continue;
      const double x = place(v).x;
      low = std::min(low, x);
      high = std::max(high, x);
      if (canal[value]) sum[0] += x, count[0] += 1;
      if (inward[value]) sum[1] += x, count[1] += 1;
    }
    Ears ears;
    ears.middle_x = 0.5 * (low + high);
    ears.both = high - low > kBothEarsMm;
    if (ears.both || count[0] == 0 || count[1] == 0)
      ears.sides = {Side::left, Side::right};
    else
      ears.sides = {sum[0] / count[0] > sum[1] / count[1] ? Side::left : Side::right};
    return ears;
  }

  /// The label's deepest voxel on a side: in the vestibule, where it is a labyrinth.
  std::optional<Vec3> deepest(const Ears& ears, Side side) {
    std::array<bool, 256> is{};
    for (const Structure* s : named(labels_, "labyrinth")) is[s->value] = true;
    auto box = box_of(ct_.frame, 1, [&](std::size_t v) {
      return is[labels_.voxels[v]] && (!ears.both || (place(v).x > ears.middle_x) == (side == Side::left));
    });
    if (!box) return std::nullopt;
    for (std::size_t v = 0; v < box->in.size(); ++v) box->in[v] = is[labels_.voxels[whole(*box, ct_.frame, v)]] ? 1 : 0;
    const std::vector<float> depth = squared_distance_mm2(box->in, box->frame, 0, quiet_);
    const auto best = static_cast<std::size_t>(std::max_element(depth.begin(), depth.end()) - depth.begin());
    return box->world(best);
  }

  void find(const std::vector<const Kind*>& known) {
    found_.assign(ct_.frame.voxel_count(), 0);
    const Ears where = ears(known);
    for (std::size_t n = 0; n < where.sides.size(); ++n) {
      context_.progress(0.5 * static_cast<double>(n) / static_cast<double>(where.sides.size()), "comparing");
      EarParams params;
      params.side = where.sides[n];
      params.what.clear();
      for (const Kind* k : known) {
        if (k->what == EarStructure::labyrinth) {
          const auto point = deepest(where, params.side);
          if (!point) continue;
          for (std::size_t a = 0; a < 3; ++a) params.labyrinth_mm[a] = (*point)[a];
        }
        params.what += (params.what.empty() ? "" : ",") +
                       std::string(EnumNames<EarStructure>::values[static_cast<std::size_t>(k->what)]);
      }
      if (params.what.empty()) return;
      const EarFindings ear = find_ear_structures(ct_, params, quiet_);
      bool any = false;
      for (const EarFinding& f : ear.findings) {
        auto& known_of = findings_[static_cast<std::size_t>(f.what)];
        if (!known_of || f.found) known_of = f;
        any = any || f.found;
      }
      for (std::size_t v = 0; v < found_.size(); ++v)
        if (ear.labels.voxels[v] != 0) found_[v] = ear.labels.voxels[v];
      if (any && !where.both) return;
    }
  }

  void compare(const Kind& kind) {
    ComparedStructure c;
    std::array<bool, 256> is{};
    for (const std::string_view name : kind.names) {
      for (const Structure* s : named(labels_, name)) {
        c.name += (c.name.empty() ? "" : " and ") + s->name;
        c.values.push_back(s->value);
        is[s->value] = true;
      }
    }
    const auto exact = static_cast<std::uint8_t>(1 + static_cast<int>(kind.what));
    const std::optional<EarFinding>& finding = findings_[static_cast<std::size_t>(kind.what)];
    auto box = box_of(ct_.frame, 1, [&](std::size_t v) { return is[labels_.voxels[v]] || found_[v] == exact; });
    if (box) {
      MaskBox other = *box;
      std::size_t ours = 0, theirs = 0;
      for (std::size_t v = 0; v < box->in.size(); ++v) {
        const std::size_t w = whole(*box, ct_.frame, v);
        box->in[v] = is[labels_.voxels[w]] ? 1 : 0;
        other.in[v] = found_[w] == exact ? 1 : 0;
        ours += box->in[v];
        theirs += other.in[v];
      }
      c.labelled = ours > 0;
      c.found = theirs > 0;
      if (c.labelled && c.found) {
        const SurfaceDifference d = difference(*box, other, kind.tolerance, quiet_);
        c.dice = d.dice;
        c.within_mm = d.within_mm;
        c.places = d.places;
        for (std::size_t v = 0; v < box->in.size(); ++v)
          if (d.apart[v] != 0) out_.apart[whole(*box, ct_.frame, v)] = d.apart[v];
      } else if (c.found && c.values.size() == 1) {
        draw_found(*box, other, c.values.front());
      }
    }
    if (!c.found) c.why = finding && !finding->why.empty() ? finding->why : std::string("nothing to look for it by");
    out_.structures.push_back(std::move(c));
  }

  /// Where the label map has none: into its background and its bone.
  void draw_found(const MaskBox& box, const MaskBox& other, std::uint8_t value) {
    std::array<bool, 256> free{};
    free[0] = true;
    for (const Structure* s : named(labels_, "bone")) free[s->value] = true;
    for (std::size_t v = 0; v < box.in.size(); ++v) {
      const std::size_t w = whole(box, ct_.frame, v);
      if (other.in[v] != 0 && free[voxels_[static_cast<std::ptrdiff_t>(w)]])
        voxels_[static_cast<std::ptrdiff_t>(w)] = value;
    }
  }

  const Image& ct_;
  const Labels& labels_;
  const Context& context_;
  Context quiet_;
  std::shared_ptr<std::uint8_t[]> voxels_;
  std::vector<std::uint8_t> found_;
  std::array<std::optional<EarFinding>, kEarStructures> findings_;
  EarComparison out_;
};

}  // namespace

EarComparison compare_with_ear(const Image& ct, const Labels& labels, const Context& context) {
  if (!(labels.frame.dims == ct.frame.dims && same_place(labels.frame, ct.frame)))
    throw Error(ExitCode::usage, "the label map does not lie on the voxels of the CT", "make it from this CT");
  return Comparison(ct, labels, context).run();
}

}  // namespace osteo::inline imaging
