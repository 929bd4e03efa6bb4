// What was done in a session, by tool: a reader of its stream. Private to libs/app/window.
#pragma once
#include <array>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "osteo/app/window/rehearsal_window.h"
#include "osteo/session/scene/reader.h"
#include "palette.h"

namespace osteo::inline app {

class WorkDone final : public Reader {
 public:
  struct ByTool {
    std::uint64_t ticks_turning = 0;
    double removed_mm3 = 0;
  };
  void resync(const World&) override {}
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  [[nodiscard]] const std::map<std::uint8_t, ByTool>& by_tool() const { return by_tool_; }
  /// What came near a structure: times that a burr was within StateFacts::kNearMm, in contact, and rotating in it.
  struct Harm {
    std::size_t near = 0, contacts = 0, violations = 0;
    friend bool operator==(const Harm&, const Harm&) = default;
  };
  /// By value in the label map; from any thread, while it is called.
  [[nodiscard]] std::map<std::uint8_t, Harm> harm() const;
  [[nodiscard]] std::size_t cuts() const { return cuts_; }
  [[nodiscard]] std::size_t undone() const { return undone_; }

 private:
  std::map<std::uint8_t, ByTool> by_tool_;
  std::size_t cuts_ = 0, undone_ = 0;
  mutable std::mutex mutex_;
  std::map<std::uint8_t, Harm> harm_;
  // Of each hand, the structure and how near it was in the tick before.
  struct Was {
    std::uint32_t structure = 0;
    int nearness = 0;  // 1 near, 2 contact, 3 violation
  };
  std::array<Was, kMaxHands> was_;
};

/// A line of the page at the end.
struct EndLine {
  std::string what, value;
  Nearness nearness = Nearness::unknown;  ///< of a structure; else unknown
};
struct EndFacts {
  std::vector<EndLine> lines;
  std::string summary;  ///< in a line: how long, how much
  std::vector<std::string> warnings;
  std::filesystem::path folder;
  bool past = false;  ///< it was over before the window opened
};
/// What became of a session's folder: kept, only where it is still there.
[[nodiscard]] std::string kept_text(const std::filesystem::path& folder);
[[nodiscard]] EndFacts end_facts(const SessionFacts& session, const WorkDone& work);

}  // namespace osteo::inline app
