#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cstring>
#include <ctime>

#include "dcmtk_tools.h"
#include "osteo/dicom/objects.h"
#include "osteo/io/surface_io.h"

namespace osteo {
namespace {

void put(DcmItem& d, const DcmTagKey& tag, const std::string& value, const fs::path& path) {
  dicom::require(d.putAndInsertString(DcmTag(tag), value.c_str()), path);
}

void put_code(DcmItem& d, const DcmTagKey& sequence, const char* value, const char* scheme, const char* meaning, const fs::path& path) {
  DcmItem* item = nullptr;
  dicom::require(d.findOrCreateSequenceItem(sequence, item, 0), path);
  put(*item, DCM_CodeValue, value, path);
  put(*item, DCM_CodingSchemeDesignator, scheme, path);
  put(*item, DCM_CodeMeaning, meaning, path);
}

// Patient and study are the source's, or nobody's.
void put_identity(DcmDataset& d, const DicomObjectOptions& o, const std::string& content, const fs::path& path, const Context& context) {
  static const DcmTagKey kTaken[] = {
      DCM_SpecificCharacterSet,  DCM_PatientName,      DCM_PatientID,           DCM_PatientBirthDate,           DCM_PatientSex,
      DCM_StudyInstanceUID,      DCM_StudyDate,        DCM_StudyTime,           DCM_ReferringPhysicianName,     DCM_StudyID,
      DCM_AccessionNumber,       DCM_StudyDescription, DCM_FrameOfReferenceUID, DCM_PositionReferenceIndicator, DCM_PatientIdentityRemoved,
      DCM_DeidentificationMethod};
  for (const auto& tag : {DCM_PatientBirthDate, DCM_PatientSex, DCM_StudyDate, DCM_StudyTime, DCM_ReferringPhysicianName, DCM_StudyID,
                          DCM_AccessionNumber, DCM_PositionReferenceIndicator}) {
    dicom::require(d.insertEmptyElement(DcmTag(tag)), path);
  }
  if (o.source == nullptr) {
    put(d, DCM_PatientName, dicom::kAnonymousName, path);
    put(d, DCM_PatientID, dicom::kAnonymousId, path);
    put(d, DCM_StudyInstanceUID, dicom::uid_of(hash_text(content + "study")), path);
    put(d, DCM_FrameOfReferenceUID, dicom::uid_of(hash_text(content + "frame")), path);
    put(d, DCM_PatientIdentityRemoved, "YES", path);
    put(d, DCM_DeidentificationMethod, "Made without the source's identity", path);
    return;
  }
  DcmFileFormat source;
  dicom::load_identity(*o.source, source, context);
  for (const auto& tag : kTaken) {
    OFString value;
    if (source.getDataset()->findAndGetOFStringArray(tag, value).good() && !value.empty()) put(d, tag, value.c_str(), path);
  }
  DcmItem *item = nullptr, *series = nullptr;
  dicom::require(d.findOrCreateSequenceItem(DCM_ReferencedSeriesSequence, series, 0), path);
  put(*series, DCM_SeriesInstanceUID, dicom::valid_uid(o.source->uid), path);
  for (const DicomHeader& h : o.source->headers) {
    if (!h.usable()) continue;
    dicom::require(d.findOrCreateSequenceItem(DCM_SourceInstanceSequence, item, -2), path);
    put(*item, DCM_ReferencedSOPClassUID, h.sop_class, path);
    put(*item, DCM_ReferencedSOPInstanceUID, dicom::valid_uid(h.sop_uid), path);
    dicom::require(series->findOrCreateSequenceItem(DCM_ReferencedInstanceSequence, item, -2), path);
    put(*item, DCM_ReferencedSOPClassUID, h.sop_class, path);
    put(*item, DCM_ReferencedSOPInstanceUID, dicom::valid_uid(h.sop_uid), path);
  }
}

}  // namespace

void save_encapsulated_stl(const TriMesh& mesh, const fs::path& path, const DicomObjectOptions& options, const Context& context) {
  if (mesh.triangles.empty()) throw Error(ExitCode::usage, "the surface is empty: there is nothing to write to '" + path.string() + "'");
  dicom::quiet_dcmtk();
  std::string stl = stl_text(mesh);
  const std::string content = hash_text(stl);
  const std::size_t length = stl.size();
  if (stl.size() % 2 != 0) stl += '\0';

  DcmFileFormat file;
  DcmDataset& d = *file.getDataset();
  put_identity(d, options, content, path, context);
  char date[16], time[16];
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::strftime(date, sizeof date, "%Y%m%d", &local);
  std::strftime(time, sizeof time, "%H%M%S", &local);
  put(d, DCM_SOPClassUID, UID_EncapsulatedSTLStorage, path);
  put(d, DCM_SOPInstanceUID, dicom::uid_of(hash_text(content + "instance")), path);
  put(d, DCM_InstanceCreationDate, date, path);
  put(d, DCM_InstanceCreationTime, time, path);
  put(d, DCM_Modality, "M3D", path);
  put(d, DCM_SeriesInstanceUID, dicom::uid_of(hash_text(content + "series")), path);
  put(d, DCM_SeriesNumber, "9002", path);
  put(d, DCM_SeriesDescription, options.description.substr(0, 64), path);
  put(d, DCM_Manufacturer, "Osteotome", path);
  put(d, DCM_ManufacturerModelName, "osteo", path);
  put(d, DCM_DeviceSerialNumber, "0", path);
  put(d, DCM_SoftwareVersions, "0.1", path);
  put(d, DCM_InstanceNumber, "1", path);
  put(d, DCM_ContentDate, date, path);
  put(d, DCM_ContentTime, time, path);
  put(d, DCM_AcquisitionDateTime, std::string(date) + time, path);
  put(d, DCM_BurnedInAnnotation, "NO", path);
  put(d, DCM_DocumentTitle, options.description, path);
  put_code(d, DCM_ConceptNameCodeSequence, "85040-4", "LN", "3D Model", path);
  put(d, DCM_MIMETypeOfEncapsulatedDocument, "model/stl", path);
  dicom::require(d.putAndInsertUint32(DCM_EncapsulatedDocumentLength, static_cast<Uint32>(length)), path);
  put_code(d, DCM_MeasurementUnitsCodeSequence, "mm", "UCUM", "mm", path);
  put(d, DCM_ModelModification, "NO", path);
  put(d, DCM_ModelMirroring, "NO", path);
  put_code(d, DCM_ModelUsageCodeSequence, "129013", "DCM", "Planning Intent", path);
  dicom::require(d.putAndInsertUint8Array(DCM_EncapsulatedDocument, reinterpret_cast<const Uint8*>(stl.data()),
                                          static_cast<unsigned long>(stl.size())),
                 path);
  write_atomically(path,
                   [&](const fs::path& temporary) { dicom::require(file.saveFile(temporary.c_str(), EXS_LittleEndianExplicit), path); });
}

}  // namespace osteo
