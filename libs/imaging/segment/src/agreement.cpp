// A label map beside what is found without training: compare_with_ear().
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "agreement_surface.h"
#include "label_line.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::inline imaging {
namespace {

using namespace segment;

// Nine tenths of what is labelled reach so far across: it is of both ears. What lies in one ear alone, and all
// together.
constexpr double kBothEarsMm = 55, kBothSidesMm = 90;

/// What of an ear is compared: the names of label maps, and how far outlines of two methods may lie apart. Chosen so
/// that true labels of a phantom do not differ (EarAgreement.OfTrueLabelsNothingDiffers).
struct Kind {
  std::vector<std::string_view> names;  // the first is looked for; the others are of the same air
  EarStructure what;
  Tolerance tolerance;
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {{"ear canal"}, EarStructure::ear_canal, {1.5, 10, Tolerance::Open::ends, 12}},
      {{"sigmoid sinus"}, EarStructure::sigmoid_sinus, {2, 20, Tolerance::Open::ends, 9}},
      {{"labyrinth"}, EarStructure::labyrinth, {1, 6, Tolerance::Open::nowhere}},
      {{"air cells", "tympanic cavity"}, EarStructure::air_cells, {1.5, 30, Tolerance::Open::box}}};
  return all;
}

std::vector<const Structure*> named(const Labels& labels, std::string_view name) {
  std::vector<const Structure*> all;
  for (const Structure& s : labels.structures)
    if (is_called(s.name, name)) all.push_back(&s);
  return all;
}

/// The side that a structure's name says.
std::optional<Side> side_of(const Structure& s) {
  const std::string words = ' ' + plain_name(s.name) + ' ';
  const auto has = [&](std::string_view word) { return words.find(word) != std::string::npos; };
  const bool left = has(" left ") || has(" l "), right = has(" right ") || has(" r ");
  if (left == right) return std::nullopt;
  return left ? Side::left : Side::right;
}

/// What is compared at once: the labels of one kind, of one side where their names say which and both are there.
struct Group {
  const Kind* kind = nullptr;
  std::optional<Side> side;
  std::vector<const Structure*> labels;
};

