#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <ctime>

#include "dcmtk_tools.h"
#include "object_identity.h"

namespace osteo::inline imaging::dicom {
namespace {

bool of_space(const DcmTagKey& tag) {
  return tag == DCM_FrameOfReferenceUID || tag == DCM_PositionReferenceIndicator;
}

}  // namespace

void put(DcmItem& d, const DcmTagKey& tag, const std::string& value, const fs::path& path) {
  require(d.putAndInsertString(DcmTag(tag), value.c_str()), path);
}

void put_identity(DcmDataset& d, const DicomObjectOptions& o, const std::string& content, bool in_space,
                  const fs::path& path, const Context& context) {
  static const DcmTagKey kTaken[] = {DCM_SpecificCharacterSet,
                                     DCM_PatientName,
                                     DCM_PatientID,
                                     DCM_PatientBirthDate,
                                     DCM_PatientSex,
                                     DCM_StudyInstanceUID,
                                     DCM_StudyDate,
                                     DCM_StudyTime,
                                     DCM_ReferringPhysicianName,
                                     DCM_StudyID,
                                     DCM_AccessionNumber,
                                     DCM_StudyDescription,
                                     DCM_FrameOfReferenceUID,
                                     DCM_PositionReferenceIndicator,
                                     DCM_PatientIdentityRemoved,
                                     DCM_DeidentificationMethod};
  // Of type 2: without a value they are there all the same.
  for (const auto& tag :
       {DCM_PatientName, DCM_PatientID, DCM_PatientBirthDate, DCM_PatientSex, DCM_StudyDate, DCM_StudyTime,
        DCM_ReferringPhysicianName, DCM_StudyID, DCM_AccessionNumber, DCM_PositionReferenceIndicator}) {
    if (in_space || !of_space(tag)) require(d.insertEmptyElement(DcmTag(tag)), path);
  }
  if (o.source == nullptr) {
    put(d, DCM_PatientName, kAnonymousName, path);
    put(d, DCM_PatientID, kAnonymousId, path);
    put(d, DCM_StudyInstanceUID, uid_of(hash_text(content + "study")), path);
    if (in_space) put(d, DCM_FrameOfReferenceUID, uid_of(hash_text(content + "frame")), path);
    put(d, DCM_PatientIdentityRemoved, "YES", path);
    put(d, DCM_DeidentificationMethod, "Made without the source's identity", path);
    return;
  }
  DcmFileFormat source;
  load_identity(*o.source, source, context);
  for (const auto& tag : kTaken) {
    OFString value;
    if (!in_space && of_space(tag)) continue;
    if (source.getDataset()->findAndGetOFStringArray(tag, value).good() && !value.empty())
      put(d, tag, value.c_str(), path);
  }
}

std::pair<std::string, std::string> now_text() {
  char date[16], time[16];
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::strftime(date, sizeof date, "%Y%m%d", &local);
  std::strftime(time, sizeof time, "%H%M%S", &local);
  return {date, time};
}

std::string lo_text(const std::string& text) {
  std::string out;
  int characters = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) != 0x80U && ++characters > 64) break;
    out += byte < 32 || c == '\\' ? ' ' : c;
  }
  while (!out.empty() && out.back() == ' ') out.pop_back();  // as it is read back
  return out;
}

std::string segment_label(const std::string& name) {
  constexpr int kHead = 30, kTail = 22, kHash = 8, kMost = 64;  // head, "...", tail, a blank, hash
  const auto begins = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; };
  if (std::count_if(name.begin(), name.end(), begins) <= kMost) return lo_text(name);
  std::size_t head = 0, tail = name.size();
  for (int n = 0; head < name.size() && (n += begins(name[head]) ? 1 : 0) <= kHead;) ++head;
  for (int n = 0; tail > 0 && n < kTail;) n += begins(name[--tail]) ? 1 : 0;
  return lo_text(name.substr(0, head) + "..." + name.substr(tail) + " " + hash_text(name).substr(0, kHash));
}

void speak_utf8(DcmDataset& d, const std::string& texts) {
  if (std::all_of(texts.begin(), texts.end(), [](char c) { return static_cast<unsigned char>(c) < 128; })) return;
  // Where this DCMTK cannot, the patient's name stays right, and the other texts are not.
  static_cast<void>(d.convertToUTF8());
}

}  // namespace osteo::inline imaging::dicom
