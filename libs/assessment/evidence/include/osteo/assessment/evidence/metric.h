// What a metric is told of a session, and what it tells.
#pragma once
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/assessment/evidence/detail/metric_table.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline assessment {

/// From where the bone was looked at, as a "camera" note has it.
struct CameraPose {
  std::uint64_t tick = 0;
  Vec3 eye_mm, target_mm;
};
/// Of all "camera" notes, by tick. One that cannot be read is counted in `unreadable`.
[[nodiscard]] std::vector<CameraPose> camera_poses(std::span<const Note> notes, std::size_t& unreadable);

/// At most a tenth of a second, as session files keep it: they have of each voxel only the last density in it. Frames
/// begin where a tick's number is a multiple of a tenth of a second, at an action that parts changes (parts_changes),
/// and behind gaps; so live and from a file they are the same.
struct EvidenceFrame {
  double rate_hz = 1000;
  std::span<const SceneAction> actions;  ///< in their order; done before the changes
  std::span<const TickRecord> ticks;     ///< of all hands
  std::span<const VoxelChange>
      changes;  ///< by the burrs: ascending names, each once; `before` is the density as the frame began
  std::span<const VoxelChange> sawn;   ///< by a saw at the frame's beginning; names as in `changes`
  const World& world;                  ///< as the frame left it
  const CameraPose* camera = nullptr;  ///< the last before the frame's end; null where nothing was noted
  std::uint64_t lost_before = 0;       ///< ticks that are not known between the frame before and this one
};

[[nodiscard]] std::string_view name_of(Better better);

/// One value, or a word on why there is none.
struct Measured {
  const MetricRow* row = nullptr;
  std::string of;  ///< a structure, an instrument, a region; empty: of the whole session
  std::optional<double> value;
  std::string word;  ///< why there is no value; empty where there is
  [[nodiscard]] bool is(MetricName metric) const { return row->name == metric.row().name; }
  [[nodiscard]] std::string name() const {
    return of.empty() ? std::string(row->name) : std::string(row->name) + "[" + of + "]";
  }
};
[[nodiscard]] Measured measured(MetricName name, double value, std::string of = {});
[[nodiscard]] Measured not_measured(MetricName name, std::string why, std::string of = {});
/// All metrics of a place that need one of these and have no value, for the same reason; in the table's order.
void not_measured_all(std::vector<Measured>& values, MetricPlace place, std::initializer_list<MetricWhen> when,
                      const std::string& why, const std::string& of = {});

/// Something that happened at a time and place: for whoever wants to look at it.
struct Moment {
  double t_s = 0;
  Vec3 at_mm;
  std::string what;
  std::string structure;
  double value = 0, limit = 0;
};

/// What is known of the scene besides its bone; must outlive the metrics.
struct EvidenceScene {
  double rate_hz = 1000;
  const StructureMap* structures = nullptr;
  const Procedure* procedure = nullptr;

  /// Whether the operation enters a structure, by its number in values(): what is to be opened is not injured by that.
  [[nodiscard]] bool opens(std::size_t number) const {
    return structures->opened(number) ||
           (procedure != nullptr && procedure->enters(structures->name_of(structures->values()[number])));
  }
};

/// One of the readers that together make a score. Frames in order; then finish(), once.
class Metric {
 public:
  virtual ~Metric() = default;
  virtual void frame(const EvidenceFrame& frame) = 0;
  /// `world`: as the session left it.
  virtual void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) = 0;
};

}  // namespace osteo::inline assessment
