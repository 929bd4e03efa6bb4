#include "osteo/imaging/edit/document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include "bone_operations.h"
#include "document_state.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "word_changes.h"

namespace osteo::inline imaging {
namespace {

using edit_inside::Recorder;
using edit_inside::Step;
using edit_inside::Structures;

std::string text_of(const Step& step) {
  return step.text.empty() ? operation_text(step.operations.front()) : step.text;
}

}  // namespace

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

EditOutcome EditDocument::apply(const EditOperation& operation, const Context& context) {
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

EditOutcome EditDocument::apply_together(const std::vector<EditOperation>& operations, const std::string& text) {
  State& s = *state_;
  if (s.stroke) throw Error(ExitCode::failed, "a stroke is being drawn");
  for (const EditOperation& o : operations) {
    require_valid(o);
    if (changes_bone(o)) throw Error(ExitCode::usage, "only operations on structures are applied together");
  }
  EditOutcome outcome;
  outcome.text = text;
  Recorder recorder;
  const Structures before = s.structures;
  Step step{operations, true, {}, {}, {}, text};
  try {
    for (const EditOperation& o : operations) s.run_on_structures(o, recorder);
  } catch (...) {
    recorder.changes(s.labels.words()).apply(s.labels.words());
    s.structures = before;
    throw;
  }
  step.labels = recorder.changes(s.labels.words());
  if (before != s.structures) step.structures = {before, s.structures};
  outcome.changed = !step.labels.empty() || step.structures.has_value();
  if (outcome.changed) s.push(std::move(step));
  return outcome;
}

BonePlan EditDocument::plan(std::vector<EditOperation> operations, const Context& context) const {
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
  if (s.stroke || plan.version != s.version)
    throw Error(ExitCode::failed, "the mask was changed meanwhile", "do it again");
  if (!plan.outcome.changed) return plan.outcome;
  std::swap(s.bone, plan.bone);
  s.push({std::move(plan.operations), true, *plan.changes, {}, {}});
  return plan.outcome;
}

std::vector<EditOperation> EditDocument::with_later_steps(const ThresholdEdit& threshold) const {
  std::vector<EditOperation> all{threshold};
  for (const EditOperation& o : operations()) {
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
  const std::span<const std::uint64_t> words =
      on_bone ? std::span<const std::uint64_t>(s.bone.words()) : s.labels.words();
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
  return can_undo() ? text_of(state_->done.back()) : std::string();
}
std::string EditDocument::redo_text() const {
  return can_redo() ? text_of(state_->undone.back()) : std::string();
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

std::vector<EditOperation> EditDocument::operations() const {
  std::vector<EditOperation> all;
  for (const Step& s : state_->done) all.insert(all.end(), s.operations.begin(), s.operations.end());
  std::size_t last = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::holds_alternative<ThresholdEdit>(all[i])) last = i;
  }
  std::vector<EditOperation> live;
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

std::vector<EditOperation> structures_of(const Labels& labels, const EditDocument& document) {
  if (!(labels.frame.dims == document.ct().frame.dims && same_place(labels.frame, document.ct().frame)))
    throw Error(ExitCode::usage, "the label map does not lie on the voxels of the CT", "make it from this CT");
  std::array<bool, 256> taken{};
  taken[0] = true;
  for (const EditStructure& s : document.structures()) taken[s.is.value] = true;
  std::vector<EditOperation> all, drawn;
  for (const Structure& found : labels.structures) {
    const auto& now = document.structures();
    const auto same =
        std::find_if(now.begin(), now.end(), [&](const EditStructure& s) { return s.is.name == found.name; });
    VoxelsEdit voxels = voxels_of(labels, found.value, 0);
    if (voxels.runs.empty()) continue;
    AddStructureEdit add;
    add.name = found.name;
    add.rgb = {found.rgb[0], found.rgb[1], found.rgb[2]};
    add.origin = found.origin;
    add.doubt = found.doubt;
    add.within_mm = std::isfinite(found.within_mm) ? found.within_mm : -1;
    if (same != now.end()) {
      add.structure = same->is.value;
      add.rgb = {same->is.rgb[0], same->is.rgb[1], same->is.rgb[2]};
      add.role = same->role;
      all.emplace_back(DeleteStructureEdit{add.structure});
    } else {
      const auto free = std::find(taken.begin(), taken.end(), false);
      if (free == taken.end()) throw Error(ExitCode::usage, "255 structures are all there can be");
      *free = true;
      add.structure = static_cast<int>(free - taken.begin());
    }
    voxels.structure = add.structure;
    all.emplace_back(add);
    drawn.emplace_back(std::move(voxels));
  }
  // Drawn last: a structure that goes takes none of those voxels with it.
  all.insert(all.end(), std::make_move_iterator(drawn.begin()), std::make_move_iterator(drawn.end()));
  return all;
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

}  // namespace osteo::inline imaging
