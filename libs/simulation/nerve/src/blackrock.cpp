#include "osteo/simulation/nerve/blackrock.h"

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

static_assert(std::endian::native == std::endian::little);

// Bytes of a header, field after field.
class Bytes {
 public:
  template <class T>
  Bytes& put(T value) {
    static_assert(std::is_trivially_copyable_v<T>);
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Bytes& text(const std::string& s, std::size_t length) {
    std::string padded = s.substr(0, length - 1);
    padded.resize(length, '\0');
    text_ += padded;
    return *this;
  }
  Bytes& raw(std::string_view s) {
    text_ += s;
    return *this;
  }
  Bytes& date() {  // year, month, day of week, day, hour, minute, second, millisecond
    for (const int v : {2000, 1, 6, 1, 0, 0, 0, 0}) put(static_cast<std::uint16_t>(v));
    return *this;
  }
  [[nodiscard]] const std::string& str() const { return text_; }

 private:
  std::string text_;
};

constexpr std::uint64_t kSettledAfter = 3000;  // samples: behind the longest wait for an answer
constexpr std::uint32_t kPacket = 8 + 2 * MonitorSpike::kLength;
constexpr const char* kProgram = "Osteotome";
constexpr const char* kComment = "A simulated signal for practice. Illustrative, not clinical.";

}  // namespace

struct BlackrockFiles::Files {
  struct File {
    std::filesystem::path path;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
    void open(const std::filesystem::path& where) {
      path = where;
      file.reset(std::fopen(path.c_str(), "wb"));
      if (!file) fail();
    }
    void write(const void* data, std::size_t bytes) const {
      if (std::fwrite(data, 1, bytes, file.get()) != bytes) fail();
    }
    void write(const std::string& s) const { write(s.data(), s.size()); }
    [[noreturn]] void fail() const {
      throw Error(ExitCode::cannot_write,
                  "'" + path.filename().string() + "' cannot be written: " + std::strerror(errno));
    }
    void close() {
      if (std::fclose(file.release()) != 0) fail();
    }
  };
  File ns5, nev;
  long count_at = 0;
  std::size_t channels = 0;
  std::uint64_t samples = 0, spikes = 0;
  std::multimap<std::uint64_t, std::string> waiting;  // packets: an answer is known behind spikes that come later
  void flush(std::uint64_t before) {
    const auto end = waiting.lower_bound(before);
    for (auto it = waiting.begin(); it != end; ++it) nev.write(it->second);
    waiting.erase(waiting.begin(), end);
  }
};

