// send, fetch, receive: to and from a PACS.
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <ostream>

#include "osteo/core/base/json_document.h"
#include "osteo/hospital/pacs/audit.h"
#include "osteo/hospital/pacs/dicomweb.h"
#include "osteo/hospital/pacs/fetch.h"
#include "osteo/hospital/pacs/receive.h"
#include "osteo/hospital/pacs/roles.h"
#include "osteo/hospital/pacs/send.h"
#include "pacs_commands.h"

namespace osteo {
namespace {

// Where to, or from where: one of both.
struct Endpoint {
  std::optional<DicomPeer> node;
  std::optional<WebServer> web;
  std::string name;
};

Endpoint endpoint_of(const PeerOrWebFlags& p, const cli::Invocation& io) {
  Endpoint endpoint;
  if (p.dicomweb.empty()) {
    if (!p.dicomweb_login.empty() || !p.dicomweb_ca.empty())
      throw Error(ExitCode::usage, "a login or certificates for which server?", "--dicomweb URL");
    if (p.peer.empty())
      throw Error(ExitCode::usage, "no node is named",
                  "--peer TITLE@HOST:PORT, like ORTHANC@127.0.0.1:4242, or --dicomweb URL");
    endpoint.node = parse_peer(p.peer);
    endpoint.node->own_ae = checked_ae(p.ae);
    endpoint.node->timeout_s = p.timeout_s;
    endpoint.node->tls = p.tls();
    endpoint.name = peer_text(*endpoint.node);
    return endpoint;
  }
  for (const char* const flag : {"peer", "ae", "tls_ca", "tls_certificate", "tls_key"})
    if (io.given.contains(flag))
      throw Error(ExitCode::usage, "a DICOM node and a DICOMweb server at once",
                  "--dicomweb has a login and certificates of its own");
  endpoint.web.emplace();
  endpoint.web->url = p.dicomweb;
  endpoint.web->ca = p.dicomweb_ca;
  endpoint.web->timeout_s = p.timeout_s;
  endpoint.web->flag = "--dicomweb";
  const char* const given = std::getenv("OSTEO_DICOMWEB_LOGIN");
  endpoint.web->login = !p.dicomweb_login.empty() ? read_login(p.dicomweb_login) : given != nullptr ? given : "";
  check_dicomweb(*endpoint.web);
  endpoint.name = web_text(*endpoint.web);
  return endpoint;
}

// Of a server: a terminal would take control characters for orders.
std::string shown(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  return text;
}

std::string megabytes(std::uint64_t bytes) {
  return format_number(std::round(static_cast<double>(bytes) / 1e5) / 10) + " MB";
}

std::vector<std::string> titles(const std::string& text) {
  std::vector<std::string> all;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    all.push_back(checked_ae(text.substr(at, comma - at)));
    at = comma + 1;
  }
  return all;
}

}  // namespace

cli::CommandInfo SendCommand::info() {
  return {"send",
          "objects to a PACS, by C-STORE or STOW-RS",
          "Sends a DICOM file, or all DICOM files of a folder, as they are: what was converted by to-slicer, "
          "save-series or a report leaves "
          "only by this command, to a DICOM node (--peer) or a DICOMweb server (--dicomweb). Every answer of the node "
          "is judged, and the node "
          "is then asked which of the objects it has. Nothing is taken out "
          "without --deidentify: what names a person in the files is sent with them. Exit code 8 when some were "
          "rejected or are not found "
          "afterwards.",
          {{"source", "a file or a folder"}},
          "osteo send CASE.seg.dcm --peer ORTHANC@127.0.0.1:4242 --dry-run"};
}

