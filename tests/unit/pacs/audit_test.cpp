// Audit messages: their form, and that they come through, wait, or are told to be lost, whatever the other side does.
#include "osteo/hospital/pacs/audit.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

// A syslog server on this machine that takes connections as it is told to.
class Syslog {
 public:
  explicit Syslog(bool hangs_up = false, int port = 0) : hangs_up_(hangs_up) {
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
    EXPECT_EQ(::listen(fd_, 8), 0);
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~Syslog() { stop(); }
  Syslog(const Syslog&) = delete;
  Syslog& operator=(const Syslog&) = delete;

  [[nodiscard]] int port() const { return port_; }
  // All that came, as messages.
  std::vector<std::string> stop() {
    if (thread_.joinable()) {
      ::shutdown(fd_, SHUT_RDWR);
      thread_.join();
      ::close(fd_);
    }
    std::vector<std::string> all;
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t blank = text_.find(' ', at);
      const std::size_t n = std::stoul(text_.substr(at, blank - at));
      EXPECT_LE(blank + 1 + n, text_.size()) << "a frame is cut";
      all.push_back(text_.substr(blank + 1, n));
      at = blank + 1 + n;
    }
    return all;
  }

 private:
  void serve() {
    for (int c = 0; (c = ::accept(fd_, nullptr, nullptr)) >= 0;) {
      char some[4096];
      for (ssize_t n = 0; !hangs_up_ && (n = ::read(c, some, sizeof some)) > 0;)
        text_.append(some, static_cast<std::size_t>(n));
      ::close(c);
    }
  }
  const bool hangs_up_;
  int fd_ = -1, port_ = 0;
  std::string text_;
  std::thread thread_;
};

class Audit : public ::testing::Test {
 protected:
  Audit() {
    context_.on_log([this](LogLevel level, std::string_view text) {
      if (level == LogLevel::warning) warned_.emplace_back(text);
    });
    settings_.queue = folder_.path() / "queue";
    settings_.timeout_s = 1;
  }
  void notify(const std::string& case_code) const {
    AuditEvent e;
    e.kind = AuditEvent::Kind::approve;
    e.case_code = case_code;
    AuditTrail(settings_).notify(e, context_);
  }
  [[nodiscard]] AuditTrail::Waiting waiting() const { return AuditTrail(settings_).waiting(); }

  TemporaryFolder folder_;
  AuditSettings settings_;
  Context context_;
  mutable std::vector<std::string> warned_;
};

