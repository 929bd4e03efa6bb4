// A session over time: ten samples a second of what a person wants to see of it, and what happened when.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "osteo/assessment/evidence/detail/hand_motion.h"
#include "osteo/assessment/evidence/metric.h"
#include "osteo/assessment/evidence/visibility.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline assessment {

/// What can happen in a session..
enum class EventKind : int {
  injury,      ///< a turning burr reached a structure
  touch,       ///< a burr that did not turn reached it
  undo,        ///< a step was taken back
  instrument,  ///< the first hand has another instrument
  saw,
  split,
  move,   ///< of a piece; one event for as long as it goes on
  plate,  ///< fixed, taken off, or opened
  note,   ///< what someone wrote, measured or marked; what the window said
  gap,    ///< not recorded
};
[[nodiscard]] std::string_view name_of(EventKind kind);

struct TimelineEvent {
  EventKind kind = EventKind::note;
  double t_s = 0, end_s = 0;  ///< from the beginning of the session; end_s >= t_s
  std::string what;           ///< a phrase: "reached the facial nerve", "cutting 4 mm", the text of a note
  std::string structure;      ///< of injury and touch
  bool placed = false;
  Vec3 at_mm;  ///< where placed: in the world; of injury and touch where the bone lay at the beginning
  /// What `what` was made of: a text of the catalogues and what fills its {part}; null: `what` is a person's own.
  const char* text = nullptr;
  std::string part = {};
  /// `what` in the language.
  [[nodiscard]] std::string shown() const;
};

/// Arrays of one length; sample n stands for [n, n + 1) tenths of a second. What is not known is not a number.
struct Timeline {
  static constexpr double kRateHz = 10;
  static constexpr std::size_t kMaxEvents = 20'000;

  std::vector<std::uint8_t> known;     ///< 1: recorded at least in part
  std::vector<std::uint8_t> drilling;  ///< 1: a burr turns and presses on bone at some tick of it
  std::vector<float> force_n;          ///< of burrs on bone, the most
  std::vector<float> speed_mm_s;       ///< of the first hand's tip, HandMotion's: mean of those known
  std::vector<float>
      distance_mm;  ///< burr's surface to the nearest structure, the least; NaN where none is within reach
  std::vector<std::uint8_t> structure;  ///< which that is: its value in the label map; 0: none
  std::vector<float> removed_mm3;       ///< by burrs in this sample, what was taken back later too
  std::vector<float> seen_mm3, hidden_mm3,
      unknown_mm3;                 ///< of what is gone at the end, whole voxels, at the time each went
  std::vector<std::uint8_t> tool;  ///< the first hand's, index in instrument_library(); kPlate: it holds a plate
  std::vector<std::array<float, 3>> at_mm;  ///< the first hand's tip, in the world
  static constexpr std::uint8_t kPlate = 255;

  std::vector<TimelineEvent> events;  ///< by time
  std::size_t events_left_out = 0;    ///< behind the first kMaxEvents
  std::map<std::uint8_t, std::string> structure_names;

  [[nodiscard]] std::size_t size() const { return known.size(); }
  [[nodiscard]] double duration_s() const { return static_cast<double>(size()) / kRateHz; }
};

/// Takes in frames in their order, live or from a file. 60 bytes a sample: 2 MB an hour. Cost: one
/// StructureMap::clearance() for each tick with a burr, 0.1 to 1 us.
class TimelineKeeper {
 public:
  /// What the scene refers to must outlive this. Structures that the procedure wants opened are no danger: they are
  /// left out.
  explicit TimelineKeeper(const EvidenceScene& scene);
  void frame(const EvidenceFrame& frame);
  /// In any order. "camera" notes are no events.
  void note(const Note& note);
  void gap(const Gap& gap);
  /// What there is by now. `voxels`: of the VisibilityMetric that was told the same frames.
  [[nodiscard]] Timeline timeline(const std::map<VoxelKey, VisibilityMetric::Voxel>& voxels) const;

 private:
  struct Near {
    Recurrence contact;
    std::size_t event = 0;
  };
  struct Hand {
    std::vector<Near> touch, injury;  // by number in values()
  };
  std::size_t sample_at(std::uint64_t tick);
  std::size_t add(TimelineEvent event);  // its number; kMaxEvents where there is no room
  void near(const EvidenceFrame& frame, const TickRecord& tick, std::size_t sample);
  void act(const SceneAction& action, double rate_hz);

  EvidenceScene scene_;
  Timeline line_;
  std::vector<std::uint8_t> watched_;  // by number in values()
  std::vector<double> each_;
  PerHand<Hand> hands_;
  HandMotion motion_;                        // of the first hand
  std::vector<std::uint32_t> speeds_known_;  // by sample: ticks whose speed is in it
  int last_tool_ = -1;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t>
      last_slow_;  // kind and number of what is moved or opened -> event
};

/// Of a session file, streamed: notes, gaps, frames and what was seen; a pass more than score_session makes, which can
/// keep one on the way (ScoreDetail). Errors: as report_frames.
[[nodiscard]] Timeline read_timeline(const SessionReader& session, World begin, const StructureMap* structures,
                                     const Procedure* procedure = nullptr, const Context& context = {});
/// Tells a keeper what is in a session besides its frames.
void report_notes(const SessionReader& session, TimelineKeeper& keeper);

/// "osteotome_timeline": 1, rate, arrays (four digits that count, null where not known) and events.
[[nodiscard]] Json timeline_json(const Timeline& timeline);

}  // namespace osteo::inline assessment
