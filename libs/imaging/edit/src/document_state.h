// What a document holds and how a step changes it. Private to libs/imaging/edit.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bone_operations.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/edit/document.h"
#include "word_changes.h"

namespace osteo::inline imaging {
namespace edit_inside {

// Zero, and taking no memory where nobody has written: pages come with the first write.
class LabelTexts {
 public:
  explicit LabelTexts(std::size_t voxels)
      : words_((voxels + 7) / 8), voxels_(voxels), at_(static_cast<std::uint64_t*>(std::calloc(words_ + 1, 8))) {
    if (!at_) throw std::bad_alloc();
  }
  [[nodiscard]] std::span<std::uint64_t> words() { return {at_.get(), words_}; }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const {
    return {reinterpret_cast<const std::uint8_t*>(at_.get()), voxels_};
  }
  [[nodiscard]] std::uint8_t* data() { return reinterpret_cast<std::uint8_t*>(at_.get()); }

 private:
  struct Free {
    void operator()(std::uint64_t* p) const { std::free(p); }
  };
  std::size_t words_, voxels_;
  std::unique_ptr<std::uint64_t, Free> at_;
};

// The first value of each word that is written, so that it can be told what changed.
class Recorder {
 public:
  void note(std::span<const std::uint64_t> words, std::size_t first, std::size_t last) {
    for (std::size_t w = first; w <= last; ++w) before_.try_emplace(static_cast<std::uint32_t>(w), words[w]);
  }
  [[nodiscard]] WordChanges changes(std::span<const std::uint64_t> words) const {
    std::vector<std::pair<std::uint32_t, std::uint64_t>> list;
    list.reserve(before_.size());
    for (const auto& [w, old] : before_) {
      if (old != words[w]) list.emplace_back(w, old ^ words[w]);
    }
    std::sort(list.begin(), list.end());
    return WordChanges(list);
  }
  [[nodiscard]] const std::unordered_map<std::uint32_t, std::uint64_t>& before() const { return before_; }

 private:
  std::unordered_map<std::uint32_t, std::uint64_t> before_;
};

using Structures = std::vector<EditStructure>;

struct Step {
  std::vector<EditOperation> operations;
  bool remembered = true;  // false: what it changed was forgotten to save memory
  WordChanges bone, labels;
  std::optional<std::pair<Structures, Structures>> structures;  // before and after
  std::string text{};                                           // of several operations; empty: the first one's
  [[nodiscard]] std::size_t memory_bytes() const {
    std::size_t n = sizeof *this + bone.memory_bytes() + labels.memory_bytes();
    for (const EditOperation& o : operations) {
      n += sizeof o;
      if (const auto* const b = std::get_if<BrushEdit>(&o)) n += b->points_mm.capacity() * sizeof(Vec3);
      if (const auto* const v = std::get_if<VoxelsEdit>(&o)) n += v->runs.capacity();
    }
    if (structures) n += (structures->first.size() + structures->second.size()) * sizeof(EditStructure);
    return n;
  }
};

// Skip and length of each run. Error(usage) for what is no list of runs within the volume.
template <class Visit>
void each_run(const std::string& runs, std::size_t voxels, const Visit& visit) {
  std::size_t at = 0;
  const char* p = runs.data();
  const char* const end = p + runs.size();
  const auto next = [&](std::size_t& value) {
    while (p < end && *p == ' ') ++p;
    const auto r = std::from_chars(p, end, value);
    if (r.ec != std::errc() || value > voxels)
      throw Error(ExitCode::usage, "the runs of a structure's voxels cannot be read");
    p = r.ptr;
  };
  while (p < end) {
    std::size_t skip = 0, length = 0;
    next(skip);
    next(length);
    if (skip + length > voxels - at) throw Error(ExitCode::usage, "the voxels of a structure do not fit this CT");
    visit(at + skip, at + skip + length);
    at += skip + length;
  }
}

}  // namespace edit_inside

struct EditDocument::State {
  using LabelTexts = edit_inside::LabelTexts;
  using Recorder = edit_inside::Recorder;
  using Structures = edit_inside::Structures;
  using Step = edit_inside::Step;

