// study demo: a whole study by simulated trainees, from a phantom's CT to the report, in one go.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <ostream>

#include "built_in_pipelines.h"
#include "commands/prepare.h"
#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/study/analysis.h"
#include "osteo/assessment/study/study.h"
#include "osteo/assessment/trainee/group.h"
#include "osteo/assessment/trainee/simulate.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/report/sheet.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/imaging/image/crop.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "study_demo.h"

#ifdef OSTEO_WITH_MOVIE
#include "osteo/assessment/movie/movie.h"
#endif

namespace osteo {
namespace {

// As many as took part in D. Morris 2006, section 3.3: eight with experience and seven without, two sessions each.
constexpr int kExperts = 8, kNovices = 7, kAttempts = 2;
constexpr const char* kCase = "left-ear";
constexpr double kWindowMm = 3.5;  // so that a session takes a minute or two

struct Job {
  std::string name, participant;  // no participant: a session of the reference
  int attempt = 1;
  TraineeGroup group = TraineeGroup::novice;
  TraineeSkill skill;
  std::uint64_t seed = 1;
};

// A part of the phantom's left ear, coarse enough for many sessions.
void make_case(const fs::path& folder, cli::Invocation& io) {
  if (fs::exists(folder / "case" / "manifest.json")) return;
  make_output_folder(folder / "scan");
  PhantomParams params;
  params.region = PhantomRegion::temporal;
  params.spacing_mm = 0.8;
  const Phantom phantom = make_phantom(params, io.context.sub(0, 0.04));
  const Box box{{42, -8, -55}, {78, 38, -15}};
  save_image(crop(phantom.ct, box), folder / "scan" / "ct.nrrd");
  save_labels(crop(phantom.labels, box), folder / "scan" / "labels.nrrd");
  PrepareCommand::Params prepare;
  prepare.out = (folder / "case").string();
  prepare.lower = 500;
  prepare.spacing_mm = 0.8;
  prepare.structures = (folder / "scan" / "labels.nrrd").string();
  prepare.names = "6=facial nerve, 7=sigmoid sinus, 12=labyrinth, 17=air cells, 18=external ear canal";
  prepare.fresh = prepare.no_report = true;
  const auto arguments = std::exchange(io.arguments, {(folder / "scan" / "ct.nrrd").string()});
  const auto given = std::exchange(io.given, {"lower", "spacing_mm", "structures", "names", "fresh", "no_report"});
  const bool quiet = std::exchange(io.common.quiet, true), json = std::exchange(io.common.json, false);
  PrepareCommand::run(prepare, io);
  io.arguments = arguments;
  io.given = given;
  io.common.quiet = quiet;
  io.common.json = json;
}

std::string time_left(double seconds) {
  if (seconds < 90) return format_number(std::max(1.0, std::round(seconds))) + " s left";
  return format_number(std::ceil(seconds / 60)) + " min left";
}

// Of a session's score what a study is about: one name each, without what belongs to a single structure.
Json metrics_of(const Score& score) {
  Json all = Json::object();
  double excess = 0;
  bool has_excess = false;
  for (const Measured& m : score.values) {
    if (!m.value) continue;
    const std::string_view name = m.row->name;
    if (name == "excess_force_ns") {
      excess += *m.value;
      has_excess = true;
    }
    for (const char* const kept : {"seen_share", "hidden_mm3", "force_p95_n", "region_per_voxel", "region_thesis",
                                   "burr_choice_share", "camera_moves", "path_mm", "duration_s", "items_passed"}) {
      if (name == kept && m.of.empty()) all[name] = *m.value;
    }
  }
  if (has_excess) all["excess_force_ns"] = excess;
  return all;
}

#ifdef OSTEO_WITH_MOVIE
// Small and short, so that all of them take a minute or two. One speed for everybody: how long a session took stays to
// be seen.
MovieOptions for_raters() {
  MovieOptions o;
  o.width = 320;
  o.height = 240;
  o.fps = 10;
  o.speed = 15;
  o.camera = MovieCamera::fixed;
  o.overlay = false;
  return o;
}
#endif

// movies/BLIND.mp4 of every session, made in the first rater's order: the files' own times tell neither people nor
// groups. Those that are there are kept. What could not be made is told in `notes`.
std::size_t make_movies([[maybe_unused]] const fs::path& folder, [[maybe_unused]] const study::Study& rated,
                        [[maybe_unused]] const std::string& rater, [[maybe_unused]] const TraineeScene& scene,
                        [[maybe_unused]] cli::Invocation& io, std::vector<std::string>& notes) {
#ifdef OSTEO_WITH_MOVIE
  const std::vector<std::string> order = study::rating_order(rated, rater);
  make_output_folder(folder / "movies");
  for (std::size_t n = 0; n < order.size(); ++n) {
    const fs::path file = folder / "movies" / (order[n] + ".mp4");
    if (fs::exists(file)) continue;
    io.context.check_cancelled();
    io.context.progress(0.85 + 0.11 * static_cast<double>(n) / static_cast<double>(order.size()),
                        "movie " + std::to_string(n + 1) + " of " + std::to_string(order.size()));
    const auto which =
        std::find_if(rated.sessions.begin(), rated.sessions.end(), [&](const auto& s) { return s.blind == order[n]; });
    const fs::path session = folder / "sessions" / (which->participant + "-" + std::to_string(which->attempt));
    try {
      write_atomically(file, [&](const fs::path& temporary) {
        make_movie(SessionReader(session / "stream.oss"), world_of(scene.the_case, scene.anatomy), scene.anatomy,
                   for_raters(), temporary);
      });
    } catch (const Error& e) {
      // A computer without OpenGL or without room for movies still gets its study.
      if (e.code() == ExitCode::cancelled) throw;
      notes.push_back("no more movies after " + std::to_string(n) + " of " + std::to_string(order.size()) + ": " +
                      e.what());
      return n;
    }
  }
  return order.size();
#else
  notes.emplace_back("no movies: this build is without them (OSTEO_MOVIE is off)");
  return 0;
#endif
}

/// A new study in a new folder; in one of a demo that was stopped, the same study goes on.
void begin_study(const fs::path& folder, std::uint64_t seed) {
  if (output_exists(folder) && !fs::is_empty(folder)) {
    if (!fs::exists(folder / "study.json") || !study::read_study(folder).plan.simulated)
      throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds something that is no simulated study",
                  "give another folder");
    if (study::read_study(folder).plan.seed != seed)
      throw Error(ExitCode::usage, "the study in '" + folder.string() + "' was begun with another --seed",
                  "give that seed, or another folder");
    return;
  }
  make_output_folder(folder.parent_path().empty() ? fs::path(".") : folder.parent_path());
  study::Plan plan;
  plan.title = "window into the mastoid";
  plan.procedure = "Window into the mastoid (pipelines/procedures/mastoid-window.json)";
  plan.groups = {"novice", "expert"};
  plan.competent = "expert";
  plan.cases = {kCase};
  plan.attempts = kAttempts;
  plan.seed = seed;
  plan.simulated = true;
  study::new_study(folder, plan);
}

/// Sessions of the reference and of the participants, who are in the study after it.
std::vector<Job> jobs_of(const fs::path& folder, std::uint64_t seed) {
  std::vector<Job> jobs;
  // As many others are the reference: fewer say too little of where experts drill (docs/validation/trainee.md).
  for (int n = 0; n < kExperts + kNovices; ++n) {
    const TraineeGroup group = n < kExperts ? TraineeGroup::expert : TraineeGroup::novice;
    const std::string code = (n < kExperts ? "RE" : "RN") + std::to_string(n < kExperts ? n + 1 : n + 1 - kExperts);
    const std::uint64_t person = seed * 1000 + 900 + static_cast<std::uint64_t>(n);
    jobs.push_back({code, "", 1, group, person_skill(group, person), person});
  }
  const study::Study before = study::read_study(folder);
  for (int n = 0; n < kExperts + kNovices; ++n) {
    const TraineeGroup group = n < kNovices ? TraineeGroup::novice : TraineeGroup::expert;
    const std::string code = "SIM" + std::to_string(101 + n).substr(1);
    const auto known = [&](const study::Participant& p) { return p.code == code; };
    if (std::none_of(before.participants.begin(), before.participants.end(), known))
      study::add_participant(folder, code,
                             std::string(EnumNames<TraineeGroup>::values[static_cast<std::size_t>(group)]));
    for (int attempt = 1; attempt <= kAttempts; ++attempt)
      jobs.push_back({code + "-" + std::to_string(attempt), code, attempt, group,
                      person_skill(group, seed * 1000 + static_cast<std::uint64_t>(n)),
                      seed * 1000 + 100 + static_cast<std::uint64_t>(2 * n + attempt)});
  }
  study::make_order(folder);
  return jobs;
}

/// Those that are not there yet. Returns how many were drilled now.
std::size_t drill_sessions(const std::vector<Job>& jobs, const fs::path& sessions, const TraineeScene& scene,
                           cli::Invocation& io) {
  make_output_folder(sessions);
  std::mutex mutex;
  std::size_t done = 0, fresh = 0;
  const auto drilling = std::chrono::steady_clock::now();
  parallel_for(jobs.size(), 1, io.common.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      // trainee.json is written last: a session without it was stopped half-way, and is made again.
      const fs::path place = sessions / jobs[i].name;
      const bool there = fs::exists(place / "trainee.json");
      if (!there) {
        io.context.check_cancelled();
        fs::remove_all(place);
        TraineeOptions o;
        o.skill = jobs[i].skill;
        o.seed = jobs[i].seed;
        o.plan.radius_mm = kWindowMm;
        // Begun together with others, in threads of its own: told of being stopped, but silent.
        (void)simulate_trainee(scene, world_of(scene.the_case, scene.anatomy), o,
                               create_session_folder(place, scene.the_case.folder, {}));
      }
      const std::lock_guard lock(mutex);
      ++done;
      fresh += there ? 0 : 1;
      const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - drilling).count();
      // Scores, ratings and the report take about a third as long again.
      const double left =
          fresh == 0 ? 0 : took / static_cast<double>(fresh) * static_cast<double>(jobs.size() - done) * 1.4;
      io.context.progress(0.06 + 0.64 * static_cast<double>(done) / static_cast<double>(jobs.size()),
                          "session " + std::to_string(done) + " of " + std::to_string(jobs.size()) +
                              (fresh > 0 ? ", " + time_left(left) : ""));
    }
  });
  return fresh;
}