BlackrockFiles::BlackrockFiles(const std::filesystem::path& folder, const std::string& name,
                               const std::vector<std::string>& labels, const MonitorConstants& constants)
    : files_(std::make_unique<Files>()) {
  Files& f = *files_;
  f.channels = labels.size();
  const auto n = static_cast<std::uint32_t>(labels.size());
  constexpr auto kRate = static_cast<std::uint32_t>(MonitorSetup::kRateHz);
  constexpr std::int16_t kMax = 32764, kMaxUv = 8191;  // 0.25 uV a bit
  const auto low_pass_mhz = static_cast<std::uint32_t>(constants.noise_hz * 1000);

  f.ns5.open(folder / (name + ".ns5"));
  Bytes h;
  h.raw("NEURALCD")
      .put<std::uint8_t>(2)
      .put<std::uint8_t>(3)
      .put<std::uint32_t>(314 + 66 * n)
      .text("30 kS/s", 16)
      .text(kComment, 256);
  h.put<std::uint32_t>(1).put<std::uint32_t>(kRate).date().put<std::uint32_t>(n);
  for (std::uint32_t ch = 0; ch < n; ++ch) {
    h.raw("CC")
        .put(static_cast<std::uint16_t>(ch + 1))
        .text(labels[ch], 16)
        .put<std::uint8_t>(1)
        .put(static_cast<std::uint8_t>(ch + 1));
    h.put<std::int16_t>(-kMax).put(kMax).put<std::int16_t>(-kMaxUv).put(kMaxUv).text("uV", 16);
    h.put<std::uint32_t>(0).put<std::uint32_t>(0).put<std::uint16_t>(0);  // high-pass: none
    h.put(low_pass_mhz).put<std::uint32_t>(1).put<std::uint16_t>(1);      // low-pass, order, kind
  }
  h.put<std::uint8_t>(1).put<std::uint32_t>(0);  // one block, from the beginning on; its count is known at the end
  f.ns5.write(h.str());
  f.count_at = static_cast<long>(h.str().size());
  f.ns5.write(Bytes().put<std::uint32_t>(0).str());

  f.nev.open(folder / (name + ".nev"));
  Bytes e;
  e.raw("NEURALEV").put<std::uint8_t>(2).put<std::uint8_t>(3).put<std::uint16_t>(1);  // all waveforms are of 16 bits
  e.put<std::uint32_t>(336 + 32 * (3 * n + 1))
      .put(kPacket)
      .put(kRate)
      .put(kRate)
      .date()
      .text(kProgram, 32)
      .text(kComment, 256);
  e.put<std::uint32_t>(3 * n + 1);
  const auto hi = static_cast<std::int16_t>(constants.event_uv);
  for (std::uint32_t ch = 0; ch < n; ++ch) {
    const auto id = static_cast<std::uint16_t>(ch + 1);
    e.raw("NEUEVWAV")
        .put(id)
        .put<std::uint8_t>(1)
        .put(static_cast<std::uint8_t>(id))
        .put<std::uint16_t>(250)
        .put<std::uint16_t>(0);
    e.put(hi).put<std::int16_t>(static_cast<std::int16_t>(-hi)).put<std::uint8_t>(0).put<std::uint8_t>(2);
    e.put(static_cast<std::uint16_t>(MonitorSpike::kLength)).text("", 8);
  }
  for (std::uint32_t ch = 0; ch < n; ++ch)
    e.raw("NEUEVLBL").put(static_cast<std::uint16_t>(ch + 1)).text(labels[ch], 16).text("", 6);
  for (std::uint32_t ch = 0; ch < n; ++ch) {
    e.raw("NEUEVFLT")
        .put(static_cast<std::uint16_t>(ch + 1))
        .put<std::uint32_t>(0)
        .put<std::uint32_t>(0)
        .put<std::uint16_t>(0);
    e.put(low_pass_mhz).put<std::uint32_t>(1).put<std::uint16_t>(1).text("", 2);
  }
  e.raw("DIGLABEL").text("stimulator", 16).put<std::uint8_t>(1).text("", 7);
  f.nev.write(e.str());
}

BlackrockFiles::~BlackrockFiles() = default;

void BlackrockFiles::block(const MonitorBlock& block) {
  Files& f = *files_;
  f.ns5.write(block.values.data(), block.values.size_bytes());
  f.samples += block.samples();
  f.flush(block.first_sample < kSettledAfter ? 0 : block.first_sample - kSettledAfter);
}

void BlackrockFiles::spike(const MonitorSpike& spike) {
  Bytes b;
  b.put(static_cast<std::uint32_t>(spike.sample))
      .put(static_cast<std::uint16_t>(spike.channel + 1))
      .put<std::uint8_t>(0)
      .put<std::uint8_t>(0);
  for (const std::int16_t v : spike.wave) b.put(v);
  files_->waiting.emplace(spike.sample, b.str());
  ++files_->spikes;
}

void BlackrockFiles::event(const MonitorEvent& event) {
  if (event.kind != MonitorEventKind::stimulus && event.kind != MonitorEventKind::response) return;
  const auto ua = static_cast<std::uint16_t>(event.ma * 1000 + 0.5);
  const auto value = static_cast<std::uint16_t>(event.kind == MonitorEventKind::response ? ua | 0x8000U : ua);
  Bytes b;
  b.put(static_cast<std::uint32_t>(event.sample))
      .put<std::uint16_t>(0)
      .put<std::uint8_t>(1)
      .put<std::uint8_t>(0)
      .put(value);
  std::string packet = b.str();
  packet.resize(kPacket, '\0');
  files_->waiting.emplace(event.sample, packet);
}

void BlackrockFiles::close() {
  Files& f = *files_;
  f.flush(~std::uint64_t{0});
  if (f.samples > 0xffffffffU)
    throw Error(ExitCode::resources, "an .ns5 file cannot hold more than 39 hours", "cut the session into parts");
  const auto count = static_cast<std::uint32_t>(f.samples);
  if (std::fseek(f.ns5.file.get(), f.count_at, SEEK_SET) != 0) f.ns5.fail();
  f.ns5.write(&count, sizeof count);
  f.ns5.close();
  f.nev.close();
}

std::uint64_t BlackrockFiles::samples() const {
  return files_->samples;
}
std::uint64_t BlackrockFiles::spikes() const {
  return files_->spikes;
}

}  // namespace osteo::inline simulation
