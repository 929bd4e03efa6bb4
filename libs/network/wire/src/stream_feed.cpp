#include "osteo/network/wire/stream_feed.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "wire_sinks.h"

namespace osteo::inline network {
namespace {

constexpr int kWireVersion = 1;

std::optional<Vec3> vector_in(const Json& j, const char* key) {
  const Json* const v = j.find(key);
  if (v == nullptr || v->items().size() != 3) return std::nullopt;
  std::array<double, 3> x{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto n = v->items()[i].number();
    if (!n || !std::isfinite(*n)) return std::nullopt;
    x[i] = *n;
  }
  return Vec3{x[0], x[1], x[2]};
}

}  // namespace

std::vector<StreamTarget> stream_targets(const std::string& text) {
  const auto refuse = [](const std::string& one) -> StreamTarget {
    throw Error(ExitCode::usage, "'" + one + "' is no place to stream to",
                "igtl:PORT, igtl:HOST:PORT, igtl:PORT/stimulator, cerebus:HOST:PORT/VERSION or lsl; several with "
                "commas between");
  };
  std::vector<StreamTarget> all;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string one(trimmed(std::string_view(text).substr(at, comma - at)));
    at = comma + 1;
    const std::size_t colon = one.find(':');
    const std::string kind = one.substr(0, colon), rest = colon == std::string::npos ? "" : one.substr(colon + 1);
    StreamTarget t;
    if (kind == "lsl" && rest.empty()) {
      t.kind = StreamTarget::Kind::lsl;
    } else if (kind == "igtl" && !rest.empty()) {
      const std::size_t slash = rest.find('/');
      t.address = rest.substr(0, slash);
      t.stimulator = slash != std::string::npos;
      if (t.stimulator && rest.substr(slash) != "/stimulator") t = refuse(one);
    } else if (kind == "cerebus" && !rest.empty()) {
      t.kind = StreamTarget::Kind::cerebus;
      const std::size_t slash = rest.find('/');
      t.address = rest.substr(0, slash);
      if (slash != std::string::npos) t.version = rest.substr(slash + 1);
      if (t.version != "3.11" && t.version != "4.0" && t.version != "4.1" && t.version != "4.2")
        throw Error(ExitCode::usage, "there is no Cerebus protocol '" + t.version + "'", "3.11, 4.0, 4.1 or 4.2");
    } else {
      t = refuse(one);
    }
    if (t.kind != StreamTarget::Kind::lsl) static_cast<void>(wire_address(t.address));
    all.push_back(t);
  }
  return all;
}

std::optional<WireCamera> camera_in_note(const std::string& json) {
  const auto j = Json::parse(json);
  if (!j) return std::nullopt;
  const auto eye = vector_in(*j, "eye_mm"), target = vector_in(*j, "target_mm"), up = vector_in(*j, "up");
  if (!eye || !target || !(length(*eye - *target) > 0)) return std::nullopt;
  WireCamera c{*eye, *target};
  if (up && length(*up) > 0) c.up = *up;
  return c;
}

Mat3 frame_along(Vec3 z) {
  const Vec3 axis = length(z) > 0 ? normalized(z) : Vec3{0, 0, 1}, x = any_perpendicular(axis);
  return {{x, cross(axis, x), axis}};
}

std::string monitor_json(const WireMonitor& m) {
  return Json{{"osteotome_wire", kWireVersion},
              {"rate_hz", MonitorSetup::kRateHz},
              {"uv_per_bit", MonitorSetup::kMicrovoltsPerBit},
              {"event_uv", m.event_uv},
              {"channels", m.labels}}
      .dump();
}

std::optional<WireMonitor> monitor_in(const std::string& json) {
  const auto j = Json::parse(json);
  if (!j) return std::nullopt;
  const auto number = [&](const char* key) {
    const Json* const v = j->find(key);
    return v == nullptr ? std::nullopt : v->number();
  };
  const Json* const channels = j->find("channels");
  const auto event_uv = number("event_uv");
  if (number("osteotome_wire") != kWireVersion || number("rate_hz") != MonitorSetup::kRateHz ||
      number("uv_per_bit") != MonitorSetup::kMicrovoltsPerBit || !event_uv || !(*event_uv > 0 && *event_uv < 1e5) ||
      channels == nullptr || channels->items().size() > MonitorSetup::kMaxChannels)
    return std::nullopt;
  WireMonitor m;
  m.event_uv = *event_uv;
  for (const Json& c : channels->items()) {
    if (c.text() == nullptr) return std::nullopt;
    m.labels.push_back(c.text()->substr(0, 64));
  }
  return m;
}

std::string event_json(const MonitorEvent& e, const std::string& words) {
  if (e.kind == MonitorEventKind::cause) return {};
  Json j{{"event", name_of(e.kind)},
         {"sample", e.sample},
         {"at_s", static_cast<double>(e.sample) / MonitorSetup::kRateHz}};
  if (e.channel >= 0) j["channel"] = e.channel;
  if (e.seconds > 0) j["seconds"] = e.seconds;
  if (e.uv > 0) j["uv"] = e.uv;
  if (e.ms > 0) j["ms"] = e.ms;
  if (e.ma > 0) j["ma"] = e.ma;
  if (e.search) j["search"] = true;
  j["words"] = words;
  return j.dump();
}

