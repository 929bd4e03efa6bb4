#include "osteo/session/session_file.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "session files are little endian");

constexpr std::uint32_t kMagic = 0x3146534f;  // "OSF1"
enum FrameType : std::uint32_t { kHeader = 1, kTicks = 2, kChanges = 3, kEnd = 4, kActions = 5 };
constexpr std::uint32_t kLongestFrame = 64U << 20;

struct FrameHead {
  std::uint32_t magic, type, bytes, crc;
};

std::uint32_t checksum(std::uint32_t type, std::span<const std::byte> payload) {
  uLong crc = ::crc32(0, reinterpret_cast<const Bytef*>(&type), sizeof type);
  crc = ::crc32(crc, reinterpret_cast<const Bytef*>(payload.data()), static_cast<uInt>(payload.size()));
  return static_cast<std::uint32_t>(crc);
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

// Fields under their names, as text where JSON has no number for them.
ordered_json fields_json(const std::vector<FieldRef>& fields) {
  ordered_json j;
  for (const FieldRef& f : fields) j[std::string(f.doc.name)] = f.to_text();
  return j;
}
void read_fields(const std::vector<FieldRef>& fields, const ordered_json& j) {
  for (const FieldRef& f : fields) f.from_text(j.at(std::string(f.doc.name)).get<std::string>());
}

ordered_json to_json(const HapticSetup& h) {
  HapticSetup copy = h;
  ordered_json j;
  j["params"] = fields_json(fields_of<HapticsParams>(copy.params));
  j["device"] = {{"damping_n_s_per_m", h.device.damping_n_s_per_m},
                 {"delay_s", h.device.delay_s},
                 {"encoder_mm", h.device.encoder_mm},
                 {"max_force_n", h.device.max_force_n},
                 {"max_stiffness_n_per_mm", h.device.max_stiffness_n_per_mm}};
  j["tool_methods"] = ordered_json::array();
  for (const auto& [tool, method] : h.tool_methods) j["tool_methods"].push_back({tool, static_cast<int>(method)});
  j["hardness"] = h.hardness;
  j["structures"] = h.structures;
  j["vibration"] = h.vibration_json;
  j["curve"] = ordered_json::array();
  for (const Vec3 p : h.curve) j["curve"].push_back({p.x, p.y, p.z});
  const auto& c = h.curve_params;
  j["curve_params"] = {c.stiffness_n_per_mm, c.max_force_n, c.arc_penalty, c.engage_mm, c.release_mm};
  return j;
}

HapticSetup setup_of(const ordered_json& j) {
  HapticSetup h;
  read_fields(fields_of<HapticsParams>(h.params), j.at("params"));
  const auto& d = j.at("device");
  h.device = {d.at("damping_n_s_per_m"), d.at("delay_s"), d.at("encoder_mm"), d.at("max_force_n"), d.at("max_stiffness_n_per_mm")};
  for (const auto& t : j.at("tool_methods")) {
    const int method = t.at(1);
    if (method < 0 || method >= static_cast<int>(EnumNames<ContactMethod>::values.size()))
      throw Error(ExitCode::corrupt, "it names an unknown method of contact");
    h.tool_methods[t.at(0)] = static_cast<ContactMethod>(method);
  }
  h.hardness = j.at("hardness");
  h.structures = j.at("structures");
  h.vibration_json = j.at("vibration");
  for (const auto& p : j.at("curve")) h.curve.push_back({p.at(0), p.at(1), p.at(2)});
  const auto& c = j.at("curve_params");
  h.curve_params = {c.at(0), c.at(1), c.at(2), c.at(3), c.at(4)};
  return h;
}

template <class T>
void append_records(std::vector<T>& out, std::span<const std::byte> payload) {
  const std::size_t n = payload.size() / sizeof(T), before = out.size();
  out.resize(before + n);
  std::memcpy(out.data() + before, payload.data(), n * sizeof(T));
}

}  // namespace

SessionWriter::SessionWriter(const fs::path& path, const SessionHeader& h) : path_(path) {
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + std::strerror(errno),
                errno == EEXIST ? "give another name" : "choose a folder that you may write to");
  }
  ordered_json j;
  j["osteotome_session"] = 1;
  j["program"] = h.program_version;
  j["bone_hash"] = h.bone_hash;
  j["rate_hz"] = h.rate_hz;
  j["burr_library"] = h.burr_library;
  j["tick_bytes"] = sizeof(TickRecord);
  j["haptics"] = to_json(h.haptics);
  j["dust"] = h.dust;
  frame(kHeader, bytes_of(j.dump()));
}

SessionWriter::~SessionWriter() {
  if (fd_ >= 0) ::close(fd_);
}

