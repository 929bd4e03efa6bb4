// What a nerve monitor would have written down, as notes of the session.
#pragma once
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline session {

/// Settings of the stimulator as stimulator_notes() reads them; bursts, trains, answers, thresholds as notes "monitor".
/// In the thread that follows the stream, which may leave notes. `rehearsal` and `wiring` must outlive it.
class MonitorNotes final : public MonitorSink {
 public:
  MonitorNotes(Rehearsal& rehearsal, const MonitorWiring& wiring) : rehearsal_(rehearsal), wiring_(wiring) {}
  void event(const MonitorEvent& event) override;

 private:
  Rehearsal& rehearsal_;
  const MonitorWiring& wiring_;
};

}  // namespace osteo::inline session
