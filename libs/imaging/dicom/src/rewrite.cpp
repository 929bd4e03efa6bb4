#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include "dcmtk_tools.h"
#include "rewrite.h"

namespace osteo::inline imaging::dicom {

std::string rewrite_plainly(const std::filesystem::path& from, const std::filesystem::path& to) {
  quiet_dcmtk();
  DcmFileFormat file;
  OFCondition status = file.loadFile(from.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect);
  if (status.bad()) return status.text();
  if (file.getDataset()->card() == 0) return "it holds no data elements";
  const DcmXfer syntax(file.getDataset()->getOriginalXfer());
  const E_TransferSyntax plain = syntax.isEncapsulated() ? syntax.getXfer() : EXS_LittleEndianExplicit;
  status = file.chooseRepresentation(plain, nullptr);
  if (status.bad()) return status.text();
  status = file.saveFile(to.c_str(), plain);
  return status.bad() ? status.text() : "";
}

}  // namespace osteo::inline imaging::dicom
