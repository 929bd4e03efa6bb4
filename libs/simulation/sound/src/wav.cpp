#include "osteo/simulation/sound/wav.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "osteo/core/base/files.h"

namespace osteo::inline simulation {
namespace {

static_assert(std::endian::native == std::endian::little);

struct WavHeader {
  std::array<char, 4> riff{'R', 'I', 'F', 'F'};
  std::uint32_t bytes_after = 36;
  std::array<char, 8> wave{'W', 'A', 'V', 'E', 'f', 'm', 't', ' '};
  std::uint32_t format_bytes = 16;
  std::uint16_t pcm = 1, channels = 1;
  std::uint32_t rate_hz = 0, bytes_per_s = 0;
  std::uint16_t bytes_per_sample = 2, bits = 16;
  std::array<char, 4> data{'d', 'a', 't', 'a'};
  std::uint32_t data_bytes = 0;
};
static_assert(sizeof(WavHeader) == 44);

}  // namespace

void write_wav(const std::filesystem::path& out, int rate_hz,
               const std::function<bool(std::vector<float>& samples)>& next) {
  write_atomically(out, [&](const std::filesystem::path& temporary) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(temporary.c_str(), "wb"), &std::fclose);
    const auto write = [&](const void* data, std::size_t bytes) {
      if (file == nullptr || std::fwrite(data, 1, bytes, file.get()) != bytes)
        throw Error(ExitCode::cannot_write, "'" + out.string() + "' cannot be written: " + std::strerror(errno));
    };
    WavHeader header;
    header.rate_hz = static_cast<std::uint32_t>(rate_hz);
    header.bytes_per_s = 2 * header.rate_hz;
    write(&header, sizeof header);
    std::vector<float> samples;
    std::vector<std::int16_t> whole;
    std::uint64_t bytes = 0;
    while (samples.clear(), next(samples)) {
      whole.resize(samples.size());
      for (std::size_t i = 0; i < samples.size(); ++i)
        whole[i] = static_cast<std::int16_t>(std::lround(32767 * std::clamp(samples[i], -1.0F, 1.0F)));
      bytes += 2 * whole.size();
      if (bytes > 0xffffff00U)
        throw Error(ExitCode::resources, "a WAV file cannot hold more than 4 GB", "cut the session into parts");
      write(whole.data(), 2 * whole.size());
    }
    header.data_bytes = static_cast<std::uint32_t>(bytes);
    header.bytes_after += header.data_bytes;
    std::rewind(file.get());
    write(&header, sizeof header);
    if (std::fflush(file.get()) != 0)
      throw Error(ExitCode::cannot_write, "'" + out.string() + "' cannot be written: " + std::strerror(errno));
  });
}

}  // namespace osteo::inline simulation
