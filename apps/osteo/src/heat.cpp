// osteo heat: how warm a session made bone and structures.
#include <cmath>
#include <filesystem>

#include "commands/heat.h"
#include "osteo/assessment/review/heat_sheet.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/heat_reader.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

cli::CommandInfo HeatCommand::info() {
  return {"heat",
          "how warm a session made bone and critical structures",
          "Runs the session again and computes the heat of its burrs: conduction in bone, water that cools, the dose "
          "at each structure. The "
          "share of a burr's work that becomes heat in bone is known within a factor of ten at best, and temperatures "
          "follow it in "
          "proportion: nothing clinical follows from them (docs/validation/heat.md). Exit code 8 when ticks are "
          "missing: heat is "
          "computed up to "
          "there.",
          {{"session", "a session folder"}},
          "osteo heat SESSION"};
}

int HeatCommand::run(const Params& p, cli::Invocation& io) {
  const std::string kind = fs::path(p.report).extension().string();
  if (!p.report.empty() && kind != ".html" && kind != ".pdf")
    throw Error(ExitCode::usage, "'" + p.report + "' is neither .html nor .pdf", "--report heat.html");
  if (!p.report.empty() && fs::exists(p.report) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + p.report + "' exists already", "--force replaces it");
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  HapticSetup setup = outline.header.haptics;
  const Case the_case = load_case(folder.case_folder);
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  World world = world_at_begin(folder, the_case, anatomy, io.context);
  HeatOfCutting params;
  params.cutting_share = p.cutting_share;
  params.diamond_w_per_n = p.diamond_w_per_n;
  params.water_c = p.water_c;
  params.film_w_per_m2_k = p.film;
  params.cell_mm = p.cell_mm;
  HeatReader heat(world, anatomy.structures.get(), outline.header.rate_hz, params);
  if (!p.report.empty()) heat.keep_history();
  Reader* const readers[] = {&heat};
  const ReplayResult r = replay(session, std::move(world), anatomy, io.context, readers);
  io.end_progress();
  if (!p.report.empty()) {
    const Sheet sheet = review::heat_sheet(heat, anatomy.structures.get(), params, folder.folder.filename().string());
    write_file(p.report, kind == ".pdf" ? sheet_pdf(sheet) : sheet_html(sheet));
  }
  const auto tenths = [](double x) { return std::round(x * 10) / 10; };
  const auto minutes = [](double x) { return x < 1000 ? std::round(x * 100) / 100 : std::round(x); };
  const HeatLedger l = heat.ledger();
  Json j{{"hottest_c", tenths(heat.hottest_c())},
         {"added_j", l.added_j},
         {"chips_j", l.chips_j},
         {"cooled_j", l.cooled_j},
         {"forgotten_j", l.forgotten_j},
         {"left_j", heat.stored_j()},
         {"ticks", r.ticks_repeated},
         {"same_as_recorded", r.identical}};
  j["structures"] = Json::list();
  for (const auto& [value, s] : heat.structures()) {
    j["structures"].push_back({{"structure", anatomy.structures->name_of(value)},
                               {"value", static_cast<int>(value)},
                               {"peak_c", tenths(s.worst.peak_c)},
                               {"cem43_min", minutes(s.worst.cem43_min)},
                               {"coagulated", s.worst.coagulated},
                               {"share_over_16_min", s.share_over_limit}});
  }
  if (io.common.json) io.out << j.dump(2) << '\n';
  for (const std::string& line : r.losses) io.err << "session: " << line << '\n';
  if (!r.identical)
    io.err << "session: the replay differs from what was recorded (" << r.difference << "): neither may its heat\n";
  if (!io.common.quiet && !io.common.json) {
    for (const std::string& line : reported(heat, anatomy.structures.get())) io.out << line << '\n';
    io.out << "by assumption: " << format_number(p.cutting_share) << " of a cutting burr's work, "
           << format_number(p.diamond_w_per_n) << " W per N of a diamond burr\n";
  }
  return static_cast<int>(!outline.gaps.empty() ? ExitCode::partial
                          : outline.damaged()   ? ExitCode::corrupt
                                                : ExitCode::ok);
}

}  // namespace osteo
