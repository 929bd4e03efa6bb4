#include "osteo/simulation/devices/detail/reports.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

struct Known {
  std::uint16_t vendor, product;
  DeviceModel model;
};
constexpr Known kKnown[] = {
    {0x1234, 0x0006, DeviceModel::woodenhaptics},  // mbed
    {0x16c0, 0x0486, DeviceModel::woodenhaptics},  // Teensy RawHID
    {0x046d, 0xc626, DeviceModel::space_mouse},    // SpaceNavigator
    {0x046d, 0xc627, DeviceModel::space_mouse},    // SpaceExplorer
    {0x046d, 0xc628, DeviceModel::space_mouse},    // SpaceNavigator for notebooks
    {0x046d, 0xc629, DeviceModel::space_mouse},    // SpacePilot Pro
    {0x046d, 0xc62b, DeviceModel::space_mouse},    // SpaceMouse Pro
    {0x046d, 0xc625, DeviceModel::space_mouse},    // SpacePilot
    {0x256f, 0xc635, DeviceModel::space_mouse},    // SpaceMouse Compact
    {0x256f, 0xc641, DeviceModel::space_mouse},    // SpaceMouse
    {0x256f, 0xc62e, DeviceModel::space_mouse_wireless},
    {0x256f, 0xc63a, DeviceModel::space_mouse_wireless},
    {0x256f, 0xc632, DeviceModel::space_mouse_wireless},  // Pro Wireless
    {0x256f, 0xc638, DeviceModel::space_mouse_wireless},
    {0x256f, 0xc633, DeviceModel::space_mouse_wireless},  // Enterprise
    {0x256f, 0xc652, DeviceModel::space_mouse_wireless},  // receiver
    {0x05f3, 0x00ff, DeviceModel::pedal_infinity},
    {0x0c45, 0x7403, DeviceModel::pedal_pcsensor},
};

int int16_at(std::span<const std::byte> r, std::size_t at) {
  return static_cast<std::int16_t>(
      static_cast<std::uint16_t>(std::to_integer<unsigned>(r[at]) | std::to_integer<unsigned>(r[at + 1]) << 8));
}
void put_int16(std::span<std::byte> r, std::size_t at, int value) {
  const auto v = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::clamp(value, -32768, 32767)));
  r[at] = static_cast<std::byte>(v & 0xff);
  r[at + 1] = static_cast<std::byte>(v >> 8);
}

}  // namespace

DeviceModel model_of(std::uint16_t vendor, std::uint16_t product) {
  const auto* const k = std::find_if(std::begin(kKnown), std::end(kKnown),
                                     [&](const Known& c) { return c.vendor == vendor && c.product == product; });
  return k != std::end(kKnown) ? k->model : DeviceModel::unknown;
}

std::string_view name_of(DeviceModel model) {
  switch (model) {
    case DeviceModel::unknown:
      break;
    case DeviceModel::woodenhaptics:
      return "WoodenHaptics or Polhem";
    case DeviceModel::space_mouse:
      return "3Dconnexion SpaceMouse";
    case DeviceModel::space_mouse_wireless:
      return "3Dconnexion SpaceMouse (wireless)";
    case DeviceModel::pedal_infinity:
      return "Infinity foot pedal";
    case DeviceModel::pedal_pcsensor:
      return "PCsensor foot pedal";
  }
  return "unknown";
}

bool decode_space_mouse(std::span<const std::byte> r, SpaceMouseState& state) {
  if (r.empty()) return false;
  constexpr double kFull = 350;
  // The device counts y towards the user and z down; so do its rotations.
  const auto triple = [&](std::size_t at, std::array<double, 3>& out) {
    constexpr double kSign[3] = {1, -1, -1};
    for (std::size_t a = 0; a < 3; ++a) out[a] = std::clamp(kSign[a] * int16_at(r, at + 2 * a) / kFull, -1.0, 1.0);
  };
  switch (std::to_integer<int>(r[0])) {
    case 1:
      if (r.size() < 7) return false;
      triple(1, state.move);
      if (r.size() >= 13) triple(7, state.turn);
      return true;
    case 2:
      if (r.size() < 7) return false;
      triple(1, state.turn);
      return true;
    case 3:
      if (r.size() < 2) return false;
      state.buttons = 0;
      for (std::size_t i = 1; i < std::min<std::size_t>(r.size(), 5); ++i)
        state.buttons |= std::to_integer<std::uint32_t>(r[i]) << (8 * (i - 1));
      return true;
    case 0x17:
      if (r.size() < 2) return false;
      state.battery_percent = std::min(100, std::to_integer<int>(r[1]));
      return true;
    default:
      return false;
  }
}

bool decode_pedal(DeviceModel model, std::span<const std::byte> r, std::uint32_t& pressed) {
  if (model == DeviceModel::pedal_infinity) {
    if (r.size() < 2) return false;
    pressed = std::to_integer<std::uint32_t>(r[0]) & 7U;
    return true;
  }
  if (model == DeviceModel::pedal_pcsensor) {
    // A keyboard's boot report, with or without an id of 1 before it: modifiers, a reserved byte, up to six usages.
    if (r.size() < 8) return false;
    const std::size_t first = r.size() >= 9 && std::to_integer<int>(r[0]) == 1 ? 3 : 2;
    pressed = 0;
    for (std::size_t i = first; i < std::min(r.size(), first + 6); ++i) {
      const int usage = std::to_integer<int>(r[i]);
      if (usage >= 4 && usage <= 6) pressed |= 1U << (usage - 4);
    }
    return true;
  }
  return false;
}

bool decode_woodenhaptics(std::span<const std::byte> r, WoodenHapticsReport& result) {
  if (r.size() < 14) return false;
  for (std::size_t e = 0; e < 6; ++e) result.encoder[e] = int16_at(r, 2 * e);
  result.calibrate = int16_at(r, 12) == 1;
  result.button = result.encoder[3] > 5000;
  if (result.button) result.encoder[3] -= 10000;
  return true;
}

std::vector<std::byte> encode_woodenhaptics(std::array<double, 3> current_ma, WoodenHapticsCommand command,
                                            std::array<int, 3> attributes, std::size_t size) {
  std::vector<std::byte> r(std::max<std::size_t>(size, 15));
  for (std::size_t m = 0; m < 3; ++m) {
    const double ma = std::isfinite(current_ma[m]) ? current_ma[m] : 0;
    put_int16(r, 1 + 2 * m, static_cast<int>(std::lround(std::clamp(ma, -32000.0, 32000.0))));
    put_int16(r, 9 + 2 * m, attributes[m]);
  }
  put_int16(r, 7, static_cast<int>(command));
  return r;
}

bool decode_woodenhaptics_command(std::span<const std::byte> r, std::array<double, 3>& current_ma,
                                  WoodenHapticsCommand& command) {
  if (r.size() < 15) return false;
  for (std::size_t m = 0; m < 3; ++m) current_ma[m] = int16_at(r, 1 + 2 * m);
  command = static_cast<WoodenHapticsCommand>(int16_at(r, 7));
  return true;
}

std::array<std::byte, 14> encode_woodenhaptics_report(const std::array<int, 6>& encoder, bool calibrate) {
  std::array<std::byte, 14> r{};
  for (std::size_t e = 0; e < 6; ++e) put_int16(r, 2 * e, encoder[e]);
  put_int16(r, 12, calibrate ? 1 : 0);
  return r;
}

}  // namespace osteo::inline simulation
