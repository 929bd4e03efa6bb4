#include "osteo/session/session_file.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "session files are little endian");

constexpr std::uint32_t kMagic = 0x3146534f;  // "OSF1"
enum FrameType : std::uint32_t { kHeader = 1, kTicks = 2, kChanges = 3, kEnd = 4, kActions = 5, kGap = 6 };
constexpr std::uint32_t kLongestFrame = 64U << 20;
constexpr std::size_t kMostRecords = 1U << 18;  // in a frame

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
  const auto traits = [](const DeviceTraits& d) -> ordered_json {
    return {{"damping_n_s_per_m", d.damping_n_s_per_m},
            {"delay_s", d.delay_s},
            {"encoder_mm", d.encoder_mm},
            {"max_force_n", d.max_force_n},
            {"max_stiffness_n_per_mm", d.max_stiffness_n_per_mm}};
  };
  j["devices"] = ordered_json::array();
  for (std::size_t hand = 0; hand < h.hands(); ++hand) j["devices"].push_back(traits(h.device_of(hand)));
  j["tool_methods"] = ordered_json::array();
  for (const auto& [tool, method] : h.tool_methods) j["tool_methods"].push_back({tool, static_cast<int>(method)});
  j["hardness"] = h.hardness.value_or(false);
  j["hardness_law"] = h.hardness_json;
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
  const auto traits = [](const ordered_json& d) -> DeviceTraits {
    return {d.at("damping_n_s_per_m"), d.at("delay_s"), d.at("encoder_mm"), d.at("max_force_n"), d.at("max_stiffness_n_per_mm")};
  };
  const auto& devices = j.at("devices");
  if (devices.empty() || devices.size() > kMostHands) throw Error(ExitCode::corrupt, "it has no hands, or more than there can be");
  h.device = traits(devices[0]);
  for (std::size_t hand = 1; hand < devices.size(); ++hand) h.more_devices.push_back(traits(devices[hand]));
  for (const auto& t : j.at("tool_methods")) {
    const int method = t.at(1);
    if (method < 0 || method >= static_cast<int>(EnumNames<ContactMethod>::values.size()))
      throw Error(ExitCode::corrupt, "it names an unknown method of contact");
    h.tool_methods[t.at(0)] = static_cast<ContactMethod>(method);
  }
  h.hardness = j.at("hardness").get<bool>();
  h.hardness_json = j.value("hardness_law", "");
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

class SessionFile final : public SessionSink {
 public:
  explicit SessionFile(const fs::path& path) : path_(path), fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644)) {
    if (fd_ >= 0) return;
    throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + std::strerror(errno),
                errno == EEXIST ? "give another name" : "choose a folder that you may write to");
  }
  ~SessionFile() override { ::close(fd_); }
  SessionFile(const SessionFile&) = delete;
  SessionFile& operator=(const SessionFile&) = delete;

  void write(std::span<const std::byte> bytes) override {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t n = ::write(fd_, bytes.data() + done, bytes.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail();
      done += static_cast<std::size_t>(n);
    }
  }
  void sync() override {
    // Some files cannot be synced (a pipe, a device); that is no loss.
    while (::fdatasync(fd_) != 0) {
      if (errno == EINVAL || errno == ENOTSUP || errno == EROFS) return;
      if (errno != EINTR) fail();
    }
  }

 private:
  [[noreturn]] void fail() const {
    throw Error(ExitCode::cannot_write, "cannot write '" + path_.string() + "': " + std::strerror(errno),
                "what was recorded before can be replayed");
  }
  fs::path path_;
  int fd_;
};

}  // namespace

std::unique_ptr<SessionSink> session_file(const fs::path& path) {
  return std::make_unique<SessionFile>(path);
}

SessionWriter::SessionWriter(std::unique_ptr<SessionSink> sink, const SessionHeader& h) : sink_(std::move(sink)) {
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
  write();
}

void SessionWriter::frame(std::uint32_t type, std::span<const std::byte> payload) {
  const FrameHead head{kMagic, type, static_cast<std::uint32_t>(payload.size()), checksum(type, payload)};
  const auto head_bytes = std::as_bytes(std::span(&head, 1));
  out_.insert(out_.end(), head_bytes.begin(), head_bytes.end());
  out_.insert(out_.end(), payload.begin(), payload.end());
}

