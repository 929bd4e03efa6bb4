// Sound as a file.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

namespace osteo::inline simulation {

/// One channel, 16 bits, little endian (RIFF/WAVE, PCM), whole or not at all. `next` fills in the samples that follow,
/// -1 to 1, and returns false behind the last. Errors: those of write_atomically; Error(resources) above 4 GB, which
/// are 12 hours at 48 kHz.
void write_wav(const std::filesystem::path& out, int rate_hz,
               const std::function<bool(std::vector<float>& samples)>& next);

}  // namespace osteo::inline simulation
