// score: a session as figures, each with what it comes from.
#include "osteo/assessment/evidence/score.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>

#include "case_series.h"
#include "commands/score.h"
#include "osteo/assessment/scoring/hint_reader.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/session_folder.h"
#include "scoring.h"

namespace osteo {

cli::CommandInfo ScoreCommand::info() {
  return {"score",
          "a session as figures: what was seen, how hard was pressed near what, what is left",
          "One line a metric on standard output, or all of it with the moments it comes from as JSON. What cannot be "
          "measured says why. "
          "With --procedure also the items of its scale, each with value, threshold and margin; with --reference "
          "compared with sessions of "
          "others on the same case. Thresholds are starting values, not fitted to rated sessions "
          "(docs/validation/evidence.md "
          "says what may not be "
          "concluded). Of a damaged session what is there is scored, and the exit code is 4.",
          {{"session", "a session folder"}},
          "osteo score SESSION --procedure mastoidectomy",
          false,
          {},
          {"csv", "measures"},
          {"procedure", "segmentation", "scan"}};
}

namespace {

Reference load_sessions(const fs::path& folder, const SessionFolder& mine, const Case& the_case, const Anatomy& anatomy,
                        const std::string& bone_hash, const Context& context) {
  Reference reference;
  const std::vector<ReferenceSession> list = load_reference(folder);
  for (std::size_t n = 0; n < list.size(); ++n) {
    const SessionFolder other = open_session_folder(folder / list[n].session, mine.case_folder);
    if (!other.guided.empty())
      throw Error(ExitCode::usage,
                  "session '" + list[n].session + "' of the reference is no work of its own: " + other.guided,
                  "a reference is of unaided sessions: leave it out of reference.json");
    const SessionReader session(other.stream(), Damage::keep);
    World begin = world_at_begin(other, the_case, anatomy, context);
    if (begin.hash() != bone_hash || session.header().bone_hash != bone_hash)
      throw Error(ExitCode::usage,
                  "session '" + list[n].session + "' of the reference was recorded on another bone than this one",
                  "a reference is of one case: leave it out of reference.json");
    context.progress(static_cast<double>(n) / static_cast<double>(list.size()), "reading the reference");
    reference.sessions.push_back(read_reference(session, std::move(begin), anatomy.structures.get(), list[n]));
  }
  return reference;
}

}  // namespace

namespace {

// `anatomy`: as it was recorded with; `structures`: as they are scored.
void add_heat(const SessionReader& session, World begin, const Anatomy& anatomy, const StructureMap* structures,
              Score& score, const Context& context) {
  HeatReader heat(begin, structures, session.header().rate_hz);
  Reader* const readers[] = {&heat};
  const ReplayResult again = replay(session, std::move(begin), anatomy, context, readers);
  for (Measured& m : heat_values(heat, structures)) score.values.push_back(std::move(m));
  if (!again.identical)
    score.words.push_back("run again the replay differs from what was recorded (" + again.difference +
                          "): neither may its heat");
  if (again.ticks_repeated < again.ticks)
    score.words.push_back("heat is known only up to where the first ticks are missing");
}

}  // namespace

Scored score_folder(const fs::path& session_folder, const ScoreAsked& asked, const Context& context) {
  const SessionFolder folder = open_session_folder(session_folder, asked.case_folder);
  // Scores of guided sessions never stand among those of unaided ones: neither compared nor in a table.
  if (!folder.guided.empty() && (!asked.reference.empty() || asked.for_table))
    throw Error(ExitCode::usage, "this session is no work of its own: " + folder.guided,
                "score it without --reference and --csv; sessions that nobody guided may be compared");
  const Case the_case = load_case(folder.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  // Hardness matters to who runs it again.
  HapticSetup setup;
  setup.hardness = false;
  if (asked.heat) setup = session.header().haptics;
  setup.opened = asked.procedure ? asked.procedure->opened() : session.header().haptics.opened;
  const Anatomy anatomy = anatomy_of(the_case, setup, context);
  World begin = world_at_begin(folder, the_case, anatomy, context);
  std::optional<World> again;
  if (asked.heat) again = begin.copy();
  const std::vector<PlannedCut> planned = planned_cuts_of(folder.case_folder);
  ScoreDetail detail;
  std::optional<Reference> reference;
  const bool compares = !asked.reference.empty();
  if (compares)
    reference =
        load_sessions(asked.reference, folder, the_case, anatomy, session.header().bone_hash, context.sub(0, 0.5));
  Scored scored{
      score_session(session, std::move(begin), anatomy.structures.get(), asked.procedure ? &*asked.procedure : nullptr,
                    reference ? &*reference : nullptr, asked.subject,
                    context.sub(compares ? 0.5 : 0, asked.heat ? 0.6 : 1), planned.empty() ? nullptr : &detail),
      folder.folder.filename().string(), folder.guided, session.outline().damaged()};
  Score& score = scored.score;
  score.source.stream = hash_path(folder.stream()).substr(0, 16);
  score.source.scored_by = program_version();
  score.source.guided = !folder.guided.empty();
  // Sessions before this one may have sawn too: held against the case's own bone.
  if (detail.end) {
    for (Measured& m : planned_cut_values(world_of(the_case, anatomy), *detail.end, planned))
      score.values.push_back(std::move(m));
  }
  if (again) {
    Anatomy recorded = anatomy;
    if (setup.opened != session.header().haptics.opened) {
      HapticSetup as_recorded = session.header().haptics;
      recorded = anatomy_of(the_case, as_recorded, context);
    }
    add_heat(session, std::move(*again), recorded, anatomy.structures.get(), score, context.sub(0.6, 1));
  }
  if (session.header().haptics.structures != setup.structures)
    score.words.push_back(
        "the case's structures are not those that the session watched: they are measured as the case has them now");
  if (!folder.guided.empty())
    score.words.push_back("guided: " + folder.guided + "; not to be compared with unaided sessions");
  if (std::string words = simulated_text(session); !words.empty())
    score.words.insert(score.words.begin(), std::move(words));
  return scored;
}

Json json_of(const Scored& scored, bool evidence) {
  Json j = score_json(scored.score, evidence);
  if (!scored.guided.empty()) j["guided"] = scored.guided;
  return j;
}

namespace {

// Values by what they are of, then the items of the scale. The session's folder may be named after who rehearsed, so it
// is called by the hash of its file.
std::vector<ScoredGroup> groups_of(const Scored& scored, const std::vector<MeasuredStructure>& structures) {
  std::vector<ScoredGroup> groups{{"Rehearsal " + scored.score.source.stream.substr(0, 8), {}, {}, {}}};
  const auto group_of = [&](const std::string& of) -> ScoredGroup& {
    const std::string name = of.empty() ? groups.front().name : groups.front().name + ": " + of;
    const auto found = std::find_if(groups.begin(), groups.end(), [&](const ScoredGroup& g) { return g.name == name; });
    if (found != groups.end()) return *found;
    const bool structure = std::ranges::any_of(structures, [&](const auto& s) { return s.name == of; });
    return groups.emplace_back(ScoredGroup{name, structure ? of : std::string(), {}, {}});
  };
  for (const Measured& m : scored.score.values)
    if (m.value) group_of(m.of).numbers.push_back({std::string(m.row->name), *m.value, std::string(m.row->unit)});
  if (scored.score.items.empty()) return groups;
  ScoredGroup& scale = groups.emplace_back(ScoredGroup{"Scale " + scored.score.procedure, {}, {}, {}});
  for (const Product::Result& r : scored.score.items) {
    if (!r.measured) continue;
    scale.numbers.push_back({r.item->name, r.value, r.unit});
    scale.verdicts.push_back({r.item->name + " passed", r.pass});
  }
  return groups;
}

// What limits it, and what has no value, by the reason.
std::vector<std::string> remarks_of(const Score& score) {
  std::map<std::string, std::string> absent;
  const auto add = [&](const std::string& name, const std::string& why) {
    std::string& names = absent[why];
    names += (names.empty() ? "" : ", ") + name;
  };
  for (const Measured& m : score.values)
    if (!m.value) add(m.name(), m.word);
  for (const Product::Result& r : score.items)
    if (!r.measured) add(r.item->name, r.word);
  std::vector<std::string> remarks = score.words;
  for (const auto& [why, names] : absent) remarks.push_back("Not measured, " + why + ": " + names);
  return remarks;
}

// The score goes where the case's scan is: of the patient, into the study.
void write_measures(const fs::path& session, const ScoreCommand::Params& p, const Scored& scored, cli::Invocation& io) {
  const AuditTrail trail;
  const SessionFolder folder = open_session_folder(session, p.case_folder);
  const CaseSeries of =
      series_of(folder.case_folder, pipeline_at_hand(folder.case_folder, read_recipe(folder.case_folder), p.scan), io);
  MeasuresReport report = measures_of_case(folder.case_folder, p.segmentation, io.context);
  report.scores = groups_of(scored, report.structures);
  report.remarks = remarks_of(scored.score);
  save_measures_report(report, p.measures, {of.series, "Score of a rehearsal, not for diagnosis"}, io.context);
  handed_over(trail, folder.case_folder, p.measures, io);
}

}  // namespace

int ScoreCommand::run(const Params& p, cli::Invocation& io) {
  const auto refuse = [&](bool given, const char* flag, const char* without) {
    if (given) throw Error(ExitCode::usage, std::string(flag) + " has no effect without " + without, "leave it out");
  };
  refuse(p.mirror && p.procedure.empty(), "--mirror", "--procedure");
  refuse(!p.subject.empty() && p.reference.empty(), "--subject", "--reference");
  refuse(p.evidence && !io.common.json, "--evidence", "--json");
  refuse(!p.segmentation.empty() && p.measures.empty(), "--segmentation", "--measures");
  refuse(!p.scan.empty() && p.measures.empty(), "--scan", "--measures");
  check_object(p.measures, io.arguments[0] + ".score.dcm", "--measures", io);
  ScoreAsked asked{{}, p.reference, p.subject, p.heat, p.case_folder, !p.csv.empty()};
  if (!p.procedure.empty()) {
    asked.procedure = load_procedure(p.procedure);
    if (p.mirror) asked.procedure = mirrored(std::move(*asked.procedure));
  }
  if (!p.csv.empty() && fs::exists(p.csv) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + p.csv + "' exists already", "--force replaces it");
  const Scored scored = score_folder(io.arguments[0], asked, io.context);
  io.end_progress();
  const Score& score = scored.score;
  if (!p.measures.empty()) write_measures(io.arguments[0], p, scored, io);
  if (!p.csv.empty()) write_file(p.csv, score_csv(score, scored.name));
  if (io.common.json) {
    io.out << json_of(scored, p.evidence).dump(2) << '\n';
  } else {
    io.out << score_lines(score);
  }
  if (!io.common.quiet) {
    const auto s = [](double x) { return format_number(std::round(x * 100) / 100) + " s"; };
    io.err << "scored in " << s(score.seconds_frames + score.seconds_product) << ", " << s(score.seconds_product)
           << " of it for the final product\n";
  }
  return scored.damaged ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
