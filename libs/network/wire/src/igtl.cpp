#include "osteo/network/wire/igtl.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace osteo::inline network {
namespace {

constexpr std::size_t kType = 12, kDevice = 20, kToolName = 20, kStatusName = 20;
constexpr std::uint64_t kMaxPassedOver = std::uint64_t{1} << 32;  // of a message; nobody sends longer ones
constexpr std::uint8_t kTracker6D = 2, kInt16 = 4;
constexpr std::uint16_t kAscii = 3, kUtf8 = 106;  // IANA MIBenum

constexpr std::array<std::uint64_t, 256> crc_table() {
  std::array<std::uint64_t, 256> table{};
  for (std::uint64_t n = 0; n < 256; ++n) {
    std::uint64_t c = n << 56;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 63) != 0 ? (c << 1) ^ 0x42F0E1EBA9EA3693ULL : c << 1;
    table[n] = c;
  }
  return table;
}

// Big endian.
class Out {
 public:
  template <class T>
  void number(T x) {
    for (int shift = 8 * static_cast<int>(sizeof(T)) - 8; shift >= 0; shift -= 8)
      bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(x) >> shift & 0xff));
  }
  void real(float x) { number(std::bit_cast<std::uint32_t>(x)); }
  void real(double x) { number(std::bit_cast<std::uint64_t>(x)); }
  void name(std::string_view text, std::size_t length) {
    for (std::size_t i = 0; i < length; ++i) bytes.push_back(i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0);
  }
  void pose(const IgtlPose& p) {
    for (const Vec3 v : {p.axes.column[0], p.axes.column[1], p.axes.column[2], p.at_mm}) {
      real(static_cast<float>(v.x));
      real(static_cast<float>(v.y));
      real(static_cast<float>(v.z));
    }
  }
  WireBytes bytes;
};

