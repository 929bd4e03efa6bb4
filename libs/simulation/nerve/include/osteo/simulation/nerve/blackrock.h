// The monitor's signal and events in the files of Blackrock's recorders: .ns5 (30 kHz, specification 2.3) and .nev
// (2.3).
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "osteo/simulation/nerve/activity.h"

namespace osteo::inline simulation {

/// Writes NAME.ns5 and NAME.nev while the monitor runs. Electrodes are numbered from 1; spikes have 48 samples, the
/// crossing at the 11th; a stimulus is a digital event whose value is its current in uA, a response one with the
/// highest bit set. Dates in headers are 2000-01-01: sessions have none. Memory does not grow.
class BlackrockFiles final : public MonitorSink {
 public:
  /// `labels` of the channels, cut off at 15 bytes. Error(cannot_write).
  BlackrockFiles(const std::filesystem::path& folder, const std::string& name, const std::vector<std::string>& labels,
                 const MonitorConstants& constants);
  ~BlackrockFiles() override;
  void block(const MonitorBlock& block) override;
  void event(const MonitorEvent& event) override;
  void spike(const MonitorSpike& spike) override;
  /// Fills in the count of samples and closes. Error(cannot_write).
  void close();

  [[nodiscard]] std::uint64_t samples() const;
  [[nodiscard]] std::uint64_t spikes() const;

 private:
  struct Files;
  std::unique_ptr<Files> files_;
};

}  // namespace osteo::inline simulation
