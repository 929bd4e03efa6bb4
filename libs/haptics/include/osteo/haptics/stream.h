// The one stream of a rehearsal: what the servo tells every reader.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/grid/brick_grid.h"
#include "osteo/rt/ring.h"

namespace osteo {

/// What a device reports in a tick. Everything that happens follows from the sequence of these.
struct DeviceSample {
  std::array<float, 3> position_mm{};  ///< centre of the burr, LPS
  std::array<float, 3> axis{0, 0, 1};  ///< unit, from burr to handle
  std::uint8_t drill_on = 0;
  std::uint8_t tool = 0;  ///< index in burr_library()
  std::uint8_t reserved[2]{};
};
static_assert(sizeof(DeviceSample) == 28);

/// One tick, as it is written to session files (little endian).
struct TickRecord {
  std::uint64_t tick = 0;
  DeviceSample device;
  std::array<float, 3> force_n{};  ///< on the hand
  float depth_mm = 0;              ///< equivalent penetration of the burr
  float removed_mm3 = 0;           ///< in this tick
  std::uint32_t voxels_changed = 0;
  std::uint32_t immersed_samples = 0;
  // Below: how the machine did. Not part of what replay must repeat.
  float work_us = 0;
  float lateness_us = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(TickRecord) == 80);

/// A voxel's new density.
struct VoxelChange {
  VoxelKey voxel;
  float density;
};
static_assert(sizeof(VoxelChange) == 8);

/// One reader's end of the stream. A tick record follows the changes of its tick.
struct StreamReader {
  StreamReader(std::size_t tick_capacity, std::size_t change_capacity) : ticks(tick_capacity), changes(change_capacity) {}
  Ring<TickRecord> ticks;
  Ring<VoxelChange> changes;
  std::atomic<std::uint64_t> dropped{0};  ///< ticks or their changes lost because the reader was too slow
};

/// Readers are added before the servo starts.
class Stream {
 public:
  StreamReader& add_reader(std::size_t tick_capacity = 1 << 13, std::size_t change_capacity = 1 << 21) {
    readers_.push_back(std::make_unique<StreamReader>(tick_capacity, change_capacity));
    return *readers_.back();
  }
  void publish(const TickRecord& tick, std::span<const VoxelChange> changes) noexcept {
    for (const auto& r : readers_) {
      // Both or neither: a reader pairs changes with ticks by their counts.
      if (r->ticks.room() < 1 || !r->changes.push(changes)) {
        r->dropped.fetch_add(1, std::memory_order_relaxed);
      } else {
        r->ticks.push(tick);
      }
    }
  }

 private:
  std::vector<std::unique_ptr<StreamReader>> readers_;
};

}  // namespace osteo
