#include "node.h"

#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/oflog/oflog.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "node_tables.h"

namespace osteo::inline hospital {

std::string checked_ae(std::string_view title) {
  while (!title.empty() && title.front() == ' ') title.remove_prefix(1);
  while (!title.empty() && title.back() == ' ') title.remove_suffix(1);
  bool good = !title.empty() && title.size() <= 16;
  for (const char c : title) good = good && c >= ' ' && c <= '~' && c != '\\';
  if (!good)
    throw Error(ExitCode::usage, "'" + std::string(title) + "' is no title of a DICOM node",
                "1 to 16 characters, no backslash, like ORTHANC");
  return std::string(title);
}

DicomPeer parse_peer(std::string_view text) {
  const auto bad = [&] {
    return Error(ExitCode::usage, "'" + std::string(text) + "' is no DICOM node",
                 "TITLE@HOST:PORT, like ORTHANC@127.0.0.1:4242");
  };
  const auto at = text.rfind('@'), colon = text.rfind(':');
  if (at == std::string_view::npos || colon == std::string_view::npos || colon < at || colon == at + 1) throw bad();
  DicomPeer peer;
  peer.ae = checked_ae(text.substr(0, at));
  peer.host = std::string(text.substr(at + 1, colon - at - 1));
  if (peer.host.find(':') != std::string::npos)
    throw Error(ExitCode::usage, "'" + peer.host + "': only names and IPv4 addresses are known here",
                "TITLE@HOST:PORT, like ORTHANC@127.0.0.1:4242");
  const std::string_view port = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), peer.port);
  if (error != std::errc{} || end != port.data() + port.size() || peer.port < 1 || peer.port > 65535) throw bad();
  return peer;
}

std::string peer_text(const DicomPeer& peer) {
  return peer.ae + "@" + peer.host + ":" + std::to_string(peer.port);
}

