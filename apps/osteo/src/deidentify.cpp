// deidentify: objects without what identifies a person.
#include "osteo/hospital/pacs/deidentify.h"

#include <map>
#include <ostream>

#include "osteo/core/base/json_document.h"
#include "osteo/hospital/pacs/audit.h"
#include "pacs_commands.h"

namespace osteo {

std::map<std::string, std::size_t> reported_refusals(const DeidentifyReport& report, cli::Invocation& io) {
  std::map<std::string, std::size_t> why;
  std::map<std::string, std::string> first;
  for (const NotDeidentified& r : report.refused)
    if (why[r.why]++ == 0) first[r.why] = r.file.filename().string();
  for (const auto& [reason, n] : why)
    io.err << n << " objects left out: " << reason << ", the first: " << first[reason] << '\n';
  return why;
}

cli::CommandInfo DeidentifyCommand::info() {
  return {"deidentify",
          "copies of DICOM objects without what identifies a person",
          "Basic Application Level Confidentiality Profile of PS3.15 Annex E (2026c), without options: dates, names, "
          "numbers, descriptions and "
          "private attributes go, UIDs are replaced so that a study stays one study. Pixels are not changed: a face "
          "can be made from a scan of "
          "a head. What may have words in its pixels, and what is no scan or segmentation, is left out (exit code 8). "
          "The originals stay as "
          "they are.",
          {{"source", "a file or a folder"}},
          "osteo deidentify CT -o OUT"};
}

int DeidentifyCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty()) throw Error(ExitCode::usage, "no folder is named for the result", "-o OUT");
  const auto unused = [&](const fs::path& folder) {
    if (output_exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
      throw Error(ExitCode::cannot_write, "'" + folder.string() + "' exists already",
                  "another folder: nothing is replaced");
  };
  unused(p.out);
  if (!p.map.empty()) {
    if (output_exists(p.map))
      throw Error(ExitCode::cannot_write, "'" + p.map + "' exists already", "another name: a map is never replaced");
    const fs::path inside =
        fs::absolute(p.map).lexically_normal().lexically_relative(fs::absolute(p.out).lexically_normal());
    if (!inside.empty() && *inside.begin() != "..")
      throw Error(ExitCode::usage, "the map would lie in the folder that leaves", "--map where only you can read");
  }
  const AuditTrail trail;
  const DicomObjects all = list_objects({io.arguments[0]}, io.context.sub(0, 0.1));
  DeidentifyReport report;
  write_folder_atomically(p.out, unused, [&](const fs::path& folder) {
    report = deidentify_objects(all.objects, folder, {p.key}, io.context.sub(0.1, 1));
    if (report.written == 0)
      throw Error(ExitCode::failed, "nothing may leave: " + report.refused[0].why + ", and so with each of " +
                                        std::to_string(report.refused.size()) + " objects");
    // The map first: a result whose way back was asked for and is lost would be of no use.
    if (!p.map.empty()) write_deidentify_map(p.map, report);
  });
  io.end_progress();
  if (trail.on()) {
    AuditEvent event;
    event.kind = AuditEvent::Kind::deidentify;
    event.good = report.refused.empty();
    event.studies = audit_studies(all.objects);
    trail.notify(event, io.context);
  }
  const auto why = reported_refusals(report, io);
  if (io.common.json) {
    Json refused = Json::list();
    for (const auto& [reason, n] : why) refused.push_back({{"why", reason}, {"objects", n}});
    io.out << Json{{"folder", p.out},
                   {"objects", report.written},
                   {"studies", report.studies.size()},
                   {"refused", refused},
                   {"set_aside", all.set_aside.size()}}
                  .dump(2)
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << report.written << " objects of " << report.studies.size() << " studies: " << p.out << '\n';
    if (!all.set_aside.empty()) io.err << all.set_aside.size() << " files are no DICOM objects and are left out\n";
  }
  return static_cast<int>(report.refused.empty() ? ExitCode::ok : ExitCode::partial);
}

}  // namespace osteo
