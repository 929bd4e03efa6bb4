#include "osteo/edit/document.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "bone_operations.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/parallel.h"
#include "word_changes.h"

namespace osteo {
namespace {

// Zero, and taking no memory where nobody has written: pages come with the first write.
class LabelWords {
 public:
  explicit LabelWords(std::size_t voxels)
      : words_((voxels + 7) / 8), voxels_(voxels), at_(static_cast<std::uint64_t*>(std::calloc(words_ + 1, 8))) {
    if (!at_) throw std::bad_alloc();
  }
  [[nodiscard]] std::span<std::uint64_t> words() { return {at_.get(), words_}; }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {reinterpret_cast<const std::uint8_t*>(at_.get()), voxels_}; }
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
  std::vector<Operation> operations;
  bool remembered = true;  // false: what it changed was forgotten to save memory
  WordChanges bone, labels;
  std::optional<std::pair<Structures, Structures>> structures;  // before and after
  [[nodiscard]] std::size_t memory_bytes() const {
    std::size_t n = sizeof *this + bone.memory_bytes() + labels.memory_bytes();
    for (const Operation& o : operations) {
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
    if (r.ec != std::errc() || value > voxels) throw Error(ExitCode::usage, "the runs of a structure's voxels cannot be read");
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

}  // namespace

struct EditDocument::State {
  State(Image image, const Labels& mask, const Labels* given, EditLimits l)
      : ct(std::move(image)), bone(ct.frame.dims, mask.span()), labels(ct.frame.voxel_count()), limits(l) {
    if (!same_place(ct.frame, mask.frame)) throw Error(ExitCode::usage, "the bone mask is not on the CT's grid");
    if (ct.frame.voxel_count() / 8 >= 0xffffffffU) throw Error(ExitCode::resources, "the CT has too many voxels to be edited");
    if (given != nullptr) take_over(*given);
    start_structures = structures;
    const BitMask none(ct.frame.dims);
    start_bone = WordChanges(none.words(), bone.words());
    start_labels = WordChanges(sparse_labels());
    start_hash = hash();
    ct_hash = hash_of(ct);
  }

  // --- the state ----------------------------------------------------------------------------------------------------------------------

  Image ct;
  BitMask bone;
  LabelWords labels;
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
        structures.push_back(
            {{static_cast<std::uint8_t>(v), "structure " + std::to_string(v), {255, 200, 60}}, StructureRole::at_risk, true});
    }
    std::sort(structures.begin(), structures.end(), [](const auto& a, const auto& b) { return a.is.value < b.is.value; });
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
      const std::string text = std::to_string(s.is.value) + "\n" + s.is.name + "\n" + std::to_string(s.is.rgb[0]) + "," +
                               std::to_string(s.is.rgb[1]) + "," + std::to_string(s.is.rgb[2]) + "\n" +
                               std::to_string(static_cast<int>(s.role)) + "\n";
      h.add(text.data(), text.size());
    }
    return h.hex();
  }

