// The verbs that speak to a PACS.
#pragma once
#include <cstddef>
#include <map>
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/hospital/pacs/deidentify.h"
#include "osteo/hospital/pacs/peer.h"
#include "osteo/hospital/pacs/rules.h"

namespace osteo {

struct TlsFlags {
  std::string tls_ca, tls_certificate, tls_key;
  static void describe(TlsFlags& p, auto& visit) {
    visit({"tls_ca", "speak TLS, and trust certificates that these have signed (PEM; empty: nothing is encrypted)"},
          p.tls_ca);
    visit({"tls_certificate", "our own certificate (PEM)"}, p.tls_certificate);
    visit({"tls_key", "private key of the TLS certificate, in a file that only we may read (PEM, without a password)"},
          p.tls_key);
  }
  [[nodiscard]] DicomTls tls() const { return {tls_ca, tls_certificate, tls_key}; }
};

/// Which node, and as whom.
struct PeerFlags : TlsFlags {
  std::string peer, ae = "OSTEOTOME";
  double timeout_s = 30;
  static void describe(PeerFlags& p, auto& visit) {
    visit({"peer", "the node, as TITLE@HOST:PORT, like ORTHANC@127.0.0.1:4242"}, p.peer);
    visit({"ae", "our own title, which the node must know"}, p.ae);
    visit({"timeout_s", "time limit of the connection and of each answer", "s", 1, 3600}, p.timeout_s);
    TlsFlags::describe(p, visit);
  }
};

/// A DICOM node, or a DICOMweb server in its place.
struct PeerOrWebFlags : PeerFlags {
  std::string dicomweb, dicomweb_login, dicomweb_ca;
  static void describe(PeerOrWebFlags& p, auto& visit) {
    PeerFlags::describe(p, visit);
    visit({"dicomweb", "root of a DICOMweb server, used instead of --peer, like https://pacs.example/dicom-web"},
          p.dicomweb);
    visit({"dicomweb_login",
           "file, mode 600, with USER:PASSWORD (empty: OSTEO_DICOMWEB_LOGIN of the environment, or none)"},
          p.dicomweb_login);
    visit({"dicomweb_ca", "certificates to trust for it (PEM; empty: those of the system)"}, p.dicomweb_ca);
  }
};

struct SendCommand {
  struct Params : PeerOrWebFlags {
    bool dry_run = false;
    bool check = true;
    bool deidentify = false;
    std::string key;
  };
  static void describe(Params& p, auto& visit) {
    PeerOrWebFlags::describe(p, visit);
    visit({"dry_run", "say what would leave, and speak to nobody"}, p.dry_run);
    visit({"check", "ask afterwards which of the objects the node has (--no-check: believe its answers)"}, p.check);
    visit({"deidentify", "send copies as 'osteo deidentify' makes them; what it leaves out does not leave"},
          p.deidentify);
    visit({"key", "key of the pseudonyms, as in 'deidentify', with --deidentify"}, p.key);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// Says on standard error why how many were left out, and counts them by reason.
std::map<std::string, std::size_t> reported_refusals(const DeidentifyReport& report, cli::Invocation& invocation);

struct DeidentifyCommand {
  struct Params {
    std::string out, key, map;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the result, which must not be there (also -o)"}, p.out);
    visit({"key",
           "file of 32 bytes or more, mode 600: the same key gives the same codes and UIDs (empty: a new one, "
           "forgotten)"},
          p.key);
    visit({"map", "file, mode 600, that leads from codes and new UIDs back to the originals (empty: none)"}, p.map);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct FetchCommand {
  struct Params : PeerOrWebFlags {
    std::string out, study, series, accession, patient_id, date, modality;
    double series_gb = 16;
  };
  static void describe(Params& p, auto& visit) {
    PeerOrWebFlags::describe(p, visit);
    visit({"out", "folder for the series (empty: only list what there is; also -o)"}, p.out);
    visit({"study", "UID of a study"}, p.study);
    visit({"series", "UID of a series, or its number as listed"}, p.series);
    visit({"accession", "number of a request"}, p.accession);
    visit({"patient_id", "others on this machine can see what a command is called with"}, p.patient_id);
    visit({"date", "date of the study, like 20240131 or 20240101-20240131"}, p.date);
    visit({"modality", "like CT (empty: any)"}, p.modality);
    visit({"series_gb", "a series may not be larger", "GB", 0.000001, 1000}, p.series_gb);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ReceiveCommand {
  struct Params : TlsFlags {
    std::string ae = "OSTEOTOME", bind = "127.0.0.1", allow, metrics;
    int port = 11112;
    bool anybody = false;
    int associations = 20;
    double object_gb = 2, folder_gb = 100, keep_free_gb = 1, memory_mb = 256, timeout_s = 30, association_s = 3600,
           quiet_s = 30;
  };
  static void describe(Params& p, auto& visit) {
    visit({"ae", "our title: who calls another is rejected"}, p.ae);
    visit({"bind", "IPv4 address to listen on (0.0.0.0: every network this machine is in)"}, p.bind);
    visit({"port", "port to listen on (0: any free one)", "", 0, 65535}, p.port);
    visit({"allow", "titles of the nodes that may send, with commas"}, p.allow);
    visit({"allow_all", "let every node send"}, p.anybody);
    visit({"associations", "associations that are accepted at the same time", "", 1, 1000}, p.associations);
    visit({"object_gb", "a larger object is rejected", "GB", 0.000001, 100}, p.object_gb);
    visit({"folder_gb", "all of the folder; what would be beyond is rejected", "GB", 0.000001, 1e6}, p.folder_gb);
    visit({"keep_free_gb", "free space to keep on the disk; with less, everything is rejected", "GB", 0, 1e6},
          p.keep_free_gb);
    visit({"memory_mb", "memory that an association's process may take", "MB", 16, 100000}, p.memory_mb);
    visit({"timeout_s", "time limit of each message of a node", "s", 1, 3600}, p.timeout_s);
    visit({"association_s", "longest that a node may stay", "s", 1, 86400}, p.association_s);
    visit({"quiet_s", "a series is closed when nothing of it came for so long", "s", 0.1, 86400}, p.quiet_s);
    visit({"metrics", "file for counters, in Prometheus' text form (empty: none)"}, p.metrics);
    TlsFlags::describe(p, visit);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// Rules whose pipelines can be read and whose settings are known. Error(usage) and those of reading otherwise.
std::vector<SeriesRule> checked_rules(const fs::path& file);

struct WatchFolderCommand {
  struct Params {
    std::string rules, out, metrics, orthanc, orthanc_login, orthanc_ca;
    double quiet_s = 30, poll_s = 2, timeout_s = 30, object_gb = 2;
    int jobs = 1;
    double memory_mb = 4000, minutes = 60, keep_free_mb = 500;
    int retries = 1;
    bool once = false, no_report = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"rules", "file that says which series go through which pipeline, like pipelines/rules.json"}, p.rules);
    visit({"out", "folder for cases and journal, made when it is not there (also -o)"}, p.out);
    visit({"quiet_s", "a series is taken when none of its files has come or changed for so long", "s", 0.1, 86400},
          p.quiet_s);
    visit({"poll_s", "time between two looks into the folder", "s", 0.1, 3600}, p.poll_s);
    visit({"jobs", "cases at a time", "", 1, 1024}, p.jobs);
    visit({"memory_mb", "memory that a case may have; one that needs more is ended (0: no bound)", "MB", 0, 10000000},
          p.memory_mb);
    visit({"minutes", "time that a case may take; one that needs longer is ended (0: no bound)", "min", 0, 100000},
          p.minutes);
    visit({"retries", "further tries of a case that ended for memory, time or a signal", "", 0, 100}, p.retries);
    visit({"keep_free_mb", "begin no case with less free on the disk of the cases", "MB", 0, 1e9}, p.keep_free_mb);
    visit({"orthanc",
           "address of an Orthanc whose series are copied into the folder, like https://orthanc.example:8042 (empty: "
           "none)"},
          p.orthanc);
    visit({"orthanc_login",
           "file, mode 600, with USER:PASSWORD (empty: OSTEO_ORTHANC_LOGIN of the environment, or none)"},
          p.orthanc_login);
    visit({"orthanc_ca", "certificates to trust (PEM; empty: those of the system)"}, p.orthanc_ca);
    visit({"timeout_s", "time limit of the connection, and of a rate below 1000 bytes a second", "s", 1, 3600},
          p.timeout_s);
    visit({"object_gb", "a series with a larger object is not taken from it", "GB", 0.000001, 100}, p.object_gb);
    visit({"once", "end when all that is there is done, instead of waiting for more"}, p.once);
    visit({"no_report", "write no report of each case: its cuts are pictures of the patient"}, p.no_report);
    visit({"metrics", "file for counters, in Prometheus' text form (empty: none)"}, p.metrics);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// What a rehearsal needs of this machine, or with --server what receive, watch and batch do.
struct DoctorCommand {
  struct Params : TlsFlags {
    double seconds = 2;
    double rate_hz = 1000;
    bool server = false, no_report = false;
    std::string inbox, cases, rules, metrics, login, allow, ae = "OSTEOTOME", bind = "127.0.0.1";
    int port = 11112, jobs = 1;
    double memory_mb = 4000, keep_free_gb = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"seconds", "how long the lateness of the 1 kHz loop is measured", "s", 0.1, 600}, p.seconds);
    visit({"rate_hz", "rate of the measured loop", "Hz", 100, 10000}, p.rate_hz);
    visit({"server",
           "look at what receive, watch and batch need instead; the flags that follow are theirs, and are for this "
           "alone"},
          p.server);
    visit({"inbox", "folder of receive (empty: none is looked at)"}, p.inbox);
    visit({"cases", "folder of watch's cases (empty: none)"}, p.cases);
    visit({"rules", "rules file of 'watch-folder' (empty: none)"}, p.rules);
    visit({"metrics", "files for counters, with commas (empty: none)"}, p.metrics);
    visit({"login", "files with USER:PASSWORD, with commas (empty: none)"}, p.login);
    visit({"ae", "our title"}, p.ae);
    visit({"allow", "titles of the nodes that may send, with commas"}, p.allow);
    visit({"bind", "IPv4 address to listen on"}, p.bind);
    visit({"port", "port to listen on", "", 1, 65535}, p.port);
    visit({"keep_free_gb", "free space to keep on the disks of inbox and cases", "GB", 0, 1e6}, p.keep_free_gb);
    visit({"jobs", "cases at a time", "", 1, 1024}, p.jobs);
    visit({"memory_mb", "memory that a case may have", "MB", 0, 10000000}, p.memory_mb);
    visit({"no_report", "cases get no reports, so pictures need not be drawn"}, p.no_report);
    TlsFlags::describe(p, visit);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
