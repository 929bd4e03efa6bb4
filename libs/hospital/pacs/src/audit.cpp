#include "osteo/hospital/pacs/audit.h"

#include <curl/curl.h>
#include <fcntl.h>
#include <linux/sockios.h>
#include <poll.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <set>
#include <thread>

#include "node.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/param.h"

namespace osteo::inline hospital {
namespace {

constexpr const char* kSettings = "/etc/osteo/audit.json";
constexpr const char* kSuffix = ".msg";
constexpr int kCloseMs = 300;  // for a server to say that it has not taken what was sent
constexpr int kPriority = 85;  // facility 10 (security), severity 5 (notice), as ITI-20 has it

Error failed(const std::string& what) {
  return {ExitCode::failed, what, "'osteo doctor --server' shows how many messages wait"};
}
std::string reason() {
  return std::strerror(errno);
}

class Handle {
 public:
  explicit Handle(int fd) : fd_(fd) {}
  ~Handle() {
    if (fd_ >= 0) ::close(fd_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  const int fd_;
};

// A server that goes away must not end us; what the program did with the signal before comes back.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before_);
  }
  ~NoPipeSignal() { ::sigaction(SIGPIPE, &before_, nullptr); }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  struct sigaction before_ {};
};

std::string in_ascii(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

// " name='value'", in XML.
std::string attribute(const char* name, const std::string& value) {
  std::string text = std::string(" ") + name + "=\"";
  for (const char c : in_ascii(value)) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += c;
    }
  }
  return text + "\"";
}

std::string code(const char* element, const char* value, const char* system, const char* meaning) {
  return std::string("<") + element + attribute("csd-code", value) + attribute("codeSystemName", system) +
         attribute("originalText", meaning) + "/>";
}

std::string now_text() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  const std::time_t s = static_cast<std::time_t>(ms / 1000);
  std::tm parts{};
  std::array<char, 40> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", ::gmtime_r(&s, &parts));
  std::array<char, 8> rest{};
  std::snprintf(rest.data(), rest.size(), ".%03dZ", static_cast<int>(ms % 1000));
  return std::string(text.data()) + rest.data();
}

std::string machine() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "-";
  return in_ascii(name.data());
}

// Who asked, as the system knows them: what a command line says of itself is no proof.
std::string user() {
  const passwd* const who = ::getpwuid(::getuid());
  return who != nullptr ? who->pw_name : std::to_string(::getuid());
}

// What PS3.15 A.5.3 calls an event, and where in its life that finds the data (RFC 3881, 5.5.3).
struct Row {
  const char *event, *meaning, *action, *kind, *kind_meaning, *life;
};
Row row_of(AuditEvent::Kind kind) {
  switch (kind) {
    case AuditEvent::Kind::receive:
      return {"110104", "DICOM Instances Transferred", "C", "receive", "Received", "2"};
    case AuditEvent::Kind::send:
      return {"110104", "DICOM Instances Transferred", "R", "send", "Sent", "10"};
    case AuditEvent::Kind::deidentify:
      return {"110106", "Export", "R", "deidentify", "De-identified copies", "7"};
    case AuditEvent::Kind::open:
      return {"110103", "DICOM Instances Accessed", "R", "open", "Opened", "6"};
    case AuditEvent::Kind::edit:
      return {"110103", "DICOM Instances Accessed", "U", "edit", "Corrected", "3"};
    case AuditEvent::Kind::hand_over:
      return {"110106", "Export", "R", "hand-over", "Written for other programs", "10"};
    case AuditEvent::Kind::approve:
      return {"110103", "DICOM Instances Accessed", "U", "approve", "Approved", "4"};
    case AuditEvent::Kind::withdraw:
      return {"110103", "DICOM Instances Accessed", "U", "withdraw", "Approval withdrawn", "4"};
    case AuditEvent::Kind::rejected:
      return {"110113", "Security Alert", "E", "110132", "Use of Restricted Function", "6"};
  }
  return {};
}