  // --- operations on structures -------------------------------------------------------------------------------------------------------

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
    grow(value, static_cast<int>(from % nx), static_cast<int>(to - row * nx), static_cast<int>(row % ny), static_cast<int>(row / ny));
  }

  void draw(const BrushEdit& o, Vec3 a, Vec3 b, Recorder& recorder) {
    const auto nx = static_cast<std::size_t>(ct.frame.dims[0]);
    rows_of_capsule(ct.frame, a, b, o.radius_mm, [&](std::size_t row, int begin, int end) {
      if (o.structure == 0) {
        const std::size_t first = row * bone.words_per_row();
        recorder.note(bone.words(), first + static_cast<std::size_t>(begin) / 64, first + static_cast<std::size_t>(end - 1) / 64);
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
      for (std::size_t i = 0; i < o.points_mm.size(); ++i) s.draw(o, o.points_mm[i > 0 ? i - 1 : 0], o.points_mm[i], recorder);
    }
    void operator()(const VoxelsEdit& o) const {
      s.need(o.structure);
      const std::size_t voxels = s.ct.frame.voxel_count(), nx = static_cast<std::size_t>(s.ct.frame.dims[0]);
      each_run(o.runs, voxels, [](std::size_t, std::size_t) {});  // all of it is right before any is written
      each_run(o.runs, voxels, [&](std::size_t from, std::size_t to) {
        while (from < to) {
          const std::size_t stop = std::min(to, (from / nx + 1) * nx);
          s.write(from, stop, static_cast<std::uint8_t>(o.structure), -1, recorder);
          from = stop;
        }
      });
    }
    void operator()(const AddStructureEdit& o) const {
      if (s.find(o.structure) != nullptr) throw Error(ExitCode::usage, "there is a structure " + std::to_string(o.structure) + " already");
      s.require_free(o.name, 0);
      s.structures.push_back({{static_cast<std::uint8_t>(o.structure), o.name, colour(o.rgb)}, o.role, true});
      std::sort(s.structures.begin(), s.structures.end(), [](const auto& a, const auto& b) { return a.is.value < b.is.value; });
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
  void run_on_structures(const Operation& operation, Recorder& recorder) { std::visit(Runner{*this, recorder}, operation); }
  void require_free(const std::string& name, int but) const {
    for (const EditStructure& s : structures) {
      if (s.is.name == name && s.is.value != but) throw Error(ExitCode::usage, "there is a structure '" + name + "' already");
    }
  }

  // --- steps --------------------------------------------------------------------------------------------------------------------------

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
    for (const Operation& o : step.operations) {
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

EditDocument::EditDocument(Image ct, const Labels& bone, const Labels* structures, EditLimits limits)
    : state_(std::make_unique<State>(std::move(ct), bone, structures, limits)) {}
EditDocument::~EditDocument() = default;
EditDocument::EditDocument(EditDocument&&) noexcept = default;
EditDocument& EditDocument::operator=(EditDocument&&) noexcept = default;

const Image& EditDocument::ct() const {
  return state_->ct;
}
const BitMask& EditDocument::bone() const {
  return state_->bone;
}
std::span<const std::uint8_t> EditDocument::labels() const {
  return state_->labels.bytes();
}
const std::vector<EditStructure>& EditDocument::structures() const {
  return state_->structures;
}
const EditStructure* EditDocument::structure(int value) const {
  return state_->find(value);
}
int EditDocument::free_value() const {
  for (int v = 1; v < 256; ++v) {
    if (state_->find(v) == nullptr) return v;
  }
  return 0;
}
void EditDocument::show(int value, bool shown) {
  if (EditStructure* const s = state_->find(value)) s->shown = shown;
}
EditDocument::Bounds EditDocument::bounds(int value) const {
  return value > 0 && value < 256 ? state_->bounds[static_cast<std::size_t>(value)] : Bounds{};
}
double EditDocument::volume_mm3(int value) const {
  std::uint64_t n = 0;
  if (value == 0) {
    n = state_->bone.count();
  } else {
    const Bounds b = bounds(value);
    for (int k = b.lo[2]; k < b.hi[2]; ++k) {
      for (int j = b.lo[1]; j < b.hi[1]; ++j) {
        const auto* const row = labels().data() + state_->ct.offset(0, j, k);
        n += static_cast<std::uint64_t>(std::count(row + b.lo[0], row + b.hi[0], static_cast<std::uint8_t>(value)));
      }
    }
  }
  return static_cast<double>(n) * state_->ct.frame.voxel_volume_mm3();
}

EditOutcome EditDocument::apply(const Operation& operation, const Context& context) {
  State& s = *state_;
  if (s.stroke) throw Error(ExitCode::failed, "a stroke is being drawn");
  require_valid(operation);
  if (const auto* const brush = std::get_if<BrushEdit>(&operation)) {
    begin_stroke(*brush);
    return end_stroke();
  }
  if (changes_bone(operation)) return commit(plan({operation}, context));
  EditOutcome outcome;
  outcome.text = operation_text(operation);
  Recorder recorder;
  const Structures before = s.structures;
  s.run_on_structures(operation, recorder);
  Step step{{operation}, true, {}, recorder.changes(s.labels.words()), {}};
  if (before != s.structures) step.structures = {before, s.structures};
  outcome.changed = !step.labels.empty() || step.structures.has_value();
  if (outcome.changed) s.push(std::move(step));
  return outcome;
}

BonePlan EditDocument::plan(std::vector<Operation> operations, const Context& context) const {
  BonePlan p{{}, state_->bone, {}, nullptr, state_->version};
  if (operations.empty()) return p;
  for (std::size_t i = 0; i < operations.size(); ++i) {
    require_valid(operations[i]);
    if (!changes_bone(operations[i])) throw Error(ExitCode::usage, "only operations on bone can be planned");
    context.progress(static_cast<double>(i) / static_cast<double>(operations.size()), operation_text(operations[i]));
    const Context part = context.sub(static_cast<double>(i) / static_cast<double>(operations.size()),
                                     static_cast<double>(i + 1) / static_cast<double>(operations.size()));
    p.outcome.note = run_on_bone(operations[i], state_->ct, p.bone, part);
  }
  p.outcome.text = operation_text(operations.front());
  state_->measure(p.bone, p.outcome);
  p.changes = std::make_shared<const WordChanges>(state_->bone.words(), p.bone.words());
  p.outcome.changed = !p.changes->empty();
  if (!p.outcome.changed && p.outcome.note.empty()) p.outcome.note = "nothing changes";
  p.operations = std::move(operations);
  return p;
}

EditOutcome EditDocument::commit(BonePlan plan) {
  State& s = *state_;
  if (s.stroke || plan.version != s.version) throw Error(ExitCode::failed, "the mask was changed meanwhile", "do it again");
  if (!plan.outcome.changed) return plan.outcome;
  std::swap(s.bone, plan.bone);
  s.push({std::move(plan.operations), true, *plan.changes, {}, {}});
  return plan.outcome;
}

std::vector<Operation> EditDocument::with_later_steps(const ThresholdEdit& threshold) const {
  std::vector<Operation> all{threshold};
  for (const Operation& o : operations()) {
    if (changes_bone(o) && !std::holds_alternative<ThresholdEdit>(o)) all.push_back(o);
  }
  return all;
}

void EditDocument::begin_stroke(BrushEdit stroke) {
  State& s = *state_;
  if (s.stroke) throw Error(ExitCode::failed, "a stroke is being drawn");
  std::vector<Vec3> points = std::move(stroke.points_mm);
  stroke.points_mm = {Vec3{}};
  require_valid(stroke);
  stroke.points_mm.clear();
  if (stroke.structure != 0) s.need(stroke.structure);
  s.stroke = std::move(stroke);
  s.stroke_changes = Recorder();
  for (const Vec3 p : points) add_point(p);
}

void EditDocument::add_point(Vec3 world_mm) {
  State& s = *state_;
  if (!s.stroke) return;
  // As a file will hold it.
  for (std::size_t a = 0; a < 3; ++a) world_mm[a] = std::round(std::clamp(world_mm[a], -1e6, 1e6) * 1000) / 1000;
  if (!s.stroke->points_mm.empty() && s.stroke->points_mm.back() == world_mm) return;
  s.draw(*s.stroke, s.stroke->points_mm.empty() ? world_mm : s.stroke->points_mm.back(), world_mm, s.stroke_changes);
  s.stroke->points_mm.push_back(world_mm);
  ++s.version;
}

EditOutcome EditDocument::end_stroke() {
  State& s = *state_;
  EditOutcome outcome;
  if (!s.stroke) return outcome;
  BrushEdit stroke = std::move(*s.stroke);
  s.stroke.reset();
  const Recorder recorder = std::exchange(s.stroke_changes, Recorder());
  outcome.text = operation_text(stroke);
  const bool on_bone = stroke.structure == 0;
  const std::span<const std::uint64_t> words = on_bone ? std::span<const std::uint64_t>(s.bone.words()) : s.labels.words();
  const double voxel = s.ct.frame.voxel_volume_mm3();
  for (const auto& [w, before] : recorder.before()) {
    if (on_bone) {
      outcome.added_mm3 += voxel * std::popcount(words[w] & ~before);
      outcome.removed_mm3 += voxel * std::popcount(before & ~words[w]);
      continue;
    }
    for (int b = 0; b < 8; ++b) {
      const bool was = (before >> (8 * b) & 255) == static_cast<std::uint64_t>(stroke.structure),
                 is = (words[w] >> (8 * b) & 255) == static_cast<std::uint64_t>(stroke.structure);
      outcome.added_mm3 += is && !was ? voxel : 0;
      outcome.removed_mm3 += was && !is ? voxel : 0;
    }
  }
  WordChanges changes = recorder.changes(words);
  outcome.changed = !changes.empty();
  if (!outcome.changed) {
    outcome.note = "nothing changes";
    return outcome;
  }
  Step step;
  step.operations = {std::move(stroke)};
  (on_bone ? step.bone : step.labels) = std::move(changes);
  s.push(std::move(step));
  return outcome;
}

bool EditDocument::in_stroke() const {
  return state_->stroke.has_value();
}
bool EditDocument::can_undo() const {
  return !state_->done.empty() && !state_->stroke;
}
bool EditDocument::can_redo() const {
  return !state_->undone.empty() && !state_->stroke;
}
std::string EditDocument::undo_text() const {
  return can_undo() ? operation_text(state_->done.back().operations.front()) : std::string();
}
std::string EditDocument::redo_text() const {
  return can_redo() ? operation_text(state_->undone.back().operations.front()) : std::string();
}

bool EditDocument::undo(const Context& context) {
  State& s = *state_;
  if (!can_undo()) return false;
  const Structures shown = s.structures;
  Step& last = s.done.back();
  if (last.remembered) {
    last.bone.apply(s.bone.words());
    last.labels.apply(s.labels.words());
    if (last.structures) s.structures = last.structures->first;
  } else {
    s.make_again(s.done.size() - 1, context);
  }
  s.keep_shown(shown);
  s.done_bytes -= last.memory_bytes();
  s.undone_bytes += last.memory_bytes();
  s.undone.push_back(std::move(last));
  s.done.pop_back();
  ++s.version;
  return true;
}

bool EditDocument::redo(const Context& context) {
  State& s = *state_;
  if (!can_redo()) return false;
  const Structures shown = s.structures;
  Step& next = s.undone.back();
  if (next.remembered) {
    next.bone.apply(s.bone.words());
    next.labels.apply(s.labels.words());
    if (next.structures) s.structures = next.structures->second;
  } else {
    s.run_again(next, context);
  }
  s.keep_shown(shown);
  s.undone_bytes -= next.memory_bytes();
  s.done_bytes += next.memory_bytes();
  s.done.push_back(std::move(next));
  s.undone.pop_back();
  ++s.version;
  return true;
}

std::size_t EditDocument::steps() const {
  return state_->done.size();
}
std::size_t EditDocument::history_bytes() const {
  return state_->done_bytes + state_->undone_bytes;
}
std::uint64_t EditDocument::version() const {
  return state_->version;
}

std::vector<Operation> EditDocument::operations() const {
  std::vector<Operation> all;
  for (const Step& s : state_->done) all.insert(all.end(), s.operations.begin(), s.operations.end());
  std::size_t last = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::holds_alternative<ThresholdEdit>(all[i])) last = i;
  }
  std::vector<Operation> live;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i >= last || !changes_bone(all[i])) live.push_back(std::move(all[i]));
  }
  return live;
}

std::string EditDocument::hash() const {
  return state_->hash();
}
const std::string& EditDocument::start_hash() const {
  return state_->start_hash;
}

const std::string& EditDocument::ct_hash() const {
  return state_->ct_hash;
}

Labels EditDocument::bone_labels(int threads) const {
  const auto voxels = make_voxels<std::uint8_t>(state_->ct.frame.voxel_count());
  state_->bone.to_bytes(voxels.get(), threads);
  Labels out;
  out.frame = state_->ct.frame;
  out.voxels = voxels;
  return out;
}

Labels EditDocument::structure_labels(StructureRole role) const {
  std::array<std::uint8_t, 256> kept{};
  Labels out;
  out.frame = state_->ct.frame;
  for (const EditStructure& s : state_->structures) {
    if (s.role != role || volume_mm3(s.is.value) == 0) continue;
    kept[s.is.value] = s.is.value;
    out.structures.push_back(s.is);
  }
  const auto voxels = make_voxels<std::uint8_t>(out.frame.voxel_count());
  const std::span<const std::uint8_t> in = labels();
  for (std::size_t v = 0; v < in.size(); ++v) voxels[static_cast<std::ptrdiff_t>(v)] = kept[in[v]];
  out.voxels = voxels;
  return out;
}

std::string hash_of(const Image& ct) {
  Hasher h;
  h.add(ct.frame.dims.data(), sizeof ct.frame.dims);
  h.add(&ct.frame.spacing_mm, sizeof ct.frame.spacing_mm);
  h.add(&ct.frame.origin_mm, sizeof ct.frame.origin_mm);
  h.add(&ct.frame.direction, sizeof ct.frame.direction);
  h.add(ct.voxels.get(), ct.span().size_bytes());
  return h.hex();
}

VoxelsEdit voxels_of(const Labels& labels, std::uint8_t value, int structure) {
  VoxelsEdit edit{structure, {}};
  const std::span<const std::uint8_t> v = labels.span();
  std::size_t last = 0;
  for (std::size_t i = 0; i < v.size();) {
    if (v[i] != value) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < v.size() && v[end] == value) ++end;
    edit.runs += (edit.runs.empty() ? "" : " ") + std::to_string(i - last) + " " + std::to_string(end - i);
    last = i = end;
  }
  return edit;
}

}  // namespace osteo