int SendCommand::run(const Params& p, cli::Invocation& io) {
  const Endpoint to = endpoint_of(p, io);
  const AuditTrail trail;
  if (!p.dry_run) require_role("send", trail, io.context);
  if (!p.key.empty() && !p.deidentify)
    throw Error(ExitCode::usage, "--key is for --deidentify", "add it, or leave the key out");
  DicomObjects all = list_objects({io.arguments[0]}, io.context.sub(0, p.dry_run && !p.deidentify ? 1 : 0.05));
  std::optional<TemporaryFolder> copies;
  std::size_t left_out = 0;
  if (p.deidentify) {
    copies.emplace();
    const DeidentifyReport made =
        deidentify_objects(all.objects, copies->path(), {p.key}, io.context.sub(0.05, p.dry_run ? 1 : 0.1));
    io.end_progress();
    left_out = made.refused.size();
    reported_refusals(made, io);
    if (made.written == 0) throw Error(ExitCode::failed, "nothing may leave: each object is left out");
    std::vector<fs::path> set_aside = std::move(all.set_aside);
    all = list_objects({copies->path()});
    all.set_aside = std::move(set_aside);
  }
  std::map<std::string, std::pair<int, std::uint64_t>> kinds;
  std::uint64_t bytes = 0;
  for (const DicomObject& o : all.objects) {
    ++kinds[o.kind].first;
    kinds[o.kind].second += o.bytes;
    bytes += o.bytes;
  }
  Json listed = Json::list();
  for (const auto& [kind, n] : kinds) listed.push_back({{"kind", kind}, {"objects", n.first}, {"bytes", n.second}});
  if (!io.common.quiet && !all.set_aside.empty()) {
    io.end_progress();
    io.err << all.set_aside.size()
           << " files are no DICOM objects and are left out, the first: " << all.set_aside[0].filename().string()
           << '\n';
  }
  if (p.dry_run) {
    io.end_progress();
    if (io.common.json) {
      io.out << Json{{"dry_run", true},
                     {"peer", to.name},
                     {"kinds", listed},
                     {"set_aside", all.set_aside.size()},
                     {"left_out", left_out}}
                    .dump(2)
             << '\n';
    } else {
      io.out << "would send to " << to.name << (to.node ? " as " + to.node->own_ae : "") << ":\n";
      for (const auto& [kind, n] : kinds)
        io.out << "  " << n.first << " x " << kind << ", " << megabytes(n.second) << '\n';
    }
    return static_cast<int>(left_out == 0 ? ExitCode::ok : ExitCode::partial);
  }
  const Context rest = io.context.sub(0.1, 1);
  AuditEvent event;
  event.kind = AuditEvent::Kind::send;
  event.peer = to.name;
  if (trail.on()) event.studies = audit_studies(all.objects);
  SendReport report;
  try {
    report =
        to.web ? send_objects(*to.web, all.objects, p.check, rest) : send_objects(*to.node, all.objects, p.check, rest);
  } catch (...) {  // some may have left before
    event.good = false;
    trail.notify(event, io.context);
    throw;
  }
  event.good = report.safe() == report.objects.size();
  trail.notify(event, io.context);
  io.end_progress();
  Json problems = Json::list();
  std::map<std::string, std::pair<int, std::string>> why;
  for (const SentObject& s : report.objects) {
    std::string problem = s.problem;
    if (s.accepted && s.found == false) problem = "accepted, but the node does not find it";
    if (problem.empty()) continue;
    problems.push_back({{"file", s.object.file.string()}, {"accepted", s.accepted}, {"problem", problem}});
    auto& [n, first] = why[problem];
    if (n++ == 0) first = s.object.file.filename().string();
  }
  if (io.common.json) {
    io.out << Json{{"peer", to.name},
                   {"kinds", listed},
                   {"objects", report.objects.size()},
                   {"accepted", report.accepted()},
                   {"checked", report.not_checked.empty()},
                   {"safe", report.safe()},
                   {"problems", problems},
                   {"set_aside", all.set_aside.size()},
                   {"left_out", left_out}}
                  .dump(2)
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << report.accepted() << " of " << report.objects.size() << " objects accepted by " << to.name << " ("
           << megabytes(bytes) << ")";
    io.err << (report.not_checked.empty() ? ", " + std::to_string(report.safe()) + " found there afterwards"
                                          : "; not asked afterwards: " + report.not_checked)
           << '\n';
  }
  for (const auto& [problem, n] : why)
    io.err << n.first << " objects: " << problem << ", the first: " << n.second << '\n';
  return static_cast<int>(report.safe() == report.objects.size() && left_out == 0 ? ExitCode::ok : ExitCode::partial);
}

cli::CommandInfo FetchCommand::info() {
  return {"fetch",
          "a series from a PACS, by C-FIND and C-GET, or QIDO-RS and WADO-RS",
          "Without --out it lists the series that match (number, modality, images, description, UID); with it, the one "
          "that matches is fetched "
          "as it is, bit for bit, into a folder that appears whole or not at all. Names of patients are not shown. A "
          "node that "
          "gives nothing by C-GET can be made to send to 'osteo receive'.",
          {},
          "osteo fetch --peer ORTHANC@127.0.0.1:4242 --accession 4711 --modality CT"};
}

