#include "osteo/simulation/sound/wav.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "osteo/core/base/files.h"
#include "scratch.h"

namespace osteo {
namespace {

TEST(Wav, IsWhatReadersExpect) {
  const test::ScratchFolder folder;
  int blocks = 0;
  write_wav(folder / "a.wav", 48000, [&](std::vector<float>& samples) {
    samples = {0, 0.5F, -1, 2};
    return ++blocks <= 3;
  });
  const std::vector<std::byte> file = read_file(folder / "a.wav");
  ASSERT_EQ(file.size(), 44U + 3 * 4 * 2);
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::uint32_t n = 0;
    std::memcpy(&n, file.data() + at, bytes);
    return n;
  };
  EXPECT_EQ(std::memcmp(file.data(), "RIFF", 4), 0);
  EXPECT_EQ(number(4, 4), file.size() - 8);
  EXPECT_EQ(number(22, 2), 1U);
  EXPECT_EQ(number(24, 4), 48000U);
  EXPECT_EQ(number(28, 4), 96000U);
  EXPECT_EQ(number(40, 4), file.size() - 44);
  EXPECT_EQ(static_cast<std::int16_t>(number(46, 2)), 16384);
  EXPECT_EQ(static_cast<std::int16_t>(number(48, 2)), -32767);
  EXPECT_EQ(static_cast<std::int16_t>(number(50, 2)), 32767);
}

TEST(Wav, WholeOrNotAtAll) {
  const test::ScratchFolder folder;
  EXPECT_THROW(write_wav(folder / "a.wav", 48000,
                         [](std::vector<float>&) -> bool { throw Error(ExitCode::corrupt, "in the middle"); }),
               Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.wav"));
  EXPECT_THROW(write_wav(folder.path() / "none" / "a.wav", 48000, [](std::vector<float>&) { return false; }), Error);
  try {
    write_wav("/dev/full", 48000, [](std::vector<float>&) { return false; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cannot_write);
  }
}

}  // namespace
}  // namespace osteo
