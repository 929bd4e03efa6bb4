// study: people, sessions, ratings and what they show, in a folder of plain files.
#include <map>
#include <ostream>
#include <set>

#include "commands/study.h"
#include "osteo/assessment/study/analysis.h"
#include "osteo/assessment/study/study.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/report/sheet.h"
#include "scoring.h"
#ifdef OSTEO_WITH_RESEARCH
#include "study_demo.h"
#endif

namespace osteo {
namespace {

std::vector<std::string> names_in(const std::string& text) {
  std::vector<std::string> names;
  std::string name;
  for (const char c : text + ",") {
    if (c != ',') {
      name += c;
      continue;
    }
    if (const std::string_view own = trimmed(name); !own.empty()) names.emplace_back(own);
    name.clear();
  }
  return names;
}

// What an action takes beside --seed, --force and the like; anything else on the command line would do nothing.
const std::map<std::string, std::set<std::string>>& flags_of_actions() {
  static const std::map<std::string, std::set<std::string>> flags{
      {"new", {"title", "procedure", "groups", "competent", "cases", "items", "attempts", "lowest", "highest"}},
      {"plan", {"primary"}},
      {"add", {"participant", "group", "case_name", "attempt", "mirror", "accept"}},
      {"remove", {"participant", "case_name", "attempt"}},
      {"order", {}},
      {"form", {"rater"}},
      {"rate", {}},
      {"analyse", {"out", "resamples", "level", "given"}},
      {"demo", {"out", "resamples", "level", "no_movies"}},
  };
  return flags;
}

void need_known(const cli::Invocation& io, const std::string& action) {
  std::vector<std::string> actions;
  std::set<std::string> any;
  for (const auto& [name, flags] : flags_of_actions()) {
    actions.push_back(name);
    any.insert(flags.begin(), flags.end());
  }
  if (!flags_of_actions().contains(action)) {
    const std::string near = nearest_name(action, actions);
    throw Error(
        ExitCode::usage,
        "'" + action + "' is nothing that a study can do: new, plan, add, remove, order, form, rate, analyse or demo",
        near.empty() ? "" : "did you mean '" + near + "'?");
  }
  for (const std::string& flag : io.given) {
    if (!any.contains(flag) || flags_of_actions().at(action).contains(flag)) continue;
    std::string written = flag;
    for (char& c : written) c = c == '_' ? '-' : c;
    throw Error(ExitCode::usage, "--" + written + " does nothing with 'study " + action + "'");
  }
  const bool takes_file = action == "add" || action == "rate";
  if (io.arguments.size() > 2 && !takes_file)
    throw Error(ExitCode::usage, "'study " + action + "' takes no file: '" + io.arguments[2] + "'");
  if (io.arguments.size() < 3 && action == "rate")
    throw Error(ExitCode::usage, "'study rate' needs the file that the form saved", "osteo study rate STUDY R1.json");
}

// In a study's folder.
constexpr const char* kProcedure = "procedure.json";

void write_new(const fs::path& path, const std::string& content, bool force) {
  if (output_exists(path) && !force)
    throw Error(ExitCode::cannot_write, "'" + path.string() + "' is there already", "--force replaces it");
  write_file(path, content);
}

/// What an action says: as JSON, in a line, and what is worth knowing besides.
struct Result {
  Json done;
  std::string message;
  std::vector<std::string> notes;
};

/// A new study, with the procedure's file where one was given.
void make_new(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  study::Plan plan;
  plan.title = p.title;
  plan.procedure = p.procedure;
  plan.groups = names_in(p.groups);
  plan.cases = names_in(p.cases);
  plan.items = names_in(p.items);
  plan.competent = !p.competent.empty() || plan.groups.empty() ? p.competent : plan.groups.back();
  plan.attempts = p.attempts;
  plan.lowest = p.lowest;
  plan.highest = p.highest;
  plan.seed = static_cast<std::uint64_t>(io.common.seed);
  std::string file;
  const auto known = built_in_procedures();
  if (p.procedure.ends_with(".json") || std::find(known.begin(), known.end(), p.procedure) != known.end()) {
    file = procedure_text(p.procedure);
    plan.procedure = parse_procedure(file, p.procedure).name;
  }
  study::new_study(folder, plan);
  if (!file.empty()) write_file(folder / kProcedure, file);
  result.message = "made '" + folder.string() + "'; meant to pass: " + plan.competent + " (--competent says otherwise)";
}

/// A participant; their code is result.
void add_person(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  for (const char* const flag : {"case_name", "attempt", "mirror", "accept"}) {
    if (io.given.contains(flag))
      throw Error(ExitCode::usage, "which session, or file of its metrics?", "osteo study add STUDY SESSION ...");
  }
  const std::string code = study::add_participant(folder, p.participant, p.group);
  result.done["participant"] = code;
  result.message = code + " is in " + p.group;
}

/// A session, scored here, or a file of its metrics.
void add_measured(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  if (io.given.contains("group")) throw Error(ExitCode::usage, "--group is of a participant, not of a session");
  const fs::path file = io.arguments[2];
  const bool session = fs::is_directory(file);
  if (p.mirror && !session)
    throw Error(ExitCode::usage, "--mirror is of a session that is scored here, not of a file of metrics");
  study::Measurements measured;
  if (session) {
    ScoreAsked asked;
    if (fs::exists(folder / kProcedure)) asked.procedure = load_procedure(folder / kProcedure);
    if (p.mirror) {
      if (!asked.procedure)
        throw Error(ExitCode::usage, "--mirror has no effect: the study has no procedure's file",
                    "osteo study new ... --procedure FILE.json keeps one");
      asked.procedure = mirrored(std::move(*asked.procedure));
    }
    const Scored scored = score_folder(file, asked, io.context);
    io.end_progress();
    // The same text as 'osteo score --json' writes: one way in.
    measured = study::read_measurements(json_of(scored, false).dump(), file.string() + " (scored)", result.notes);
    for (const std::string& word : scored.score.words) result.notes.push_back("note: " + word);
  } else {
    measured = study::read_measurements(read_text(file), file.string(), result.notes);
  }
  const std::string blind =
      study::add_session(folder, p.participant, p.case_name, p.attempt, measured, names_in(p.accept), result.notes);
  result.done["blind"] = blind;
  result.message =
      "raters know the session as " + blind + ": its movie goes to " + (folder / "movies" / (blind + ".mp4")).string();
}

/// A participant, or one of their sessions.
void take_out(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  if (p.participant.empty())
    throw Error(ExitCode::usage, "nobody was named", "osteo study remove STUDY --participant CODE");
  if (io.given.contains("attempt") && p.case_name.empty())
    throw Error(ExitCode::usage, "--attempt is of a session: give its --case-name too");
  const study::Removed r = study::remove(folder, p.participant, p.case_name, p.attempt);
  result.done["sessions"] = r.sessions;
  result.done["ratings"] = r.ratings;
  result.done["movies"] = r.movies;
  result.done["forms"] = Json(r.forms);
  result.message = p.participant + (p.case_name.empty() ? " is out, with " : ": taken out ") +
                   std::to_string(r.sessions) + (r.sessions == 1 ? " session, " : " sessions, ") +
                   std::to_string(r.ratings) + " ratings and " + std::to_string(r.movies) + " movies";
  if (!r.forms.empty())
    result.notes.push_back(
        "forms were written again: who has an old one opens the new one and loads what was saved; the "
        "order is another");
  result.notes.push_back("the report is of before until it is made again; sessions' own folders are not touched");
}

/// Primary outcomes, and what can be found with them.
void plan_outcomes(const StudyCommand::Params& p, cli::Invocation& /*io*/, const fs::path& folder, Result& result) {
  if (!p.primary.empty()) study::set_primary(folder, names_in(p.primary));
  const study::Study study = study::read_study(folder);
  result.done["primary"] = Json(study.plan.primary);
  result.done["primary_after"] = study.plan.primary_after;
  result.done["reach"] = Json::list();
  if (study.plan.primary.empty())
    result.notes.emplace_back("no primary outcome is named: all columns will be corrected together");
  for (const study::Reach& r : study::reach_of(study)) {
    result.done["reach"].push_back(study::json_of(r));
    result.notes.push_back(study::reported(r));
  }
  result.message = "study.json: " + std::to_string(study.plan.primary.size()) + " primary outcomes";
}

/// The order of cases, for those who have none yet.
void extend_order(const StudyCommand::Params& /*p*/, cli::Invocation& /*io*/, const fs::path& folder, Result& result) {
  const std::size_t added = study::make_order(folder);
  result.done["added"] = added;
  result.message = "order.csv: " + std::to_string(added) + " people added";
}

/// A rater's form.
void write_form(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  const fs::path file = folder / "forms" / (p.rater + ".html");
  const std::string page = study::form_html(study::read_study(folder), p.rater);
  make_output_folder(folder / "forms");
  write_new(file, page, io.common.force);
  result.done["form"] = file.string();
  result.message = "open " + file.string() + " in a browser";
}

/// What a rater saved.
void take_ratings(const StudyCommand::Params& /*p*/, cli::Invocation& io, const fs::path& folder, Result& result) {
  const study::RaterSheet sheet =
      study::read_ratings(read_text(io.arguments[2]), io.arguments[2], study::read_study(folder), result.notes);
  make_output_folder(folder / "ratings");
  write_new(folder / "ratings" / (sheet.rater + ".json"), read_text(io.arguments[2]), io.common.force);
  result.done["rater"] = sheet.rater;
  result.message = sheet.rater + ": ratings of " + std::to_string(sheet.sessions.size()) + " sessions taken";
}

/// The analysis as page, PDF and JSON.
void write_report(const StudyCommand::Params& p, cli::Invocation& io, const fs::path& folder, Result& result) {
  const study::Study study = study::read_study(folder);
  const study::Analysis analysis = study::analyse(study, {p.level, p.resamples, names_in(p.given)});
  const std::string base = p.out.empty() ? (folder / "report").string() : p.out;
  // The report follows from the folder; one that is there is replaced, as that of a case is, unless it was put
  // elsewhere.
  const bool replace = p.out.empty() || io.common.force;
  for (const char* const suffix : {".json", ".html", ".pdf"}) {
    if (!replace && output_exists(base + suffix))
      throw Error(ExitCode::cannot_write, "'" + base + suffix + "' is there already", "--force replaces it");
  }
  write_file(base + ".json", analysis.json.dump(2) + "\n");
  write_file(base + ".html", sheet_html(analysis.sheet));
  write_file(base + ".pdf", sheet_pdf(analysis.sheet));
  for (const Json& r : analysis.json.find("refused")->items())
    result.notes.push_back("not computed: " + *r.find("what")->text() + ". " + *r.find("why")->text());
  result.done = analysis.json;
  result.message = base + ".html, .pdf and .json";
}

int run_demo(const StudyCommand::Params& p, cli::Invocation& io) {
  if (io.arguments.size() > 1 && !p.out.empty())
    throw Error(ExitCode::usage, "the demo's folder is given twice", "leave -o out");
  if (io.arguments.size() < 2 && p.out.empty())
    throw Error(ExitCode::usage, "the demo needs a folder", "osteo study demo -o FOLDER");
#ifdef OSTEO_WITH_RESEARCH
  return run_study_demo(io.arguments.size() > 1 ? io.arguments[1] : p.out, p.resamples, p.level, !p.no_movies, io);
#else
  throw Error(ExitCode::usage, "this build has no simulated trainees, by whom the demo's sessions are made",
              "build with -DOSTEO_RESEARCH=ON");
#endif
}

}  // namespace

cli::CommandInfo StudyCommand::info() {
  return {
      "study",
      "a study: people by code, order of cases, sessions, ratings, analysis",
      "Keeps a study as a folder of plain files. 'new' makes it; 'plan' names the primary outcomes and says what so "
      "many people can find; 'add' takes a participant (--group), or a session, which it scores and keeps with what "
      "distinguishes it from others (also what 'osteo score' wrote of one, as JSON or CSV); 'remove' takes a person or "
      "a "
      "session out, ratings and movies too; 'order' draws who does which case when; 'form' writes a page to rate "
      "sessions with, "
      "in any browser and "
      "without a network; 'rate' takes what it saved; 'analyse' writes what the study shows: agreement of raters, "
      "differences of groups "
      "with effect sizes and intervals, correlation of metrics with ratings, ROC, pass marks and power, as JSON, HTML "
      "and PDF. What "
      "there is too little for is not computed, and the report says why. 'demo' makes a whole study by simulated "
      "trainees, labelled so, "
      "with "
      "blinded movies and forms for raters (--no-movies leaves the movies out, as does a build without them); "
      "stopped and begun again it goes on where it was. Random choices follow the study's own seed, given to 'new'. "
      "docs/guides/study.md defines every number and says what may not be concluded.",
      {{"action", "new, plan, add, remove, order, form, rate, analyse or demo"},
       {"study", "its folder; of a demo also by -o", true},
       {"file", "add: a session's folder, or its metrics (.json, .csv); rate: ratings that the form saved", true}},
      "osteo study analyse STUDY"};
}

int StudyCommand::run(const Params& p, cli::Invocation& io) {
  const std::string action = io.arguments[0];
  need_known(io, action);
  if (action == "demo") return run_demo(p, io);
  if (io.arguments.size() < 2)
    throw Error(ExitCode::usage, "'study " + action + "' needs the study's folder", "osteo study " + action + " STUDY");
  const fs::path folder = io.arguments[1];
  if (io.given.contains("seed") && action != "new")
    throw Error(ExitCode::usage, "--seed does nothing here: the study has its own",
                "it is in " + (folder / "study.json").string());
  using Action = void (*)(const Params&, cli::Invocation&, const fs::path&, Result&);
  static const std::map<std::string, Action> actions{
      {"new", make_new},    {"remove", take_out},   {"plan", plan_outcomes},  {"order", extend_order},
      {"form", write_form}, {"rate", take_ratings}, {"analyse", write_report}};
  Result result{{{"action", action}}, {}, {}};
  if (action == "add") {
    (io.arguments.size() < 3 ? add_person : add_measured)(p, io, folder, result);
  } else {
    actions.at(action)(p, io, folder, result);
  }
  if (io.common.json) {
    if (!result.notes.empty() && action != "analyse") result.done["notes"] = Json(result.notes);
    io.out << result.done.dump(2) << '\n';
  }
  if (!io.common.quiet) {
    for (const std::string& note : result.notes) io.err << note << '\n';
    if (!io.common.json) io.err << result.message << '\n';
  }
  return 0;
}

}  // namespace osteo