TEST_F(Audit, AMessageSaysWhatTheProfileWants) {
  AuditEvent e;
  e.kind = AuditEvent::Kind::send;
  e.peer = "ORTHANC@127.0.0.1:4242";
  e.studies = {{"1.2.3", "A&<\"1\xE9", {{"1.2.840.10008.5.1.4.1.1.2", 7}}}};
  const std::string text = audit_message(e, "ward 3");
  EXPECT_TRUE(text.starts_with("<85>1 2")) << text;
  for (const char* const part :
       {" osteo ", " DICOM+RFC3881 - \xEF\xBB\xBF<?xml", "EventActionCode=\"R\"", "EventOutcomeIndicator=\"0\"",
        R"(<EventID csd-code="110104" codeSystemName="DCM")",
        R"(UserID="ORTHANC@127.0.0.1:4242" UserIsRequestor="false")", R"(AuditSourceID="ward 3")",
        R"(ParticipantObjectID="1.2.3")", R"(<SOPClass UID="1.2.840.10008.5.1.4.1.1.2" NumberOfInstances="7"/>)",
        R"(ParticipantObjectID="A&amp;&lt;&quot;1?" ParticipantObjectTypeCode="1")", "</AuditMessage>"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("ParticipantObjectName"), std::string::npos) << "no name of a patient";
  EXPECT_EQ(text.find('\n'), std::string::npos) << "a line of a file";
  e.good = false;
  EXPECT_NE(audit_message(e, "").find("EventOutcomeIndicator=\"4\""), std::string::npos);
}

TEST_F(Audit, OffIsOff) {
  notify("a");
  EXPECT_FALSE(fs::exists(settings_.queue));
  EXPECT_TRUE(warned_.empty());
}

TEST_F(Audit, AFileGetsALineEach) {
  settings_.to = "file:" + (folder_.path() / "audit.log").string();
  notify("first");
  fs::rename(folder_.path() / "audit.log", folder_.path() / "audit.log.1");  // as logs are rotated
  notify("second");
  notify("third");
  EXPECT_NE(read_text(folder_.path() / "audit.log.1").find("\"first\""), std::string::npos);
  const std::string now = read_text(folder_.path() / "audit.log");
  EXPECT_EQ(std::ranges::count(now, '\n'), 2);
  EXPECT_LT(now.find("\"second\""), now.find("\"third\""));
  EXPECT_EQ(waiting().messages, 0U);
  EXPECT_TRUE(warned_.empty());
}

TEST_F(Audit, ADeadServerIsToldAndGetsAllWhenItLives) {
  int port = 0;
  {
    Syslog gone;
    port = gone.port();
  }
  settings_.to = "tcp://127.0.0.1:" + std::to_string(port);
  notify("one");
  notify("two");
  EXPECT_EQ(warned_.size(), 2U);
  EXPECT_EQ(waiting().messages, 2U);
  Syslog back(false, port);
  notify("three");
  EXPECT_EQ(warned_.size(), 2U);
  EXPECT_EQ(waiting().messages, 0U);
  const auto came = back.stop();
  ASSERT_EQ(came.size(), 3U);
  EXPECT_NE(came[0].find("\"one\""), std::string::npos);
  EXPECT_NE(came[2].find("\"three\""), std::string::npos);
}

TEST_F(Audit, AServerThatHangsUpHasNotTakenIt) {
  Syslog rude(true);
  settings_.to = "tcp://127.0.0.1:" + std::to_string(rude.port());
  for (int n = 0; n < 20; ++n) notify("x");
  EXPECT_EQ(waiting().messages, 20U);
  EXPECT_EQ(warned_.size(), 20U);
}

TEST_F(Audit, AFullDiskWaitsAndAFullQueueIsCounted) {
  settings_.to = "file:/dev/full";
  settings_.queue_mb = 0.003;
  notify("kept");
  EXPECT_EQ(waiting().messages, 1U);
  ASSERT_EQ(warned_.size(), 1U);
  EXPECT_NE(warned_[0].find("No space left"), std::string::npos) << warned_[0];
  for (int n = 0; n < 10; ++n) notify("more");
  const auto w = waiting();
  EXPECT_LE(w.bytes, 3000U);
  EXPECT_GT(w.messages, 0U);
  EXPECT_EQ(w.messages + w.lost, 11U) << "none goes without a count";
  settings_.to = "file:" + (folder_.path() / "audit.log").string();
  AuditTrail(settings_).deliver();
  const std::string text = read_text(folder_.path() / "audit.log");
  EXPECT_NE(text.find("\"kept\""), std::string::npos);
  EXPECT_NE(text.find("110113"), std::string::npos) << "what was lost is told to who reads the log";
  EXPECT_NE(text.find("ParticipantObjectID=\"" + std::to_string(w.lost) + "\""), std::string::npos);
  EXPECT_EQ(waiting().messages + waiting().lost, 0U);
}

TEST_F(Audit, WithoutAPlaceToWaitWorkGoesOnAndIsWarnedOf) {
  write_file(folder_.path() / "file", "");
  settings_.queue = folder_.path() / "file/queue";
  settings_.to = "file:" + (folder_.path() / "audit.log").string();
  notify("x");
  ASSERT_FALSE(warned_.empty());
  EXPECT_NE(warned_[0].find("is lost"), std::string::npos) << warned_[0];
  EXPECT_NE(warned_[0].find("cannot even be counted"), std::string::npos) << warned_[0];
}

TEST_F(Audit, SettingsThatAreWrongAreRefused) {
  const fs::path file = folder_.path() / "audit.json";
  const auto refused = [&](const std::string& members) {
    write_file(file, "{\"osteotome_audit\": 1, " + members + "}");
    try {
      static_cast<void>(read_audit_settings(file));
    } catch (const Error& e) {
      return e.code() == ExitCode::usage || e.code() == ExitCode::no_input;
    }
    return false;
  };
  EXPECT_FALSE(refused(R"("to": "tls://log.example:6514", "queue": "/q")"));
  EXPECT_FALSE(refused(R"("to": "file:/a", "queue": "/q", "queue_mb": 1, "source": "x", "timeout_s": 2)"));
  EXPECT_TRUE(refused(R"("to": "udp://log.example:514", "queue": "/q")"));
  EXPECT_TRUE(refused(R"("to": "tcp://log.example", "queue": "/q")"));
  EXPECT_TRUE(refused(R"("to": "tcp://log.example:601/x", "queue": "/q")"));
  EXPECT_TRUE(refused(R"("to": "file:/a", "queue": "q")"));
  EXPECT_TRUE(refused(R"("to": "file:/a")"));
  EXPECT_TRUE(refused(R"("to": "tcp://a:1", "queue": "/q", "ca": "/etc/hostname")")) << "certificates without TLS";
  EXPECT_TRUE(refused(R"("to": "tls://a:1", "queue": "/q", "ca": "/not/there.pem")"));
  EXPECT_TRUE(refused(R"("to": "file:/a", "queue": "/q", "que": 1)"));
}

// Python's TLS, which asks for our certificate when `strict`; what it reads goes into a file.
constexpr const char* kTlsServer = R"(
import socket, ssl, sys
folder, strict = sys.argv[1], sys.argv[2] == "strict"
c = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
c.load_cert_chain(folder + "/c.pem", folder + "/k.pem")
if strict:
    c.load_verify_locations(folder + "/c.pem")
    c.verify_mode = ssl.CERT_REQUIRED
s = socket.create_server(("127.0.0.1", 0))
print(s.getsockname()[1], flush=True)
for _ in range(int(sys.argv[3])):
    try:
        with c.wrap_socket(s.accept()[0], server_side=True) as t, open(folder + "/came", "ab") as f:
            while some := t.recv(4096):
                f.write(some)
    except OSError:
        pass
)";

TEST_F(Audit, TlsToWhoHasTheCertificateAlone) {
  const std::string folder = folder_.path().string();
  const std::string make =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=log -addext "
      "subjectAltName=IP:127.0.0.1 -keyout '" +
      folder + "/k.pem' -out '" + folder + "/c.pem' 2>/dev/null && python3 -c 'import ssl'";
  if (std::system(make.c_str()) != 0) GTEST_SKIP() << "no openssl or python3 here";
  write_file(folder_.path() / "server.py", kTlsServer);
  settings_.timeout_s = 60;  // a busy machine takes seconds for a handshake
  const auto with_server = [&](const std::string& how, int connections, const std::function<void()>& use) {
    FILE* const server = ::popen(
        ("python3 '" + folder + "/server.py' '" + folder + "' " + how + " " + std::to_string(connections)).c_str(),
        "r");
    char port[16] = "";
    ASSERT_NE(std::fgets(port, sizeof port, server), nullptr);
    settings_.to = "tls://127.0.0.1:" + std::to_string(std::atoi(port));
    use();
    ::pclose(server);
  };
  with_server("open", 2, [&] {
    settings_.ca.clear();
    notify("not trusted");
    EXPECT_EQ(waiting().messages, 1U) << "a certificate that nobody has signed";
    settings_.ca = folder + "/c.pem";
    notify("trusted");
    EXPECT_EQ(waiting().messages, 0U);
  });
  EXPECT_EQ(warned_.size(), 1U);
  const std::string came = read_text(folder_.path() / "came");
  EXPECT_LT(came.find("\"not trusted\""), came.find("\"trusted\""));
  fs::remove(folder_.path() / "came");
  with_server("strict", 2, [&] {
    notify("nobody");
    EXPECT_EQ(waiting().messages, 1U) << "who is asked for a certificate and has none";
    settings_.certificate = folder + "/c.pem";
    settings_.key = folder + "/k.pem";
    notify("somebody");
    EXPECT_EQ(waiting().messages, 0U);
  });
  EXPECT_NE(read_text(folder_.path() / "came").find("\"somebody\""), std::string::npos);
}

}  // namespace
}  // namespace osteo