namespace pacs {

void quiet_dcmtk(double timeout_s) {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  // A message is several small packets: waiting for the answer to each before the next (Nagle) costs 0.1 s an object.
  // DCMTK takes this from the environment alone; who has set it keeps what was set.
  ::setenv("TCP_NODELAY", "1", 0);
  dcmConnectionTimeout.set(static_cast<Sint32>(std::ceil(timeout_s)));
  // Also while TLS shakes hands, of which DCMTK keeps no time itself.
  dcmSocketReceiveTimeout.set(static_cast<Sint32>(std::ceil(timeout_s)));
  dcmSocketSendTimeout.set(static_cast<Sint32>(std::ceil(timeout_s)));
  dcmDisableGethostbyaddr.set(OFTrue);  // nobody needs to know the peer's name, and asking can take long
}

void warn_of_open_key(const DicomTls& tls, const Context& context) {
  struct stat facts {};
  if (!tls.key.empty() && ::stat(tls.key.c_str(), &facts) == 0 && (facts.st_mode & 077) != 0)
    context.warn("others may read the key '" + tls.key + "': chmod 600 " + tls.key);
}

namespace {

constexpr auto kTlsProfile = TSP_Profile_BCP195_ND;

/// Later versions of DCMTK ask for the profile already here.
auto set_certificate(auto& layer, const std::string& file, auto profile) {
  if constexpr (requires { layer.setCertificateFile(file.c_str(), DCF_Filetype_PEM, profile); })
    return layer.setCertificateFile(file.c_str(), DCF_Filetype_PEM, profile);
  else
    return layer.setCertificateFile(file.c_str(), DCF_Filetype_PEM);
}

}  // namespace

std::unique_ptr<DcmTLSTransportLayer> tls_layer(const DicomTls& tls, T_ASC_NetworkRole role) {
  if (tls.ca.empty()) {
    if (!tls.certificate.empty() || !tls.key.empty())
      throw Error(ExitCode::usage, "a certificate, but none that is trusted", "--tls-ca names those of the other side");
    return nullptr;
  }
  if (tls.certificate.empty() != tls.key.empty() || (role == NET_ACCEPTOR && tls.key.empty()))
    throw Error(ExitCode::usage, "TLS needs a certificate and its key", "--tls-certificate and --tls-key");
  require_readable(tls.ca);
  DcmTLSTransportLayer::initializeOpenSSL();
  auto layer = std::make_unique<DcmTLSTransportLayer>(role, nullptr, OFFalse);
  layer->setPrivateKeyPasswd("");  // or OpenSSL would ask at the terminal
  const auto need = [](bool good, const std::string& file, const char* what) {
    if (!good)
      throw Error(ExitCode::cannot_read, "'" + file + "' " + what,
                  "files in PEM form are needed, a key without a password");
  };
  need(layer->addTrustedCertificateFile(tls.ca.c_str(), DCF_Filetype_PEM).good(), tls.ca, "holds no certificate");
  if (!tls.key.empty()) {
    require_readable(tls.certificate);
    require_readable(tls.key);
    need(layer->setPrivateKeyFile(tls.key.c_str(), DCF_Filetype_PEM).good(), tls.key, "holds no key that can be read");
    need(set_certificate(*layer, tls.certificate, kTlsProfile).good(), tls.certificate, "holds no certificate");
    need(layer->checkPrivateKeyMatchesCertificate() == OFTrue, tls.key, "is not the key of the certificate");
  }
  layer->setCertificateVerification(DCV_requireCertificate);
  if (layer->setTLSProfile(kTlsProfile).bad() || layer->activateCipherSuites().bad())
    throw Error(ExitCode::failed, "this machine's OpenSSL knows none of the ciphers that DICOM asks for");
  return layer;
}

void Scu::prepare(const DicomPeer& peer) {
  DcmSCU& scu = *this;
  quiet_dcmtk(peer.timeout_s);
  const auto seconds = static_cast<Uint32>(std::ceil(peer.timeout_s));
  scu.setAETitle(peer.own_ae.c_str());
  scu.setPeerAETitle(peer.ae.c_str());
  scu.setPeerHostName(peer.host.c_str());
  scu.setPeerPort(static_cast<Uint16>(peer.port));
  scu.setACSETimeout(seconds);
  scu.setDIMSETimeout(seconds);
  scu.setDIMSEBlockingMode(DIMSE_NONBLOCKING);
  scu.setConnectionTimeout(static_cast<Sint32>(seconds));
  scu.setMaxReceivePDULength(ASC_MAXIMUMPDUSIZE);
}

void Scu::connect(const DicomPeer& peer) {
  if (layer == nullptr) layer = tls_layer(peer.tls, NET_REQUESTOR);
  OFCondition done = initNetwork();
  if (done.good() && layer != nullptr) done = useSecureConnection(layer.get());
  if (done.good()) done = negotiateAssociation();
  if (done.good()) return;
  if (done == NET_EC_NoAcceptablePresentationContexts)
    throw Error(ExitCode::failed, peer_text(peer) + " takes none of these kinds of objects",
                "ask its administrator what it accepts");
  std::string why = done.text();
  for (char& c : why)
    if (c == '\n') c = ' ';
  const bool rejected = done == DUL_ASSOCIATIONREJECTED || why.find("Reject") != std::string::npos;
  throw Error(ExitCode::failed,
              peer_text(peer) + (rejected ? " rejects " + peer.own_ae : " cannot be reached") + ": " + why,
              rejected ? "the node must know our title (--ae) and we must call it by its own"
                       : "check host, port and firewall");
}

bool is_uid(std::string_view text) {
  if (text.empty() || text.size() > 64 || text.front() == '.' || text.back() == '.') return false;
  bool dot = false;
  for (const char c : text) {
    if (c == '.' && dot) return false;
    dot = c == '.';
    if (!dot && (c < '0' || c > '9')) return false;
  }
  return true;
}

std::string text_of(DcmItem& item, const DcmTagKey& tag) {
  OFString value;
  if (item.findAndGetOFStringArray(tag, value).bad()) return {};
  std::string text(value.c_str(), value.size());
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

std::string class_name(const std::string& uid) {
  const auto* const row = std::ranges::find(kStorageClasses, uid, &UidRow::uid);
  if (row != kStorageClasses.end()) return std::string(row->name);
  const char* const name = dcmFindNameOfUID(uid.c_str());
  if (name == nullptr) return uid;
  // DCMTK's names have no spaces: "CTImageStorage", "EncapsulatedSTLStorage".
  std::string text;
  for (const char* c = name; *c != '\0'; ++c) {
    const auto upper = [](char x) { return x >= 'A' && x <= 'Z'; };
    const bool begins = c != name && upper(*c) && (!upper(c[-1]) || (c[1] != '\0' && !upper(c[1])));
    if (begins) text += ' ';
    text += *c;
  }
  return text;
}

std::string status_text(unsigned status) {
  char code[8];
  std::snprintf(code, sizeof code, "%04X", status);
  const char* const what = status == 0x0110               ? "it failed to process it"
                           : status == 0x0111             ? "it has another object of this UID"
                           : status == 0x0117             ? "the UID is not valid"
                           : status == 0x0122             ? "it does not take this kind of object"
                           : status == 0x0124             ? "we may not send to it"
                           : status == 0xB000             ? "it changed values"
                           : status == 0xB006             ? "it left values out"
                           : status == 0xB007             ? "the object does not match its kind, it says"
                           : (status & 0xFF00U) == 0xA700 ? "it is out of resources"
                           : (status & 0xFF00U) == 0xA900 ? "the object does not match its kind"
                           : (status & 0xF000U) == 0xC000 ? "it cannot understand the object"
                                                          : "it rejected it";
  return std::string(what) + " (status " + code + ")";
}

bool read_head(const fs::path& file, ObjectHead& head, DcmFileFormat* whole) {
  DcmFileFormat mine;
  DcmFileFormat& format = whole != nullptr ? *whole : mine;
  // Long values are not read before they are asked for.
  if (format.loadFileUntilTag(file.c_str(), EXS_Unknown, EGL_noChange, 1024, ERM_autoDetect, DCM_PixelData).bad())
    return false;
  DcmDataset& data = *format.getDataset();
  head = {text_of(data, DCM_SOPClassUID), text_of(data, DCM_SOPInstanceUID), text_of(data, DCM_StudyInstanceUID),
          text_of(data, DCM_SeriesInstanceUID), DcmXfer(data.getOriginalXfer()).getXferID()};
  return is_uid(head.sop_class) && is_uid(head.sop_instance);
}

bool holds_data_set(const fs::path& file, std::uint64_t bytes) {
  // Preamble, "DICM", then (0002,0000) UL 4 and how long the rest of the meta information is (PS3.10 7.1).
  std::ifstream in(file, std::ios::binary);
  std::array<unsigned char, 144> head{};
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return false;
  const std::uint64_t group =
      head[140] | head[141] << 8U | head[142] << 16U | static_cast<std::uint64_t>(head[143]) << 24U;
  std::error_code error;
  return fs::file_size(file, error) == head.size() + group + bytes && !error;
}

}  // namespace pacs
}  // namespace osteo::inline hospital
