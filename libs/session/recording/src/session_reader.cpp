#include "osteo/session/recording/session_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "frame.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "session_header.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;

// A file that is read here and there.
class Bytes {
 public:
  explicit Bytes(const fs::path& path) : path_(path) {
    require_readable(path);
    fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat about {};
    if (fd_ < 0 || ::fstat(fd_, &about) != 0) fail();
    size_ = static_cast<std::uint64_t>(about.st_size);
  }
  ~Bytes() { ::close(fd_); }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;
  [[nodiscard]] std::uint64_t size() const { return size_; }
  // False where the file has no so many.
  bool read(std::uint64_t at, void* to, std::size_t n) const {
    if (at > size_ || n > size_ - at) return false;
    for (std::size_t done = 0; done < n;) {
      const ssize_t some = ::pread(fd_, static_cast<char*>(to) + done, n - done, static_cast<off_t>(at + done));
      if (some < 0 && errno == EINTR) continue;
      if (some < 0) fail();
      if (some == 0) return false;
      done += static_cast<std::size_t>(some);
    }
    return true;
  }

 private:
  [[noreturn]] void fail() const {
    throw Error(ExitCode::cannot_read, "cannot read '" + path_.string() + "': " + std::strerror(errno));
  }
  fs::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

bool frame_at(const Bytes& file, std::uint64_t at, FrameHead& head, std::vector<std::byte>& payload) {
  if (!file.read(at, &head, sizeof head) || head.magic != kMagic || head.bytes > kLongestFrame) return false;
  if (head.bytes > file.size() - at - sizeof head) return false;
  payload.resize(head.bytes);
  return file.read(at + sizeof head, payload.data(), payload.size()) && checksum(head, payload) == head.crc;
}

// Where the next whole frame begins, from `at` on; the end of the file when there is none.
std::uint64_t next_frame(const Bytes& file, std::uint64_t at) {
  std::array<char, sizeof kMagic> magic{};
  std::memcpy(magic.data(), &kMagic, sizeof kMagic);
  FrameHead head;
  std::vector<std::byte> payload;
  std::vector<char> piece;
  while (at + sizeof head <= file.size()) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(1 << 20, file.size() - at)));
    if (!file.read(at, piece.data(), piece.size())) break;
    for (auto from = piece.begin();;) {
      from = std::search(from, piece.end(), magic.begin(), magic.end());
      if (from == piece.end()) break;
      const std::uint64_t found = at + static_cast<std::uint64_t>(from - piece.begin());
      if (frame_at(file, found, head, payload)) return found;
      ++from;
    }
    at += piece.size() - (magic.size() - 1);  // it may lie across two pieces
  }
  return file.size();
}