/// Regions and forces are held against sessions of people who do not take part.
Reference make_reference(const std::vector<Job>& jobs, const fs::path& folder, const TraineeScene& scene) {
  Reference reference;
  Json list = Json::list();
  for (const Job& j : jobs) {
    if (!j.participant.empty()) continue;
    const ReferenceSession which{"../sessions/" + j.name, j.name,
                                 j.group == TraineeGroup::expert ? ReferenceGroup::expert : ReferenceGroup::novice};
    reference.sessions.push_back(read_reference(SessionReader(folder / "sessions" / j.name / "stream.oss"),
                                                world_of(scene.the_case, scene.anatomy), scene.anatomy.structures.get(),
                                                which));
    list.push_back({{"session", which.session},
                    {"subject", which.subject},
                    {"group", j.group == TraineeGroup::expert ? "expert" : "novice"}});
  }
  make_output_folder(folder / "reference");
  write_file(folder / "reference" / "reference.json",
             Json{{"osteotome_reference", 1}, {"sessions", list}}.dump(2) + "\n");
  return reference;
}

/// Those that the study does not hold yet.
void score_sessions(const std::vector<Job>& jobs, const fs::path& folder, const TraineeScene& scene,
                    const Reference& reference, cli::Invocation& io) {
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const Job& j = jobs[i];
    if (j.participant.empty()) continue;
    const study::Study now = study::read_study(folder);
    if (std::any_of(now.sessions.begin(), now.sessions.end(),
                    [&](const study::Session& s) { return s.participant == j.participant && s.attempt == j.attempt; }))
      continue;
    io.context.progress(0.7 + 0.15 * static_cast<double>(i) / static_cast<double>(jobs.size()), "scoring " + j.name);
    const fs::path place = folder / "sessions" / j.name, file = place / "metrics.json";
    const Score score = score_session(SessionReader(place / "stream.oss"), world_of(scene.the_case, scene.anatomy),
                                      scene.anatomy.structures.get(), &scene.procedure, &reference, j.participant);
    Json source = *score_json(score, false).find("source");
    source["stream"] = hash_path(place / "stream.oss").substr(0, 16);
    source["scored_by"] = program_version();
    const std::string text = Json{{"source", source}, {"metrics", metrics_of(score)}}.dump(2) + "\n";
    write_file(file, text);
    // A demo that goes on may have been begun by another version.
    study::add_session(folder, j.participant, kCase, j.attempt, study::read_measurements(text, file.string(), notes),
                       {"program"}, notes);
  }
}