/// None where one of the kind's names is missing.
std::vector<Group> groups_of(const Labels& labels, const Kind& kind) {
  std::array<Group, 2> sided{Group{&kind, Side::left, {}}, Group{&kind, Side::right, {}}};
  Group all{&kind, std::nullopt, {}};
  std::array<bool, 2> each{true, true};
  bool by_side = true;
  for (const std::string_view name : kind.names) {
    const std::vector<const Structure*> these = named(labels, name);
    if (these.empty()) return {};
    std::array<bool, 2> there{};
    for (const Structure* s : these) {
      all.labels.push_back(s);
      const auto side = side_of(*s);
      by_side = by_side && side;
      if (!side) continue;
      const auto n = static_cast<std::size_t>(*side);
      sided[n].labels.push_back(s);
      there[n] = true;
    }
    each = {each[0] && there[0], each[1] && there[1]};
  }
  if (by_side && each[0] && each[1]) return {sided[0], sided[1]};
  return {all};
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

/// How far voxels reach across, but for the outermost twentieth on either side: specks do not count.
class Spread {
 public:
  void add(double x) {
    ++at_[static_cast<int>(std::floor(x))];
    ++all_;
  }
  [[nodiscard]] std::array<double, 2> most() const {
    std::array<double, 2> ends{};
    std::size_t below = 0;
    bool begun = false;
    for (const auto& [x, count] : at_) {
      if (!begun && 20 * (below + count) > all_) {
        ends[0] = x;
        begun = true;
      }
      if (20 * below < 19 * all_) ends[1] = x + 1;
      below += count;
    }
    return ends;
  }

 private:
  std::map<int, std::size_t> at_;
  std::size_t all_ = 0;
};

constexpr std::uint8_t kOfRight = 100;

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
    std::vector<Group> known;
    for (const Kind& k : kinds())
      for (Group& g : groups_of(labels_, k)) known.push_back(std::move(g));
    if (!known.empty()) {
      find(known);
      for (const Group& g : known) compare(g);
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
  Ears ears(const std::vector<Group>& known) const {
    // By place across, in mm: what is compared, the canal, what lies inward of it, and what one ear has within 55 mm.
    constexpr std::array<std::string_view, 5> kInward{"labyrinth", "facial nerve", "tympanic cavity", "carotid",
                                                      "ossicle"};
    constexpr std::array<std::string_view, 4> kNarrow{"labyrinth", "ear canal", "tympanic cavity", "ossicle"};
    std::array<bool, 256> counts{}, canal{}, inward{};
    std::array<std::size_t, 256> narrow{};  // 1 + which
    for (const Group& g : known)
      for (const Structure* s : g.labels) counts[s->value] = true;
    for (const Structure& s : labels_.structures) {
      canal[s.value] = is_called(s.name, "ear canal");
      // Also their parts and vessels: they lie there as well.
      for (const std::string_view name : kInward)
        inward[s.value] = inward[s.value] || plain_name(s.name).find(name) != std::string::npos;
      for (std::size_t n = 0; n < kNarrow.size(); ++n)
        if (is_called(s.name, kNarrow[n])) narrow[s.value] = 1 + n;
    }
    std::array<Spread, 1 + kNarrow.size()> spread;  // first all that is compared
    std::array<double, 2> sum{}, count{};
    for (std::size_t v = 0; v < ct_.frame.voxel_count(); ++v) {
      const std::uint8_t value = labels_.voxels[v];
      if (!counts[value] && !canal[value] && !inward[value]) continue;
      const double x = place(v).x;
      spread[0].add(x);
      if (narrow[value] != 0) spread[narrow[value]].add(x);
      if (canal[value]) sum[0] += x, count[0] += 1;
      if (inward[value]) sum[1] += x, count[1] += 1;
    }
    Ears ears;
    for (std::size_t n = 0; n < spread.size(); ++n) {
      const auto [low, high] = spread[n].most();
      if (n == 0) ears.middle_x = 0.5 * (low + high);
      if (high - low <= (n == 0 ? kBothSidesMm : kBothEarsMm)) continue;
      ears.both = true;
      ears.middle_x = 0.5 * (low + high);
    }
    for (const Group& g : known) ears.both = ears.both || g.side;
    if (ears.both || count[0] == 0 || count[1] == 0)
      ears.sides = {Side::left, Side::right};
    else
      ears.sides = {sum[0] / count[0] > sum[1] / count[1] ? Side::left : Side::right};
    return ears;
  }

  /// The group's deepest voxel on a side: in the vestibule, where it is a labyrinth.
  std::optional<Vec3> deepest(const Group& group, const Ears& ears, Side side) {
    std::array<bool, 256> is{};
    for (const Structure* s : group.labels) is[s->value] = true;
    const bool split = ears.both && !group.side;
    auto box = box_of(ct_.frame, 1, [&](std::size_t v) {
      return is[labels_.voxels[v]] && (!split || (place(v).x > ears.middle_x) == (side == Side::left));
    });
    if (!box) return std::nullopt;
    for (std::size_t v = 0; v < box->in.size(); ++v) box->in[v] = is[labels_.voxels[whole(*box, ct_.frame, v)]] ? 1 : 0;
    const std::vector<float> depth = squared_distance_mm2(box->in, box->frame, 0, quiet_);
    const auto best = static_cast<std::size_t>(std::max_element(depth.begin(), depth.end()) - depth.begin());
    return box->world(best);
  }

  void find(const std::vector<Group>& known) {
    found_.assign(ct_.frame.voxel_count(), 0);
    const Ears where = ears(known);
    for (std::size_t n = 0; n < where.sides.size(); ++n) {
      context_.progress(0.5 * static_cast<double>(n) / static_cast<double>(where.sides.size()), "comparing");
      EarParams params;
      params.side = where.sides[n];
      params.what.clear();
      for (const Group& g : known) {
        if (g.side && *g.side != params.side) continue;
        if (g.kind->what == EarStructure::labyrinth) {
          const auto point = deepest(g, where, params.side);
          if (!point) continue;
          params.labyrinth_mm = {point->x, point->y, point->z};
        }
        params.what += (params.what.empty() ? "" : ",") +
                       std::string(EnumNames<EarStructure>::values[static_cast<std::size_t>(g.kind->what)]);
      }
      if (params.what.empty()) continue;
      const EarFindings ear = find_ear_structures(ct_, params, quiet_);
      bool any = false;
      for (const EarFinding& f : ear.findings) {
        findings_[static_cast<std::size_t>(params.side)][static_cast<std::size_t>(f.what)] = f;
        any = any || f.found;
      }
      const std::uint8_t ofs = params.side == Side::right ? kOfRight : 0;
      for (std::size_t v = 0; v < found_.size(); ++v)
        if (ear.labels.voxels[v] != 0) found_[v] = static_cast<std::uint8_t>(ofs + ear.labels.voxels[v]);
      if (any && !where.both) return;
    }
  }

  void compare(const Group& group) {
    ComparedStructure c;
    std::array<bool, 256> is{}, exact{};
    for (const Structure* s : group.labels) {
      c.name += (c.name.empty() ? "" : " and ") + s->name;
      c.values.push_back(s->value);
      is[s->value] = true;
    }
    std::string why;
    for (const Side side : {Side::right, Side::left}) {
      if (group.side && *group.side != side) continue;
      const auto& finding = findings_[static_cast<std::size_t>(side)][static_cast<std::size_t>(group.kind->what)];
      if (finding && !finding->why.empty()) why = finding->why;
      exact[(side == Side::right ? kOfRight : 0U) + 1U + static_cast<std::size_t>(group.kind->what)] = true;
    }
    auto box = box_of(ct_.frame, 1, [&](std::size_t v) { return is[labels_.voxels[v]] || exact[found_[v]]; });
    if (box) {
      MaskBox other = *box;
      std::size_t ours = 0, theirs = 0;
      for (std::size_t v = 0; v < box->in.size(); ++v) {
        const std::size_t w = whole(*box, ct_.frame, v);
        box->in[v] = is[labels_.voxels[w]] ? 1 : 0;
        other.in[v] = exact[found_[w]] ? 1 : 0;
        ours += box->in[v];
        theirs += other.in[v];
      }
      c.labelled = ours > 0;
      c.found = theirs > 0;
      if (c.labelled && c.found) {
        const SurfaceDifference d = difference(*box, other, group.kind->tolerance, quiet_);
        c.dice = d.dice;
        c.within_mm = d.within_mm;
        c.places = d.places;
        for (std::size_t v = 0; v < box->in.size(); ++v)
          if (d.apart[v] != 0) out_.apart[whole(*box, ct_.frame, v)] = d.apart[v];
      } else if (c.found && c.values.size() == 1) {
        draw_found(*box, other, c.values.front());
      }
    }
    if (!c.found) c.why = !why.empty() ? why : std::string("nothing to look for it by");
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
  std::vector<std::uint8_t> found_;  // 1 + EarStructure, and kOfRight more on the right
  std::array<std::array<std::optional<EarFinding>, kEarStructures>, 2> findings_;  // of left and right
  EarComparison out_;
};

}  // namespace

EarComparison compare_with_ear(const Image& ct, const Labels& labels, const Context& context) {
  if (!(labels.frame.dims == ct.frame.dims && same_place(labels.frame, ct.frame)))
    throw Error(ExitCode::usage, "the label map does not lie on the voxels of the CT", "make it from this CT");
  return Comparison(ct, labels, context).run();
}

}  // namespace osteo::inline imaging
