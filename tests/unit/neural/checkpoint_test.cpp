#include "osteo/imaging/neural/detail/checkpoint.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "golden.h"
#include "osteo/core/base/files.h"

namespace osteo {
namespace {

std::vector<std::byte> checkpoint_bytes() {
  return read_file(source_folder() / "testdata/neural/flat/fold_0/checkpoint_final.pth");
}

// What was asked for beyond the file's end is counted: the reader may not do so.
Checkpoint read(const std::vector<std::byte>& bytes) {
  ByteSource source;
  source.size = bytes.size();
  source.read = [&](std::uint64_t offset, std::span<std::byte> to) {
    ASSERT_LE(offset + to.size(), bytes.size());
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), to.size(), to.begin());
  };
  return read_checkpoint(source);
}

std::string refusal(const std::vector<std::byte>& bytes) {
  try {
    static_cast<void>(read(bytes));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::corrupt);
    return error.what();
  }
  return "";
}

std::size_t find(const std::vector<std::byte>& bytes, std::string_view text) {
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t at = all.find(text);
  EXPECT_NE(at, std::string_view::npos) << text;
  return at;
}

TEST(NetworkCheckpoint, HoldsWhatTheTrainingSaved) {
  const Checkpoint c = read(checkpoint_bytes());
  EXPECT_EQ(c.configuration, "2d");
  EXPECT_EQ(c.mirror_axes, (std::vector<int>{0, 1}));
  EXPECT_EQ(c.weights.at("encoder.stages.1.0.convs.0.conv.weight").shape, (std::vector<std::int64_t>{20, 8, 3, 3}));
  EXPECT_EQ(c.weights.at("decoder.seg_layers.0.bias").values.size(), 3U);
  for (const auto& [name, tensor] : c.weights) {
    EXPECT_EQ(name.find("all_modules"), std::string::npos);
    EXPECT_EQ(name.find("num_batches"), std::string::npos);
  }
}

TEST(NetworkCheckpoint, WhatIsNoCheckpointIsRefused) {
  EXPECT_NE(refusal({}).find("no zip"), std::string::npos);
  EXPECT_NE(refusal(std::vector<std::byte>(100)).find("no zip"), std::string::npos);
  auto bytes = checkpoint_bytes();
  bytes.resize(bytes.size() / 2);
  EXPECT_NE(refusal(bytes), "");
  bytes = checkpoint_bytes();
  std::memcpy(bytes.data() + find(bytes, "network_weights"), "netwerk_weights", 15);
  EXPECT_NE(refusal(bytes).find("no network_weights"), std::string::npos);
}

// A class by another name is carried along as a value without content, and missed only where a tensor is wanted.
TEST(NetworkCheckpoint, NothingIsCalled) {
  auto bytes = checkpoint_bytes();
  std::memcpy(bytes.data() + find(bytes, "ctorch._utils\n_rebuild_tensor_v2"), "cposix.......\nsystem............", 32);
  EXPECT_NE(refusal(bytes).find("is no tensor"), std::string::npos);
}

TEST(NetworkCheckpoint, ATensorBeyondItsValuesIsRefused) {
  auto bytes = checkpoint_bytes();
  // The shape (8, 1, 3, 3) of the first weight: its 8 becomes 9.
  const std::size_t at = find(bytes, std::string_view("(K\x08K\x01K\x03K\x03", 9));
  bytes[at + 2] = std::byte{9};
  EXPECT_NE(refusal(bytes).find("lies beyond its values"), std::string::npos);
}

TEST(NetworkCheckpoint, MutationsAreReadOrRefused) {
  const auto whole = checkpoint_bytes();
  const std::size_t pickle = find(whole, "network_weights"), directory = whole.size() - 3000;
  std::mt19937 random(11);
  int refused = 0, read_well = 0;
  for (int n = 0; n < mutations(); ++n) {
    auto bytes = whole;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int c = 0; c < changes; ++c) {
      const std::size_t from = n % 2 == 0 ? pickle : directory, span = n % 2 == 0 ? 6000 : 3000;
      bytes[std::min(from + random() % span, bytes.size() - 1)] = static_cast<std::byte>(random());
    }
    if (n % 5 == 0) bytes.resize(random() % bytes.size());
    try {
      const Checkpoint c = read(bytes);
      std::size_t values = 0;
      for (const auto& [name, tensor] : c.weights) values += tensor.values.size();
      EXPECT_LE(values * 2, bytes.size());
      ++read_well;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::corrupt);
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
  EXPECT_GT(read_well, 20);
}

}  // namespace
}  // namespace osteo
