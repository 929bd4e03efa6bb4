#include "osteo/network/wire/remote_monitor.h"

#include <cmath>

namespace osteo::inline network {
namespace {

constexpr std::size_t kMaxBody = 1 << 17;  // a text is at most 64 KiB, a block of 16 channels less

}  // namespace

RemoteMonitor::RemoteMonitor(const WireAddress& server, Begin begin, std::string_view tidy_code)
    : begin_(std::move(begin)),
      link_(tidy_code.empty() ? nullptr : std::make_unique<StimulatorLink>(tidy_code)),
      client_(server, kMaxBody, [this](const IgtlMessage& m) { take(m); }) {}

void RemoteMonitor::stimulate(const StimulatorSetting& setting) {
  if (!link_) return;
  const std::lock_guard lock(link_mutex_);
  if (const auto message = link_->set(setting)) client_.send(*message);
}

std::string RemoteMonitor::trouble() const {
  if (!client_.connected()) return client_.trouble();
  if (!understood_) return "connected; it has not announced a nerve monitor";
  if (link_) {
    const StimulatorLink::State s = link_->state();
    if (!s.paired)
      return s.refused.empty() ? "the stimulator is not paired: does the rehearsal stream with /stimulator?"
                               : s.refused;
  }
  return {};
}

void RemoteMonitor::take(const IgtlMessage& m) {
  if (link_ && m.type == "STATUS" && client_.counts().connections != connection_) {  // the first that a server says
    connection_ = client_.counts().connections;
    const std::lock_guard lock(link_mutex_);
    client_.send(link_->begin());
  }
  if (link_ && m.type == kStimulatorType) {
    const std::lock_guard lock(link_mutex_);
    for (const WireBytes& b : link_->hear(m)) client_.send(b);
    return;
  }
  if (m.type == "STRING") {
    const auto text = igtl_string_in(m);
    if (!text) return;
    if (m.device == "NerveSetup") {
      ended_ = false;
      if (*text == setup_) return;
      const auto monitor = monitor_in(*text);
      if (!monitor) return;
      setup_ = *text;
      monitor_ = monitor;
      sinks_ = begin_(*monitor);
      understood_ = true;
    } else if (m.device == "NerveEvent" && monitor_) {
      const auto event = event_in(*text);
      if (!event || event->channel >= static_cast<int>(monitor_->labels.size())) return;
      ++events_;
      if (link_ && event->kind == MonitorEventKind::stimulator) link_->reported(event->ma, event->search);
      if (link_ && (event->kind == MonitorEventKind::threshold || event->kind == MonitorEventKind::no_threshold))
        link_->reported(0, false);
      for (MonitorSink* const s : sinks_) s->event(*event);
    } else if (m.device == "SessionEnd") {
      ended_ = true;
    }
    return;
  }
  if (m.device != "NerveSignal" || !monitor_) return;
  const auto samples = igtl_samples_in(m);
  if (!samples || samples->channels != monitor_->labels.size() || samples->channels == 0 || samples->values.empty())
    return;
  const auto first = static_cast<std::uint64_t>(std::llround(m.time_s * MonitorSetup::kRateHz));
  const MonitorBlock block{first, samples->channels, samples->values};
  // One that begins before what was heard is another session; connected to again, the same goes on behind a gap.
  if (any_ && first < next_sample_) sinks_ = begin_(*monitor_);
  if (any_ && first > next_sample_) {
    MonitorEvent e;
    e.kind = MonitorEventKind::lost;
    e.sample = next_sample_;
    e.seconds = static_cast<double>(first - next_sample_) / MonitorSetup::kRateHz;
    lost_ += first - next_sample_;
    for (MonitorSink* const s : sinks_) s->event(e);
  }
  any_ = true;
  next_sample_ = first + block.samples();
  samples_ += block.samples();
  for (MonitorSink* const s : sinks_) s->block(block);
}

}  // namespace osteo::inline network