// One write for what belongs together, so that a kill rarely parts it.
void SessionWriter::write() {
  const std::vector<std::byte> out = std::exchange(out_, {});
  sink_->write(out);
  bytes_ += out.size();
}

void SessionWriter::append(const SceneAction& action) {
  frame(kActions, std::as_bytes(std::span(&action, 1)));
  write();
}

void SessionWriter::append(const RecordingGap& gap) {
  frame(kGap, std::as_bytes(std::span(&gap, 1)));
  write();
}

void SessionWriter::append(std::span<const TickRecord> ticks, std::span<const VoxelChange> changes) {
  for (std::size_t i = 0; i < ticks.size(); i += kMostRecords)
    frame(kTicks, std::as_bytes(ticks.subspan(i, std::min(kMostRecords, ticks.size() - i))));
  // The last change of each voxel is all a reader needs to follow block by block.
  coalesced_.assign(changes.begin(), changes.end());
  std::stable_sort(coalesced_.begin(), coalesced_.end(), [](const auto& a, const auto& b) { return a.voxel < b.voxel; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < coalesced_.size(); ++i) {
    if (i + 1 < coalesced_.size() && coalesced_[i + 1].voxel == coalesced_[i].voxel) continue;
    coalesced_[kept++] = coalesced_[i];
  }
  coalesced_.resize(kept);
  for (std::size_t i = 0; i < kept; i += kMostRecords)
    frame(kChanges, std::as_bytes(std::span(coalesced_).subspan(i, std::min(kMostRecords, kept - i))));
  write();
}

void SessionWriter::finish(const SessionEnd& e) {
  ordered_json j;
  j["ticks"] = e.ticks;
  j["bone_hash"] = e.bone_hash;
  j["surface_hash"] = e.surface_hash;
  j["removed_mm3"] = e.removed_mm3;
  j["dust_hash"] = e.dust_hash;
  j["ticks_lost"] = e.ticks_lost;
  frame(kEnd, bytes_of(j.dump()));
  write();
  sync();
}

namespace {

struct Frame {
  std::uint32_t type = 0;
  std::span<const std::byte> payload;
  std::size_t end = 0;  // where the next begins
};

std::optional<Frame> frame_at(std::span<const std::byte> bytes, std::size_t at) {
  FrameHead head{};
  if (at + sizeof head > bytes.size()) return std::nullopt;
  std::memcpy(&head, bytes.data() + at, sizeof head);
  if (head.magic != kMagic || head.bytes > kLongestFrame || head.bytes > bytes.size() - at - sizeof head) return std::nullopt;
  const auto payload = bytes.subspan(at + sizeof head, head.bytes);
  if (checksum(head.type, payload) != head.crc) return std::nullopt;
  return Frame{head.type, payload, at + sizeof head + head.bytes};
}

// Where the next whole frame begins, from `at` on; the end of the file when there is none.
std::size_t next_frame(std::span<const std::byte> bytes, std::size_t at) {
  std::array<std::byte, sizeof kMagic> magic{};
  std::memcpy(magic.data(), &kMagic, sizeof kMagic);
  while (true) {
    const auto found = std::search(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), magic.begin(), magic.end());
    at = static_cast<std::size_t>(found - bytes.begin());
    if (at == bytes.size() || frame_at(bytes, at)) return at;
    ++at;
  }
}

SessionHeader header_of(const ordered_json& j, const std::string& name) {
  SessionHeader h;
  h.program_version = j.at("program");
  h.bone_hash = j.at("bone_hash");
  h.rate_hz = j.at("rate_hz");
  h.burr_library = j.at("burr_library");
  if (j.at("tick_bytes") != sizeof(TickRecord) || h.burr_library != kBurrLibraryVersion) {
    throw Error(ExitCode::corrupt, name + " was recorded by another version (" + h.program_version + ")", "replay it with that version");
  }
  h.haptics = setup_of(j.at("haptics"));
  for (const auto& [name, value] : j.at("haptics").at("params").items()) h.setting_names.push_back(name);
  h.dust = j.value("dust", false);
  return h;
}

// Takes frames in their order and watches that ticks follow each other.
class Reading {
 public:
  Reading(Session& session, const std::string& name) : s_(session), name_(name) {}

  void take(const Frame& f) {
    const std::string_view text(reinterpret_cast<const char*>(f.payload.data()), f.payload.size());
    if (f.type == kTicks) {
      const std::size_t first = s_.ticks.size();
      append_records(s_.ticks, records<TickRecord>(f));
      if (first == s_.ticks.size()) return;
      arrive(s_.ticks[first].tick);
      std::uint64_t changed = 0;
      for (std::size_t t = first; t < s_.ticks.size(); ++t) {
        const TickRecord& r = s_.ticks[t];
        // Of each tick all hands, in their order.
        const std::uint32_t hand = t == 0 ? 0 : (s_.ticks[t - 1].hand + 1) % static_cast<std::uint32_t>(s_.header.haptics.hands());
        if (r.hand != hand || r.tick + (hand > 0 ? 1 : 0) != next_tick_) missing();
        next_tick_ += hand == 0 ? 1 : 0;
        changed += r.voxels_changed;
      }
      unchanged_from_ = changed > 0 ? first : kNone;
    } else if (f.type == kChanges) {
      append_records(s_.changes, records<VoxelChange>(f));
      unchanged_from_ = kNone;
    } else if (f.type == kActions) {
      std::vector<SceneAction> actions;
      append_records(actions, records<SceneAction>(f));
      for (SceneAction& a : actions) {
        if (a.is(ActionKind::setting)) a.item = setting(a.item);
        s_.actions.push_back({a, s_.changes.size()});
      }
    } else if (f.type == kGap) {
      std::vector<RecordingGap> gaps;
      append_records(gaps, records<RecordingGap>(f));
      for (const RecordingGap& g : gaps) {
        arrive(g.first_tick);
        if (g.first_tick != next_tick_) missing();
        open_gap(0, 0);
        s_.gaps.back().ticks = g.ticks;
        s_.gaps.back().bone_lost = g.bone_lost != 0;
        open_ = false;
        next_tick_ += g.ticks;
      }
    } else if (f.type == kEnd) {
      const auto j = ordered_json::parse(text);
      s_.end = SessionEnd{j.at("ticks"),       j.at("bone_hash"),        j.at("surface_hash"),
                          j.at("removed_mm3"), j.value("dust_hash", ""), j.value("ticks_lost", std::uint64_t{0})};
      arrive(s_.end->ticks);
      if (s_.end->ticks != next_tick_) missing();
    } else {
      throw Error(ExitCode::corrupt, name_ + " holds frames of a kind (" + std::to_string(f.type) + ") that this version does not know",
                  "it was recorded by a later one; use that");
    }
  }
  void damage(std::size_t at, std::size_t bytes) {
    if (open_) {
      s_.gaps.back().bytes += bytes;
      return;
    }
    open_gap(at, bytes);
  }
  // The last ticks of a file that was cut before their changes.
  void cut() {
    if (s_.end || unchanged_from_ == kNone) return;
    const std::size_t hands = s_.header.haptics.hands(), kept = unchanged_from_ / hands * hands;
    s_.torn_ticks = (s_.ticks.size() - kept) / hands;
    s_.ticks.resize(kept);
    for (Gap& g : s_.gaps) g.ticks_before = std::min(g.ticks_before, s_.ticks.size());
  }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};
  template <class T>
  std::span<const std::byte> records(const Frame& f) const {
    if (f.payload.size() % sizeof(T) != 0) throw Error(ExitCode::corrupt, name_ + " has a frame whose length is that of no records");
    return f.payload;
  }
  // The next tick there is: what a damaged part took is known now.
  void arrive(std::uint64_t tick) {
    if (!open_ || tick < next_tick_) return;
    s_.gaps.back().ticks = tick - next_tick_;
    next_tick_ = tick;
    open_ = false;
  }
  void open_gap(std::size_t at, std::size_t bytes) {
    s_.gaps.push_back({next_tick_, 0, true, at, bytes, s_.ticks.size(), s_.changes.size(), s_.actions.size()});
    open_ = true;
    unchanged_from_ = kNone;
  }
  // Numbers of settings are those of the program that recorded; the header says which names they had.
  std::uint32_t setting(std::uint32_t recorded) const {
    const auto& names = s_.header.setting_names;
    const int here = recorded < names.size() ? setting_number(names[recorded]) : -1;
    if (here < 0)
      throw Error(ExitCode::corrupt, name_ + " changes a setting that this version does not know",
                  "it was recorded by another one; use that");
    return static_cast<std::uint32_t>(here);
  }
  [[noreturn]] void missing() const { throw Error(ExitCode::corrupt, name_ + ": tick " + std::to_string(next_tick_) + " is missing"); }

  Session& s_;
  const std::string& name_;
  std::uint64_t next_tick_ = 0;
  std::size_t unchanged_from_ = kNone;  // ticks whose changes have to follow
  bool open_ = false;                   // the last gap does not know yet how far it goes
};

