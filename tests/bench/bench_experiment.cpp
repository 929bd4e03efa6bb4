// Time of an alignment of 1000 x 1000 with its path, on one core, beside the plain recurrence. Writes the curves for
// peers. usage: experiment_bench [FOLDER]; then tests/bench/experiment_peers.py FOLDER
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "osteo/assessment/experiment/participant.h"
#include "osteo/assessment/experiment/recall.h"
#include "osteo/assessment/experiment/trial.h"
#include "osteo/core/base/simd.h"

using namespace osteo;
using namespace osteo::experiment;

namespace {
double best_ms(int rounds, auto&& work) {
  double best = 1e300;
  for (int r = 0; r < rounds; ++r) {
    const auto begun = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
  }
  return best;
}
}  // namespace

int main(int argc, char** argv) {
  Protocol p;
  p.participants = {"P01"};
  SimulatedParticipant person({}, 5);
  std::printf("instructions: %s\ntrial  score  by      ms      plain ms  same\n",
              std::string(simd_name(simd())).c_str());
  static constexpr const char* kBy[] = {"band", "matrix"};
  const auto trials = trials_of(p, 0);
  for (const std::size_t n : {std::size_t{0}, std::size_t{5}, std::size_t{8}, std::size_t{40}, std::size_t{71}}) {
    const Stimulus s = stimulus_of(p, trials[n]);
    const TrialScore score = score_trial("P01", s, simulate_trial(p, trials[n], s, person));
    const Recall& r = score.recall;
    const double rate = 999 / r.seconds;
    const auto ts = slopes(r.target_n, rate), as = slopes(r.applied_n, rate);
    const Curve target{r.target_n, ts, {}}, applied{r.applied_n, as, {}};
    Aligner aligner;
    Alignment plain;
    const double fast_ms = best_ms(300, [&] { (void)aligner.align(target, applied); });
    const double plain_ms = best_ms(5, [&] { plain = align_plainly(target, applied); });
    Aligner whole({}, 1);
    const double whole_ms = best_ms(100, [&] { (void)whole.align(target, applied); });
    const Alignment& a = aligner.align(target, applied);
    std::printf("%5zu  %.3f  %-6s  %.3f   %.2f      %s   whole matrix %.3f ms\n", n + 1, r.score,
                kBy[static_cast<int>(a.by)], fast_ms, plain_ms,
                a.cost_n == plain.cost_n && a.path.size() == plain.path.size() ? "yes" : "NO", whole_ms);
    if (argc > 1) {
      std::filesystem::create_directories(argv[1]);
      std::ofstream out(std::filesystem::path(argv[1]) / ("trial-" + std::to_string(n + 1) + ".csv"));
      out << fast_ms << '\n';
      for (std::size_t i = 0; i < r.target_n.size(); ++i) out << r.target_n[i] << ',' << r.applied_n[i] << '\n';
    }
  }
  return 0;
}
