#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "frame.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/session_file.h"
#include "record_codec.h"
#include "session_header.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxChanges = 1U << 20;  // in a frame
// Whose coalescing is worth its time.
constexpr std::size_t kManyChanges = 1U << 21;

class FileSink final : public SessionSink {
 public:
  explicit FileSink(const fs::path& path)
      : path_(path), fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644)) {
    if (fd_ >= 0) return;
    throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + std::strerror(errno),
                errno == EEXIST ? "give another name" : "choose a folder that you may write to");
  }
  ~FileSink() override { ::close(fd_); }
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

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
    // A file that was deleted takes what is written for as long as it is open, and none of it can be found again.
    struct stat now {};
    if (::fstat(fd_, &now) == 0 && S_ISREG(now.st_mode) && now.st_nlink == 0)
      throw Error(ExitCode::cannot_write, "'" + path_.string() + "' was deleted while it was recorded",
                  "what was done in this session is lost: end it, and begin another in a folder that stays");
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

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

// The last change of each voxel is all a reader needs to follow frame by frame.
void coalesce(std::vector<VoxelChange>& changes) {
  std::stable_sort(changes.begin(), changes.end(), [](const auto& a, const auto& b) { return a.voxel < b.voxel; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (i + 1 < changes.size() && changes[i + 1].voxel == changes[i].voxel) continue;
    changes[kept++] = changes[i];
  }
  changes.resize(kept);
}

// A scene can be made without those that are for the servo or for dust.
bool changes_scene(const SceneAction& a) {
  const ActionRow& row = row_of(a);
  return row.changes_touch || row.changes_world || row.by_servo;
}

void put_part(std::vector<std::byte>& out, std::uint32_t part, std::size_t n) {
  const std::uint32_t head[2] = {part, static_cast<std::uint32_t>(n)};
  const auto bytes = std::as_bytes(std::span(head));
  out.insert(out.end(), bytes.begin(), bytes.end());
}
template <class T>
void put_part(std::vector<std::byte>& out, const RecordTable& table, std::span<const T> records) {
  if (records.empty()) return;
  put_part(out, table.part, records.size());
  put_records(out, table.fields, records.data(), records.size(), sizeof(T));
}

// What is no JSON is kept as text.
std::string line_of(const Note& note) {
  auto value = ordered_json::parse(note.json, nullptr, false);
  if (value.is_discarded()) value = note.json;
  return ordered_json{{"tick", note.tick}, {"kind", note.kind}, {"value", value}}.dump(
             -1, ' ', false, ordered_json::error_handler_t::replace) +
         "\n";
}

}  // namespace

std::unique_ptr<SessionSink> session_file(const fs::path& path) {
  return std::make_unique<FileSink>(path);
}

SessionWriter::SessionWriter(std::unique_ptr<SessionSink> sink, const SessionHeader& h)
    : sink_(std::move(sink)), rate_hz_(h.rate_hz) {
  frame(kHeaderFrame, 0, 0, bytes_of(header_json(h)));
}

// One write for each, so that a kill rarely parts it.
void SessionWriter::frame(std::uint32_t type, std::uint64_t first_tick, std::uint64_t end_tick,
                          std::span<const std::byte> payload) {
  FrameHead head{kMagic, type, static_cast<std::uint32_t>(payload.size()), 0, first_tick, end_tick};
  head.crc = checksum(head, payload);
  const auto head_bytes = std::as_bytes(std::span(&head, 1));
  out_.assign(head_bytes.begin(), head_bytes.end());
  out_.insert(out_.end(), payload.begin(), payload.end());
  sink_->write(out_);
  bytes_ += out_.size();
}

void SessionWriter::records(std::uint32_t type, std::uint64_t first_tick, std::uint64_t end_tick,
                            const Segment& segment, std::span<const TickRecord> ticks, std::span<const Note> notes) {
  raw_.clear();
  put_part(raw_, action_record_table(), std::span(segment.actions));
  put_part(raw_, tick_table(), ticks);
  std::string lines;
  for (const Note& n : notes) lines += line_of(n);
  if (!lines.empty()) {
    put_part(raw_, kNotesPart, lines.size());
    const auto text = bytes_of(lines);
    raw_.insert(raw_.end(), text.begin(), text.end());
  }
  // More than fit go into frames behind it.
  for (std::span<const VoxelChange> left = segment.changes;; first_tick = end_tick) {
    put_part(raw_, change_table(), left.first(std::min(kMaxChanges, left.size())));
    left = left.subspan(std::min(kMaxChanges, left.size()));
    frame(type, first_tick, end_tick, compressed(raw_));
    if (left.empty()) return;
    raw_.clear();
  }
}

void SessionWriter::append(const SessionBatch& b) {
  if (b.empty()) return;
  Segment segment{b.actions, b.changes};
  coalesce(segment.changes);
  const std::uint64_t first = b.ticks.empty() ? next_tick_ : b.ticks.front().tick;
  next_tick_ = b.ticks.empty() ? next_tick_ : b.ticks.back().tick + 1;
  records(kRecordsFrame, first, next_tick_, segment, b.ticks, b.notes);
  remember({std::move(segment.actions), {}, std::move(segment.changes), {}});
  if (static_cast<double>(next_tick_ - checkpoint_tick_) >= kCheckpointEveryS * rate_hz_) checkpoint();
}

void SessionWriter::append(const RecordingGap& gap) {
  const ordered_json j{{"bone_lost", gap.bone_lost}};
  next_tick_ = gap.first_tick + gap.ticks;
  frame(kGapFrame, gap.first_tick, next_tick_, bytes_of(j.dump()));
}

// Of changes that no action looks at in between only the last of each voxel counts.
void SessionWriter::remember(const SessionBatch& b) {
  for (const SceneAction& a : b.actions) {
    if (!changes_scene(a)) continue;
    if (since_checkpoint_.empty() || (parts_changes(row_of(a)) && !since_checkpoint_.back().changes.empty()))
      since_checkpoint_.emplace_back();
    since_checkpoint_.back().actions.push_back(a);
  }
  if (b.changes.empty()) return;
  if (since_checkpoint_.empty()) since_checkpoint_.emplace_back();
  auto& changes = since_checkpoint_.back().changes;
  changes.insert(changes.end(), b.changes.begin(), b.changes.end());
  if (changes.size() > kManyChanges && changes.size() - b.changes.size() <= kManyChanges) coalesce(changes);
}

void SessionWriter::checkpoint() {
  std::vector<Segment> segments = std::exchange(since_checkpoint_, {});
  if (segments.empty()) segments.emplace_back();
  std::uint64_t first = std::exchange(checkpoint_tick_, next_tick_);
  for (Segment& s : segments) {
    coalesce(s.changes);
    records(kCheckpointFrame, first, next_tick_, s);
    first = next_tick_;
  }
}

void SessionWriter::finish(const SessionEnd& e) {
  checkpoint();
  const ordered_json j{{"ticks", e.ticks},
                       {"bone_hash", e.bone_hash},
                       {"surface_hash", e.surface_hash},
                       {"removed_mm3", e.removed_mm3},
                       {"dust_hash", e.dust_hash},
                       {"ticks_lost", e.ticks_lost},
                       {"notes_lost", e.notes_lost}};
  frame(kEndFrame, e.ticks, e.ticks, bytes_of(j.dump()));
  sync();
}

}  // namespace osteo::inline session
