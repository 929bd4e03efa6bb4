// Makes a long session out of a short one, its minutes repeated, and opens it at random times.
// usage: long_sessions SESSION MINUTES OUT      (OUT: a new session folder; the case is where SESSION says)
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "osteo/scene/session_folder.h"

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
      if (!p->actions.empty() || !p->ticks.empty()) flush();
      batch.actions.insert(batch.actions.end(), p->actions.begin(), p->actions.end());
      batch.ticks.insert(batch.ticks.end(), p->ticks.begin(), p->ticks.end());
      batch.changes.insert(batch.changes.end(), p->changes.begin(), p->changes.end());
    }
    flush();
    shift = next;
  }
  writer.finish({next, "", "", 0, "", 0, 0});
  std::printf("%.1f minutes, %.1f MB: %.2f MB a minute\n", static_cast<double>(next) / header.rate_hz / 60,
              static_cast<double>(writer.bytes()) / 1e6, static_cast<double>(writer.bytes()) / 1e6 / (static_cast<double>(next) / header.rate_hz / 60));
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

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
  std::vector<double> times;
  for (int n = 0; n < 20; ++n) {
    // Everything but the case: opening the file, finding its frames, making the scene.
    const auto begin = std::chrono::steady_clock::now();
    const osteo::SessionReader reader(out.stream());
    osteo::World world = start.copy();
    osteo::apply_recorded_until(reader, world, random() % reader.outline().tick_records);
    times.push_back(seconds_since(begin));
  }
  std::sort(times.begin(), times.end());
  const auto begin = std::chrono::steady_clock::now();
  osteo::World end = start.copy();
  osteo::apply_recorded(osteo::SessionReader(out.stream()), end);
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  std::printf("opened at 20 random times: median %.2f s, p95 %.2f s, most %.2f s; all changes without checkpoints %.2f s; most memory %ld MB\n",
              times[10], times[18], times[19], seconds_since(begin), usage.ru_maxrss / 1024);
  return 0;
}
