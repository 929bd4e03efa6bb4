// All soft tissue of a case: bodies that each go on by themselves, felt together.
#pragma once
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "osteo/session/scene/detail/soft_body.h"
#include "osteo/session/scene/reader.h"

namespace osteo::inline session {

/// Bodies share what an update may take (SoftBody::kMaxWork): those that need less than their part leave it to the
/// others, and those that sleep need none. They do not feel each other. What a hand feels between two updates is a
/// plane: the forces of all bodies on its tool together, rising with depth. Each such plane is an action of the stream,
/// so a replay needs no tissue.
class SoftTissue final : public Reader {
 public:
  /// Error(usage) for a name twice, or none.
  void add(const std::string& name, std::unique_ptr<SoftBody> body);

  [[nodiscard]] std::size_t size() const { return bodies_.size(); }
  [[nodiscard]] SoftBody& body(std::size_t n) { return *bodies_[n]; }
  [[nodiscard]] const std::string& name(std::size_t n) const { return facts_[n].name; }

  void meet(const World* world);
  /// One update; `tools`: one a hand, at most kMaxHands. For each hand whose tool is pushed, or was until now, its
  /// plane.
  std::vector<SceneAction> update(std::span<const SoftTool> tools);

  [[nodiscard]] double cut_off_mm3() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Of a body, as the last update left it.
  struct Facts {
    std::string name;
    double cut_off_mm3 = 0, of_real_time = 1;
    bool asleep = false;
  };
  /// From any thread.
  [[nodiscard]] std::vector<Facts> facts() const;

  /// Bone has changed: who lies there wakes.
  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

 private:
  void keep_facts();

  std::vector<std::unique_ptr<SoftBody>> bodies_;
  std::array<bool, kMaxHands> pushed_{};
  mutable std::mutex mutex_;
  std::vector<Facts> facts_;
};

/// What a case lists; null without. In its folder tissue.vtu and tissue.json, and where they are tissue-constants.json
/// and tissue.ply, the surface that is drawn: the body "tissue". Under the same names in tissue/NAME: the body NAME; in
/// the order of their names. Errors: no_input, with the file's name, for one of these files without those it needs;
/// usage for a file in tissue/, for two bodies of a name, and for what is no name; as of SoftBody, with the body's
/// name.
[[nodiscard]] std::shared_ptr<SoftTissue> soft_tissue_of(const std::filesystem::path& case_folder);

}  // namespace osteo::inline session