  State(Image image, const Labels& mask, const Labels* given, EditLimits l)
      : ct(std::move(image)), bone(ct.frame.dims, mask.span()), labels(ct.frame.voxel_count()), limits(l) {
    if (!same_place(ct.frame, mask.frame)) throw Error(ExitCode::usage, "the bone mask is not on the CT's grid");
    if (ct.frame.voxel_count() / 8 >= 0xffffffffU)
      throw Error(ExitCode::resources, "the CT has too many voxels to be edited");
    if (given != nullptr) take_over(*given);
    start_structures = structures;
    const BitMask none(ct.frame.dims);
    start_bone = WordChanges(none.words(), bone.words());
    start_labels = WordChanges(sparse_labels());
    start_hash = hash();
    ct_hash = hash_of(ct);
  }

  // --- the state
  // ----------------------------------------------------------------------------------------------------------------------

  Image ct;
  BitMask bone;
  LabelTexts labels;
  Structures structures;
  std::array<Bounds, 256> bounds{};
  EditLimits limits;
  std::vector<Step> done, undone;
  std::size_t done_bytes = 0, undone_bytes = 0;
  std::uint64_t version = 0;
  WordChanges start_bone, start_labels;
  Structures start_structures;
  std::string start_hash, ct_hash;
  // A stroke that is being drawn.
  std::optional<BrushEdit> stroke;
  Recorder stroke_changes;

  void take_over(const Labels& given) {
    for (const Structure& s : given.structures) structures.push_back({s, StructureRole::at_risk, true});
    const bool same = same_place(ct.frame, given.frame);
    const auto& d = ct.frame.dims;
    std::size_t at = 0;
    for (int k = 0; k < d[2]; ++k) {
      for (int j = 0; j < d[1]; ++j) {
        for (int i = 0; i < d[0]; ++i, ++at) {
          std::uint8_t value = 0;
          std::array<int, 3> from{};
          if (same) {
            value = given.voxels[at];
          } else if (voxel_at(given.frame, ct.frame.world_from_index({double(i), double(j), double(k)}), from)) {
            value = given.at(from[0], from[1], from[2]);
          }
          if (value == 0) continue;
          labels.data()[at] = value;  // only here: pages of nothing stay untouched
          grow(value, i, i + 1, j, k);
        }
      }
    }
    for (int v = 1; v < 256; ++v) {
      if (bounds[static_cast<std::size_t>(v)].hi[0] > 0 && find(v) == nullptr)
        structures.push_back({{static_cast<std::uint8_t>(v), "structure " + std::to_string(v), {255, 200, 60}},
                              StructureRole::at_risk,
                              true});
    }
    std::sort(structures.begin(), structures.end(),
              [](const auto& a, const auto& b) { return a.is.value < b.is.value; });
  }

  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint64_t>> sparse_labels() {
    std::vector<std::pair<std::uint32_t, std::uint64_t>> list;
    const std::span<const std::uint64_t> words = labels.words();
    for (std::size_t w = 0; w < words.size(); ++w) {
      if (words[w] != 0) list.emplace_back(static_cast<std::uint32_t>(w), words[w]);
    }
    return list;
  }

  void grow(int value, int i0, int i1, int j, int k) {
    Bounds& b = bounds[static_cast<std::size_t>(value)];
    const std::array<int, 3> lo{i0, j, k}, hi{i1, j + 1, k + 1};
    const bool empty = b.hi[0] <= b.lo[0];
    for (std::size_t a = 0; a < 3; ++a) {
      b.lo[a] = empty ? lo[a] : std::min(b.lo[a], lo[a]);
      b.hi[a] = empty ? hi[a] : std::max(b.hi[a], hi[a]);
    }
  }

  [[nodiscard]] EditStructure* find(int value) {
    for (EditStructure& s : structures) {
      if (s.is.value == value) return &s;
    }
    return nullptr;
  }
  EditStructure& need(int value) {
    EditStructure* const s = find(value);
    if (s == nullptr) throw Error(ExitCode::usage, "there is no structure " + std::to_string(value));
    return *s;
  }

  [[nodiscard]] std::string hash() const {
    Hasher h;
    h.add(ct.frame.dims.data(), sizeof ct.frame.dims);
    h.add(bone.words().data(), bone.words().size_bytes());
    h.add(labels.bytes().data(), labels.bytes().size());
    for (const EditStructure& s : structures) {
      const std::string text = std::to_string(s.is.value) + "\n" + s.is.name + "\n" + std::to_string(s.is.rgb[0]) +
                               "," + std::to_string(s.is.rgb[1]) + "," + std::to_string(s.is.rgb[2]) + "\n" +
                               std::to_string(static_cast<int>(s.role)) + "\n";
      h.add(text.data(), text.size());
    }
    return h.hex();
  }

