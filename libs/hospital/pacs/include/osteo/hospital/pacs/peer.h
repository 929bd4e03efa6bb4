// Another DICOM node and how it is spoken to.
#pragma once
#include <string>
#include <string_view>

namespace osteo::inline hospital {

/// DICOM over TLS (PS3.15 B, BCP 195: TLS 1.2 or later). Files in PEM form; a key with a password is rejected.
struct DicomTls {
  std::string ca;  ///< certificates that are trusted: the other side must have one that these sign. Empty: no TLS
  std::string certificate, key;  ///< our own; a client may do without, where the node does not ask for one
};

struct DicomPeer {
  std::string ae;    ///< its title
  std::string host;  ///< name or IPv4 address: DCMTK 3.6.7 knows no IPv6
  int port = 104;
  std::string own_ae = "OSTEOTOME";  ///< what we call ourselves
  double timeout_s = 30;             ///< for the connection and for each answer
  DicomTls tls;  ///< the name in the node's certificate is not compared: trust only its own issuer or itself
};

/// An application entity's title: 1 to 16 characters of ASCII without backslash and control characters, spaces around
/// it do not count (PS3.5, AE). Error(usage) otherwise.
[[nodiscard]] std::string checked_ae(std::string_view title);

/// "TITLE@HOST:PORT", like "ORTHANC@127.0.0.1:4242". Error(usage) for anything else.
[[nodiscard]] DicomPeer parse_peer(std::string_view text);

/// "ORTHANC@127.0.0.1:4242".
[[nodiscard]] std::string peer_text(const DicomPeer& peer);

/// Markdown for the conformance statement: services, roles, classes and transfer syntaxes as they are negotiated, TLS,
/// de-identification.
[[nodiscard]] std::string network_conformance();

}  // namespace osteo::inline hospital
