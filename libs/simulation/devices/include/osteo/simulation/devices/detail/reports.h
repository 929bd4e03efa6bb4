// What is in the reports of the devices known here: bytes to values and back. Pure functions; short and garbled reports
// are rejected, long ones read up to what is known.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace osteo::inline simulation {

enum class DeviceModel : int {
  unknown,
  woodenhaptics,
  space_mouse,
  space_mouse_wireless,
  pedal_infinity,
  pedal_pcsensor
};

/// By vendor and product: WoodenHaptics and Polhem (haptikfabriken firmware), 3Dconnexion, Infinity IN-USB-2, PCsensor
/// FootSwitch.
[[nodiscard]] DeviceModel model_of(std::uint16_t vendor, std::uint16_t product);
[[nodiscard]] std::string_view name_of(DeviceModel model);

/// Six axes, full deflection 1 (350 counts), in the frame of the device on a desk: x right, y away from the user, z up;
/// rotations about them.
struct SpaceMouseState {
  std::array<double, 3> move{}, turn{};
  std::uint32_t buttons = 0;
  int battery_percent = -1;
};
/// One report: translation (id 1, with rotation in it on wireless ones), rotation (2), buttons (3), battery (0x17).
/// False when it is none of these or too short; the state is then as it was.
bool decode_space_mouse(std::span<const std::byte> report, SpaceMouseState& state);

/// Infinity: bit 0 left, 1 middle, 2 right. PCsensor, which acts as a keyboard: bits 0 to 2 for its first three keys
/// (a, b, c as it is sold).
bool decode_pedal(DeviceModel model, std::span<const std::byte> report, std::uint32_t& pressed);

/// 7 little-endian int16: six encoders, then an info word.
struct WoodenHapticsReport {
  std::array<int, 6> encoder{};
  bool button = false;     ///< of the stylus: told by encoder d beyond 5000, from which 10000 are taken
  bool calibrate = false;  ///< the device's calibration button
};
bool decode_woodenhaptics(std::span<const std::byte> report, WoodenHapticsReport& result);

enum class WoodenHapticsCommand : std::int16_t { force = 0, set_encoders = 1 };
/// Id 0 and 7 int16: three motor currents in mA, command, three attributes. `size` 15, or 65 for devices with reports
/// of 64 bytes.
[[nodiscard]] std::vector<std::byte> encode_woodenhaptics(std::array<double, 3> current_ma,
                                                          WoodenHapticsCommand command, std::array<int, 3> attributes,
                                                          std::size_t size);
/// The other direction, for simulated devices. False when it is too short.
bool decode_woodenhaptics_command(std::span<const std::byte> report, std::array<double, 3>& current_ma,
                                  WoodenHapticsCommand& command);
[[nodiscard]] std::array<std::byte, 14> encode_woodenhaptics_report(const std::array<int, 6>& encoder, bool calibrate);

}  // namespace osteo::inline simulation
