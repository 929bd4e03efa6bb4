// OpenIGTLink messages (protocol versions 1 to 3) as bytes. Pure: no socket, no clock.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline network {

using WireBytes = std::vector<std::uint8_t>;

/// Where something is, as OpenIGTLink and 3D Slicer count: mm to the patient's right, front and top (RAS). Columns are
/// the thing's own axes.
struct IgtlPose {
  Mat3 axes;
  Vec3 at_mm;
};
/// From the scene (LPS) and back: the same numbers, x and y turned.
[[nodiscard]] constexpr Vec3 ras_of_lps(Vec3 v) {
  return {-v.x, -v.y, v.z};
}
[[nodiscard]] IgtlPose ras_of_lps(const IgtlPose& pose);

/// Units of SENSOR, as the specification packs them: prefix, then unit and exponent. Only those that are sent.
inline constexpr std::uint64_t kIgtlNewton = std::uint64_t{0x02C4} << 48;
inline constexpr std::uint64_t kIgtlHertz = std::uint64_t{0x0284} << 48;

enum class IgtlStatus : std::uint16_t { ok = 1, overflow = 8, shut_down = 19 };

/// One message. `type` at most 12 bytes, `device` at most 20, the rest is cut off. The header's time is seconds of the
/// sender's own count (a session's own time, here), to 2^-32 s; negative becomes 0. Without extended header (version
/// 1), which every reader knows.
[[nodiscard]] WireBytes igtl_message(std::string_view type, std::string_view device, double time_s,
                                     std::span<const std::uint8_t> body);
[[nodiscard]] WireBytes igtl_transform(std::string_view device, double time_s, const IgtlPose& pose);
struct IgtlTool {
  std::string name;
  IgtlPose pose;
};
/// TDATA: tools of 6 degrees of freedom.
[[nodiscard]] WireBytes igtl_tracking(std::string_view device, double time_s, std::span<const IgtlTool> tools);
[[nodiscard]] WireBytes igtl_sensor(std::string_view device, double time_s, std::uint64_t unit,
                                    std::span<const double> values);
/// NDARRAY of int16, samples by channels: all channels of a sample, then the next sample.
[[nodiscard]] WireBytes igtl_samples(std::string_view device, double time_s, std::size_t channels,
                                     std::span<const std::int16_t> values);
/// At most 65,535 bytes; the rest is cut off.
[[nodiscard]] WireBytes igtl_string(std::string_view device, double time_s, std::string_view text);
[[nodiscard]] WireBytes igtl_status(std::string_view device, double time_s, IgtlStatus code, std::int64_t sub_code,
                                    std::string_view name, std::string_view text);

/// CRC-64 of ECMA-182, not reflected, from 0, as OpenIGTLink has it.
[[nodiscard]] std::uint64_t igtl_crc64(std::span<const std::uint8_t> bytes);

/// What came: the content without extended header and metadata.
struct IgtlMessage {
  std::string type, device;
  double time_s = 0;
  std::span<const std::uint8_t> content;  ///< while the call lasts
};
// Contents. Nothing: it is not one, or a number in it is not finite.
[[nodiscard]] std::optional<IgtlPose> igtl_pose_in(const IgtlMessage& message);
[[nodiscard]] std::optional<std::vector<double>> igtl_sensor_in(const IgtlMessage& message);
[[nodiscard]] std::optional<std::string> igtl_string_in(const IgtlMessage& message);
struct IgtlSamples {
  std::size_t channels = 0;
  std::vector<std::int16_t> values;
};
[[nodiscard]] std::optional<IgtlSamples> igtl_samples_in(const IgtlMessage& message);
/// Axes of unit length at right angles, right-handed, to 1 %; place within 10 m: what a tracker may say of a tool.
[[nodiscard]] bool is_rigid(const IgtlPose& pose);

/// Cuts what comes over a connection into messages. Memory: at most most_body and a header. What is longer is passed
/// over; a body whose checksum is wrong, or whose extended header lies, is dropped. All of it is counted.
class IgtlParser {
 public:
  static constexpr std::size_t kHeader = 58;
  explicit IgtlParser(std::size_t most_body) : most_body_(most_body) {}

  /// The next bytes; calls `take` for each message that is whole. False: what comes is no OpenIGTLink, and nothing more
  /// will be.
  bool feed(std::span<const std::uint8_t> bytes, const std::function<void(const IgtlMessage&)>& take);

  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }  ///< checksum, extended header
  [[nodiscard]] std::uint64_t passed_over() const { return passed_over_; }

 private:
  bool header();
  void body(const std::function<void(const IgtlMessage&)>& take);
  std::size_t most_body_;
  std::vector<std::uint8_t> waiting_;  // header, then body
  std::uint64_t body_bytes_ = 0, skip_ = 0, crc_ = 0;
  std::uint16_t version_ = 0;
  bool in_body_ = false, lost_ = false;
  IgtlMessage now_;
  std::uint64_t messages_ = 0, damaged_ = 0, passed_over_ = 0;
};

}  // namespace osteo::inline network
