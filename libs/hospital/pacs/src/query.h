// Questions to a node: what may be asked, and asking by C-FIND, study root. Private to libs/hospital/pacs.
#pragma once
#include <memory>
#include <vector>

#include "node.h"
#include "osteo/hospital/pacs/fetch.h"

namespace osteo::inline hospital::pacs {

/// Error(usage) when nothing is asked for, or what cannot be (a UID that is none, wildcards).
void check_keys(const SeriesKeys& keys);
/// By study and number.
[[nodiscard]] bool before(const RemoteSeries& a, const RemoteSeries& b);

class Query : public Scu {
 public:
  /// Connects. Error(failed).
  explicit Query(const DicomPeer& peer);
  ~Query() override;
  /// At most `most` answers. Errors: usage when there are more, failed.
  [[nodiscard]] std::vector<std::unique_ptr<DcmDataset>> ask(DcmDataset& keys, std::size_t most);

 private:
  OFCondition handleFINDResponse(T_ASC_PresentationContextID id, QRResponse* response, OFBool& wait) override;

  std::string peer_;
  std::vector<std::unique_ptr<DcmDataset>> found_;
  std::size_t most_ = 0;
  bool more_ = false;
  unsigned status_ = 0;
};

}  // namespace osteo::inline hospital::pacs
