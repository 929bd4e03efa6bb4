// Questions to a node by C-FIND, study root. Private to libs/pacs.
#pragma once
#include <memory>
#include <vector>

#include "node.h"

namespace osteo::pacs {

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

}  // namespace osteo::pacs
