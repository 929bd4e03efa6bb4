// What both directions share. Private to libs/hospital/pacs.
#pragma once
#include <memory>

#include "dcmtk/config/osconfig.h"
// DCMTK's configuration first.
#include "dcmtk/dcmdata/dctk.h"
#include "dcmtk/dcmnet/dcmtrans.h"
#include "dcmtk/dcmnet/dimse.h"
#include "dcmtk/dcmnet/scu.h"
#include "dcmtk/dcmtls/tlslayer.h"
#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/peer.h"

namespace osteo::inline hospital::pacs {

/// DCMTK's messages go nowhere, and a connection may not wait for ever.
void quiet_dcmtk(double timeout_s);

/// Warns where others than the owner may read the private key.
void warn_of_open_key(const DicomTls& tls, const Context& context);
/// What speaks TLS; none where `tls` names no trusted certificates. Errors: usage, no_input, cannot_read.
[[nodiscard]] std::unique_ptr<DcmTLSTransportLayer> tls_layer(const DicomTls& tls, T_ASC_NetworkRole role);

// A base of its own, so that it outlives the connection that uses it.
struct TlsHolder {
  std::unique_ptr<DcmTLSTransportLayer> layer;
};
class Scu : private TlsHolder, public DcmSCU {
 public:
  /// Sets titles, address and limits of time; contexts are the caller's.
  void prepare(const DicomPeer& peer);
  /// Connects and negotiates. Error(failed) in words that say whose title was rejected.
  void connect(const DicomPeer& peer);
};

/// 1 to 64 digits and dots, no empty component (PS3.5, UI). Leading zeros are let pass: scanners write them.
[[nodiscard]] bool is_uid(std::string_view text);

/// Of an element; empty when it is not there. Padding is taken off.
[[nodiscard]] std::string text_of(DcmItem& item, const DcmTagKey& tag);

/// What a class of objects is called; its UID when DCMTK has no name for it.
[[nodiscard]] std::string class_name(const std::string& uid);

/// What a C-STORE status other than success means (PS3.4 B.2.3, PS3.7 C).
[[nodiscard]] std::string status_text(unsigned status);

/// The head of a file with what a node needs to know of it; false when it is no DICOM object.
struct ObjectHead {
  std::string sop_class, sop_instance, study, series, syntax;
};
/// `whole`, when given, then holds what was read.
[[nodiscard]] bool read_head(const fs::path& file, ObjectHead& head, DcmFileFormat* whole = nullptr);

/// Whether the bytes after the file meta information are `bytes` in number: a full disk can cut a file without a word.
[[nodiscard]] bool holds_data_set(const fs::path& file, std::uint64_t bytes);

}  // namespace osteo::inline hospital::pacs