std::optional<MonitorEvent> event_in(const std::string& json) {
  const auto j = Json::parse(json);
  const Json* const name = j ? j->find("event") : nullptr;
  if (name == nullptr || name->text() == nullptr) return std::nullopt;
  MonitorEvent e;
  bool found = false;
  for (int kind = 0; kind <= static_cast<int>(MonitorEventKind::lost) && !found; ++kind) {
    e.kind = static_cast<MonitorEventKind>(kind);
    found = e.kind != MonitorEventKind::cause && name_of(e.kind) == *name->text();
  }
  const auto number = [&](const char* key, double most) -> double {
    const Json* const v = j->find(key);
    const auto n = v == nullptr ? std::nullopt : v->number();
    return n && *n >= 0 && *n <= most ? *n : -1;
  };
  const double sample = number("sample", 9e15);
  if (!found || sample < 0) return std::nullopt;
  e.sample = static_cast<std::uint64_t>(sample);
  e.channel = static_cast<int>(number("channel", MonitorSetup::kMaxChannels - 1));
  e.seconds = std::max(0.0, number("seconds", 1e6));
  e.uv = std::max(0.0, number("uv", 1e6));
  e.ms = std::max(0.0, number("ms", 1e6));
  e.ma = std::max(0.0, number("ma", 100));
  const Json* const search = j->find("search");
  e.search = search != nullptr && *search == Json(true);
  return e;
}

std::unique_ptr<WireSink> make_sink(const StreamTarget& target) {
  switch (target.kind) {
    case StreamTarget::Kind::cerebus:
      return make_cerebus_sink(target);
    case StreamTarget::Kind::lsl:
      return make_lsl_sink();
    case StreamTarget::Kind::igtl:
      break;
  }
  return make_igtl_sink(target);
}

StreamFeed::StreamFeed(std::span<const StreamTarget> targets, double rate_hz, std::size_t hands,
                       const MonitorReader* monitor)
    : rate_hz_(rate_hz),
      every_(static_cast<std::uint64_t>(std::max(1.0, std::round(rate_hz / kPoseHz)))),
      now_(hands),
      monitor_(monitor) {
  for (const StreamTarget& t : targets) sinks_.push_back(make_sink(t));
  WireMonitor m;
  if (monitor != nullptr) m = {monitor->wiring().labels(), monitor->setup().constants.event_uv};
  for (const auto& o : sinks_) o->begin(m);
}

StreamFeed::~StreamFeed() {
  end();
}

void StreamFeed::tick(const TickRecord& record, std::span<const VoxelChange>) {
  tick_ = record.tick;
  if (record.tick % every_ != 0 || record.hand >= now_.size()) return;
  WireTool& t = now_[record.hand];
  t.hand = record.hand;
  t.tip_mm = from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm);
  t.axis = from_floats(record.device.axis);
  t.force_n = from_floats(record.force_n);
  t.rotation_hz = static_cast<double>(record.speed_rpm) / 60;
  t.pedal = record.device.pedal / 255.0;
  if (record.hand + 1 != now_.size()) return;
  const double at_s = static_cast<double>(record.tick) / rate_hz_;
  std::optional<WireCamera> camera;
  {
    const std::lock_guard lock(mutex_);
    camera.swap(camera_);
  }
  for (const auto& o : sinks_) {
    o->tools(at_s, now_);
    if (camera) o->camera(at_s, *camera);
  }
  ++counts_.tools;
  if (camera) ++counts_.cameras;
}

void StreamFeed::block(const MonitorBlock& block) {
  for (const auto& o : sinks_) o->block(block);
  counts_.samples += block.samples();
}

void StreamFeed::event(const MonitorEvent& event) {
  if (event.kind == MonitorEventKind::cause || monitor_ == nullptr) return;
  const std::string words = words_of(event, monitor_->wiring());
  for (const auto& o : sinks_) o->event(event, words);
  ++counts_.events;
}

void StreamFeed::spike(const MonitorSpike& spike) {
  for (const auto& o : sinks_) o->spike(spike);
  ++counts_.spikes;
}

void StreamFeed::note(const std::string& kind, const std::string& json) {
  if (kind != "camera") return;
  if (const auto camera = camera_in_note(json)) {
    const std::lock_guard lock(mutex_);
    camera_ = camera;
  }
}

void StreamFeed::end() {
  if (std::exchange(ended_, true)) return;
  const std::string json = Json{
      {"samples", counts_.samples},
      {"tools", counts_.tools},
      {"events", counts_.events},
      {"cameras", counts_.cameras},
      {"spikes",
       counts_.spikes}}.dump();
  for (const auto& o : sinks_) o->end(static_cast<double>(tick_) / rate_hz_, json);
}

void StreamFeed::let_stimulate(const std::shared_ptr<StimulatorEndpoint>& endpoint) {
  for (const auto& o : sinks_) o->let_stimulate(endpoint);
}

bool StreamFeed::wait_for(std::size_t listeners, double most_s, const std::function<bool()>& stop) {
  return std::all_of(sinks_.begin(), sinks_.end(), [&](const auto& o) { return o->wait(listeners, most_s, stop); });
}

std::vector<std::string> StreamFeed::reported() const {
  std::vector<std::string> all;
  for (const auto& o : sinks_) all.push_back(o->reported());
  return all;
}

std::uint64_t StreamFeed::dropped() const {
  std::uint64_t sum = 0;
  for (const auto& o : sinks_) sum += o->dropped();
  return sum;
}

}  // namespace osteo::inline network
