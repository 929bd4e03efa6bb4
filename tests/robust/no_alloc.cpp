// The servo neither allocates nor locks: every way to do so is counted while a tick runs. The first case proves that
// the counting works.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <cmath>
#include <mutex>

#include "osteo/simulation/haptics/servo.h"
#include "slab.h"

namespace {
thread_local bool watched = false;
thread_local int offences = 0;
void offence() {
  if (watched) ++offences;
}
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
void* malloc(std::size_t n) {
  offence();
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t m) {
  offence();
  return __libc_calloc(n, m);
}
void* realloc(void* p, std::size_t n) {
  offence();
  return __libc_realloc(p, n);
}
void* memalign(std::size_t a, std::size_t n) {
  offence();
  return __libc_memalign(a, n);
}
void* aligned_alloc(std::size_t a, std::size_t n) {
  offence();
  return __libc_memalign(a, n);
}
void free(void* p) {
  if (p != nullptr) offence();
  __libc_free(p);
}
int pthread_mutex_lock(pthread_mutex_t* m) {
  offence();
  static int (*const real)(pthread_mutex_t*) =
      reinterpret_cast<int (*)(pthread_mutex_t*)>(::dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  return real(m);
}
int pthread_cond_wait(pthread_cond_t* c, pthread_mutex_t* m) {
  offence();
  static auto* const real =
      reinterpret_cast<int (*)(pthread_cond_t*, pthread_mutex_t*)>(::dlsym(RTLD_NEXT, "pthread_cond_wait"));
  return real(c, m);
}
}
#else
#define OSTEO_NOT_COUNTED 1
#endif

namespace osteo {
namespace {

TEST(Counting, SeesAllocationAndLock) {
#ifdef OSTEO_NOT_COUNTED
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  std::mutex m;
  offences = 0;
  watched = true;
  int* volatile p = new int(3);  // volatile: or the compiler leaves both out
  delete p;
  const int memory = offences;
  m.lock();
  m.unlock();
  watched = false;
  EXPECT_GE(memory, 2);
  EXPECT_GT(offences, memory);
}

// Two plates below the bone's face.
std::shared_ptr<const StructureMap> some_structures() {
  Labels labels;
  labels.frame.dims = {30, 30, 30};
  labels.frame.origin_mm = {-15, -15, -20};
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (std::size_t n = 0; n < labels.frame.voxel_count(); ++n) v[n] = n / 900 == 16 ? 1 : n / 900 == 18 ? 2 : 0;
  labels.voxels = v;
  return std::make_shared<const StructureMap>(labels);
}

TEST(Servo, NeitherAllocatesNorLocks) {
#ifdef OSTEO_NOT_COUNTED
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  for (const ContactMethod method :
       {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap, ContactMethod::proxy}) {
    auto bone = test::slab(0.5);
    HapticSetup setup;
    setup.params.contact.method = method;
    setup.device = SpringHand::traits();
    setup.curve = {{-5, 0, 1}, {0, 3, 0}, {5, 0, 1}};
    const auto hardness = std::make_shared<const Hardness>(bone, to_sparse(bone, "hu"));
    // A burr, and beside it a sucker, another burr and a probe.
    setup.more_devices.assign(3, SpringHand::traits());
    HapticRenderer renderer(setup, bone, {hardness, nullptr, some_structures()}, 1e-3);
    Stream stream;
    auto& reader = stream.add_reader(1 << 15, 1 << 22);
    Strokes script;
    script.axis = {0.6, 0, 0.8};
    for (int i = 0; i <= 40; ++i)
      script.waypoints.push_back({0.1 * i, {4 * std::sin(i), 4 * std::cos(i), 4 - 0.2 * i}, i % 5 != 0});
    std::vector<std::unique_ptr<ScriptedDevice>> devices;
    std::vector<Device*> hands;
    for (const int tool : {3, instrument_index("sucker 8 Fr"), 10, instrument_index("probe 1 mm")}) {
      script.tool = tool;
      hands.push_back(devices.emplace_back(std::make_unique<ScriptedDevice>(script, 1000)).get());
      for (auto& w : script.waypoints) w.at_mm.x += 1.5;
    }
    ::osteo::Servo servo(renderer, hands, stream, 1000);
    // Settings change and a scene is handed over in between.
    HapticsParams softer = setup.params;
    softer.contact.stiffness_n_per_mm = 1;
    const Handover handover{SceneAction::setting(static_cast<std::uint32_t>(setting_number("stiffness_n_per_mm")), 1),
                            nullptr, false, &softer};
    offences = 0;
    watched = true;
    while (servo.step(0)) {
      if (servo.ticks() == 2000) servo.post(&handover);
    }
    watched = false;
    EXPECT_EQ(renderer.stiffness_n_per_mm(3), 1);
    EXPECT_EQ(offences, 0) << EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)];
    EXPECT_EQ(reader.dropped, 0u);
    EXPECT_EQ(servo.ticks(), 4000u);
  }
}

}  // namespace
}  // namespace osteo
