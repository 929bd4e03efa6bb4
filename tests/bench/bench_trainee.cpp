// Simulated trainees of drawn skill, each scored against sessions of simulated experts and novices: what
// docs/validation/trainee.md holds. Not a test.
//   build/release/bin/trainee_bench CASE PROCEDURE FOLDER RUNS PEOPLE ALONE
// RUNS sessions with every skill drawn by itself (Latin hypercube), PEOPLE people in each of two groups with two
// sessions each, and of each of kAlone ALONE sessions in which it alone goes through its range, the rest an expert's.
// Writes FOLDER/runs.json, people.json, alone.json: skills, metrics, items and the trainee's own truth;
// tests/bench/trainee_table.py makes the tables. What is there already is not done again.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>

#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/trainee/group.h"
#include "osteo/assessment/trainee/simulate.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/statistics/basics.h"

using namespace osteo;

namespace {

constexpr std::pair<const char*, double TraineeSkill::*> kAlone[] = {{"undercut", &TraineeSkill::undercut},
                                                                     {"force_control", &TraineeSkill::force_control},
                                                                     {"region", &TraineeSkill::region}};

struct Job {
  fs::path folder;
  std::string name;
  TraineeSkill skill;
  std::uint64_t seed = 1;
};

void drill(const TraineeScene& scene, const Job& job) {
  if (fs::exists(job.folder / "trainee.json")) return;
  fs::remove_all(job.folder);
  TraineeOptions o;
  o.skill = job.skill;
  o.seed = job.seed;
  o.most_s = 150;
  o.plan.radius_mm = 3.5;
  (void)simulate_trainee(scene, world_of(scene.the_case, scene.anatomy), o,
                         create_session_folder(job.folder, scene.the_case.folder, {}));
}

Json scored(const TraineeScene& scene, const Job& job, const Reference& reference) {
  const fs::path kept = job.folder / "scored.json";
  if (!fs::exists(kept)) {
    const SessionReader session(job.folder / "stream.oss");
    const Score score = score_session(session, world_of(scene.the_case, scene.anatomy), scene.anatomy.structures.get(),
                                      &scene.procedure, &reference, job.name);
    write_file(kept, score_json(score, false).dump());
  }
  return Json::parse(read_text(kept)).value();
}

void write_table(const fs::path& file, const std::vector<Job>& jobs, const std::vector<Json>& scores) {
  Json all = Json::list();
  for (std::size_t i = 0; i < jobs.size(); ++i)
    all.push_back({{"name", jobs[i].name},
                   {"skill", skill_json(jobs[i].skill)},
                   {"score", scores[i]},
                   {"trainee", Json::parse(read_text(jobs[i].folder / "trainee.json")).value()}});
  write_file(file, all.dump(1) + "\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) {
    std::cerr << "trainee_bench CASE PROCEDURE FOLDER RUNS PEOPLE ALONE\n";
    return 2;
  }
  try {
    const TraineeScene scene = trainee_scene(argv[1], load_procedure(argv[2]));
    const fs::path folder = argv[3];
    make_output_folder(folder);
    const int runs = std::stoi(argv[4]), people = std::stoi(argv[5]), alone = std::stoi(argv[6]);
    std::vector<Job> reference_jobs, run_jobs, people_jobs, alone_jobs;
    // As many as took part in D. Morris 2006, section 3.3.
    constexpr int kReferenceExperts = 8, kReference = 15;
    for (int n = 0; n < kReference; ++n) {
      const bool expert = n < kReferenceExperts;
      const std::string name = (expert ? "RE" : "RN") + std::to_string(expert ? n + 1 : n + 1 - kReferenceExperts);
      reference_jobs.push_back(
          {folder / name, name, person_skill(expert ? TraineeGroup::expert : TraineeGroup::novice, 900 + n), 900U + n});
    }
    const std::vector<TraineeSkill> drawn = latin_hypercube(static_cast<std::size_t>(runs), 7);
    for (int n = 0; n < runs; ++n) {
      const std::string name = "run" + std::to_string(n + 1);
      run_jobs.push_back({folder / name, name, drawn[static_cast<std::size_t>(n)], 100U + n});
    }
    for (int n = 0; n < 2 * people; ++n) {
      const bool expert = n < people;
      const TraineeSkill skill = person_skill(expert ? TraineeGroup::expert : TraineeGroup::novice, 500 + n);
      for (int attempt = 1; attempt <= 2; ++attempt) {
        const std::string name = (expert ? "E" : "N") + std::to_string(n % people + 1) + "-" + std::to_string(attempt);
        people_jobs.push_back({folder / name, name, skill, 1000U + 2U * n + attempt});
      }
    }
    for (const auto& [name, member] : kAlone) {
      for (int n = 0; n < alone; ++n) {
        TraineeSkill skill;
        skill.*member = static_cast<double>(n) / std::max(1, alone - 1);
        const std::string run = std::string(name) + std::to_string(n + 1);
        alone_jobs.push_back({folder / run, run, skill, 3000U + n});
      }
    }
    std::vector<Job> all = reference_jobs;
    all.insert(all.end(), run_jobs.begin(), run_jobs.end());
    all.insert(all.end(), people_jobs.begin(), people_jobs.end());
    all.insert(all.end(), alone_jobs.begin(), alone_jobs.end());
    std::mutex mutex;
    std::size_t done = 0;
    parallel_for(all.size(), 1, 0, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        drill(scene, all[i]);
        const std::lock_guard lock(mutex);
        std::cerr << "drilled " << ++done << " of " << all.size() << std::endl;
      }
    });
    Reference reference;
    for (std::size_t n = 0; n < reference_jobs.size(); ++n)
      reference.sessions.push_back(read_reference(
          SessionReader(reference_jobs[n].folder / "stream.oss"), world_of(scene.the_case, scene.anatomy),
          scene.anatomy.structures.get(),
          {reference_jobs[n].name, reference_jobs[n].name,
           n < static_cast<std::size_t>(kReferenceExperts) ? ReferenceGroup::expert : ReferenceGroup::novice}));
    for (const auto& [jobs, file] : {std::pair{run_jobs, "runs.json"}, std::pair{people_jobs, "people.json"},
                                     std::pair{alone_jobs, "alone.json"}}) {
      std::vector<Json> scores(jobs.size());
      const auto& these = jobs;
      parallel_for(these.size(), 1, 0, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
          scores[i] = scored(scene, these[i], reference);
          const std::lock_guard lock(mutex);
          std::cerr << "scored " << these[i].name << std::endl;
        }
      });
      write_table(folder / file, these, scores);
    }
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
  return 0;
}
