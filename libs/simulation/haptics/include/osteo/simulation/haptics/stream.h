// The one stream of a rehearsal: what the servo tells every reader.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "osteo/core/rt/ring.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline simulation {

/// What a device reports in a tick. Everything that happens follows from the sequences of these, one for each hand.
struct DeviceSample {
  std::array<float, 3> position_mm{};  ///< centre of the instrument's tip, LPS
  std::array<float, 3> axis{0, 0, 1};  ///< unit, from tip to handle
  std::uint8_t pedal = 0;              ///< 0: up, 255: down as far as it goes, which a mere button is at once
  std::uint8_t tool = 0;               ///< index in instrument_library()
  std::uint8_t age_ms = 0;             ///< since the device last reported; 255: longer, or unplugged
  std::uint8_t buttons =
      0;  ///< of the device, beyond the pedal's; of a hand that leads another: kLeadStrength, kLeadStill
};
static_assert(sizeof(DeviceSample) == 28);

/// DeviceSample::buttons of a hand that leads another (ActionKind::guide): how much of the pull there is, 127 all of
/// it; and that for this hand time stands still: it is where it is told to be, but meets no bone and takes none, and
/// goes on later as if nothing had been.
enum LeadBits : std::uint8_t { kLeadStrength = 127, kLeadStill = 128 };

/// What happened in a tick, as bits of TickRecord::flags.
enum TickFlag : std::uint32_t {
  kPoseInvalid = 1,          ///< not finite: the last good pose stood in
  kPoseJumped = 2,           ///< farther than a hand moves in a tick: force begins again from nothing
  kPoseStale = 4,            ///< the device has not reported for a while: force fades out
  kForceCapped = 8,          ///< the limit of the force was reached
  kRateCapped = 16,          ///< the limit of its rate was
  kPassivity = 32,           ///< the passivity controller took energy out
  kShaftContact = 64,        ///< the shaft touches bone
  kEscape = 128,             ///< too deep for a direction of its own: pushed along the distance map
  kCurveHeld = 256,          ///< the curve constraint holds
  kStructureTouched = 512,   ///< the burr reaches a critical structure
  kStructureInjured = 1024,  ///< and it turns: it may cut in this tick
  kHeld = 2048,              ///< nothing was removed, since the scene is being changed
  kPlateInHand = 4096,       ///< the hand holds a plate, not its instrument
  kSoftContact = 8192,       ///< soft tissue pushes the tool
  kNoRoom = 16384,           ///< bone that the burr covers in part was left: too many voxels are (Grains::room)
  kGuided = 32768,           ///< another hand led it: its force is not its own alone
  kInSlot = 65536,           ///< the saw is in a cutting guide: it cuts in the guide's plane, wherever the hand is
};

/// One tick of one hand, as it is written to session files (little endian). With several hands each tick has one of
/// these for each, in their order.
struct TickRecord {
  std::uint64_t tick = 0;
  DeviceSample device;
  std::array<float, 3> force_n{};      ///< on the hand, after all limits
  std::array<float, 3> torque_n_mm{};  ///< on the hand, about position_mm; devices of 3 degrees of freedom leave it out
  std::array<float, 3> shown_offset_mm{};  ///< from position_mm to where the tool is shown: at the bone's surface
  float normal_force_n = 0;                ///< of the burr on bone: what drives removal
  float depth_mm = 0;                      ///< equivalent penetration of the burr
  float removed_mm3 = 0;                   ///< in this tick
  std::uint32_t voxels_changed = 0;
  std::uint32_t immersed = 0;  ///< voxels (or samples) of bone in the burr
  std::uint32_t flags = 0;     ///< TickFlag
  float energy_mj = 0;         ///< the passivity observer's: positive, the contact gave more than it took
  float thickness_mm = 0;      ///< of the bone that the burr presses on, along the push; 0 without contact, at most 10
  float clearance_mm = 0;      ///< to the nearest critical structure; negative inside; 0 where the scene has none
  std::uint32_t structure =
      0;                   ///< which that is: its value in the label map; 0: none within reach of the burr's surface
  std::uint32_t hand = 0;  ///< whose: from 0
  float speed_rpm = 0;     ///< of the burr, which follows the pedal with its own inertia; 0 of other instruments
  // Below: how the machine did. Not part of what replay must repeat.
  float work_us = 0;
  float lateness_us = 0;
};
static_assert(sizeof(TickRecord) == 128);

