#include "query.h"

#include "node_tables.h"

namespace osteo::inline hospital::pacs {

Query::Query(const DicomPeer& peer) : peer_(peer_text(peer)) {
  prepare(peer);
  OFList<OFString> syntaxes;
  for (const UidRow& row : kPlainSyntaxes) syntaxes.push_back(row.uid.data());
  addPresentationContext(kFindStudyRoot.uid.data(), syntaxes);
  connect(peer);
}

Query::~Query() {
  if (isConnected()) releaseAssociation();
}

std::vector<std::unique_ptr<DcmDataset>> Query::ask(DcmDataset& keys, std::size_t most) {
  const auto id = findPresentationContextID(kFindStudyRoot.uid.data(), "");
  found_.clear();
  most_ = most;
  more_ = false;
  const OFCondition done = sendFINDRequest(id, &keys, nullptr);
  if (done.bad()) throw Error(ExitCode::failed, peer_ + " does not answer: " + done.text());
  if (more_)
    throw Error(ExitCode::usage, "more than " + std::to_string(most) + " match",
                "ask for less: a date, a modality, a study");
  if (status_ != STATUS_Success)
    throw Error(ExitCode::failed, peer_ + " rejects the question: " + status_text(status_));
  return std::move(found_);
}

OFCondition Query::handleFINDResponse(T_ASC_PresentationContextID, QRResponse* response, OFBool& wait) {
  more_ = found_.size() > most_;
  status_ = response->m_status;
  wait = DICOM_PENDING_STATUS(status_) && !more_ ? OFTrue : OFFalse;
  if (response->m_dataset != nullptr && !more_) {
    found_.emplace_back(response->m_dataset);
    response->m_dataset = nullptr;
  }
  return EC_Normal;
}

}  // namespace osteo::inline hospital::pacs
