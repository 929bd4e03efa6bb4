#include "mcap_writer.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>

namespace osteo::inline session {
namespace {

enum Op : unsigned char {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};
constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
constexpr std::size_t kChunkBytes = 768 << 10;

template <class T>
void number(std::string& to, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);  // little endian, as this machine is
  to.append(raw, sizeof value);
}
void text(std::string& to, std::string_view value) {
  number(to, static_cast<std::uint32_t>(value.size()));
  to.append(value);
}
void record(std::string& to, Op op, std::string_view content) {
  to += static_cast<char>(op);
  number(to, static_cast<std::uint64_t>(content.size()));
  to.append(content);
}
// In pieces: zlib's lengths are 32 bits wide.
std::uint32_t crc32_of(std::uint32_t crc, std::string_view bytes) {
  for (constexpr std::size_t kPiece = 1U << 30; !bytes.empty(); bytes.remove_prefix(std::min(kPiece, bytes.size()))) {
    crc = static_cast<std::uint32_t>(
        ::crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(std::min(kPiece, bytes.size()))));
  }
  return crc;
}

}  // namespace

McapWriter::McapWriter(Out out, std::string_view library) : out_(std::move(out)) {
  std::string bytes(kMcapMagic), content;
  text(content, "");  // no profile
  text(content, library);
  record(bytes, kHeader, content);
  put(bytes);
}

void McapWriter::put(std::string_view bytes) {
  out_(bytes);
  at_ += bytes.size();
  crc_ = crc32_of(crc_, bytes);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name,
                                      std::string_view schema_json,
                                      const std::vector<std::pair<std::string, std::string>>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  Channel& c = channels_.emplace_back();
  number(c.schema, id);
  text(c.schema, schema_name);
  text(c.schema, "jsonschema");
  text(c.schema, schema_json);
  number(c.record, id);
  number(c.record, id);  // its schema's
  text(c.record, topic);
  text(c.record, "json");
  std::string pairs;
  for (const auto& [key, value] : metadata) {
    text(pairs, key);
    text(pairs, value);
  }
  text(c.record, pairs);
  record(chunk_, kSchema, c.schema);
  record(chunk_, kChannel, c.record);
  return id;
}

void McapWriter::message(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  Channel& c = channels_[channel - 1U];
  c.index.emplace_back(time_ns, chunk_.size());
  std::string content;
  content.reserve(22 + json.size());
  number(content, channel);
  number(content, static_cast<std::uint32_t>(c.messages++));
  number(content, time_ns);
  number(content, time_ns);
  content.append(json);
  record(chunk_, kMessage, content);
  first_ns_ = in_chunk_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = in_chunk_ == 0 ? time_ns : std::max(last_ns_, time_ns);
  ++in_chunk_;
  if (chunk_.size() >= kChunkBytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  Chunk chunk{first_ns_, last_ns_, at_, 0, 0, chunk_.size(), {}};
  std::string content;
  number(content, first_ns_);
  number(content, last_ns_);
  number(content, static_cast<std::uint64_t>(chunk_.size()));
  number(content, crc32_of(0, chunk_));
  text(content, "");  // not compressed
  number(content, static_cast<std::uint64_t>(chunk_.size()));
  content += chunk_;
  std::string bytes;
  record(bytes, kChunk, content);
  put(bytes);
  chunk.length = bytes.size();
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    auto& index = channels_[c].index;
    if (index.empty()) continue;
    std::stable_sort(index.begin(), index.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const auto id = static_cast<std::uint16_t>(c + 1);
    chunk.index_at.emplace_back(id, at_);
    std::string entries;
    for (const auto& [time, offset] : index) {
      number(entries, time);
      number(entries, offset);
    }
    content.clear();
    number(content, id);
    text(content, entries);
    bytes.clear();
    record(bytes, kMessageIndex, content);
    put(bytes);
    chunk.index_length += bytes.size();
    index.clear();
  }
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
  in_chunk_ = 0;
  first_ns_ = last_ns_ = 0;
}

void McapWriter::finish() {
  end_chunk();
  std::string content, bytes;
  number(content, crc_);
  record(bytes, kDataEnd, content);
  put(bytes);

  const std::uint64_t summary = at_;
  std::string all, offsets;
  const auto group = [&](Op op, auto&& fill) {
    const std::uint64_t begin = all.size();
    fill();
    if (all.size() == begin) return;
    std::string entry;
    entry += static_cast<char>(op);
    number(entry, summary + begin);
    number(entry, static_cast<std::uint64_t>(all.size()) - begin);
    record(offsets, kSummaryOffset, entry);
  };
  group(kSchema, [&] {
    for (const Channel& c : channels_) record(all, kSchema, c.schema);
  });
  group(kChannel, [&] {
    for (const Channel& c : channels_) record(all, kChannel, c.record);
  });
  group(kStatistics, [&] {
    std::uint64_t messages = 0, first = 0, last = 0;
    std::string counts;
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      messages += channels_[c].messages;
      number(counts, static_cast<std::uint16_t>(c + 1));
      number(counts, channels_[c].messages);
    }
    bool any = false;
    for (const Chunk& c : chunks_) {
      if (c.index_at.empty()) continue;
      first = any ? std::min(first, c.first_ns) : c.first_ns;
      last = std::max(last, c.last_ns);
      any = true;
    }
    content.clear();
    number(content, messages);
    number(content, static_cast<std::uint16_t>(channels_.size()));
    number(content, static_cast<std::uint32_t>(channels_.size()));
    number(content, std::uint32_t{0});  // attachments
    number(content, std::uint32_t{0});  // metadata
    number(content, static_cast<std::uint32_t>(chunks_.size()));
    number(content, first);
    number(content, last);
    text(content, counts);
    record(all, kStatistics, content);
  });
  group(kChunkIndex, [&] {
    for (const Chunk& c : chunks_) {
      content.clear();
      number(content, c.first_ns);
      number(content, c.last_ns);
      number(content, c.at);
      number(content, c.length);
      std::string index;
      for (const auto& [channel, at] : c.index_at) {
        number(index, channel);
        number(index, at);
      }
      text(content, index);
      number(content, c.index_length);
      text(content, "");
      number(content, c.size);
      number(content, c.size);
      record(all, kChunkIndex, content);
    }
  });
  const std::uint64_t offsets_at = summary + all.size();
  all += offsets;
  // The summary's CRC counts the footer up to itself.
  content.clear();
  number(content, summary);
  number(content, offsets_at);
  number(content, std::uint32_t{0});
  record(all, kFooter, content);
  all.resize(all.size() - sizeof(std::uint32_t));
  number(all, crc32_of(0, all));
  all.append(kMcapMagic);
  put(all);
}

}  // namespace osteo::inline session