/// One reader's end of the stream. A tick's records follow its actions and changes.
struct StreamReader {
  StreamReader(std::size_t tick_capacity, std::size_t change_capacity)
      : ticks(tick_capacity), changes(change_capacity) {}
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};
  Ring<TickRecord> ticks;
  Ring<VoxelChange> changes;
  Ring<SceneAction> actions{1 << 12};
  /// The first tick it is told of, with the actions at its beginning or not; kNone until then. What comes before it was
  /// never meant for this reader: it is not lost.
  std::atomic<std::uint64_t> first_tick{kNone};
  /// Lost because the reader was too slow: ticks (all hands of them) with their changes, and actions.
  std::atomic<std::uint64_t> dropped{0}, actions_dropped{0};
};

/// The servo's thread publishes; readers join and leave at any time, each from any one thread at a time. publish()
/// takes no lock, waits for nobody and allocates nothing.
class Stream {
 public:
  static constexpr std::size_t kMaxReaders = 16;

  Stream() = default;
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Reported of what is published from now on; belongs to the stream until it leaves. Allocates: never in the servo.
  /// Error(resources) where kMaxReaders are there.
  StreamReader& add_reader(std::size_t tick_capacity = 1 << 13, std::size_t change_capacity = 1 << 21);
  /// Waits for the end of a publish() that may still use it (microseconds), then it is gone. Others notice nothing.
  void remove_reader(StreamReader& reader);

  /// Before the tick at whose beginning it happened.
  void publish(const SceneAction& action) noexcept {
    for_each([&](StreamReader& r) {
      if (!r.actions.push(action)) r.actions_dropped.fetch_add(1, std::memory_order_relaxed);
    });
  }
  /// A tick: the records of all hands, and their changes in the same order.
  void publish(std::span<const TickRecord> hands, std::span<const VoxelChange> changes) noexcept {
    for_each([&](StreamReader& r) {
      if (r.first_tick.load(std::memory_order_relaxed) == StreamReader::kNone)
        r.first_tick.store(hands.front().tick, std::memory_order_relaxed);
      // Both or neither: a reader pairs changes with ticks by their counts.
      if (r.ticks.room() < hands.size() || !r.changes.push(changes)) {
        r.dropped.fetch_add(1, std::memory_order_relaxed);
      } else {
        r.ticks.push(hands);
      }
    });
  }
  void publish(const TickRecord& tick, std::span<const VoxelChange> changes) noexcept { publish({&tick, 1}, changes); }

 private:
  // Odd while it runs. Who leaves empties its slot and then looks at this number, the servo raises it and then looks at
  // the slots: in one order of all four (sequential consistency) either the servo finds the slot empty or the leaver
  // finds the number odd, and waits.
  template <class F>
  void for_each(F&& f) noexcept {
    const std::uint64_t n = publishes_.load(std::memory_order_relaxed);
    publishes_.store(n + 1, std::memory_order_seq_cst);
    for (const auto& slot : slots_) {
      if (StreamReader* const r = slot.load(std::memory_order_seq_cst)) f(*r);
    }
    publishes_.store(n + 2, std::memory_order_release);
  }

  std::array<std::atomic<StreamReader*>, kMaxReaders> slots_{};
  std::atomic<std::uint64_t> publishes_{0};
  std::mutex mutex_;  // of those who join and leave, among themselves
  std::vector<std::unique_ptr<StreamReader>> readers_;
};

}  // namespace osteo::inline simulation