  // --- operations on structures
  // -------------------------------------------------------------------------------------------------------

  // Voxels [from, to) in scan order, of one row, become `value`; with `only` those that have that value.
  void write(std::size_t from, std::size_t to, std::uint8_t value, int only, Recorder& recorder) {
    if (from >= to) return;
    recorder.note(labels.words(), from / 8, (to - 1) / 8);
    std::uint8_t* const p = labels.data();
    for (std::size_t v = from; v < to; ++v) {
      if (only < 0 || p[v] == only) p[v] = value;
    }
    if (value == 0) return;
    const auto nx = static_cast<std::size_t>(ct.frame.dims[0]), ny = static_cast<std::size_t>(ct.frame.dims[1]);
    const std::size_t row = from / nx;
    grow(value, static_cast<int>(from % nx), static_cast<int>(to - row * nx), static_cast<int>(row % ny),
         static_cast<int>(row / ny));
  }

  void draw(const BrushEdit& o, Vec3 a, Vec3 b, Recorder& recorder) {
    const auto nx = static_cast<std::size_t>(ct.frame.dims[0]);
    rows_of_capsule(ct.frame, a, b, o.radius_mm, [&](std::size_t row, int begin, int end) {
      if (o.structure == 0) {
        const std::size_t first = row * bone.words_per_row();
        recorder.note(bone.words(), first + static_cast<std::size_t>(begin) / 64,
                      first + static_cast<std::size_t>(end - 1) / 64);
        bone.set(row, begin, end, !o.erase);
      } else {
        write(row * nx + static_cast<std::size_t>(begin), row * nx + static_cast<std::size_t>(end),
              o.erase ? std::uint8_t{0} : static_cast<std::uint8_t>(o.structure), o.erase ? o.structure : -1, recorder);
      }
    });
  }

  struct Runner {
    State& s;
    Recorder& recorder;
    void operator()(const BrushEdit& o) const {
      s.need(o.structure);
      for (std::size_t i = 0; i < o.points_mm.size(); ++i)
        s.draw(o, o.points_mm[i > 0 ? i - 1 : 0], o.points_mm[i], recorder);
    }
    void operator()(const VoxelsEdit& o) const {
      s.need(o.structure);
      const std::size_t voxels = s.ct.frame.voxel_count(), nx = static_cast<std::size_t>(s.ct.frame.dims[0]);
      edit_inside::each_run(o.runs, voxels,
                            [](std::size_t, std::size_t) {});  // all of it is right before any is written
      edit_inside::each_run(o.runs, voxels, [&](std::size_t from, std::size_t to) {
        while (from < to) {
          const std::size_t stop = std::min(to, (from / nx + 1) * nx);
          s.write(from, stop, static_cast<std::uint8_t>(o.structure), -1, recorder);
          from = stop;
        }
      });
    }
    void operator()(const AddStructureEdit& o) const {
      if (s.find(o.structure) != nullptr)
        throw Error(ExitCode::usage, "there is a structure " + std::to_string(o.structure) + " already");
      s.require_free(o.name, 0);
      s.structures.push_back({{static_cast<std::uint8_t>(o.structure), o.name, colour(o.rgb)}, o.role, true});
      std::sort(s.structures.begin(), s.structures.end(),
                [](const auto& a, const auto& b) { return a.is.value < b.is.value; });
    }
    void operator()(const ChangeStructureEdit& o) const {
      EditStructure& is = s.need(o.structure);
      s.require_free(o.name, o.structure);
      is.is.name = o.name;
      is.is.rgb = colour(o.rgb);
      is.role = o.role;
    }
    void operator()(const DeleteStructureEdit& o) const {
      s.need(o.structure);
      const Bounds b = s.bounds[static_cast<std::size_t>(o.structure)];
      for (int k = b.lo[2]; k < b.hi[2]; ++k) {
        for (int j = b.lo[1]; j < b.hi[1]; ++j) {
          const std::size_t row = s.ct.offset(0, j, k);
          std::size_t from = row + static_cast<std::size_t>(b.lo[0]);
          const std::size_t to = row + static_cast<std::size_t>(b.hi[0]);
          const auto* const p = s.labels.data();
          for (; from < to; ++from) {  // run by run, so that only words that change are noted
            if (p[from] != o.structure) continue;
            std::size_t stop = from;
            while (stop < to && p[stop] == o.structure) ++stop;
            s.write(from, stop, 0, o.structure, recorder);
            from = stop - 1;
          }
        }
      }
      std::erase_if(s.structures, [&](const EditStructure& e) { return e.is.value == o.structure; });
    }
    void operator()(const auto&) const {}
    static std::array<std::uint8_t, 3> colour(const std::vector<int>& rgb) {
      return {static_cast<std::uint8_t>(rgb[0]), static_cast<std::uint8_t>(rgb[1]), static_cast<std::uint8_t>(rgb[2])};
    }
  };
  void run_on_structures(const EditOperation& operation, Recorder& recorder) {
    std::visit(Runner{*this, recorder}, operation);
  }
  void require_free(const std::string& name, int but) const {
    for (const EditStructure& s : structures) {
      if (s.is.name == name && s.is.value != but)
        throw Error(ExitCode::usage, "there is a structure '" + name + "' already");
    }
  }

