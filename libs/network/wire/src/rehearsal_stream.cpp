#include "osteo/network/wire/rehearsal_stream.h"

#include <algorithm>

#include "osteo/core/base/files.h"

namespace osteo::inline network {

RehearsalStream::RehearsalStream(Rehearsal& rehearsal, std::span<const StreamTarget> targets, MonitorReader* monitor,
                                 const MonitorOptions& options)
    : rehearsal_(rehearsal), monitor_(monitor) {
  if (monitor_ == nullptr) {
    own_ = std::make_unique<MonitorReader>(options, rehearsal.structures(), rehearsal.rate_hz());
    monitor_ = own_.get();
  }
  feed_ = std::make_unique<StreamFeed>(targets, rehearsal.rate_hz(), rehearsal.hands(), monitor_);
  monitor_->add_sink(*feed_);
  const auto place = std::find_if(targets.begin(), targets.end(), [](const StreamTarget& t) { return t.stimulator; });
  if (place != targets.end()) {
    if (own_) {  // else whoever has made it leaves them
      notes_ = std::make_unique<MonitorNotes>(rehearsal, monitor_->wiring());
      monitor_->add_sink(*notes_);
    }
    const std::string code = make_pairing_code();
    endpoint_ = std::make_shared<StimulatorEndpoint>(
        tidy_code(code), [this](const StimulatorSetting& s) { monitor_->stimulate(s); },
        [this] {
          StimulatorSetting now;
          rehearsal_.look([&](const World&, SceneReaders&) { now = monitor_->stimulator(); });
          return std::pair(now, static_cast<std::uint32_t>(rehearsal_.hands()));
        });
    feed_->let_stimulate(endpoint_);
    invitation_ = "to set the stimulator: osteo nerve-console " + place->address + " --code " + code;
  }
  if (own_) rehearsal.add_reader(*own_);
  rehearsal.add_reader(*feed_);
}

RehearsalStream::~RehearsalStream() {
  rehearsal_.remove_reader(*feed_);
  if (own_) rehearsal_.remove_reader(*own_);
}

MonitorOptions monitor_options_of(const std::string& setup_file) {
  MonitorOptions options;
  options.setup = setup_file.empty() ? parse_monitor(default_monitor_json(), "the built-in monitor")
                                     : parse_monitor(read_text(setup_file), setup_file);
  return options;
}

}  // namespace osteo::inline network