class In {
 public:
  explicit In(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  // The caller has looked at left().
  template <class T>
  T number() {
    std::uint64_t x = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) x = x << 8 | bytes_[at_++];
    return static_cast<T>(x);
  }
  float real32() { return std::bit_cast<float>(number<std::uint32_t>()); }
  double real64() { return std::bit_cast<double>(number<std::uint64_t>()); }
  std::string name(std::size_t length) {
    std::string text;
    for (std::size_t i = 0; i < length; ++i) {
      if (bytes_[at_ + i] == 0) break;
      text.push_back(static_cast<char>(bytes_[at_ + i]));
    }
    at_ += length;
    return text;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

bool finite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

IgtlPose ras_of_lps(const IgtlPose& p) {
  return {{{ras_of_lps(p.axes.column[0]), ras_of_lps(p.axes.column[1]), ras_of_lps(p.axes.column[2])}},
          ras_of_lps(p.at_mm)};
}

std::uint64_t igtl_crc64(std::span<const std::uint8_t> bytes) {
  static constexpr auto kTable = crc_table();
  std::uint64_t crc = 0;
  for (const std::uint8_t b : bytes) crc = kTable[(crc >> 56 ^ b) & 0xff] ^ crc << 8;
  return crc;
}

WireBytes igtl_message(std::string_view type, std::string_view device, double time_s,
                       std::span<const std::uint8_t> body) {
  Out out;
  out.bytes.reserve(IgtlParser::kHeader + body.size());
  out.number(std::uint16_t{1});
  out.name(type, kType);
  out.name(device, kDevice);
  const double seconds = std::isfinite(time_s) ? std::clamp(time_s, 0.0, 4294967295.0) : 0.0;
  out.number(static_cast<std::uint64_t>(std::llround(std::ldexp(seconds, 30))) << 2);
  out.number(static_cast<std::uint64_t>(body.size()));
  out.number(igtl_crc64(body));
  out.bytes.insert(out.bytes.end(), body.begin(), body.end());
  return std::move(out.bytes);
}

WireBytes igtl_transform(std::string_view device, double time_s, const IgtlPose& pose) {
  Out body;
  body.pose(pose);
  return igtl_message("TRANSFORM", device, time_s, body.bytes);
}

WireBytes igtl_tracking(std::string_view device, double time_s, std::span<const IgtlTool> tools) {
  Out body;
  for (const IgtlTool& t : tools) {
    body.name(t.name, kToolName);
    body.number(kTracker6D);
    body.number(std::uint8_t{0});
    body.pose(t.pose);
  }
  return igtl_message("TDATA", device, time_s, body.bytes);
}

WireBytes igtl_sensor(std::string_view device, double time_s, std::uint64_t unit, std::span<const double> values) {
  Out body;
  const std::size_t n = std::min<std::size_t>(values.size(), 255);
  body.number(static_cast<std::uint8_t>(n));
  body.number(std::uint8_t{0});
  body.number(unit);
  for (const double v : values.first(n)) body.real(v);
  return igtl_message("SENSOR", device, time_s, body.bytes);
}

WireBytes igtl_samples(std::string_view device, double time_s, std::size_t channels,
                       std::span<const std::int16_t> values) {
  Out body;
  body.bytes.reserve(6 + 2 * values.size());
  body.number(kInt16);
  body.number(std::uint8_t{2});
  body.number(static_cast<std::uint16_t>(channels == 0 ? 0 : values.size() / channels));
  body.number(static_cast<std::uint16_t>(channels));
  for (const std::int16_t v : values) body.number(static_cast<std::uint16_t>(v));
  return igtl_message("NDARRAY", device, time_s, body.bytes);
}

WireBytes igtl_string(std::string_view device, double time_s, std::string_view text) {
  Out body;
  text = text.substr(0, 65535);
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
  body.number(ascii ? kAscii : kUtf8);
  body.number(static_cast<std::uint16_t>(text.size()));
  body.name(text, text.size());
  return igtl_message("STRING", device, time_s, body.bytes);
}

WireBytes igtl_status(std::string_view device, double time_s, IgtlStatus code, std::int64_t sub_code,
                      std::string_view name, std::string_view text) {
  Out body;
  body.number(static_cast<std::uint16_t>(code));
  body.number(static_cast<std::uint64_t>(sub_code));
  body.name(name, kStatusName);
  body.name(text, text.size());
  body.number(std::uint8_t{0});
  return igtl_message("STATUS", device, time_s, body.bytes);
}

std::optional<IgtlPose> igtl_pose_in(const IgtlMessage& m) {
  if (m.type != "TRANSFORM" || m.content.size() != 48) return std::nullopt;
  In in(m.content);
  std::array<Vec3, 4> v;
  for (Vec3& each : v) {
    const float x = in.real32(), y = in.real32(), z = in.real32();
    each = {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
    if (!finite(each)) return std::nullopt;
  }
  return IgtlPose{{{v[0], v[1], v[2]}}, v[3]};
}

std::optional<std::vector<double>> igtl_sensor_in(const IgtlMessage& m) {
  if (m.type != "SENSOR" || m.content.size() < 10) return std::nullopt;
  In in(m.content);
  const auto n = static_cast<std::size_t>(in.number<std::uint8_t>());
  static_cast<void>(in.number<std::uint8_t>());
  static_cast<void>(in.number<std::uint64_t>());
  if (in.left() != 8 * n) return std::nullopt;
  std::vector<double> values(n);
  for (double& v : values) {
    v = in.real64();
    if (!std::isfinite(v)) return std::nullopt;
  }
  return values;
}

std::optional<std::string> igtl_string_in(const IgtlMessage& m) {
  if (m.type != "STRING" || m.content.size() < 4) return std::nullopt;
  In in(m.content);
  const auto encoding = in.number<std::uint16_t>();
  const auto length = static_cast<std::size_t>(in.number<std::uint16_t>());
  if ((encoding != kAscii && encoding != kUtf8) || in.left() < length) return std::nullopt;
  return in.name(length);
}

std::optional<IgtlSamples> igtl_samples_in(const IgtlMessage& m) {
  if (m.type != "NDARRAY" || m.content.size() < 6) return std::nullopt;
  In in(m.content);
  const auto kind = in.number<std::uint8_t>(), dimensions = in.number<std::uint8_t>();
  if (kind != kInt16 || dimensions != 2) return std::nullopt;
  const auto samples = static_cast<std::size_t>(in.number<std::uint16_t>()),
             channels = static_cast<std::size_t>(in.number<std::uint16_t>());
  if (in.left() != 2 * samples * channels) return std::nullopt;
  IgtlSamples all{channels, std::vector<std::int16_t>(samples * channels)};
  for (std::int16_t& v : all.values) v = static_cast<std::int16_t>(in.number<std::uint16_t>());
  return all;
}

bool is_rigid(const IgtlPose& p) {
  constexpr double kTolerance = 0.01, kFarMm = 10000;
  const auto& c = p.axes.column;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!finite(c[i]) || !(std::abs(length(c[i]) - 1) <= kTolerance) ||
        !(std::abs(dot(c[i], c[(i + 1) % 3])) <= kTolerance))
      return false;
  }
  return determinant(p.axes) > 0 && finite(p.at_mm) && length(p.at_mm) <= kFarMm;
}

bool IgtlParser::header() {
  In in(waiting_);
  version_ = in.number<std::uint16_t>();
  now_.type = in.name(kType);
  now_.device = in.name(kDevice);
  now_.time_s = std::ldexp(static_cast<double>(in.number<std::uint64_t>()), -32);
  body_bytes_ = in.number<std::uint64_t>();
  crc_ = in.number<std::uint64_t>();
  const bool words =
      !now_.type.empty() && std::all_of(now_.type.begin(), now_.type.end(), [](char c) { return c >= ' ' && c < 127; });
  return version_ >= 1 && version_ <= 3 && words && body_bytes_ <= kMaxPassedOver;
}

void IgtlParser::body(const std::function<void(const IgtlMessage&)>& take) {
  std::span<const std::uint8_t> content(waiting_);
  if (igtl_crc64(content) != crc_) {
    ++damaged_;
    return;
  }
  if (version_ > 1) {
    In in(content);
    if (content.size() < 12) {
      ++damaged_;
      return;
    }
    const auto extended = static_cast<std::size_t>(in.number<std::uint16_t>());
    const auto metadata = static_cast<std::size_t>(in.number<std::uint16_t>()) + in.number<std::uint32_t>();
    if (extended < 12 || extended > content.size() || metadata > content.size() - extended) {
      ++damaged_;
      return;
    }
    content = content.subspan(extended, content.size() - extended - metadata);
  }
  now_.content = content;
  ++messages_;
  take(now_);
  now_.content = {};
}

bool IgtlParser::feed(std::span<const std::uint8_t> bytes, const std::function<void(const IgtlMessage&)>& take) {
  while (!lost_ && (!bytes.empty() || (in_body_ && body_bytes_ == 0))) {
    if (skip_ > 0) {
      const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(skip_, bytes.size()));
      bytes = bytes.subspan(n);
      skip_ -= n;
      continue;
    }
    const std::size_t wanted = in_body_ ? static_cast<std::size_t>(body_bytes_) : kHeader;
    const std::size_t n = std::min(wanted - waiting_.size(), bytes.size());
    waiting_.insert(waiting_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    bytes = bytes.subspan(n);
    if (waiting_.size() < wanted) break;
    if (in_body_) {
      body(take);
      in_body_ = false;
    } else if (!header()) {
      lost_ = true;
    } else if (body_bytes_ > most_body_) {
      ++passed_over_;
      skip_ = body_bytes_;
    } else {
      in_body_ = true;
    }
    waiting_.clear();
  }
  return !lost_;
}

}  // namespace osteo::inline network