std::string participant(const std::string& id, bool asks, const char* role, const char* meaning) {
  return "<ActiveParticipant" + attribute("UserID", id) + attribute("UserIsRequestor", asks ? "true" : "false") + ">" +
         code("RoleIDCode", role, "DCM", meaning) + "</ActiveParticipant>";
}

std::string framed(const std::string& body) {
  return "<" + std::to_string(kPriority) + ">1 " + now_text() + " " + machine() + " osteo " +
         std::to_string(::getpid()) + " DICOM+RFC3881 - \xEF\xBB\xBF<?xml version=\"1.0\" encoding=\"UTF-8\"?>" + body;
}

std::string head_of(const char* action, bool good, const std::string& codes) {
  return "<AuditMessage><EventIdentification" + attribute("EventActionCode", action) +
         attribute("EventDateTime", now_text()) + attribute("EventOutcomeIndicator", good ? "0" : "4") + ">" + codes +
         "</EventIdentification>";
}

std::string source_of(const std::string& source) {
  return "<AuditSourceIdentification" + attribute("AuditSourceID", source.empty() ? machine() : source) +
         "><AuditSourceTypeCode" + attribute("csd-code", "4") + "/></AuditSourceIdentification>";
}

std::string lost_message(std::uint64_t lost, const std::string& source) {
  return framed(head_of("E", false,
                        code("EventID", "110113", "DCM", "Security Alert") +
                            code("EventTypeCode", "lost", "99OSTEOTOME", "Audit messages lost")) +
                participant(user(), true, "110150", "Application") + source_of(source) +
                "<ParticipantObjectIdentification" + attribute("ParticipantObjectID", std::to_string(lost)) +
                attribute("ParticipantObjectTypeCode", "2") + attribute("ParticipantObjectTypeCodeRole", "13") + ">" +
                code("ParticipantObjectIDTypeCode", "lost", "99OSTEOTOME", "Number of audit messages lost") +
                "</ParticipantObjectIdentification></AuditMessage>");
}

// The number of messages lost lies in a file of its own whose bytes are there from the beginning: it can be raised on a
// full disk.
class Lost {
 public:
  explicit Lost(const fs::path& queue) : file_(::open((queue / "lost").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0660)) {
    if (file_.get() < 0) return;
    ::flock(file_.get(), LOCK_EX);
    struct stat s {};
    if (::fstat(file_.get(), &s) == 0 && s.st_size == 0) static_cast<void>(set(0));
  }
  [[nodiscard]] std::uint64_t get() const {
    std::array<char, 24> text{};
    if (file_.get() < 0 || ::pread(file_.get(), text.data(), text.size() - 1, 0) <= 0) return 0;
    return std::strtoull(text.data(), nullptr, 10);
  }
  [[nodiscard]] bool set(std::uint64_t n) const {
    std::array<char, 24> text{};
    std::snprintf(text.data(), text.size(), "%020llu\n", static_cast<unsigned long long>(n));
    return file_.get() >= 0 && ::pwrite(file_.get(), text.data(), 21, 0) == 21;
  }

 private:
  Handle file_;
};

std::vector<fs::path> queued(const fs::path& queue) {
  std::vector<fs::path> all;
  std::error_code error;
  for (fs::directory_iterator at(queue, error), end; !error && at != end; at.increment(error))
    if (at->path().extension() == kSuffix) all.push_back(at->path());
  std::ranges::sort(all);  // names begin with the time
  return all;
}

void append(const fs::path& file, const std::string& text) {
  const Handle to(::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0640));
  struct stat before {};
  if (to.get() < 0 || ::fstat(to.get(), &before) != 0) throw failed("'" + file.string() + "': " + reason());
  errno = 0;
  if (::write(to.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(to.get()) == 0)
    return;
  const std::string why = errno != 0 ? reason() : "written in part";
  static_cast<void>(S_ISREG(before.st_mode) ? ::ftruncate(to.get(), before.st_size) : 0);  // no half lines
  throw failed("'" + file.string() + "': " + why);
}