std::string count(std::uint64_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string ticks_of(const Gap& g) {
  return g.ticks == 1 ? "tick " + std::to_string(g.first_tick)
                      : "ticks " + std::to_string(g.first_tick) + " to " + std::to_string(g.first_tick + g.ticks - 1);
}

}  // namespace

bool Session::damaged() const {
  return std::any_of(gaps.begin(), gaps.end(), [](const Gap& g) { return g.bytes > 0; });
}

const Gap* Session::bone_known_until() const {
  for (const Gap& g : gaps) {
    if (g.bone_lost && (damaged() || !end)) return &g;
  }
  return nullptr;
}

std::vector<std::string> losses(const Session& s) {
  std::vector<std::string> lines;
  for (const Gap& g : s.gaps) {
    if (g.bytes > 0) {
      lines.push_back(
          "damaged at byte " + std::to_string(g.at_byte) + ": " + count(g.bytes, "byte") + " cannot be read, " +
          (g.ticks > 0 ? ticks_of(g) + " missing" : "with changes, actions or the end of ticks around " + std::to_string(g.first_tick)));
    } else {
      lines.push_back(
          (g.ticks > 0 ? ticks_of(g) + " (" + count(g.ticks, "tick") + ")" : "actions before tick " + std::to_string(g.first_tick)) +
          " were not recorded, since " +
          (g.bone_lost ? "the recorder did not come to run; what they changed is missing too"
                       : "the disk did not keep up; what they changed and what was done meanwhile is there"));
    }
  }
  if (s.torn_bytes > 0) lines.push_back("cut at its end: " + count(s.torn_bytes, "byte") + " behind the last whole frame left out");
  if (s.torn_ticks > 0) lines.push_back("cut at its end: " + count(s.torn_ticks, "tick") + " without their voxel changes left out");
  return lines;
}

