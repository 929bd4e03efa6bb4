// Readers beside a score: hints as the window would have given them, and heat among the metrics.
#pragma once
#include <mutex>
#include <optional>
#include <vector>

#include "osteo/assessment/evidence/hints.h"
#include "osteo/assessment/evidence/metric.h"
#include "osteo/session/scene/heat_reader.h"
#include "osteo/session/scene/reader.h"

namespace osteo::inline assessment {

// -- Hints that are watched for while a session runs.

/// Whether the burr can be seen is asked ten times a second while it drills: a ray from the eye to the burr through the
/// bone as it is then, voxels in touch with the burr left out. Cost: 20 ns a tick and some 5 us a ray.
class HintReader final : public Reader {
 public:
  static constexpr double kLookHz = 10;
  /// `structures` may be null; must outlive this.
  HintReader(const std::vector<HintRule>& rules, double rate_hz, const StructureMap* structures, bool water)
      : rate_hz_(rate_hz), watch_(rules, rate_hz, structures, water) {}

  void resync(const World& world) override { world_ = &world; }
  void action(const SceneAction& action) override { watch_.action(action); }
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  void update() override;

  /// From any thread: where one looks from.
  void look_from(Vec3 eye_mm);
  /// From any thread: a hint that has come since, once.
  [[nodiscard]] std::optional<Hint> take();

 private:
  double rate_hz_;
  HintWatch watch_;
  const World* world_ = nullptr;
  TickRecord last_;
  std::uint64_t look_at_tick_ = 0;
  std::mutex mutex_;
  std::optional<Vec3> eye_mm_;
  std::optional<Hint> hint_;
};

// -- Heat among the metrics of a score: only for who asks, since the session has to be run again for it.

/// What a heat reader that followed the whole session knows: heat_bone_c, and for each structure heat_peak_c and
/// heat_cem43_min (the body's temperature and no dose where nothing warmed it). `structures` may be null.
[[nodiscard]] std::vector<Measured> heat_values(const HeatReader& heat, const StructureMap* structures);

}  // namespace osteo::inline assessment
