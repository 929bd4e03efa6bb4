// Makes a long session out of a short one, its minutes repeated, and opens it at random times.
// usage: long_sessions SESSION MINUTES OUT      (OUT: a new session folder; the case is where SESSION says)
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <random>

#include "osteo/session/scene/session_folder.h"

namespace {

// The same ticks again and again, numbered on.
void repeat(const osteo::SessionReader& session, double minutes, const std::filesystem::path& file) {
  const osteo::SessionHeader& header = session.header();
  osteo::SessionWriter writer(file, header);
  const auto wanted = static_cast<std::uint64_t>(minutes * 60 * header.rate_hz);
  std::uint64_t shift = 0, next = 0;
  while (next < wanted) {
    auto parts = session.parts();
    osteo::SessionBatch batch;
    const auto flush = [&] {
      for (osteo::TickRecord& t : batch.ticks) t.tick += shift;
      for (osteo::SceneAction& a : batch.actions) a.tick += shift;
      if (!batch.ticks.empty()) next = batch.ticks.back().tick + 1;
      writer.append(batch);
      batch = {};
    };
    while (const osteo::SessionPart* const p = parts.next()) {
      if (!p->actions.empty() || (!p->ticks.empty() && !batch.ticks.empty())) flush();
      batch.actions.insert(batch.actions.end(), p->actions.begin(), p->actions.end());
      batch.ticks.insert(batch.ticks.end(), p->ticks.begin(), p->ticks.end());
      batch.changes.insert(batch.changes.end(), p->changes.begin(), p->changes.end());
    }
    flush();
    shift = next;
  }
  writer.finish({next, "", "", 0, "", 0, 0});
  std::printf("%.1f minutes, %.1f MB: %.2f MB a minute\n", static_cast<double>(next) / header.rate_hz / 60,
              static_cast<double>(writer.bytes()) / 1e6,
              static_cast<double>(writer.bytes()) / 1e6 / (static_cast<double>(next) / header.rate_hz / 60));
}

// In real time, and of this process alone: other programs take their share of a busy machine.
struct Times {
  std::vector<double> wall_s, own_s;
  template <class F>
  void add(F&& f) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t own = std::clock();
    f();
    wall_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    own_s.push_back(static_cast<double>(std::clock() - own) / CLOCKS_PER_SEC);
  }
  void print(const char* what) {
    std::sort(wall_s.begin(), wall_s.end());
    std::sort(own_s.begin(), own_s.end());
    const auto at = [](const std::vector<double>& v, double share) {
      return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1))];
    };
    std::printf("%s: median %.2f s, p95 %.2f s; of that its own %.2f s, %.2f s\n", what, at(wall_s, 0.5),
                at(wall_s, 0.95), at(own_s, 0.5), at(own_s, 0.95));
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const osteo::Context context;
  const auto session = osteo::open_session_folder(argv[1]);
  const auto out = osteo::create_session_folder(argv[3], session.case_folder, {});
  repeat(osteo::SessionReader(session.stream()), std::atof(argv[2]), out.stream());
  const osteo::Case the_case = osteo::load_case(session.case_folder);
  const osteo::World start = osteo::world_of(the_case, {});
  std::mt19937 random(20);
  Times opened, whole;
  for (int n = 0; n < 20; ++n) {
    // Everything but the case: opening the file, finding its frames, making the scene.
    opened.add([&] {
      const osteo::SessionReader reader(out.stream());
      osteo::World world = start.copy();
      osteo::apply_recorded_until(reader, world, random() % reader.outline().tick_records);
    });
  }
  whole.add([&] {
    osteo::World end = start.copy();
    osteo::apply_recorded(osteo::SessionReader(out.stream()), end);
  });
  opened.print("opened at 20 random times");
  whole.print("all changes, without checkpoints");
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  std::printf("most memory %ld MB\n", usage.ru_maxrss / 1024);
  return 0;
}