// A connection of TCP or TLS; frames are counted in octets (RFC 6587, RFC 5425).
class Wire {
 public:
  explicit Wire(const AuditSettings& s) : s_(s), curl_(::curl_easy_init(), &::curl_easy_cleanup) {
    if (!curl_) throw Error(ExitCode::resources, "there is no memory left");
    const bool tls = s.to.starts_with("tls://");
    const std::string url = (tls ? "https" : "http") + s.to.substr(3);
    const auto set = [&](CURLoption option, auto value) {
      if (::curl_easy_setopt(curl_.get(), option, value) != CURLE_OK)
        throw failed("this machine's libcurl cannot do what the audit trail needs");
    };
    set(CURLOPT_URL, url.c_str());
    set(CURLOPT_CONNECT_ONLY, 1L);
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_NOPROXY, "*");
    set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(s.timeout_s * 1000));
    if (tls) {
      set(CURLOPT_SSL_ENABLE_ALPN, 0L);
      set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
      set(CURLOPT_SSL_VERIFYPEER, 1L);
      set(CURLOPT_SSL_VERIFYHOST, 2L);
      if (!s.ca.empty()) set(CURLOPT_CAINFO, s.ca.c_str());
      if (!s.certificate.empty()) set(CURLOPT_SSLCERT, s.certificate.c_str());
      if (!s.key.empty()) set(CURLOPT_SSLKEY, s.key.c_str());
    }
    check(::curl_easy_perform(curl_.get()));
    check(::curl_easy_getinfo(curl_.get(), CURLINFO_ACTIVESOCKET, &socket_));
  }

  void send(const std::string& message) {
    const std::string frame = std::to_string(message.size()) + " " + message;
    for (std::size_t at = 0; at < frame.size();) {
      std::size_t n = 0;
      const CURLcode done = ::curl_easy_send(curl_.get(), frame.data() + at, frame.size() - at, &n);
      if (done == CURLE_AGAIN) {
        if (!ready(POLLOUT, static_cast<int>(s_.timeout_s * 1000))) throw failed(s_.to + " takes nothing more");
        continue;
      }
      check(done);
      at += n;
    }
  }

  // Syslog answers nothing. But who has hung up, or rejects our certificate, has not read what we sent.
  void finish() {
    if (ready(POLLRDHUP, 0)) throw failed(s_.to + " has hung up");
    const bool tls = s_.to.starts_with("tls://");
    if (!tls) ::shutdown(socket_, SHUT_WR);
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(kCloseMs);
    for (std::array<char, 512> some{};;) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now()).count();
      if (left <= 0 || !ready(POLLIN, static_cast<int>(left))) return acknowledged();
      throw_reset();
      std::size_t n = 0;
      const CURLcode done = ::curl_easy_recv(curl_.get(), some.data(), some.size(), &n);
      if (done == CURLE_AGAIN) continue;
      check(done);
      if (n > 0) continue;
      if (tls) throw failed(s_.to + " has hung up");
      return acknowledged();  // it closes as we did; whether it has read all of it, its machine says
    }
  }

 private:
  void check(CURLcode done) const {
    if (done != CURLE_OK) throw failed(s_.to + ": " + ::curl_easy_strerror(done));
  }
  void throw_reset() const {
    int error = 0;
    socklen_t size = sizeof error;
    if (::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error != 0)
      throw failed(s_.to + " has hung up: " + std::strerror(error));
  }
  // Who closes before our message is there sends its end first and the reset after it, on a busy machine much later.
  // Until then our message is not acknowledged; who has read it all has acknowledged it before or with its end.
  void acknowledged() const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(s_.timeout_s);
    for (int unread = 0;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      const bool asked = ::ioctl(socket_, SIOCOUTQ, &unread) == 0;
      throw_reset();
      if (!asked || unread == 0) return;
      if (std::chrono::steady_clock::now() >= until)
        throw failed(s_.to + " has not taken " + std::to_string(unread) + " bytes of it");
    }
  }
  [[nodiscard]] bool ready(short what, int ms) const {
    pollfd p{static_cast<int>(socket_), what, 0};
    return ::poll(&p, 1, ms) > 0 && (p.revents & (what | POLLERR | POLLHUP)) != 0;
  }

  const AuditSettings& s_;
  std::unique_ptr<CURL, decltype(&::curl_easy_cleanup)> curl_;
  curl_socket_t socket_ = CURL_SOCKET_BAD;
};