int FetchCommand::run(const Params& p, cli::Invocation& io) {
  const Endpoint from = endpoint_of(p, io);
  if (!p.out.empty() && output_exists(p.out) && !(fs::is_directory(p.out) && fs::is_empty(p.out)))
    throw Error(ExitCode::cannot_write, "'" + p.out + "' exists already",
                "another folder: what was fetched is never replaced");
  const bool by_number = !p.series.empty() && p.series.find('.') == std::string::npos;
  const SeriesKeys keys{p.study, by_number ? "" : p.series, p.accession, p.patient_id, p.date, p.modality};
  std::vector<RemoteSeries> found =
      from.web ? find_series(*from.web, keys, io.context) : find_series(*from.node, keys, io.context);
  for (RemoteSeries& s : found) {
    s.modality = shown(s.modality);
    s.description = shown(s.description);
  }
  if (by_number) std::erase_if(found, [&](const RemoteSeries& s) { return std::to_string(s.number) != p.series; });
  if (found.empty()) throw Error(ExitCode::no_input, "nothing matches at " + from.name);
  Json listed = Json::list();
  std::string lines;
  for (const RemoteSeries& s : found) {
    listed.push_back({{"study", s.study},
                      {"series", s.series},
                      {"number", s.number},
                      {"modality", s.modality},
                      {"images", s.images},
                      {"description", s.description}});
    lines += "  " + std::to_string(s.number) + "  " + s.modality + "  " +
             (s.images < 0 ? "?" : std::to_string(s.images)) + " images  " + s.description + "  " + s.series + "\n";
  }
  io.end_progress();
  if (p.out.empty()) {
    if (io.common.json)
      io.out << listed.dump(2) << '\n';
    else
      io.out << lines;
    return 0;
  }
  if (found.size() > 1)
    throw Error(ExitCode::usage, std::to_string(found.size()) + " series match:\n" + lines.substr(0, 4000),
                "choose one by --series (and --study)");
  FetchReport report;
  FetchLimits limits;
  limits.series_gb = p.series_gb;
  write_folder_atomically(
      p.out, [](const fs::path&) {},
      [&](const fs::path& folder) {
        report = from.web ? fetch_series(*from.web, found[0], folder, limits, io.context)
                          : fetch_series(*from.node, found[0], folder, limits, io.context);
      });
  io.end_progress();
  if (io.common.json)
    io.out << Json{{"folder", p.out},
                   {"images", report.images},
                   {"bytes", report.bytes},
                   {"modality", found[0].modality}}
                  .dump(2)
           << '\n';
  if (!io.common.quiet) io.err << report.images << " objects, " << megabytes(report.bytes) << ": " << p.out << '\n';
  return 0;
}

cli::CommandInfo ReceiveCommand::info() {
  return {
      "receive",
      "a DICOM node that takes what a PACS or scanner sends into a folder",
      "Answers C-ECHO and C-STORE on this machine alone unless --bind says otherwise, until it is stopped. Objects are "
      "kept as they come, "
      "each in a folder of its study and series whose names are hashes; none is ever written over. A series is closed "
      "when nothing "
      "of it has come for --quiet-s: a line on standard output names its folder (with --json a JSON line), and a file "
      "CLOSED lies in it; "
      "slices that come later open it again. Each association has a process of its own with limits, so that no peer "
      "can harm another. "
      "Without --tls-ca nothing is encrypted: then put it behind a tunnel, or keep it on one machine with the PACS.",
      {{"folder", "where to; made when it is missing"}},
      "osteo receive INBOX --allow ORTHANC"};
}

int ReceiveCommand::run(const Params& p, cli::Invocation& io) {
  const AuditTrail trail;
  ReceiveOptions o;
  o.ae = checked_ae(p.ae);
  o.address = p.bind;
  o.port = p.port;
  o.allowed = titles(p.allow);
  o.anybody = p.anybody;
  o.tls = p.tls();
  o.most_associations = p.associations;
  o.object_gb = p.object_gb;
  o.folder_gb = p.folder_gb;
  o.keep_free_gb = p.keep_free_gb;
  o.memory_mb = p.memory_mb;
  o.timeout_s = p.timeout_s;
  o.association_s = p.association_s;
  o.quiet_s = p.quiet_s;
  io.end_progress();
  ReceiveEvents events;
  events.listening = [&](int port) {
    if (io.common.json) io.out << Json{{"listening", port}}.dump() << std::endl;
    if (!io.common.quiet)
      io.err << o.ae << " listens on " << o.address << ':' << port << (o.tls.ca.empty() ? "" : " with TLS")
             << (o.anybody ? ", anybody may send" : "") << std::endl;
  };
  events.closed = [&](const ClosedSeries& s) {
    trail.report_apart(
        [&] {
          AuditEvent event;
          for (const std::string& title : s.from) event.peer += (event.peer.empty() ? "" : ",") + title;
          event.studies = audit_studies(list_objects({s.folder}).objects);
          return event;
        },
        io.context);
    if (io.common.json)
      io.out << Json{{"closed", s.folder.string()}, {"objects", s.objects}, {"bytes", s.bytes}}.dump() << std::endl;
    else
      io.out << s.folder.string() << std::endl;
    if (!io.common.quiet)
      io.err << "a series of " << s.objects << " objects, " << megabytes(s.bytes) << ": " << s.folder.string()
             << std::endl;
  };
  ReceiveCounters last;
  events.counters = [&](const ReceiveCounters& c) {
    if (!p.metrics.empty()) write_file(p.metrics, metrics_text(c));
    if (!io.common.quiet && (c.refused != last.refused || c.refused_associations != last.refused_associations))
      io.err << c.refused << " objects and " << c.refused_associations << " associations rejected so far" << std::endl;
    last = c;
  };
  receive_objects(io.arguments[0], o, events, io.context);
  if (!io.common.quiet)
    io.err << "stopped: " << last.stored << " objects stored, " << last.again << " were there already, " << last.refused
           << " rejected\n";
  return 0;
}

}  // namespace osteo
