// Audit messages of PS3.15 A.5 (IHE ITI-20) in syslog frames, to a file or to a syslog server.
//
// A message is first put into a queue on the disk, and taken out when it is delivered. What cannot be delivered waits
// there, up to a bound; what cannot wait either is counted and warned of. Work goes on in each case.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/send.h"
#include "osteo/hospital/pacs/server.h"

namespace osteo::inline hospital {

/// A study that an event is about. The patient's ID is what the profile wants; no name is ever written.
struct AuditStudy {
  std::string study, patient_id;               ///< UID; bytes beyond ASCII as '?'. Empty where the object does not say
  std::map<std::string, std::size_t> classes;  ///< UIDs of classes, with the number of objects
};

struct AuditEvent {
  enum class Kind { receive, send, deidentify, open, edit, approve, withdraw, hand_over, rejected };
  Kind kind = Kind::receive;
  bool good = true;                 ///< false: it failed, or not all of it was done
  std::string action;               ///< what was rejected
  std::string peer;                 ///< the other node or server; empty: none
  std::vector<AuditStudy> studies;  ///< of DICOM objects
  std::string case_code;            ///< of a case, which is a hash; empty: none
};

/// Studies of objects; the head of the first of each is read for the patient's ID.
[[nodiscard]] std::vector<AuditStudy> audit_studies(const std::vector<DicomObject>& objects);

/// Where messages go. `to`: "file:/PATH", "tcp://HOST:PORT" or "tls://HOST:PORT" (the certificate must be for HOST).
struct AuditSettings {
  std::string to, ca, certificate, key;  ///< the last three for tls://; `ca` empty: those of the system
  fs::path queue;        ///< folder, made when it is missing; of a file of settings: one below it for each user
  std::string source;    ///< AuditSourceID; empty: the name of the machine
  double queue_mb = 64;  ///< what may wait
  double timeout_s = 5;  ///< for the connection, and for each message
};

/// The file that turns audit on: /etc/osteo/audit.json where it is there, else the one that OSTEO_AUDIT names; empty:
/// audit is off. Nobody turns off by an environment what the machine's own file has turned on.
[[nodiscard]] fs::path audit_file();
/// Errors: usage (unknown keys, a place that is none), no_input, cannot_read.
[[nodiscard]] AuditSettings read_audit_settings(const fs::path& file);

/// One message as it is sent, without the frame's length.
[[nodiscard]] std::string audit_message(const AuditEvent& event, const std::string& source);

class AuditTrail {
 public:
  /// By audit_file(), whose errors it throws: a wrong setting stops work before it begins.
  AuditTrail();
  explicit AuditTrail(AuditSettings settings) : settings_(std::move(settings)) {}

  [[nodiscard]] bool on() const { return !settings_.to.empty(); }
  /// Queues the message, then delivers what waits. Warns of what is lost and of what stays waiting; throws nothing.
  void notify(const AuditEvent& event, const Context& context) const noexcept;
  /// The same in a process of its own, for who may not wait: `make` is called there. The calling process must have one
  /// thread.
  void report_apart(const std::function<AuditEvent()>& make, const Context& context) const noexcept;
  /// Delivers what waits, oldest first. Error(failed) where it could not; another process that delivers is let be.
  void deliver() const;

  struct Waiting {
    std::size_t messages = 0;
    std::uint64_t bytes = 0, lost = 0;
  };
  [[nodiscard]] Waiting waiting() const;

 private:
  void queue(const std::string& message) const;
  AuditSettings settings_;
};

/// A line of `doctor --server`: whether it is on, can be queued and is delivered; tries to deliver what waits.
[[nodiscard]] ServerFinding check_audit();

}  // namespace osteo::inline hospital