void send_all(const AuditSettings& s, const std::vector<std::string>& messages) {
  if (s.to.starts_with("file:")) {
    std::string lines;
    for (const std::string& m : messages) lines += m + "\n";
    return append(s.to.substr(5), lines);
  }
  const NoPipeSignal guard;
  Wire wire(s);
  for (const std::string& m : messages) wire.send(m);
  wire.finish();
}

}  // namespace

std::vector<AuditStudy> audit_studies(const std::vector<DicomObject>& objects) {
  std::map<std::string, AuditStudy> by_study;
  for (const DicomObject& o : objects) {
    AuditStudy& s = by_study[o.study];
    if (s.classes.empty()) {
      s.study = o.study;
      pacs::ObjectHead head;
      DcmFileFormat whole;
      if (pacs::read_head(o.file, head, &whole))
        s.patient_id = in_ascii(pacs::text_of(*whole.getDataset(), DCM_PatientID));
    }
    ++s.classes[o.sop_class];
  }
  std::vector<AuditStudy> all;
  for (auto& [uid, s] : by_study) all.push_back(std::move(s));
  return all;
}

fs::path audit_file() {
  std::error_code error;
  if (fs::exists(kSettings, error) || error) return kSettings;
  const char* const given = std::getenv("OSTEO_AUDIT");
  return given != nullptr ? given : "";
}

AuditSettings read_audit_settings(const fs::path& file) {
  require_readable(file);
  const JsonFile json(read_text(file), file.string());
  json.require_format("osteotome_audit");
  const JsonValue& root = json.root();
  json.allow(root, "",
             std::vector<std::string>{"osteotome_audit", "to", "queue", "queue_mb", "timeout_s", "source", "ca",
                                      "certificate", "key"});
  AuditSettings s;
  const JsonValue& to = json.need(root, "", "to");
  s.to = json.text(to, "to");
  const bool wire = s.to.starts_with("tcp://") || s.to.starts_with("tls://");
  const bool port = wire && s.to.find_first_of("/@?#", 6) == std::string::npos && s.to.rfind(':') > 6 &&
                    std::atoi(s.to.c_str() + s.to.rfind(':') + 1) > 0;
  if (!port && !s.to.starts_with("file:/"))
    throw json.wrong(to, "to: '" + s.to + "' is no place for audit messages",
                     "file:/var/log/osteo/audit.log, tcp://HOST:601 or tls://HOST:6514");
  s.queue = json.text(json.need(root, "", "queue"), "queue");
  if (!s.queue.is_absolute())
    throw json.wrong(root, "queue: a folder from the root is needed", "/var/spool/osteo-audit");
  s.queue /= user();  // each user's own: the messages of one are not for another to read
  if (const JsonValue* v = root.find("queue_mb")) s.queue_mb = json.number(*v, "queue_mb", 0.001, 1e5);
  if (const JsonValue* v = root.find("timeout_s")) s.timeout_s = json.number(*v, "timeout_s", 0.1, 60);
  if (const JsonValue* v = root.find("source")) s.source = json.text(*v, "source");
  for (const auto& [name, field] : {std::pair{"ca", &s.ca}, {"certificate", &s.certificate}, {"key", &s.key}}) {
    const JsonValue* const v = root.find(name);
    if (v == nullptr) continue;
    if (!s.to.starts_with("tls://")) throw json.wrong(*v, std::string(name) + " is for tls://", "leave it out");
    *field = json.text(*v, name);
    require_readable(*field);
  }
  return s;
}

