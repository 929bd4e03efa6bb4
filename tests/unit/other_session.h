// Sessions as another version of the program would write them: other fields, kinds of records, frames.
#pragma once
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "frame.h"
#include "osteo/session/recording/session_reader.h"
#include "record_codec.h"
#include "session_header.h"

namespace osteo::test {

// A tick with a field more.
struct OtherTick {
  TickRecord tick;
  float pulse_bpm = 70;
};

class OtherWriter {
 public:
  // `fields` of OtherTick; `change` may do to the header what it likes.
  OtherWriter(const std::filesystem::path& path, const SessionHeader& header, std::vector<RecordField> fields,
              const std::function<void(nlohmann::ordered_json&)>& change = {})
      : out_(path, std::ios::binary), fields_(std::move(fields)) {
    auto j = nlohmann::ordered_json::parse(header_json(header));
    auto& described = j["records"]["tick"]["fields"];
    described = nlohmann::ordered_json::array();
    for (const RecordField& f : fields_)
      described.push_back(
          {{"name", f.name}, {"type", name_of(f.type)}, {"role", f.role == FieldRole::input ? "input" : "result"}});
    if (change) change(j);
    frame(kHeaderFrame, 0, 0, j.dump());
  }
  void frame(std::uint32_t type, std::uint64_t first, std::uint64_t end, const std::string& payload) {
    const auto bytes = std::as_bytes(std::span(payload));
    FrameHead head{kMagic, type, static_cast<std::uint32_t>(bytes.size()), 0, first, end};
    head.crc = checksum(head, bytes);
    out_.write(reinterpret_cast<const char*>(&head), sizeof head);
    out_ << payload;
    out_.flush();
  }
  void part(std::uint32_t number, std::size_t n, std::span<const std::byte> bytes) {
    const std::uint32_t head[2] = {number, static_cast<std::uint32_t>(n)};
    const auto raw = std::as_bytes(std::span(head));
    raw_.insert(raw_.end(), raw.begin(), raw.end());
    raw_.insert(raw_.end(), bytes.begin(), bytes.end());
  }
  template <class T>
  void records(std::uint32_t number, std::span<const RecordField> fields, std::span<const T> records) {
    if (records.empty()) return;
    std::vector<std::byte> bytes;
    put_records(bytes, fields, records.data(), records.size(), sizeof(T));
    part(number, records.size(), bytes);
  }
  void ticks(std::span<const TickRecord> ticks) {
    std::vector<OtherTick> others;
    for (const TickRecord& t : ticks) others.push_back({t, 70});
    records<OtherTick>(tick_table().part, fields_, others);
  }
  // What was put since the last one.
  void end_frame(std::uint32_t type, std::uint64_t first, std::uint64_t end) {
    const auto bytes = compressed(std::exchange(raw_, {}));
    frame(type, first, end, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  void finish(const SessionEnd& e) {
    const nlohmann::ordered_json j{{"ticks", e.ticks},
                                   {"bone_hash", e.bone_hash},
                                   {"surface_hash", e.surface_hash},
                                   {"removed_mm3", e.removed_mm3},
                                   {"dust_hash", e.dust_hash},
                                   {"ticks_lost", e.ticks_lost}};
    frame(kEndFrame, e.ticks, e.ticks, j.dump());
  }

 private:
  std::ofstream out_;
  std::vector<RecordField> fields_;
  std::vector<std::byte> raw_;
};

// The header's list of instruments or plates as another version has it: only those that `keep` takes, or all, the last
// first.
inline void renumber(nlohmann::ordered_json& list, const std::function<bool(const std::string&)>& keep,
                     bool backwards = false) {
  auto other = nlohmann::ordered_json::array();
  for (const auto& one : list) {
    if (keep(one.at("name"))) other.push_back(one);
  }
  if (backwards) std::reverse(other.begin(), other.end());
  list = other;
}
inline std::uint32_t number_in(const nlohmann::ordered_json& list, const std::string& name) {
  std::uint32_t n = 0;
  while (n < list.size() && list[n].at("name") != name) ++n;
  return n;
}

inline std::vector<RecordField> tick_fields() {
  return {tick_table().fields.begin(), tick_table().fields.end()};
}
inline std::vector<RecordField> with_pulse(FieldRole role = FieldRole::result) {
  auto fields = tick_fields();
  fields.insert(fields.begin() + 5,
                {"pulse_bpm", FieldType::f32, offsetof(OtherTick, pulse_bpm), "1/min", "of the patient", role});
  return fields;
}
inline std::vector<RecordField> without(std::string_view name) {
  auto fields = tick_fields();
  std::erase_if(fields, [&](const RecordField& f) { return f.name == name; });
  return fields;
}

// A session that this program wrote, as another would have written it: frame by frame, each part in one of its own.
// `as_there`: what the other has in a tick.
inline void write_otherwise(const std::filesystem::path& from, OtherWriter& to,
                            const std::function<void(TickRecord&)>& as_there = {}) {
  const SessionReader reader(from);
  auto parts = reader.parts();
  std::uint64_t next = 0;
  while (const SessionPart* const p = parts.next()) {
    const std::uint64_t first = next;
    if (p->checkpoint || p->gap != nullptr || !p->notes.empty()) continue;
    if (!p->ticks.empty()) next = p->ticks.back().tick + 1;
    to.records<SceneAction>(action_record_table().part, action_record_table().fields, p->actions);
    std::vector<TickRecord> ticks(p->ticks.begin(), p->ticks.end());
    for (TickRecord& t : ticks) {
      if (as_there) as_there(t);
    }
    to.ticks(ticks);
    to.records<VoxelChange>(change_table().part, change_table().fields, p->changes);
    to.end_frame(kRecordsFrame, first, next);
  }
  if (reader.outline().end) to.finish(*reader.outline().end);
}

}  // namespace osteo::test
