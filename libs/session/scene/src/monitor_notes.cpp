#include "osteo/session/scene/monitor_sound.h"

#include "osteo/core/base/json_document.h"

namespace osteo::inline session {

void MonitorNotes::event(const MonitorEvent& e) {
  switch (e.kind) {
    case MonitorEventKind::stimulator:
      rehearsal_.note(kStimulatorNote, stimulator_note(e));
      break;
    case MonitorEventKind::burst:
    case MonitorEventKind::train:
    case MonitorEventKind::response:
    case MonitorEventKind::no_response:
    case MonitorEventKind::threshold:
    case MonitorEventKind::no_threshold:
    case MonitorEventKind::lost:
      rehearsal_.note("monitor", Json{{"event", name_of(e.kind)},
                                      {"at_s", static_cast<double>(e.sample) / MonitorSetup::kRateHz},
                                      {"words", words_of(e, wiring_)}}
                                     .dump());
      break;
    default:
      break;
  }
}

}  // namespace osteo::inline session
