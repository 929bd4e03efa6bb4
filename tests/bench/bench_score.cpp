// What it costs to keep the score of a session, and to judge what it left: what docs/validation/evidence.md holds. Not
// a test.
//   build/release/bin/score_bench SESSION PROCEDURE
// Processor time, so that it tells the same on a machine that is busy otherwise; the best of three.
#include <ctime>

#include <algorithm>
#include <iostream>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/scoring/hint_reader.h"
#include "osteo/session/scene/session_folder.h"

using namespace osteo;

namespace {

double cpu_s(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "score_bench SESSION PROCEDURE\n";
    return 2;
  }
  try {
    const SessionFolder folder = open_session_folder(argv[1], "");
    double t = cpu_s(CLOCK_PROCESS_CPUTIME_ID);
    const Case the_case = load_case(folder.case_folder);
    HapticSetup setup;
    setup.hardness = false;
    const Anatomy anatomy = anatomy_of(the_case, setup, {});
    const World begin = world_at_begin(folder, the_case, anatomy, {});
    std::cout << "reading the case, distances to structures: " << cpu_s(CLOCK_PROCESS_CPUTIME_ID) - t
              << " s of all threads\n";
    const SessionReader session(folder.stream(), Damage::keep);
    const Procedure procedure = load_procedure(argv[2]);
    const double rate_hz = session.header().rate_hz;
    double least_keeper = 1e9, least_hints = 1e9, least_all = 1e9, least_product = 1e9, length_s = 0;
    for (int round = 0; round < 3; ++round) {
      ScoreKeeper keeper({rate_hz, anatomy.structures.get(), &procedure});
      HintReader hints(usual_hints(), rate_hz, anatomy.structures.get(), true);
      double in_keeper = 0, in_hints = 0;
      std::uint64_t ticks = 0;
      t = cpu_s(CLOCK_THREAD_CPUTIME_ID);
      const World end = report_frames(session, begin.copy(), [&](const EvidenceFrame& f) {
        const double a = cpu_s(CLOCK_THREAD_CPUTIME_ID);
        keeper.frame(f);
        const double b = cpu_s(CLOCK_THREAD_CPUTIME_ID);
        hints.resync(f.world);
        if (f.camera != nullptr) hints.look_from(f.camera->eye_mm);
        for (const SceneAction& action : f.actions) hints.action(action);
        for (const TickRecord& tick : f.ticks) hints.tick(tick, {});
        hints.update();
        in_keeper += b - a;
        in_hints += cpu_s(CLOCK_THREAD_CPUTIME_ID) - b;
        ticks += f.ticks.size();
      });
      least_all = std::min(least_all, cpu_s(CLOCK_THREAD_CPUTIME_ID) - t - in_hints);
      least_keeper = std::min(least_keeper, in_keeper);
      least_hints = std::min(least_hints, in_hints);
      length_s = static_cast<double>(ticks) / rate_hz;
      keeper.finish(end);
      std::vector<RemovedVoxel> removed;
      for (const auto& [name, voxel] : keeper.removed()) removed.push_back(voxel);
      Context one_thread;
      one_thread.threads = 1;
      t = cpu_s(CLOCK_PROCESS_CPUTIME_ID);
      const Product product(begin, end, *anatomy.structures, procedure, std::move(removed), one_thread);
      std::size_t measured = 0;
      for (const ScaleItem& item : procedure.items)
        measured += product.evaluate(item, keeper.approach(), {}).measured ? 1 : 0;
      measured += product.regions().size();
      least_product = std::min(least_product, cpu_s(CLOCK_PROCESS_CPUTIME_ID) - t);
      std::cout << "round " << round + 1 << ": " << measured << " items and regions measured on cubes of "
                << product.spacing_mm() << " mm\n";
    }
    const auto share = [&](double s) { return 100 * s / length_s; };
    std::cout << "the session: " << length_s << " s\n"
              << "all metrics, frame by frame: " << least_keeper << " s, " << share(least_keeper)
              << " % of a core while it ran\n"
              << "the same with frames made and the file read: " << least_all << " s, " << share(least_all) << " %\n"
              << "hints: " << least_hints << " s, " << share(least_hints) << " %\n"
              << "final product: " << least_product << " s\n";
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
  return 0;
}
