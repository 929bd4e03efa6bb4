// The weights in a file of torch.save: a zip with a pickle, of which only tensors and plain containers are understood.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace osteo::inline imaging {

/// Values in row-major order.
struct NetworkTensor {
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};

struct Checkpoint {
  std::map<std::string, NetworkTensor> weights;  ///< without what the network lists twice; floating point alone
  std::string configuration;                     ///< "3d_fullres"
  std::vector<int> mirror_axes;                  ///< of the network's input, 0 is its slowest; empty: none
};

/// Bytes of a file: fills `to` from `offset`. The caller stays within the size.
struct ByteSource {
  std::uint64_t size = 0;
  std::function<void(std::uint64_t offset, std::span<std::byte> to)> read;
};

/// Nothing in the file is run: a class or function that is not a tensor's becomes a value without content. Memory: at
/// most twice the file's size in weights (16-bit numbers widen), and 0.5 GB for the pickle and the zip's directory.
/// Error(corrupt) says what is wrong.
[[nodiscard]] Checkpoint read_checkpoint(const ByteSource& source);
[[nodiscard]] Checkpoint read_checkpoint(const std::filesystem::path& path);

}  // namespace osteo::inline imaging
