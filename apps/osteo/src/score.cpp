// score: a session as figures, each with what it comes from.
#include "osteo/evidence/score.h"

#include <cmath>
#include <ostream>

#include "commands.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/scene/session_folder.h"

namespace osteo {

cli::CommandInfo ScoreCommand::info() {
  return {"score",
          "a session as figures: what was seen, how hard was pressed near what, what is left",
          "One line a metric on standard output, or all of it with the moments it comes from as JSON. What cannot be measured says why. "
          "With --procedure also the items of its scale, each with value, threshold and margin; with --reference compared with sessions of "
          "others on the same case. Thresholds are starting values, not fitted to rated sessions (docs/evidence.md says what may not be "
          "concluded). Of a damaged session what is there is scored, and the exit code is 4.",
          {{"session", "a session folder"}},
          "osteo score SESSION --procedure pipelines/procedures/mastoidectomy.json"};
}

namespace {

Reference load_sessions(const fs::path& folder, const SessionFolder& mine, const Case& the_case, const Anatomy& anatomy,
                        const std::string& bone_hash, const Context& context) {
  Reference reference;
  const std::vector<ReferenceSession> list = load_reference(folder);
  for (std::size_t n = 0; n < list.size(); ++n) {
    const SessionFolder other = open_session_folder(folder / list[n].session, mine.case_folder);
    const SessionReader session(other.stream(), Damage::keep);
    World begin = world_at_begin(other, the_case, anatomy, context);
    if (begin.hash() != bone_hash || session.header().bone_hash != bone_hash)
      throw Error(ExitCode::usage, "session '" + list[n].session + "' of the reference was recorded on another bone than this one",
                  "a reference is of one case: leave it out of reference.json");
    context.progress(static_cast<double>(n) / static_cast<double>(list.size()), "reading the reference");
    reference.sessions.push_back(read_reference(session, std::move(begin), anatomy.structures.get(), list[n]));
  }
  return reference;
}

}  // namespace

int ScoreCommand::run(const Params& p, cli::Invocation& io) {
  const auto refuse = [&](bool given, const char* flag, const char* without) {
    if (given) throw Error(ExitCode::usage, std::string(flag) + " has no effect without " + without, "leave it out");
  };
  refuse(p.mirror && p.procedure.empty(), "--mirror", "--procedure");
  refuse(!p.subject.empty() && p.reference.empty(), "--subject", "--reference");
  refuse(p.evidence && !io.common.json, "--evidence", "--json");
  std::optional<Procedure> procedure;
  if (!p.procedure.empty()) {
    procedure = load_procedure(p.procedure);
    if (p.mirror) procedure = mirrored(std::move(*procedure));
  }
  if (!p.csv.empty() && fs::exists(p.csv) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + p.csv + "' exists already", "--force replaces it");
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const Case the_case = load_case(folder.case_folder);
  HapticSetup setup;
  setup.hardness = false;
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  const SessionReader session(folder.stream(), Damage::keep);
  World begin = world_at_begin(folder, the_case, anatomy, io.context);
  std::optional<Reference> reference;
  if (!p.reference.empty())
    reference = load_sessions(p.reference, folder, the_case, anatomy, session.header().bone_hash, io.context.sub(0, 0.5));
  Score score = score_session(session, std::move(begin), anatomy.structures.get(), procedure ? &*procedure : nullptr,
                              reference ? &*reference : nullptr, p.subject, io.context.sub(p.reference.empty() ? 0 : 0.5, 1));
  if (session.header().haptics.structures != setup.structures)
    score.words.push_back("the case's structures are not those that the session watched: they are measured as the case has them now");
  io.end_progress();
  if (!p.csv.empty()) write_file(p.csv, score_csv(score, folder.folder.filename().string()));
  if (io.common.json) {
    io.out << score_json(score, p.evidence).dump(2) << '\n';
  } else {
    io.out << score_lines(score);
  }
  if (!io.common.quiet) {
    const auto s = [](double x) { return format_number(std::round(x * 100) / 100) + " s"; };
    io.err << "scored in " << s(score.seconds_frames + score.seconds_product) << ", " << s(score.seconds_product)
           << " of it for the end product\n";
  }
  return session.outline().damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
