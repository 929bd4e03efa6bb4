// review: a session as a page that a person reads.
#include "osteo/assessment/review/review.h"

#include <ostream>

#include "commands/review.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"

namespace osteo {

cli::CommandInfo ReviewCommand::info() {
  return {"review",
          "a session as a page to read and to print: what was found, where it is seen, how it went over time",
          "Writes review.html (one page that asks nothing of any network), review.pdf and review.json into a folder: "
          "findings in words with "
          "pictures of what proves them, what was removed seen and unseen, a timeline to look through, force by "
          "distance, a view in 3D, and "
          "with "
          "--reference or --earlier how it stands beside other sessions. Figures are those of 'osteo score'. Of a "
          "damaged session what is "
          "there "
          "is shown, and the exit code is 4.",
          {{"session", "a session folder"}},
          "osteo review SESSION -o review --procedure mastoidectomy"};
}

int ReviewCommand::run(const Params& p, cli::Invocation& io) {
  const auto refuse = [&](bool given, const char* flag, const char* without) {
    if (given) throw Error(ExitCode::usage, std::string(flag) + " has no effect without " + without, "leave it out");
  };
  refuse(p.mirror && p.procedure.empty(), "--mirror", "--procedure");
  refuse(!p.subject.empty() && p.reference.empty(), "--subject", "--reference");
  if (p.out.empty()) throw Error(ExitCode::usage, "a review needs a folder to be written into", "-o FOLDER");
  // Before the work, not after it.
  may_write_review(p.out, io.common.force);
  ReviewRequest q;
  q.session = io.arguments[0];
  q.case_folder = p.case_folder;
  if (!p.procedure.empty()) {
    q.procedure = load_procedure(p.procedure);
    if (p.mirror) q.procedure = mirrored(std::move(*q.procedure));
  }
  q.reference = p.reference;
  q.subject = p.subject;
  std::string name;
  for (const char c : p.earlier + ",") {
    if (c != ',') {
      name += c;
      continue;
    }
    if (const std::string_view own = trimmed(name); !own.empty()) q.earlier.emplace_back(own);
    name.clear();
  }
  q.pictures = !p.no_pictures;
  // The page is for people; what is printed here and the JSON are for programs too.
  const Review review = [&] {
    const InLanguage theirs(language_of_environment());
    Review made = make_review(q, io.context);
    write_review(made, p.out, io.common.force);
    return made;
  }();
  io.end_progress();
  if (io.common.json) {
    Json j{{"folder", p.out}, {"findings", review.findings.list.size()}, {"pictures", review.pictures.size()}};
    j["labels"] = review.labels;
    j["left_out"] = review.left_out;
    io.out << j.dump(2) << '\n';
  } else if (!io.common.quiet) {
    for (const std::string& l : review.labels) io.out << l << '\n';
    for (const std::string& s : review.findings.summary) io.out << s << '\n';
    for (const std::string& w : review.findings.words) io.out << "note: " << w << '\n';
    for (const ScoreFinding& f : review.findings.list) {
      if (f.severity >= FindingSeverity::caution) io.out << name_of(f.severity) << ": " << f.text << '\n';
    }
    io.err << "written: " << (fs::path(p.out) / "review.html").string() << '\n';
  }
  return review.damaged ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
