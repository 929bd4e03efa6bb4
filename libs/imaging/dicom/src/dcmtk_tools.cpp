#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/oflog/oflog.h>

#include <algorithm>
#include <cstdio>
#include <mutex>

#include "dcmtk_tools.h"

namespace osteo::inline imaging::dicom {

void quiet_dcmtk() {
  static std::once_flag once;
  std::call_once(once, [] { OFLog::configure(OFLogger::OFF_LOG_LEVEL); });
}

std::string uid_of(const std::string& hex) {
  // Long division of a 128-bit number in base 16 by 10.
  std::string digits;
  std::string number = hex.substr(0, 32);
  while (!number.empty()) {
    int remainder = 0;
    std::string quotient;
    for (const char c : number) {
      const int value = remainder * 16 + (c <= '9' ? c - '0' : c - 'a' + 10);
      const int q = value / 10;
      remainder = value % 10;
      if (!quotient.empty() || q > 0) quotient += "0123456789abcdef"[q];
    }
    digits.insert(digits.begin(), static_cast<char>('0' + remainder));
    number = quotient;
  }
  return "2.25." + digits;
}

std::string valid_uid(const std::string& uid) {
  return DcmUniqueIdentifier::checkStringValue(uid.c_str(), "1").good() ? uid : uid_of(hash_text(uid));
}

void load_identity(const DicomSeries& source, DcmFileFormat& file, const Context& context) {
  const auto first =
      std::find_if(source.headers.begin(), source.headers.end(), [](const auto& h) { return h.usable(); });
  if (first == source.headers.end() || file.loadFile(first->file.c_str(), EXS_Unknown, EGL_noChange, 64).bad())
    throw Error(ExitCode::corrupt, "the source series holds no slice that can be read");
  DcmDataset& d = *file.getDataset();
  delete d.remove(DCM_PixelData);
  std::string names;
  const auto reported = [&](const DcmElement& e) {
    names += (names.empty() ? "" : ", ") + std::string(DcmTag(e.getTag()).getTagName());
  };
  for (unsigned long i = 0; i < d.card(); ++i) {
    DcmElement* const e = d.getElement(i);
    if (!e->isLeaf() || e->getGTag() > 0x0020) continue;
    OFString text;
    if (e->ident() == EVR_UI) {
      if (e->getOFStringArray(text).bad() || text.empty() || e->checkValue("1").good()) continue;
      reported(*e);
      require(e->putString(valid_uid(text.c_str()).c_str()), first->file);
    } else if (e->getLength() > 0 && e->checkValue("1-n").bad()) {
      reported(*e);
      require(e->putString(""), first->file);
    }
  }
  if (!names.empty()) context.warn("values of the source that DICOM does not allow are not taken over: " + names);
}

void require(const OFCondition& condition, const fs::path& path) {
  if (condition.good()) return;
  throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + condition.text(),
              "see that the disk has room and the folder may be written");
}

std::string decimal(double value) {
  char text[40];
  for (int precision = 15; precision > 0; --precision) {
    std::snprintf(text, sizeof text, "%.*g", precision, value == 0 ? 0.0 : value);
    if (std::char_traits<char>::length(text) <= 16) break;
  }
  return text;
}

}  // namespace osteo::inline imaging::dicom