/// Forms, and ratings by programs that know the skill: each has a severity of its own, and errs.
void rate_sessions(const std::vector<Job>& jobs, const fs::path& folder, const study::Study& rated,
                   std::uint64_t seed) {
  make_output_folder(folder / "forms");
  make_output_folder(folder / "ratings");
  for (int r = 1; r <= 2; ++r) {
    const std::string rater = "SIMULATED-" + std::to_string(r);
    statistics::Random random(seed * 77 + static_cast<std::uint64_t>(r));
    const double severe = 0.3 * random.normal();
    Json rows = Json::list();
    for (const study::Session& s : rated.sessions) {
      const auto job = std::find_if(jobs.begin(), jobs.end(), [&](const Job& j) {
        return j.participant == s.participant && j.attempt == s.attempt;
      });
      if (job == jobs.end()) continue;
      const double value =
          std::clamp(std::round(0.2 + 5.2 * overall(job->skill) - severe + 0.5 * random.normal()), 1.0, 5.0);
      rows.push_back({{"session", s.blind}, {"item", "overall"}, {"value", static_cast<int>(value)}});
    }
    write_file(folder / "forms" / (rater + ".html"), study::form_html(rated, rater));
    write_file(
        folder / "ratings" / (rater + ".json"),
        Json{{"osteotome_ratings", 1}, {"study", study::study_id(rated.plan)}, {"rater", rater}, {"ratings", rows}}
                .dump(2) +
            "\n");
  }
}

}  // namespace

