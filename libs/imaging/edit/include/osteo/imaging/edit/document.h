// A case under correction: its CT, the bone mask and the structures as they are now, and every step that led there, to
// be undone and done again. No window; the CT is never changed.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/edit/bit_mask.h"
#include "osteo/imaging/edit/detail/operation.h"

namespace osteo::inline imaging {

/// A structure as the editor knows it: what the case will know (value, name, colour), its role, and whether it is
/// drawn.
struct EditStructure {
  Structure is;
  StructureRole role = StructureRole::at_risk;
  bool shown = true;  ///< how it is looked at: no step of the history
  friend bool operator==(const EditStructure&, const EditStructure&) = default;
};

/// What a step did.
struct EditOutcome {
  bool changed = false;  ///< false: nothing was done, and there is no step
  std::string text;      ///< "threshold from 300 HU"
  std::string note;      ///< "3 components removed, 1 left"; or why nothing changed
  double added_mm3 = 0, removed_mm3 = 0;
};

/// A change of bone that is worked out but not made: see EditDocument::plan.
struct BonePlan;
class WordChanges;  // private to libs/imaging/edit

struct EditLimits {
  /// Of the history. Above it the largest old steps forget what they changed; undoing one of those makes all before it
  /// again, from the start, which takes as long as they took.
  std::size_t history_bytes = 256U << 20;
};

/// Memory: the CT (2 bytes a voxel), 1 bit for bone, 1 byte for structures in those pages of memory that hold any, and
/// the history: some 100 bytes for a dab of the brush, a few MB for a new threshold of a noisy 512 x 512 x 600. One
/// thread changes it; while none does, any may read, and `plan` counts as reading.
class EditDocument {
 public:
  /// `bone` (1 is bone) and `structures` as the case begins. Structures on another grid than the CT's are taken over by
  /// the voxel that holds each centre. Error(usage) when `bone` is on another grid.
  EditDocument(Image ct, const Labels& bone, const Labels* structures = nullptr, EditLimits limits = {});
  ~EditDocument();
  EditDocument(EditDocument&&) noexcept;
  EditDocument& operator=(EditDocument&&) noexcept;

  [[nodiscard]] const Image& ct() const;
  [[nodiscard]] const BitMask& bone() const;
  /// 0 is none; x fastest.
  [[nodiscard]] std::span<const std::uint8_t> labels() const;
  [[nodiscard]] const std::vector<EditStructure>& structures() const;
  /// Null when there is none of that value.
  [[nodiscard]] const EditStructure* structure(int value) const;
  /// Smallest value that is free; 0 when there is none.
  [[nodiscard]] int free_value() const;
  void show(int value, bool shown);
  /// [lo, hi) in voxels that holds all of a structure, perhaps more; hi <= lo: it has none.
  struct Bounds {
    std::array<int, 3> lo{0, 0, 0}, hi{0, 0, 0};
  };
  [[nodiscard]] Bounds bounds(int value) const;
  [[nodiscard]] double volume_mm3(int value) const;  ///< 0: bone

  /// One step of one operation. Errors: usage for values out of range or a structure that is not there; cancelled, and
  /// then nothing is done.
  EditOutcome apply(const EditOperation& operation, const Context& context = {});
  /// One step of several operations on structures, which `text` names for undo and redo: all, or with an error none.
  /// Error(usage) also where one of them is on bone.
  EditOutcome apply_together(const std::vector<EditOperation>& operations, const std::string& text);
  /// One step of several operations on bone, worked out beside the document, which others may read meanwhile. Made true
  /// by `commit`, which takes no time, unless the document was changed since (Error(failed)).
  [[nodiscard]] BonePlan plan(std::vector<EditOperation> operations, const Context& context = {}) const;
  EditOutcome commit(BonePlan plan);
  /// A threshold, and after it all that was done to bone since the last one, or since the beginning: what a new
  /// threshold would forget.
  [[nodiscard]] std::vector<EditOperation> with_later_steps(const ThresholdEdit& threshold) const;

  // A brush stroke while it is drawn: it shows at once, and is one step when it ends. Nothing else may be done
  // meanwhile.
  /// `stroke` without points.
  void begin_stroke(BrushEdit stroke);
  void add_point(Vec3 world_mm);
  EditOutcome end_stroke();
  [[nodiscard]] bool in_stroke() const;

  [[nodiscard]] bool can_undo() const;
  [[nodiscard]] bool can_redo() const;
  /// What the next undo or redo would take: "brush 4 mm".
  [[nodiscard]] std::string undo_text() const;
  [[nodiscard]] std::string redo_text() const;
  /// False when there is nothing. Error(cancelled) only where steps have to be made again.
  bool undo(const Context& context = {});
  bool redo(const Context& context = {});
  [[nodiscard]] std::size_t steps() const;
  [[nodiscard]] std::size_t history_bytes() const;
  /// Grows with each change, undo and redo: tells whether something was drawn from an older state.
  [[nodiscard]] std::uint64_t version() const;

  /// What leads from the start to here, without what a later threshold has made vain.
  [[nodiscard]] std::vector<EditOperation> operations() const;
  /// Content hash of bone, labels and structures (not whether they are shown).
  [[nodiscard]] std::string hash() const;
  /// Of the CT, as `hash_of` has it.
  [[nodiscard]] const std::string& ct_hash() const;
  /// As `hash`, of the state at the beginning.
  [[nodiscard]] const std::string& start_hash() const;

  /// For the pipeline: bone as 0 and 1; structures of a role that have voxels, with names and colours.
  [[nodiscard]] Labels bone_labels(int threads = 0) const;
  [[nodiscard]] Labels structure_labels(StructureRole role) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct BonePlan {
  std::vector<EditOperation> operations;
  BitMask bone;
  EditOutcome outcome;
  std::shared_ptr<const WordChanges> changes;
  std::uint64_t version = 0;  ///< of the document that it was worked out for
};

/// Content hash of a CT with its grid: what edits are bound to.
[[nodiscard]] std::string hash_of(const Image& ct);
/// The structures of a label map on the document's grid as operations: each in place of one of the same name, whose
/// role and colour stay, else new. What has no voxels is left out. Error(usage): another grid, or more than 255 in all.
[[nodiscard]] std::vector<EditOperation> structures_of(const Labels& labels, const EditDocument& document);
/// The voxels of one value as an operation; empty runs when there are none.
[[nodiscard]] VoxelsEdit voxels_of(const Labels& labels, std::uint8_t value, int structure);

}  // namespace osteo::inline imaging
