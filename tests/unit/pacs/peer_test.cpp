// How a node is named, and what is counted.
#include "osteo/hospital/pacs/peer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "node.h"
#include "osteo/core/base/error.h"
#include "osteo/hospital/pacs/receive.h"
#include "osteo/hospital/pacs/send.h"

namespace osteo {
namespace {

TEST(Peer, IsReadStrictly) {
  const DicomPeer p = parse_peer(" ORTHANC @pacs.example:4242");
  EXPECT_EQ(p.ae, "ORTHANC");
  EXPECT_EQ(p.host, "pacs.example");
  EXPECT_EQ(p.port, 4242);
  EXPECT_EQ(peer_text(p), "ORTHANC@pacs.example:4242");
  EXPECT_EQ(parse_peer("A@B@h:1").ae, "A@B");  // a title may hold it
  for (const char* const bad : {"", "@h:1", "A@:1", "A@h", "A@h:", "A@h:0", "A@h:65536", "A@h:1x", "A@h:-1", "h:104",
                                "A@[::1]:104", "SEVENTEENLETTERS1@h:1", "A\\B@h:1", "\x01@h:1"})
    EXPECT_THROW(static_cast<void>(parse_peer(bad)), Error) << bad;
}

TEST(Tls, WhatIsMissingIsToldBeforeAnyFileIsRead) {
  const auto code = [](const DicomTls& tls, T_ASC_NetworkRole role) {
    try {
      static_cast<void>(pacs::tls_layer(tls, role));
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::ok;
  };
  const std::string ca = testing::TempDir() + "no-such-ca.pem", own = testing::TempDir() + "no-such.pem";
  for (const T_ASC_NetworkRole role : {NET_REQUESTOR, NET_ACCEPTOR}) {
    EXPECT_EQ(code({}, role), ExitCode::ok) << "no TLS";
    EXPECT_EQ(pacs::tls_layer({}, role), nullptr);
    EXPECT_EQ(code({"", own, ""}, role), ExitCode::usage);
    EXPECT_EQ(code({"", "", own}, role), ExitCode::usage);
    EXPECT_EQ(code({"", own, own}, role), ExitCode::usage);
    EXPECT_EQ(code({ca, own, ""}, role), ExitCode::usage);
    EXPECT_EQ(code({ca, "", own}, role), ExitCode::usage);
    EXPECT_EQ(code({ca, own, own}, role), ExitCode::no_input) << "its files are not there";
  }
  EXPECT_EQ(code({ca, "", ""}, NET_REQUESTOR), ExitCode::no_input) << "a client may do without";
  EXPECT_EQ(code({ca, "", ""}, NET_ACCEPTOR), ExitCode::usage);
}

TEST(Receive, NeedsToKnowWhoMaySend) {
  try {
    receive_objects(testing::TempDir() + "nobody", {}, {}, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    EXPECT_NE(e.advice().find("--allow"), std::string::npos);
  }
}

TEST(Receive, CountsAreWrittenAsPrometheusReadsThem) {
  ReceiveCounters c;
  c.stored = 7;
  const std::string text = metrics_text(c);
  EXPECT_NE(text.find("# TYPE osteotome_receive_stored_total counter\nosteotome_receive_stored_total 7\n"),
            std::string::npos)
      << text;
  EXPECT_EQ(std::ranges::count(text, '\n'), 3 * 10);
}

TEST(Send, WhatIsNoObjectIsNotSent) {
  const fs::path folder = fs::path(testing::TempDir()) / "no-objects";
  fs::create_directories(folder);
  write_file(folder / "a.txt", "words");
  EXPECT_THROW(static_cast<void>(list_objects({folder})), Error);
  EXPECT_THROW(static_cast<void>(list_objects({folder / "none"})), Error);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace osteo
