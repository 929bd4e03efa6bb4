// MCAP files (https://mcap.dev/spec), streamed: messages in chunks, each with its index; the summary at the end.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace osteo::inline session {

/// Laid out as the reference writers do: header; chunks of 768 KiB, uncompressed, with a CRC, each followed by an index
/// of its messages for each channel; data end with the CRC of all before; schemas, channels, statistics, chunk index,
/// summary offsets; footer with the summary's CRC. Memory: a chunk, and 60 bytes for each chunk written.
class McapWriter {
 public:
  using Out = std::function<void(std::string_view bytes)>;
  McapWriter(Out out, std::string_view library);
  /// Messages in JSON. Returns the channel's number.
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema_json,
                            const std::vector<std::pair<std::string, std::string>>& metadata);
  void message(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  void finish();

 private:
  struct Channel {
    std::string schema, record;  // contents of their records
    std::uint64_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  // time and offset of messages in this chunk
  };
  struct Chunk {
    std::uint64_t first_ns, last_ns, at, length, index_length, size;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> index_at;
  };
  void put(std::string_view bytes);
  void end_chunk();
  Out out_;
  std::uint64_t at_ = 0;
  std::uint32_t crc_ = 0;
  std::string chunk_;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;  // of the chunk
  std::size_t in_chunk_ = 0;
  std::vector<Channel> channels_;
  std::vector<Chunk> chunks_;
};

}  // namespace osteo::inline session
