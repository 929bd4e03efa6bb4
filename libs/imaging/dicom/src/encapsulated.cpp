#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>

#include "dcmtk_tools.h"
#include "object_identity.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/io/surface_io.h"
#include "segment_codes.h"

namespace osteo::inline imaging {
namespace {

using dicom::now_text;
using dicom::put;
using dicom::put_identity;

// The slices that it was made from.
void put_source(DcmDataset& d, const DicomObjectOptions& o, bool in_space, const fs::path& path) {
  if (o.source == nullptr) return;
  DcmItem *item = nullptr, *series = nullptr;
  if (in_space) {  // Common Instance Reference, which the standard gives to models and not to documents
    dicom::require(d.findOrCreateSequenceItem(DCM_ReferencedSeriesSequence, series, 0), path);
    put(*series, DCM_SeriesInstanceUID, dicom::valid_uid(o.source->uid), path);
  }
  for (const DicomHeader& h : o.source->headers) {
    if (!h.usable()) continue;
    dicom::require(d.findOrCreateSequenceItem(DCM_SourceInstanceSequence, item, -2), path);
    put(*item, DCM_ReferencedSOPClassUID, h.sop_class, path);
    put(*item, DCM_ReferencedSOPInstanceUID, dicom::valid_uid(h.sop_uid), path);
    if (series == nullptr) continue;
    dicom::require(series->findOrCreateSequenceItem(DCM_ReferencedInstanceSequence, item, -2), path);
    put(*item, DCM_ReferencedSOPClassUID, h.sop_class, path);
    put(*item, DCM_ReferencedSOPInstanceUID, dicom::valid_uid(h.sop_uid), path);
  }
}

struct Document {
  const char *sop_class, *modality, *series_number, *mime_type;
  std::string content;  // UIDs are made from it
};

// What every encapsulated document says of itself (PS3.3 C.24.1, C.24.2).
void put_document(DcmDataset& d, const Document& document, const DicomObjectOptions& options, const std::string& title,
                  const fs::path& path) {
  const auto [date, time] = now_text();
  dicom::speak_utf8(d, options.description + title);
  put(d, DCM_SOPClassUID, document.sop_class, path);
  put(d, DCM_SOPInstanceUID, dicom::uid_of(hash_text(document.content + "instance")), path);
  put(d, DCM_InstanceCreationDate, date, path);
  put(d, DCM_InstanceCreationTime, time, path);
  put(d, DCM_Modality, document.modality, path);
  put(d, DCM_SeriesInstanceUID, dicom::uid_of(hash_text(document.content + "series")), path);
  put(d, DCM_SeriesNumber, document.series_number, path);
  put(d, DCM_SeriesDescription, dicom::lo_text(options.description), path);
  put(d, DCM_Manufacturer, "Osteotome", path);
  put(d, DCM_ManufacturerModelName, "osteo", path);
  put(d, DCM_DeviceSerialNumber, "0", path);
  put(d, DCM_SoftwareVersions, "0.1", path);
  put(d, DCM_InstanceNumber, "1", path);
  put(d, DCM_ContentDate, date, path);
  put(d, DCM_ContentTime, time, path);
  put(d, DCM_AcquisitionDateTime, date + time, path);
  put(d, DCM_BurnedInAnnotation, "NO", path);
  put(d, DCM_DocumentTitle, title, path);
  put(d, DCM_MIMETypeOfEncapsulatedDocument, document.mime_type, path);
}

std::string study_of(DcmDataset& d, const fs::path& path) {
  OFString study;
  dicom::require(d.findAndGetOFString(DCM_StudyInstanceUID, study), path);
  return study.c_str();
}

void save_document(DcmFileFormat& file, std::string bytes, const fs::path& path) {
  DcmDataset& d = *file.getDataset();
  dicom::require(d.putAndInsertUint32(DCM_EncapsulatedDocumentLength, static_cast<Uint32>(bytes.size())), path);
  if (bytes.size() % 2 != 0) bytes += '\0';
  dicom::require(d.putAndInsertUint8Array(DCM_EncapsulatedDocument, reinterpret_cast<const Uint8*>(bytes.data()),
                                          static_cast<unsigned long>(bytes.size())),
                 path);
  write_atomically(path, [&](const fs::path& temporary) {
    dicom::require(file.saveFile(temporary.c_str(), EXS_LittleEndianExplicit), path);
  });
}

}  // namespace

void save_encapsulated_stl(const TriMesh& mesh, const fs::path& path, const DicomObjectOptions& options,
                           const Context& context) {
  if (mesh.triangles.empty())
    throw Error(ExitCode::usage, "the surface is empty: there is nothing to write to '" + path.string() + "'");
  dicom::quiet_dcmtk();
  std::string stl = stl_text(mesh);
  std::string content = hash_text(stl);
  DcmFileFormat file;
  DcmDataset& d = *file.getDataset();
  put_identity(d, options, content, true, path, context);
  put_source(d, options, true, path);
  content += study_of(d, path);  // the same surface can stand in two studies
  put_document(d, {UID_EncapsulatedSTLStorage, "M3D", "9002", "model/stl", content}, options, options.description,
               path);
  dicom::put_code(d, DCM_ConceptNameCodeSequence, {"85040-4", "3D Model"}, "LN", path);
  dicom::put_code(d, DCM_MeasurementUnitsCodeSequence, {"mm", "mm"}, "UCUM", path);
  put(d, DCM_ModelModification, "NO", path);
  put(d, DCM_ModelMirroring, "NO", path);
  dicom::put_code(d, DCM_ModelUsageCodeSequence, {"129013", "Planning Intent"}, "DCM", path);
  save_document(file, std::move(stl), path);
}

void save_encapsulated_pdf(std::string_view pdf, const std::string& title, const fs::path& path,
                           const DicomObjectOptions& options, const Context& context) {
  if (!pdf.starts_with("%PDF-"))
    throw Error(ExitCode::usage, "that is no PDF: there is nothing to write to '" + path.string() + "'");
  if (pdf.size() > 0xFFFFFFFEU - 1)
    throw Error(ExitCode::usage,
                "a PDF of more than 4 GB does not fit a DICOM object: '" + path.string() + "' is not written");
  dicom::quiet_dcmtk();
  DcmFileFormat file;
  DcmDataset& d = *file.getDataset();
  std::string content = hash_text(pdf);
  put_identity(d, options, content, false, path, context);
  put_source(d, options, false, path);
  // The pages name nobody, so they can be the same in two studies, as after a scan was made anonymous: the objects are
  // not.
  content += study_of(d, path);
  put_document(d, {UID_EncapsulatedPDFStorage, "DOC", "9003", "application/pdf", content}, options, title, path);
  put(d, DCM_ConversionType, "WSD", path);
  // None of the codes for titles says what it is: no diagnosis, no radiologist's report. It may be empty.
  dicom::require(d.insertEmptyElement(DcmTag(DCM_ConceptNameCodeSequence)), path);
  put(d, DCM_VerificationFlag, "UNVERIFIED", path);
  save_document(file, std::string(pdf), path);
}

}  // namespace osteo::inline imaging