std::string audit_message(const AuditEvent& e, const std::string& source) {
  const Row row = row_of(e.kind);
  std::string text = head_of(row.action, e.good,
                             code("EventID", row.event, "DCM", row.meaning) +
                                 code("EventTypeCode", row.kind,
                                      e.kind == AuditEvent::Kind::rejected ? "DCM" : "99OSTEOTOME", row.kind_meaning));
  const bool in = e.kind == AuditEvent::Kind::receive;
  if (!e.peer.empty())
    text += participant(e.peer, in, in ? "110153" : "110152", in ? "Source Role ID" : "Destination Role ID");
  text += participant(user(), !in || e.peer.empty(),
                      in               ? "110152"
                      : e.peer.empty() ? "110150"
                                       : "110153",
                      in               ? "Destination Role ID"
                      : e.peer.empty() ? "Application"
                                       : "Source Role ID");
  text += source_of(source);
  std::set<std::string> patients;
  for (const AuditStudy& s : e.studies) {
    text += "<ParticipantObjectIdentification" + attribute("ParticipantObjectID", s.study) +
            attribute("ParticipantObjectTypeCode", "2") + attribute("ParticipantObjectTypeCodeRole", "3") +
            attribute("ParticipantObjectDataLifeCycle", row.life) + ">" +
            code("ParticipantObjectIDTypeCode", "110180", "DCM", "Study Instance UID") +
            "<ParticipantObjectDescription>";
    for (const auto& [uid, n] : s.classes)
      text += "<SOPClass" + attribute("UID", uid) + attribute("NumberOfInstances", std::to_string(n)) + "/>";
    text += "</ParticipantObjectDescription></ParticipantObjectIdentification>";
    if (!s.patient_id.empty()) patients.insert(s.patient_id);
  }
  if (!e.case_code.empty())
    text += "<ParticipantObjectIdentification" + attribute("ParticipantObjectID", e.case_code) +
            attribute("ParticipantObjectTypeCode", "2") + attribute("ParticipantObjectTypeCodeRole", "3") +
            attribute("ParticipantObjectDataLifeCycle", row.life) + ">" +
            code("ParticipantObjectIDTypeCode", "case", "99OSTEOTOME", "Code of a case") +
            "</ParticipantObjectIdentification>";
  if (!e.action.empty())
    text += "<ParticipantObjectIdentification" + attribute("ParticipantObjectID", e.action) +
            attribute("ParticipantObjectTypeCode", "2") + attribute("ParticipantObjectTypeCodeRole", "13") + ">" +
            code("ParticipantObjectIDTypeCode", "action", "99OSTEOTOME", "What was rejected") +
            "</ParticipantObjectIdentification>";
  for (const std::string& id : patients)
    text += "<ParticipantObjectIdentification" + attribute("ParticipantObjectID", id) +
            attribute("ParticipantObjectTypeCode", "1") + attribute("ParticipantObjectTypeCodeRole", "1") + ">" +
            code("ParticipantObjectIDTypeCode", "2", "RFC-3881", "Patient Number") +
            "</ParticipantObjectIdentification>";
  return framed(text + "</AuditMessage>");
}

AuditTrail::AuditTrail() {
  if (const fs::path file = audit_file(); !file.empty()) settings_ = read_audit_settings(file);
}

void AuditTrail::queue(const std::string& message) const {
  static std::atomic<unsigned> counter{0};
  make_output_folder(settings_.queue);
  { const Lost there(settings_.queue); }  // while there is room
  const Waiting now = waiting();
  if (static_cast<double>(now.bytes + message.size()) > settings_.queue_mb * 1e6)
    throw failed("the queue is full (" + std::to_string(now.messages) + " messages wait)");
  std::array<char, 80> name{};
  std::snprintf(name.data(), name.size(), "%020lld-%d-%06u%s",
                static_cast<long long>(std::chrono::system_clock::now().time_since_epoch().count()),
                static_cast<int>(::getpid()), counter++, kSuffix);
  write_file(settings_.queue / name.data(), message);
}

void AuditTrail::notify(const AuditEvent& event, const Context& context) const noexcept {
  if (!on()) return;
  try {
    try {
      queue(audit_message(event, settings_.source));
    } catch (const std::exception& e) {
      const Lost lost(settings_.queue);
      const bool counted = lost.set(lost.get() + 1);
      context.warn(std::string("an audit message is lost: ") + e.what() +
                   (counted ? "; it is counted" : "; it cannot even be counted"));
    }
    deliver();
  } catch (const std::exception& e) {
    try {
      context.warn("audit messages wait in '" + settings_.queue.string() + "': " + e.what());
    } catch (...) {  // nobody listens any more
    }
  }
}

