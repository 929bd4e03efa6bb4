#include "osteo/session/recording/records.h"

#include <array>
#include <cstring>
#include <utility>

#include "record_codec.h"

namespace osteo::inline session {
namespace {

using enum FieldType;
using enum FieldRole;

template <class Record>
constexpr RecordField nth(std::string_view name, FieldType type, std::size_t base, std::size_t n, std::string_view unit,
                          std::string_view meaning, FieldRole role = result) {
  const std::size_t bytes = type == u8 ? 1 : type == u32 || type == f32 ? 4 : 8;
  return {name, type, static_cast<std::uint32_t>(base + n * bytes), unit, meaning, role};
}

constexpr std::size_t kPosition = offsetof(TickRecord, device.position_mm), kAxis = offsetof(TickRecord, device.axis);
constexpr std::size_t kForce = offsetof(TickRecord, force_n), kTorque = offsetof(TickRecord, torque_n_mm);
constexpr std::size_t kShown = offsetof(TickRecord, shown_offset_mm);
constexpr std::string_view kTip = "centre of the burr's tip, LPS", kToHandle = "unit, from burr to handle";
constexpr std::string_view kOnHand = "force on the hand, after all limits",
                           kTurning = "torque on the hand about the position";
constexpr std::string_view kWhereShown = "from the position to where the tool is shown";

constexpr RecordField kTickFields[] = {
    {"tick", u64, offsetof(TickRecord, tick), "1", "number of the tick, from 0"},
    {"hand", u32, offsetof(TickRecord, hand), "number", "whose, from 0: of each tick all hands in their order"},
    nth<TickRecord>("x_mm", f32, kPosition, 0, "mm", kTip, input),
    nth<TickRecord>("y_mm", f32, kPosition, 1, "mm", kTip, input),
    nth<TickRecord>("z_mm", f32, kPosition, 2, "mm", kTip, input),
    nth<TickRecord>("axis_x", f32, kAxis, 0, "1", kToHandle, input),
    nth<TickRecord>("axis_y", f32, kAxis, 1, "1", kToHandle, input),
    nth<TickRecord>("axis_z", f32, kAxis, 2, "1", kToHandle, input),
    {"pedal", u8, offsetof(TickRecord, device.pedal), "0 to 255", "how far down it is", input},
    {"tool", u8, offsetof(TickRecord, device.tool), "index", "in the header's instruments", input},
    {"buttons", u8, offsetof(TickRecord, device.buttons), "bits", "of the device, beyond the pedal's", input},
    {"device_age_ms", u8, offsetof(TickRecord, device.age_ms), "ms", "since the device last reported; 255: longer",
     input},
    nth<TickRecord>("force_x_n", f32, kForce, 0, "N", kOnHand),
    nth<TickRecord>("force_y_n", f32, kForce, 1, "N", kOnHand),
    nth<TickRecord>("force_z_n", f32, kForce, 2, "N", kOnHand),
    nth<TickRecord>("torque_x_n_mm", f32, kTorque, 0, "N mm", kTurning),
    nth<TickRecord>("torque_y_n_mm", f32, kTorque, 1, "N mm", kTurning),
    nth<TickRecord>("torque_z_n_mm", f32, kTorque, 2, "N mm", kTurning),
    nth<TickRecord>("shown_offset_x_mm", f32, kShown, 0, "mm", kWhereShown),
    nth<TickRecord>("shown_offset_y_mm", f32, kShown, 1, "mm", kWhereShown),
    nth<TickRecord>("shown_offset_z_mm", f32, kShown, 2, "mm", kWhereShown),
    {"speed_rpm", f32, offsetof(TickRecord, speed_rpm), "rpm", "of the burr; 0 of other instruments"},
    {"normal_force_n", f32, offsetof(TickRecord, normal_force_n), "N", "that presses the burr on bone"},
    {"depth_mm", f32, offsetof(TickRecord, depth_mm), "mm", "equivalent penetration of the burr"},
    {"removed_mm3", f32, offsetof(TickRecord, removed_mm3), "mm3", "bone removed in this tick"},
    {"voxels_changed", u32, offsetof(TickRecord, voxels_changed), "voxels", "in this tick"},
    {"immersed", u32, offsetof(TickRecord, immersed), "voxels", "of bone in the burr"},
    {"flags", u32, offsetof(TickRecord, flags), "bits", "what happened: see session-format.md"},
    {"energy_mj", f32, offsetof(TickRecord, energy_mj), "mJ",
     "of the passivity observer: positive, the contact gave more than it took"},
    {"thickness_mm", f32, offsetof(TickRecord, thickness_mm), "mm",
     "of bone under the burr along its push; 0 without contact, at most 10"},
    {"clearance_mm", f32, offsetof(TickRecord, clearance_mm), "mm",
     "to the nearest critical structure; negative inside"},
    {"structure", u32, offsetof(TickRecord, structure), "label value", "which structure that is; 0: none within reach"},
    {"work_us", f32, offsetof(TickRecord, work_us), "us", "time the tick took", machine},
    {"lateness_us", f32, offsetof(TickRecord, lateness_us), "us", "how late it was woken", machine},
};
constexpr RecordField kChangeFields[] = {
    {"voxel", u32, offsetof(VoxelChange, voxel), "name", "brick number times 512 plus place in the brick, x fastest"},
    {"density", f32, offsetof(VoxelChange, density), "share of a voxel", "from now on"},
};
constexpr std::string_view kByAction = "as the kind of action says";
constexpr std::array<std::string_view, 12> kValueNames{"value_0", "value_1", "value_2",  "value_3",
                                                       "value_4", "value_5", "value_6",  "value_7",
                                                       "value_8", "value_9", "value_10", "value_11"};
constexpr auto kActionFields = [] {
  std::array<RecordField, 6 + kValueNames.size()> f{{
      {"tick", u64, offsetof(SceneAction, tick), "1", "at whose beginning it happened", input},
      {"action", u32, offsetof(SceneAction, kind), "kind", "a number of the header's actions", input},
      {"piece", u32, offsetof(SceneAction, body), "number, 4294967295: none or all", kByAction, input},
      {"second_piece", u32, offsetof(SceneAction, other), "number, 4294967295: none", kByAction, input},
      {"item", u32, offsetof(SceneAction, item), "plate or fixture, 4294967295: none", kByAction, input},
      {"hand", u32, offsetof(SceneAction, hand), "number", "whose, from 0; sessions before this field have 0", input},
  }};
  for (std::size_t v = 0; v < kValueNames.size(); ++v)
    f[6 + v] = nth<SceneAction>(kValueNames[v], f64, offsetof(SceneAction, values), v, "by action", kByAction, input);
  return f;
}();

constexpr RecordTable kTicks{"tick", 1, sizeof(TickRecord), kTickFields};
constexpr RecordTable kChanges{"change", 2, sizeof(VoxelChange), kChangeFields};
constexpr RecordTable kActions{"action", 3, sizeof(SceneAction), kActionFields};

// The type that a field has in memory, given to f.
template <class F>
auto with_type(FieldType type, F&& f) {
  switch (type) {
    case u8:
      return f(std::uint8_t{});
    case u32:
      return f(std::uint32_t{});
    case u64:
      return f(std::uint64_t{});
    case f32:
      return f(float{});
    default:
      return f(double{});
  }
}
template <class F>
void with_bits(FieldType type, F&& f) {
  if (size_of(type) == 1)
    f(std::uint8_t{});
  else if (size_of(type) == 4)
    f(std::uint32_t{});
  else
    f(std::uint64_t{});
}
template <class T>
T load(const void* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

// A number of another type: what does not fit becomes 0, which no range of ours relies on.
template <class To, class From>
To converted(From value) {
  if constexpr (std::is_integral_v<To> && std::is_integral_v<From>) {
    return std::in_range<To>(value) ? static_cast<To>(value) : To{};
  } else if constexpr (std::is_integral_v<To>) {
    return value >= 0 && value < 18446744073709551616.0 && std::in_range<To>(static_cast<std::uint64_t>(value))
               ? static_cast<To>(value)
               : To{};
  } else {
    return static_cast<To>(value);
  }
}

}  // namespace

const RecordTable& tick_table() {
  return kTicks;
}
const RecordTable& change_table() {
  return kChanges;
}
const RecordTable& action_record_table() {
  return kActions;
}

std::string_view name_of(FieldType type) {
  constexpr std::array<std::string_view, 5> kNames{"u8", "u32", "u64", "f32", "f64"};
  return kNames[static_cast<std::size_t>(type)];
}

std::size_t size_of(FieldType type) {
  return with_type(type, [](auto t) { return sizeof t; });
}

double value_of(const RecordField& field, const void* record) {
  return with_type(field.type, [&](auto t) {
    return static_cast<double>(load<decltype(t)>(static_cast<const std::byte*>(record) + field.offset));
  });
}

const RecordField* first_difference(std::span<const RecordField* const> fields, const void* a, const void* b) {
  for (const RecordField* const f : fields) {
    if (f->role == machine) continue;
    if (std::memcmp(static_cast<const std::byte*>(a) + f->offset, static_cast<const std::byte*>(b) + f->offset,
                    size_of(f->type)) != 0)
      return f;
  }
  return nullptr;
}

void put_records(std::vector<std::byte>& out, std::span<const RecordField> fields, const void* records, std::size_t n,
                 std::size_t bytes) {
  for (const RecordField& field : fields) {
    std::size_t at = out.size();
    out.resize(at + n * size_of(field.type));
    with_bits(field.type, [&](auto bits) {
      using Bits = decltype(bits);
      const auto* from = static_cast<const std::byte*>(records) + field.offset;
      Bits before{};
      for (std::size_t i = 0; i < n; ++i, from += bytes, ++at) {
        const Bits now = load<Bits>(from);
        const auto step = static_cast<Bits>(now - std::exchange(before, now));
        for (std::size_t k = 0; k < sizeof step; ++k) out[at + k * n] = static_cast<std::byte>(step >> (8 * k));
      }
    });
  }
}

void get_records(const FileTable& table, std::span<const std::byte> from, std::size_t n, void* records,
                 std::size_t bytes) {
  std::size_t at = 0;
  for (const FileField& field : table.fields) {
    const std::size_t column = at;
    at += n * size_of(field.type);
    if (field.ours == nullptr) continue;
    with_bits(field.type, [&](auto bits) {
      using Bits = decltype(bits);
      auto* to = static_cast<std::byte*>(records) + field.ours->offset;
      Bits now{};
      for (std::size_t i = 0; i < n; ++i, to += bytes) {
        Bits step{};
        for (std::size_t k = 0; k < sizeof step; ++k)
          step |= static_cast<Bits>(static_cast<Bits>(from[column + i + k * n]) << (8 * k));
        now = static_cast<Bits>(now + step);
        if (field.type == field.ours->type) {
          std::memcpy(to, &now, sizeof now);
          continue;
        }
        with_type(field.type, [&](auto theirs) {
          if constexpr (sizeof theirs == sizeof now) {
            const auto value = load<decltype(theirs)>(&now);
            with_type(field.ours->type, [&](auto ours) {
              const auto mine = converted<decltype(ours)>(value);
              std::memcpy(to, &mine, sizeof mine);
            });
          }
        });
      }
    });
  }
}

}  // namespace osteo::inline session