void SessionWriter::frame(std::uint32_t type, std::span<const std::byte> payload) {
  const FrameHead head{kMagic, type, static_cast<std::uint32_t>(payload.size()), checksum(type, payload)};
  // One write a frame, so that a frame is rarely cut in two.
  const auto head_bytes = std::as_bytes(std::span(&head, 1));
  std::vector<std::byte> all(head_bytes.begin(), head_bytes.end());
  all.insert(all.end(), payload.begin(), payload.end());
  std::size_t done = 0;
  while (done < all.size()) {
    const ssize_t n = ::write(fd_, all.data() + done, all.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      throw Error(ExitCode::cannot_write, "cannot write '" + path_.string() + "': " + std::strerror(errno),
                  "what was recorded before can be replayed");
    done += static_cast<std::size_t>(n);
  }
  bytes_ += all.size();
}

void SessionWriter::append(const SceneAction& action) {
  frame(kActions, std::as_bytes(std::span(&action, 1)));
}

void SessionWriter::append(std::span<const TickRecord> ticks, std::span<const VoxelChange> changes) {
  if (!ticks.empty()) frame(kTicks, std::as_bytes(ticks));
  if (changes.empty()) return;
  // The last change of each voxel is all a reader needs to follow block by block.
  coalesced_.assign(changes.begin(), changes.end());
  std::stable_sort(coalesced_.begin(), coalesced_.end(), [](const auto& a, const auto& b) { return a.voxel < b.voxel; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < coalesced_.size(); ++i) {
    if (i + 1 < coalesced_.size() && coalesced_[i + 1].voxel == coalesced_[i].voxel) continue;
    coalesced_[kept++] = coalesced_[i];
  }
  coalesced_.resize(kept);
  frame(kChanges, std::as_bytes(std::span(coalesced_)));
}

void SessionWriter::sync() {
  ::fdatasync(fd_);
}

void SessionWriter::finish(const SessionEnd& e) {
  ordered_json j;
  j["ticks"] = e.ticks;
  j["bone_hash"] = e.bone_hash;
  j["surface_hash"] = e.surface_hash;
  j["removed_mm3"] = e.removed_mm3;
  j["dust_hash"] = e.dust_hash;
  frame(kEnd, bytes_of(j.dump()));
  sync();
}

Session read_session(const fs::path& path) {
  const auto bytes = read_file(path);
  const std::string name = "'" + path.string() + "'";
  Session session;
  std::size_t at = 0;
  bool first = true;
  while (at + sizeof(FrameHead) <= bytes.size()) {
    FrameHead head{};
    std::memcpy(&head, bytes.data() + at, sizeof head);
    const bool plausible = head.magic == kMagic && head.bytes <= kLongestFrame;
    if (!plausible && first) throw Error(ExitCode::corrupt, name + " is not a session file");
    const bool whole = plausible && at + sizeof head + head.bytes <= bytes.size();
    const std::span payload = whole ? std::span(bytes).subspan(at + sizeof head, head.bytes) : std::span<const std::byte>();
    if (!whole || checksum(head.type, payload) != head.crc) {
      const bool last = !plausible || !whole || at + sizeof head + head.bytes == bytes.size();
      if (!first && last) break;
      throw Error(ExitCode::corrupt, name + " is damaged at byte " + std::to_string(at), "copy the file again from its source");
    }
    const std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
    try {
      if (first) {
        const auto j = ordered_json::parse(text);
        if (head.type != kHeader || j.at("osteotome_session") != 1)
          throw Error(ExitCode::corrupt, name + " is not a session of this program");
        session.header.program_version = j.at("program");
        session.header.bone_hash = j.at("bone_hash");
        session.header.rate_hz = j.at("rate_hz");
        session.header.burr_library = j.at("burr_library");
        if (j.at("tick_bytes") != sizeof(TickRecord) || session.header.burr_library != kBurrLibraryVersion) {
          throw Error(ExitCode::corrupt, name + " was recorded by another version (" + session.header.program_version + ")",
                      "replay it with that version");
        }
        session.header.haptics = setup_of(j.at("haptics"));
        session.header.dust = j.value("dust", false);
        first = false;
      } else if (head.type == kTicks) {
        append_records(session.ticks, payload);
      } else if (head.type == kChanges) {
        append_records(session.changes, payload);
      } else if (head.type == kActions) {
        std::vector<SceneAction> actions;
        append_records(actions, payload);
        for (const SceneAction& a : actions) session.actions.push_back({a, session.changes.size()});
      } else if (head.type == kEnd) {
        const auto j = ordered_json::parse(text);
        session.end = SessionEnd{j.at("ticks"), j.at("bone_hash"), j.at("surface_hash"), j.at("removed_mm3"), j.value("dust_hash", "")};
      }
    } catch (const nlohmann::json::exception& e) {
      throw Error(ExitCode::corrupt, name + " has a damaged frame: " + json_complaint(e));
    }
    at += sizeof head + head.bytes;
  }
  if (first) throw Error(ExitCode::corrupt, name + " is not a session file, or was cut before its header ended");
  session.torn_bytes = bytes.size() - at;
  for (std::size_t t = 0; t < session.ticks.size(); ++t) {
    if (session.ticks[t].tick != t) throw Error(ExitCode::corrupt, name + ": tick " + std::to_string(t) + " is missing");
  }
  return session;
}

}  // namespace osteo