std::string count(std::uint64_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string ticks_of(const Gap& g) {
  return g.ticks == 1 ? "tick " + std::to_string(g.first_tick)
                      : "ticks " + std::to_string(g.first_tick) + " to " + std::to_string(g.first_tick + g.ticks - 1);
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

bool SessionOutline::damaged() const {
  return std::any_of(gaps.begin(), gaps.end(), [](const Gap& g) { return g.bytes > 0; });
}

const Gap* SessionOutline::bone_known_until() const {
  for (const Gap& g : gaps) {
    if (g.bone_lost && (damaged() || !end)) return &g;
  }
  return nullptr;
}

std::vector<std::string> losses(const SessionOutline& s) {
  std::vector<std::string> lines;
  for (const Gap& g : s.gaps) {
    if (g.bytes > 0) {
      lines.push_back(
          "damaged at byte " + std::to_string(g.at_byte) + ": " + count(g.bytes, "byte") + " cannot be read, " +
          (g.ticks > 0 ? ticks_of(g) + " missing"
                       : "with a checkpoint, actions or the end around tick " + std::to_string(g.first_tick)));
    } else {
      lines.push_back((g.ticks > 0 ? ticks_of(g) + " (" + count(g.ticks, "tick") + ")"
                                   : "actions before tick " + std::to_string(g.first_tick)) +
                      " were not recorded, since " +
                      (g.bone_lost
                           ? "the recorder did not come to run; what they changed is missing too"
                           : "the disk did not keep up; what they changed and what was done meanwhile is there"));
    }
  }
  if (s.torn_bytes > 0)
    lines.push_back("cut at its end: " + count(s.torn_bytes, "byte") + " behind the last whole frame left out");
  return lines;
}

struct SessionReader::File {
  // A frame, or where something is missing.
  struct Entry {
    std::uint64_t at = 0;
    std::uint64_t first_tick = 0, end_tick = 0;
    std::uint32_t type = 0;
    std::uint32_t gap = 0;  // kGapFrame: index in gaps
  };
  explicit File(const fs::path& path) : name("'" + path.string() + "'"), bytes(path) {}
  [[noreturn]] void broken(const Entry& e, const std::string& what) const {
    throw Error(ExitCode::corrupt, name + ", frame at byte " + std::to_string(e.at) + ": " + what,
                "a later version may have written it; use that");
  }
  void look_through();
  void take(std::uint64_t at, const FrameHead& head, std::span<const std::byte> payload);
  void arrive(std::uint64_t tick);
  [[noreturn]] void missing() const {
    throw Error(ExitCode::corrupt, name + ": tick " + std::to_string(next_tick) + " is missing");
  }

  std::string name;
  Bytes bytes;
  SessionOutline outline;
  std::vector<FileTable> tables;
  FileNumbers numbers;
  std::vector<Entry> entries;
  std::map<std::uint32_t, std::uint64_t> unknown_frames;
  // While looking through.
  std::uint64_t next_tick = 0;
  bool open = false;  // the last gap does not know yet how far it goes
};

// What is there next: what a damaged part took is known now.
void SessionReader::File::arrive(std::uint64_t tick) {
  if (open && tick >= next_tick) {
    outline.gaps.back().ticks = tick - next_tick;
    entries.back().end_tick = next_tick = tick;
    open = false;
  }
  if (tick != next_tick) missing();
}

void SessionReader::File::take(std::uint64_t at, const FrameHead& head, std::span<const std::byte> payload) {
  Entry entry{at, head.first_tick, head.end_tick, head.type, 0};
  if (head.end_tick < head.first_tick) broken(entry, "it ends before it begins");
  switch (head.type) {
    case kRecordsFrame:
      arrive(head.first_tick);
      next_tick = head.end_tick;
      outline.tick_records += (head.end_tick - head.first_tick) * outline.header.haptics.hands();
      break;
    case kGapFrame: {
      arrive(head.first_tick);
      const auto j = ordered_json::parse(text_of(payload));
      entry.gap = static_cast<std::uint32_t>(outline.gaps.size());
      outline.gaps.push_back({head.first_tick, head.end_tick - head.first_tick, j.at("bone_lost"), 0, 0});
      next_tick = head.end_tick;
      break;
    }
    case kCheckpointFrame:
      arrive(head.end_tick);
      break;
    case kEndFrame: {
      const auto j = ordered_json::parse(text_of(payload));
      outline.end = SessionEnd{j.at("ticks"),
                               j.at("bone_hash"),
                               j.at("surface_hash"),
                               j.at("removed_mm3"),
                               j.at("dust_hash"),
                               j.at("ticks_lost"),
                               j.value("notes_lost", std::uint64_t{0})};
      arrive(outline.end->ticks);
      return;
    }
    default:
      ++unknown_frames[head.type];
      return;
  }
  entries.push_back(entry);
}

void SessionReader::File::look_through() {
  FrameHead head;
  std::vector<std::byte> payload;
  if (!frame_at(bytes, 0, head, payload) || head.type != kHeaderFrame) {
    std::uint32_t magic = 0;
    static_cast<void>(bytes.read(0, &magic, sizeof magic));
    if (magic == kOldMagic)
      throw Error(ExitCode::corrupt,
                  name + " is a session of format 1, which this version does not read (it reads format " +
                      std::to_string(kSessionFormat) + ")",
                  "use the version it was recorded with, which can also export it");
    throw Error(ExitCode::corrupt,
                name + (magic == kMagic ? " is damaged at byte 0, in its header, or was cut before that ended"
                                        : " is not a session file"));
  }
  std::uint64_t at = sizeof head + head.bytes;
  try {
    read_header(text_of(payload), name, outline, tables, numbers);
    while (at < bytes.size()) {
      if (frame_at(bytes, at, head, payload)) {
        take(at, head, payload);
        at += sizeof head + head.bytes;
        continue;
      }
      const std::uint64_t next = next_frame(bytes, at + 1);
      if (next == bytes.size()) break;
      if (open) {
        outline.gaps.back().bytes += next - at;
      } else {
        entries.push_back({at, next_tick, next_tick, kGapFrame, static_cast<std::uint32_t>(outline.gaps.size())});
        outline.gaps.push_back({next_tick, 0, true, at, next - at});
        open = true;
      }
      at = next;
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::corrupt, name + " has a damaged frame: " + json_complaint(e));
  } catch (const std::logic_error& e) {  // a kind of action that is no number
    throw Error(ExitCode::corrupt, name + " has a damaged header: " + e.what());
  }
  outline.torn_bytes = bytes.size() - at;
  for (const auto& [type, n] : unknown_frames)
    outline.newer.push_back(count(n, "frame") + " of a kind " + std::to_string(type));
}

SessionReader::SessionReader(const fs::path& path, Damage damage) : file_(std::make_unique<File>(path)) {
  file_->look_through();
  const SessionOutline& o = file_->outline;
  if (damage == Damage::keep || !o.damaged()) return;
  for (const Gap& g : o.gaps) {
    if (g.bytes > 0)
      throw Error(ExitCode::corrupt, file_->name + " is " + losses(o)[static_cast<std::size_t>(&g - o.gaps.data())],
                  "copy the file again from its source; 'osteo export' and 'osteo replay' still use what is whole");
  }
}
SessionReader::~SessionReader() = default;
SessionReader::SessionReader(SessionReader&&) noexcept = default;

const SessionOutline& SessionReader::outline() const {
  return file_->outline;
}

struct SessionReader::Parts::State {
  explicit State(const File& f) : file(f) {}

  bool next();
  void open(const File::Entry& e);
  bool next_of_frame();

  const File& file;
  std::vector<std::size_t> frames;  // which, in order
  std::size_t at = 0;               // of the next
  bool contents = false;            // of checkpoints
  bool scene_only = false;          // actions and changes
  bool marked = false;              // the checkpoint before
  const File::Entry* entry = nullptr;
  std::vector<std::byte> payload, raw;
  std::span<const std::byte> left;  // of raw
  std::uint64_t next_tick = 0;      // in this frame
  std::uint32_t hand = 0;
  std::vector<SceneAction> actions;
  std::vector<TickRecord> ticks;
  std::vector<VoxelChange> changes;
  std::vector<Note> notes;
  SessionPart part;
};

void SessionReader::Parts::State::open(const File::Entry& e) {
  FrameHead head;
  if (!frame_at(file.bytes, e.at, head, payload)) file.broken(e, "it was whole before, and is not any more");
  if (!decompress(payload, raw)) file.broken(e, "it cannot be decompressed");
  entry = &e;
  left = raw;
  next_tick = e.first_tick;
  hand = 0;
}

// The next part of this frame; false behind the last.
bool SessionReader::Parts::State::next_of_frame() {
  while (!left.empty()) {
    std::uint32_t head[2];
    if (left.size() < sizeof head) file.broken(*entry, "it holds a part of a part");
    std::memcpy(head, left.data(), sizeof head);
    left = left.subspan(sizeof head);
    const std::size_t n = head[1];
    const auto table =
        std::find_if(file.tables.begin(), file.tables.end(), [&](const FileTable& t) { return t.part == head[0]; });
    if (table == file.tables.end()) file.broken(*entry, "it holds records that the header does not describe");
    if (n == 0 || n > left.size() / table->bytes) file.broken(*entry, "its records are fewer than it says");
    const auto from = left.first(n * table->bytes);
    left = left.subspan(from.size());
    part = {};
    const auto read = [&](auto& records) {
      using Record = typename std::remove_reference_t<decltype(records)>::value_type;
      records.assign(n, Record{});
      get_records(*table, from, n, records.data(), sizeof(Record));
    };
    if (table->part == tick_table().part) {
      if (scene_only) continue;
      read(ticks);
      for (TickRecord& t : ticks) {
        t.device.tool = static_cast<std::uint8_t>(file.numbers.tools(t.device.tool, file.name));
        if (t.tick != next_tick || t.hand != hand || t.tick >= entry->end_tick)
          file.broken(*entry, "tick " + std::to_string(next_tick) + " is missing");
        if (++hand == file.outline.header.haptics.hands()) {
          hand = 0;
          ++next_tick;
        }
      }
      part.ticks = ticks;
    } else if (table->part == change_table().part) {
      read(changes);
      part.changes = changes;
    } else if (table->part == action_record_table().part) {
      read(actions);
      for (SceneAction& a : actions) {
        // What is fixed or taken by hand is a plate of the library; other items are numbers of the scene.
        if ((a.is(ActionKind::grip) || a.is(ActionKind::attach)) && a.item != SceneAction::kNobody)
          a.item = file.numbers.plates(a.item, file.name);
        if (!a.is(ActionKind::setting)) continue;
        const auto& names = file.outline.setting_names;
        const int here = a.item < names.size() ? setting_number(names[a.item]) : -1;
        a.item = here < 0 ? SceneAction::kNobody : static_cast<std::uint32_t>(here);
      }
      part.actions = actions;
    } else if (table->part == kNotesPart && table->text) {
      if (scene_only) continue;
      notes.clear();
      std::string_view lines = text_of(from);
      while (!lines.empty()) {
        const std::size_t length = std::min(lines.find('\n'), lines.size());
        const auto j = ordered_json::parse(lines.substr(0, length), nullptr, false);
        lines.remove_prefix(std::min(length + 1, lines.size()));
        if (!j.is_object() || !j.contains("value") || !j.contains("kind") || !j["kind"].is_string() ||
            !j.contains("tick") || !j["tick"].is_number_unsigned())
          file.broken(*entry, "it holds a note that is not valid");
        notes.push_back(
            {j["tick"], j["kind"], j["value"].dump(-1, ' ', false, ordered_json::error_handler_t::replace)});
      }
      part.notes = notes;
    } else {
      continue;
    }
    return true;
  }
  if (entry != nullptr && entry->type == kRecordsFrame && !scene_only && next_tick != entry->end_tick)
    file.broken(*entry, "tick " + std::to_string(next_tick) + " is missing");
  entry = nullptr;
  return false;
}

bool SessionReader::Parts::State::next() {
  while (true) {
    if (entry != nullptr && next_of_frame()) return true;
    // The marker of a checkpoint stands behind its last frame, which something follows.
    if (at > 0 && at <= frames.size() && !scene_only) {
      const std::size_t last = frames[at - 1];
      const bool ends = file.entries[last].type == kCheckpointFrame &&
                        (last + 1 < file.entries.size() ? file.entries[last + 1].type != kCheckpointFrame
                                                        : file.outline.end.has_value());
      if (ends && !std::exchange(marked, true)) {
        part = {};
        part.checkpoint = file.entries[last].end_tick;
        return true;
      }
    }
    if (at == frames.size()) return false;
    marked = false;
    const File::Entry& e = file.entries[frames[at++]];
    if (e.type == kGapFrame) {
      part = {};
      part.gap = &file.outline.gaps[e.gap];
      return true;
    }
    if (e.type == kRecordsFrame || contents) open(e);
  }
}

SessionReader::Parts::Parts(std::unique_ptr<State> state) : state_(std::move(state)) {}
SessionReader::Parts::~Parts() = default;
SessionReader::Parts::Parts(Parts&&) noexcept = default;

const SessionPart* SessionReader::Parts::next() {
  return state_->next() ? &state_->part : nullptr;
}

SessionReader::Parts SessionReader::parts() const {
  auto state = std::make_unique<Parts::State>(*file_);
  for (std::size_t i = 0; i < file_->entries.size(); ++i) state->frames.push_back(i);
  return Parts(std::move(state));
}

SessionReader::Parts SessionReader::checkpoints() const {
  auto state = std::make_unique<Parts::State>(*file_);
  state->contents = true;
  for (std::size_t i = 0; i < file_->entries.size(); ++i) {
    if (file_->entries[i].type == kCheckpointFrame) state->frames.push_back(i);
  }
  return Parts(std::move(state));
}

SessionReader::Parts SessionReader::scene_at(std::uint64_t tick, std::uint64_t& reached) const {
  auto state = std::make_unique<Parts::State>(*file_);
  state->contents = state->scene_only = true;
  const auto& entries = file_->entries;
  // The last checkpoint that is whole and not behind the tick; those before lead to it.
  std::size_t from = 0;
  for (std::size_t i = 0; i < entries.size() && entries[i].first_tick < tick; ++i) {
    const bool followed =
        i + 1 < entries.size() ? entries[i + 1].type != kCheckpointFrame : file_->outline.end.has_value();
    if (entries[i].type == kCheckpointFrame && followed && entries[i].end_tick < tick) from = i + 1;
  }
  reached = from > 0 ? entries[from - 1].end_tick : 0;
  for (std::size_t i = 0; i < entries.size() && (i < from || entries[i].first_tick < tick); ++i) {
    const File::Entry& e = entries[i];
    if (e.type == kGapFrame && file_->outline.gaps[e.gap].bone_lost)
      throw Error(ExitCode::corrupt,
                  file_->name + " does not tell the scene at tick " + std::to_string(tick) + ": " +
                      losses(file_->outline)[e.gap],
                  "ask for a time before that");
    if (i >= from) reached = e.end_tick;
    if (e.type == (i < from ? kCheckpointFrame : kRecordsFrame)) state->frames.push_back(i);
  }
  return Parts(std::move(state));
}

Session read_session(const fs::path& path, Damage damage) {
  const SessionReader reader(path, damage);
  Session s;
  static_cast<SessionOutline&>(s) = reader.outline();
  auto parts = reader.parts();
  while (const SessionPart* const p = parts.next()) {
    for (const SceneAction& a : p->actions) s.actions.push_back({a, s.changes.size()});
    s.ticks.insert(s.ticks.end(), p->ticks.begin(), p->ticks.end());
    s.changes.insert(s.changes.end(), p->changes.begin(), p->changes.end());
    s.notes.insert(s.notes.end(), p->notes.begin(), p->notes.end());
  }
  return s;
}

}  // namespace osteo::inline session
