// The sound card's thread must not wait for memory.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

#include "osteo/simulation/sound/synthesizer.h"

// Sanitizers have an allocator of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
namespace {
std::atomic<std::size_t> g_allocations{0};
}
void* operator new(std::size_t bytes) {
  ++g_allocations;
  if (void* const p = std::malloc(bytes > 0 ? bytes : 1)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

TEST(Synthesizer, RendersWithoutAllocating) {
  using namespace osteo;
  SoundState state;
  state.voices[0] = {SoundKind::burr, 60000, 4, 2, 0, 0, 0};
  state.voices[1] = {SoundKind::sucker, 0, 3, 0, 0, 0, 1};
  state.voices[2] = {SoundKind::irrigator, 0, 2, 0, 0, 0, 1};
  state.water = 0.5;
  state.alarm = SoundAlarm::touched;
  Synthesizer s;
  std::vector<float> out(Synthesizer::kBlock);
  const std::size_t before = g_allocations;
  EXPECT_GT(before, 0U);
  for (int i = 0; i < 100; ++i) {
    state.metal_n = i % 20 < 10 ? 1 : 0;
    s.render(state, 1, out);
  }
  s.render(state, 1, {});
  EXPECT_EQ(g_allocations, before);
}
#endif