Session read_session(const fs::path& path, Damage damage) {
  const auto bytes = read_file(path);
  const std::string name = "'" + path.string() + "'";
  Session session;
  const auto header = frame_at(bytes, 0);
  if (!header) {
    const bool ours = bytes.size() >= sizeof kMagic && std::memcmp(bytes.data(), &kMagic, sizeof kMagic) == 0;
    throw Error(ExitCode::corrupt,
                name + (ours ? " is damaged at byte 0, in its header, or was cut before that ended" : " is not a session file"));
  }
  std::size_t at = header->end;
  try {
    const auto j = ordered_json::parse(std::string_view(reinterpret_cast<const char*>(header->payload.data()), header->payload.size()));
    if (header->type != kHeader || j.at("osteotome_session") != 1)
      throw Error(ExitCode::corrupt, name + " is not a session of this program");
    session.header = header_of(j, name);
    Reading reading(session, name);
    while (at < bytes.size()) {
      if (const auto frame = frame_at(bytes, at)) {
        reading.take(*frame);
        at = frame->end;
        continue;
      }
      const std::size_t next = next_frame(bytes, at + 1);
      if (next == bytes.size()) break;
      reading.damage(at, next - at);
      at = next;
    }
    reading.cut();
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::corrupt, name + " has a damaged frame: " + json_complaint(e));
  }
  session.torn_bytes = bytes.size() - at;
  if (damage == Damage::refuse && session.damaged()) {
    for (const Gap& g : session.gaps) {
      if (g.bytes > 0)
        throw Error(ExitCode::corrupt, name + " is " + losses(session)[static_cast<std::size_t>(&g - session.gaps.data())],
                    "copy the file again from its source; 'osteo export' and 'osteo replay' still use what is whole");
    }
  }
  return session;
}

}  // namespace osteo