void AuditTrail::report_apart(const std::function<AuditEvent()>& make, const Context& context) const noexcept {
  if (!on()) return;
  const pid_t child = ::fork();
  if (child == 0) {
    // Twice, so that nobody has to wait for it.
    if (const pid_t own = ::fork(); own != 0) ::_exit(own < 0 ? 1 : 0);
    ::close_range(3, ~0U, 0);  // ports and locks are our parent's
    try {
      notify(make(), context);
    } catch (const std::exception& e) {
      context.warn(std::string("an audit message is lost: ") + e.what());
    }
    ::_exit(0);
  }
  int status = 0;
  while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (child < 0 || status != 0) context.warn("an audit message is lost: no process could be made for it");
}

void AuditTrail::deliver() const {
  while (on()) {
    const Handle folder(::open(settings_.queue.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.get() < 0) throw failed("'" + settings_.queue.string() + "': " + reason());
    if (::flock(folder.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return;
    const std::vector<fs::path> files = queued(settings_.queue);
    std::vector<std::string> messages;
    for (const fs::path& file : files) messages.push_back(read_text(file));
    const std::uint64_t lost = Lost(settings_.queue).get();
    if (lost > 0) messages.push_back(lost_message(lost, settings_.source));
    if (messages.empty()) return;
    send_all(settings_, messages);
    for (const fs::path& file : files) {
      std::error_code error;
      if (!fs::remove(file, error) && error)
        throw failed("a message was delivered and stays in the queue: " + error.message());
    }
    const Lost now(settings_.queue);
    if (lost > 0 && !now.set(now.get() - std::min(now.get(), lost)))
      throw failed("the number of messages lost cannot be set back: " + reason());
  }
}

AuditTrail::Waiting AuditTrail::waiting() const {
  Waiting w;
  if (!on()) return w;
  for (const fs::path& file : queued(settings_.queue)) {
    std::error_code error;
    const auto size = fs::file_size(file, error);
    if (error) continue;  // delivered meanwhile
    ++w.messages;
    w.bytes += size;
  }
  std::error_code error;
  if (fs::exists(settings_.queue / "lost", error)) w.lost = Lost(settings_.queue).get();
  return w;
}

ServerFinding check_audit() {
  using State = ServerFinding::State;
  try {
    const fs::path file = audit_file();
    if (file.empty())
      return {"audit", State::none, std::string("off: there is no ") + kSettings,
              "docs/how-to/pacs.md says how it is set"};
    const AuditSettings settings = read_audit_settings(file);
    const AuditTrail trail(settings);
    make_output_folder(settings.queue);
    if (::access(settings.queue.c_str(), W_OK | X_OK) != 0)
      return {"audit", State::bad, user() + " cannot write into '" + settings.queue.string() + "': " + reason(),
              "let who works here write there"};
    const auto lost = trail.waiting().lost;  // told below, even where the server now takes the message about it
    std::string why;
    try {
      trail.deliver();
      if (settings.to.starts_with("file:"))
        append(settings.to.substr(5), {});
      else
        send_all(settings, {});
    } catch (const Error& e) {
      why = e.what();
    }
    const AuditTrail::Waiting w = trail.waiting();
    const std::string says = settings.to + ": " + std::to_string(w.messages) + " messages wait (" +
                             format_number(std::round(static_cast<double>(w.bytes) / 1e4) / 100) + " of " +
                             format_number(settings.queue_mb) + " MB), " + std::to_string(lost) + " are lost";
    if (!why.empty()) return {"audit", State::bad, says + "; " + why, "mend it: they are sent with the next one"};
    if (lost > 0) return {"audit", State::bad, says, "find out why: the disk was full, or the queue is too small"};
    return {"audit", State::good, says, {}};
  } catch (const Error& e) {
    return bad_finding("audit", e);
  }
}

}  // namespace osteo::inline hospital
