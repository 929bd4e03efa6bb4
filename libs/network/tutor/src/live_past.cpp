#include "osteo/network/tutor/live_past.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/network/tutor/live_run.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline network {
namespace {

class MemorySink final : public SessionSink {
 public:
  explicit MemorySink(Bytes& to) : to_(to) {}
  void write(std::span<const std::byte> bytes) override {
    const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
    to_.insert(to_.end(), from, from + bytes.size());
  }
  void sync() override {}

 private:
  Bytes& to_;
};

// Readers want a file.
class BytesAsFile {
 public:
  explicit BytesAsFile(std::span<const std::uint8_t> bytes) : file_(folder_.path() / "stream.oss") {
    write_file(file_, std::string(bytes.begin(), bytes.end()));
  }
  [[nodiscard]] SessionReader open() const { return SessionReader(file_); }

 private:
  TemporaryFolder folder_;
  fs::path file_;
};

// Settings, behind their length; the rest is the past.
std::pair<std::span<const std::uint8_t>, std::span<const std::uint8_t>> parts_of(const Bytes& bytes) {
  std::uint32_t length = 0;
  if (bytes.size() >= sizeof length) std::memcpy(&length, bytes.data(), sizeof length);
  const auto rest = std::span<const std::uint8_t>(bytes).subspan(std::min(bytes.size(), sizeof length));
  if (length == 0 || length > rest.size())
    throw Error(ExitCode::corrupt, "the host's settings are damaged", "join once more");
  return {rest.first(length), rest.subspan(length)};
}

}  // namespace

Bytes settings_bytes(const SessionHeader& header, const Bytes& past) {
  Bytes settings;
  { const SessionWriter writer(std::make_unique<MemorySink>(settings), header); }
  const auto length = static_cast<std::uint32_t>(settings.size());
  Bytes all(sizeof length + settings.size() + past.size());
  std::memcpy(all.data(), &length, sizeof length);
  std::copy(settings.begin(), settings.end(), all.begin() + sizeof length);
  std::copy(past.begin(), past.end(), all.end() - static_cast<std::ptrdiff_t>(past.size()));
  return all;
}

SessionHeader settings_of(const Bytes& bytes) {
  const BytesAsFile file(parts_of(bytes).first);
  const SessionReader reader = file.open();
  if (!reader.outline().not_replayable.empty())
    throw Error(ExitCode::corrupt,
                "the host's session cannot be followed by this version: " + reader.outline().not_replayable,
                "both need the same version");
  // What comes live is not read from a file: its numbers are the host's.
  if (!reader.outline().numbered_alike)
    throw Error(
        ExitCode::corrupt,
        "the host's session cannot be followed by this version: its library of instruments or plates is another",
        "both need the same version");
  return reader.header();
}

Bytes past_of(const Bytes& settings) {
  const auto past = parts_of(settings).second;
  return {past.begin(), past.end()};
}

Bytes past_bytes(const SessionFolder& session) {
  const std::vector<SessionBefore> chain = sessions_before(session);
  Bytes bytes;
  std::optional<SessionWriter> writer;
  SessionBatch batch;
  const auto flush = [&] {
    writer->append(batch);
    batch = {};
    if (bytes.size() > kMaxPastBytes)
      throw Error(ExitCode::failed, "the sessions that this one goes on from are too long to be sent",
                  "begin with the case's bone");
  };
  for (const SessionBefore& before : chain) {
    const SessionReader reader(before.session.stream());
    if (!reader.outline().gaps.empty())
      throw Error(ExitCode::failed, "a session that this one goes on from lacks ticks", "begin with the case's bone");
    if (!writer) {
      SessionHeader header = reader.header();
      header.dust = header.heat = false;
      writer.emplace(std::make_unique<MemorySink>(bytes), header);
    }
    std::uint64_t reached = 0;
    auto parts = before.until_s > 0
                     ? reader.scene_at(
                           static_cast<std::uint64_t>(std::llround(before.until_s * reader.header().rate_hz)), reached)
                     : reader.parts();
    while (const SessionPart* const part = parts.next()) {
      if (!part->actions.empty() && !batch.changes.empty()) flush();
      for (SceneAction a : part->actions) {
        a.tick = 0;
        batch.actions.push_back(a);
      }
      batch.changes.insert(batch.changes.end(), part->changes.begin(), part->changes.end());
    }
    if (!batch.empty()) flush();
  }
  if (writer) writer->finish({});
  return bytes;
}

SessionFolder create_joined_folder(const fs::path& wanted, const fs::path& case_folder, const Bytes& past,
                                   const std::string& words) {
  fs::path before;
  if (!past.empty()) {
    fs::path beside = wanted.lexically_normal();  // not below it, also where it was written with a slash at its end
    if (!beside.empty() && !beside.has_filename()) beside = beside.parent_path();
    if (!beside.empty()) beside += "-before";
    const SessionFolder made =
        create_session_folder(beside, case_folder, {}, words + "; what the instructor's session goes on from");
    before = made.folder;
    write_file(made.stream(), std::string(past.begin(), past.end()));
  }
  return create_session_folder(wanted, case_folder, before, words);
}

World world_of_past(const Bytes& past, const Case& the_case, const Anatomy& anatomy) {
  World world = world_of(the_case, anatomy);
  if (past.empty()) return world;
  const BytesAsFile file(past);
  const SessionReader reader = file.open();
  if (world.hash() != reader.header().bone_hash)
    throw Error(ExitCode::usage, "the host's bone is another", "both need the same case, unchanged");
  apply_recorded(reader, world);
  return world;
}

}  // namespace osteo::inline network
