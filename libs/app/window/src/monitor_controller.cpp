#include "osteo/app/window/monitor_controller.h"

#include "monitor_screen.h"
#include "osteo/session/scene/monitor_sound.h"

namespace osteo::inline app {
struct MonitorController::Parts {
  Parts(Rehearsal& r, const MonitorOptions& options)
      : rehearsal(&r),
        reader(std::make_unique<MonitorReader>(options, r.structures(), r.rate_hz())),
        wiring(reader->wiring()),
        screen(options.setup, wiring),
        notes(std::make_unique<MonitorNotes>(r, wiring)) {}
  Parts(const MonitorSetup& setup, const MonitorWiring& of) : wiring(of), screen(setup, wiring) {}
  Rehearsal* rehearsal = nullptr;
  std::unique_ptr<MonitorReader> reader;
  MonitorWiring wiring;
  MonitorScreen screen;
  MonitorSound sound;
  std::unique_ptr<MonitorNotes> notes;
  std::optional<RemoteStimulator> far;
  std::string invitation;
};

MonitorController::MonitorController(Rehearsal& rehearsal, const MonitorOptions& options)
    : parts_(std::make_unique<Parts>(rehearsal, options)) {
  for (MonitorSink* const s : sinks()) parts_->reader->add_sink(*s);
  parts_->reader->add_sink(*parts_->notes);
  rehearsal.add_reader(*parts_->reader);
}

MonitorController::MonitorController(const std::vector<std::string>& labels, double event_uv) {
  MonitorSetup setup;
  setup.constants.event_uv = event_uv;
  MonitorWiring wiring;
  for (const std::string& label : labels) wiring.channels.push_back({0, {label, 0, 0, 0}});
  parts_ = std::make_unique<Parts>(setup, wiring);
}

MonitorController::~MonitorController() {
  if (parts_->rehearsal != nullptr) parts_->rehearsal->remove_reader(*parts_->reader);
}

MonitorScreen& MonitorController::screen() {
  return parts_->screen;
}
MonitorSound& MonitorController::sound() {
  return parts_->sound;
}
MonitorReader& MonitorController::reader() {
  return *parts_->reader;
}
const MonitorWiring& MonitorController::wiring() const {
  return parts_->wiring;
}
std::size_t MonitorController::hands() const {
  if (parts_->far) return parts_->far->hands();
  return parts_->rehearsal == nullptr ? 0 : parts_->rehearsal->hands();
}

std::vector<MonitorSink*> MonitorController::sinks() {
  return {&parts_->screen, &parts_->sound};
}

void MonitorController::lend(RemoteStimulator stimulator) {
  parts_->far = std::move(stimulator);
}
void MonitorController::invite(std::string words) {
  parts_->invitation = std::move(words);
}
const std::string& MonitorController::invitation() const {
  return parts_->invitation;
}

bool MonitorController::stimulates() const {
  return parts_->reader != nullptr || (parts_->far && parts_->far->there());
}

void MonitorController::stimulate(const StimulatorSetting& setting) {
  if (parts_->far) return parts_->far->set(setting);
  if (parts_->reader) parts_->reader->stimulate(setting);
}

StimulatorSetting MonitorController::stimulator() const {
  if (parts_->far) return parts_->far->now();
  StimulatorSetting now;
  if (parts_->rehearsal != nullptr)
    parts_->rehearsal->look([&](const World&, SceneReaders&) { now = parts_->reader->stimulator(); });
  return now;
}

}  // namespace osteo::inline app