  // --- steps
  // --------------------------------------------------------------------------------------------------------------------------

  void measure(const BitMask& after, EditOutcome& outcome) const {
    std::uint64_t added = 0, removed = 0;
    const auto a = bone.words(), b = after.words();
    for (std::size_t w = 0; w < a.size(); ++w) {
      if (a[w] == b[w]) continue;
      added += static_cast<std::uint64_t>(std::popcount(b[w] & ~a[w]));
      removed += static_cast<std::uint64_t>(std::popcount(a[w] & ~b[w]));
    }
    outcome.added_mm3 = static_cast<double>(added) * ct.frame.voxel_volume_mm3();
    outcome.removed_mm3 = static_cast<double>(removed) * ct.frame.voxel_volume_mm3();
  }

  void push(Step step) {
    undone.clear();
    undone_bytes = 0;
    done_bytes += step.memory_bytes();
    done.push_back(std::move(step));
    ++version;
    if (done_bytes > limits.history_bytes) save_memory();
  }

  // The largest of the older steps forget, until all fit.
  void save_memory() {
    constexpr std::size_t kNew = 4;
    while (done_bytes > limits.history_bytes && done.size() > kNew) {
      Step* largest = nullptr;
      for (std::size_t i = 0; i + kNew < done.size(); ++i) {
        Step& s = done[i];
        if (s.remembered && (largest == nullptr || s.memory_bytes() > largest->memory_bytes())) largest = &s;
      }
      if (largest == nullptr) return;
      const std::size_t before = largest->memory_bytes();
      largest->bone = WordChanges();  // moved, so that the memory goes
      largest->labels = WordChanges();
      largest->structures.reset();
      largest->remembered = false;
      done_bytes -= before - largest->memory_bytes();
    }
  }

  void run_again(const Step& step, const Context& context) {
    Recorder nobody;
    for (const EditOperation& o : step.operations) {
      if (changes_bone(o)) {
        run_on_bone(o, ct, bone, context);
      } else {
        run_on_structures(o, nobody);
      }
    }
  }

  // The state after the first `count` steps, from the beginning.
  void make_again(std::size_t count, const Context& context) {
    const BitMask bone_now = bone;
    const WordChanges labels_now(sparse_labels());
    const Structures structures_now = structures;
    const auto empty_labels = [&] {
      for (const auto& [w, value] : sparse_labels()) labels.words()[w] = 0;
    };
    try {
      bone = BitMask(ct.frame.dims);
      start_bone.apply(bone.words());
      empty_labels();
      start_labels.apply(labels.words());
      structures = start_structures;
      for (std::size_t i = 0; i < count; ++i) {
        context.check_cancelled();
        run_again(done[i], context);
      }
    } catch (...) {
      bone = bone_now;
      empty_labels();
      labels_now.apply(labels.words());
      structures = structures_now;
      throw;
    }
  }

  void keep_shown(const Structures& as) {
    for (EditStructure& s : structures) {
      for (const EditStructure& o : as) {
        if (o.is.value == s.is.value) s.shown = o.shown;
      }
    }
  }
};

}  // namespace osteo::inline imaging