int run_study_demo(const std::string& name, int resamples, double level, bool movies, cli::Invocation& io) {
  const auto begun = std::chrono::steady_clock::now();
  const fs::path folder = name;
  const auto seed = static_cast<std::uint64_t>(io.common.seed);
  begin_study(folder, seed);
  io.context.progress(0, "the case");
  make_case(folder, io);
  const std::vector<Job> jobs = jobs_of(folder, seed);
  const TraineeScene scene = trainee_scene(folder / "case", parse_procedure(kMastoidWindow, "mastoid-window.json"),
                                           io.context.sub(0.04, 0.06));
  const std::size_t fresh = drill_sessions(jobs, folder / "sessions", scene, io);
  score_sessions(jobs, folder, scene, make_reference(jobs, folder, scene), io);
  const study::Study rated = study::read_study(folder);
  rate_sessions(jobs, folder, rated, seed);
  std::vector<std::string> notes;
  const std::size_t shown = movies ? make_movies(folder, rated, "SIMULATED-1", scene, io, notes) : 0;
  io.context.progress(0.96, "analysis");
  const study::Analysis analysis = study::analyse(study::read_study(folder), {level, resamples, {}});
  write_file(folder / "report.json", analysis.json.dump(2) + "\n");
  write_file(folder / "report.html", sheet_html(analysis.sheet));
  write_file(folder / "report.pdf", sheet_pdf(analysis.sheet));
  io.end_progress();
  if (io.common.json) io.out << analysis.json.dump(2) << '\n';
  if (!io.common.quiet) {
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    io.err << "simulated study of " << kExperts + kNovices << " trainees, " << fresh << " sessions drilled in "
           << format_number(std::round(took)) << " s: " << (folder / "report.html").string() << ", .pdf and .json\n";
    for (const std::string& note : notes) io.err << note << '\n';
    if (shown > 0)
      io.err << "raters get the folders 'forms' and 'movies' (" << shown
             << " blinded movies, 15 times as fast; --no-movies leaves them out); everything else here is the key, and "
                "not for them\n";
    io.err << "It shows that the chain works, and nothing about people.\n";
  }
  return 0;
}

}  // namespace osteo
