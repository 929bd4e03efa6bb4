// Lab Streaming Layer: its library is looked for when it is asked for, and nothing is linked to it.
#include <dlfcn.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "osteo/core/base/error.h"
#include "wire_sinks.h"

namespace osteo::inline network {
namespace {

// Of lsl_c.h, 1.1x.
struct LslInfo;
struct LslOutletHandle;
struct LslXml;
constexpr std::int32_t kLslInt16 = 5, kLslText = 3;

class Library {
 public:
  Library() {
    const char* const own = std::getenv("OSTEO_LSL_LIBRARY");
    for (const char* const name : {own, "liblsl.so.2", "liblsl.so"}) {
      if (name == nullptr || *name == 0) continue;
      handle_ = ::dlopen(name, RTLD_NOW | RTLD_LOCAL);
      if (handle_ != nullptr) break;
    }
    if (handle_ == nullptr)
      throw Error(ExitCode::failed, "the library of Lab Streaming Layer (liblsl) is not on this machine",
                  "install liblsl, or name its file in OSTEO_LSL_LIBRARY");
    find(create_info, "lsl_create_streaminfo");
    find(destroy_info, "lsl_destroy_streaminfo");
    find(create_outlet, "lsl_create_outlet");
    find(destroy_outlet, "lsl_destroy_outlet");
    find(push_samples, "lsl_push_chunk_stp");
    find(push_text, "lsl_push_sample_strt");
    find(clock, "lsl_local_clock");
    find(wait, "lsl_wait_for_consumers");
    find(have_consumers, "lsl_have_consumers");
    find(desc, "lsl_get_desc");
    find(child, "lsl_append_child");
    find(value, "lsl_append_child_value");
  }
  LslInfo* (*create_info)(const char* name, const char* type, std::int32_t channels, double rate, std::int32_t format,
                          const char* id);
  void (*destroy_info)(LslInfo*);
  LslOutletHandle* (*create_outlet)(LslInfo*, std::int32_t chunk, std::int32_t buffered_s);
  void (*destroy_outlet)(LslOutletHandle*);
  std::int32_t (*push_samples)(LslOutletHandle*, const std::int16_t*, unsigned long elements, double time);
  std::int32_t (*push_text)(LslOutletHandle*, const char**, double time);
  double (*clock)();
  std::int32_t (*wait)(LslOutletHandle*, double most_s);
  std::int32_t (*have_consumers)(LslOutletHandle*);
  LslXml* (*desc)(LslInfo*);
  LslXml* (*child)(LslXml*, const char*);
  LslXml* (*value)(LslXml*, const char*, const char*);

 private:
  template <class F>
  void find(F& f, const char* name) {
    f = reinterpret_cast<F>(::dlsym(handle_, name));
    if (f == nullptr)
      throw Error(ExitCode::failed, std::string("liblsl lacks ") + name, "a newer one is needed (1.13 or later)");
  }
  void* handle_ = nullptr;
};

// Samples are stamped by LSL's clock as of the session's beginning, so that its time and that of others agree. The
// library's own threads send; what nobody takes within kBufferedS it drops.
class LslSink final : public WireSink {
 public:
  void begin(const WireMonitor& monitor) override {
    channels_ = monitor.labels.size();
    LslInfo* const events = lsl_.create_info("OsteotomeEvents", "Markers", 1, 0, kLslText, "osteotome-events");
    events_ = lsl_.create_outlet(events, 0, kBufferedS);
    lsl_.destroy_info(events);
    if (channels_ == 0) return;
    LslInfo* const info = lsl_.create_info("OsteotomeEMG", "EMG", static_cast<std::int32_t>(channels_),
                                           MonitorSetup::kRateHz, kLslInt16, "osteotome-emg");
    LslXml* const all = lsl_.child(lsl_.desc(info), "channels");
    for (const std::string& label : monitor.labels) {
      LslXml* const one = lsl_.child(all, "channel");
      lsl_.value(one, "label", label.c_str());
      lsl_.value(one, "unit", "0.25 microvolts");
      lsl_.value(one, "type", "EMG");
    }
    signal_ = lsl_.create_outlet(info, 0, kBufferedS);
    lsl_.destroy_info(info);
  }
  ~LslSink() override {
    // What the library has not sent yet is lost with the outlet, and it does not tell when it has: time for the last
    // blocks.
    bool heard = false;
    for (LslOutletHandle* const o : {signal_, events_}) heard = heard || (o != nullptr && lsl_.have_consumers(o) != 0);
    if (heard) std::this_thread::sleep_for(std::chrono::seconds(1));
    if (signal_ != nullptr) lsl_.destroy_outlet(signal_);
    if (events_ != nullptr) lsl_.destroy_outlet(events_);
  }
  void block(const MonitorBlock& b) override {
    if (signal_ == nullptr || b.values.empty()) return;
    lsl_.push_samples(signal_, b.values.data(), b.values.size(), time_of(b.first_sample + b.samples() - 1));
    samples_ += b.samples();
  }
  void event(const MonitorEvent& e, const std::string& words) override {
    const std::string json = event_json(e, words);
    const char* text = json.c_str();
    lsl_.push_text(events_, &text, time_of(e.sample));
  }
  void end(double at_s, const std::string& json) override {
    const char* text = json.c_str();
    lsl_.push_text(events_, &text, time_of(static_cast<std::uint64_t>(at_s * MonitorSetup::kRateHz)));
  }
  bool wait(std::size_t listeners, double most_s, const std::function<bool()>& stop) override {
    if (listeners == 0) return true;
    for (double waited = 0; waited < most_s && !(stop && stop()); waited += 0.2) {
      if (lsl_.wait(signal_ != nullptr ? signal_ : events_, 0.2) != 0) return true;
    }
    return false;
  }
  [[nodiscard]] std::string reported() const override {
    return "LSL: " + std::to_string(samples_) + " samples of " + std::to_string(channels_) + " channels";
  }

 private:
  static constexpr std::int32_t kBufferedS = 30;
  [[nodiscard]] double time_of(std::uint64_t sample) {
    const double at_s = static_cast<double>(sample) / MonitorSetup::kRateHz;
    if (!begin_s_) begin_s_ = lsl_.clock() - at_s;
    return *begin_s_ + at_s;
  }
  Library lsl_;
  LslOutletHandle *signal_ = nullptr, *events_ = nullptr;
  std::size_t channels_ = 0;
  std::uint64_t samples_ = 0;
  std::optional<double> begin_s_;
};

}  // namespace

std::unique_ptr<WireSink> make_lsl_sink() {
  return std::make_unique<LslSink>();
}

}  // namespace osteo::inline network
