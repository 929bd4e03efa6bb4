// What is read and written, for the conformance statement: from the table of encodings, and from objects written for
// it.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <map>
#include <set>

#include "dcmtk_tools.h"
#include "encodings.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/dicom/save_series.h"

namespace osteo::inline imaging {
namespace {

struct WrittenObject {
  std::string_view column, uid, name, made_by;
};
constexpr std::array kWritten{
    WrittenObject{"CT", UID_CTImageStorage, "CT Image Storage", "`osteo convert`, `osteo phantom` and `-o` of stages"},
    WrittenObject{"SEG", UID_SegmentationStorage, "Segmentation Storage", "`osteo convert`"},
    WrittenObject{"LABELMAP", "1.2.840.10008.5.1.4.1.1.66.7", "Label Map Segmentation Storage",
                  "`osteo convert --segmentation labelmap` or `labelmap16`"},
    WrittenObject{"STL", UID_EncapsulatedSTLStorage, "Encapsulated STL Storage", "`osteo convert`"},
    WrittenObject{"PDF", UID_EncapsulatedPDFStorage, "Encapsulated PDF Storage", "`osteo report --dicom`"},
    WrittenObject{"SR", UID_ComprehensiveSRStorage, "Comprehensive SR Storage (TID 1500)", "`osteo report --measures`"},
};

// One object of each class, as small as it can be.
std::vector<fs::path> write_samples(const fs::path& folder) {
  Frame frame;
  frame.dims = {4, 4, 3};
  const auto hu = make_voxels<std::int16_t>(frame.voxel_count());
  const auto mask = make_voxels<std::uint8_t>(frame.voxel_count());
  for (std::size_t v = 0; v < frame.voxel_count(); ++v) {
    hu[v] = static_cast<std::int16_t>(100 * v);
    mask[v] = v % 2 == 0 ? 1 : 0;
  }
  save_dicom_series({frame, hu}, folder / "ct");
  const Labels labels{{frame, mask}, {{1, "facial nerve", {}, "tube, version 1"}}};
  const DicomScan scan = scan_dicom(folder / "ct");
  const DicomObjectOptions of{&scan.series.at(0), "Sample"};
  DicomObjectOptions map = of;
  map.form = SegmentationForm::labelmap;
  save_segmentation(labels, folder / "seg.dcm", of);
  save_segmentation(labels, folder / "map.dcm", map);
  TriMesh mesh;
  mesh.points_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  save_encapsulated_stl(mesh, folder / "stl.dcm", of);
  save_encapsulated_pdf("%PDF-1.5", "Sample", folder / "pdf.dcm", of);
  MeasuresReport report;
  report.program = "0";
  report.code = "sample";
  report.bone_mm3 = 24;
  report.bone_lower_hu = 300;
  report.structures = {{"facial nerve", "tube, version 1", 24, 0}};
  report.scores = {
      {"Rehearsal", "facial nerve", {{"near_contact_seconds", 1, "s"}, {"touches", 0, "1"}}, {{"a", true}}}};
  report.remarks = {"sample"};
  report.segmentation = folder / "seg.dcm";
  save_measures_report(report, folder / "sr.dcm", of);
  return {scan.series.at(0).headers.at(0).file,
          folder / "seg.dcm",
          folder / "map.dcm",
          folder / "stl.dcm",
          folder / "pdf.dcm",
          folder / "sr.dcm"};
}

std::string tag_text(const DcmTagKey& tag) {
  char text[16];
  std::snprintf(text, sizeof text, "(%04X,%04X)", tag.getGroup(), tag.getElement());
  return text;
}

std::string attribute_table() {
  const TemporaryFolder scratch;
  std::map<DcmTagKey, std::set<std::size_t>> in;
  const std::vector<fs::path> files = write_samples(scratch.path());
  for (std::size_t n = 0; n < files.size(); ++n) {
    DcmFileFormat file;
    dicom::require(file.loadFile(files[n].c_str()), files[n]);
    DcmDataset& d = *file.getDataset();
    for (unsigned long e = 0; e < d.card(); ++e) in[d.getElement(e)->getTag().getXTag()].insert(n);
  }
  std::string page = "| attribute | tag |";
  for (const WrittenObject& w : kWritten) page += " " + std::string(w.column) + " |";
  page += "\n|---|---|";
  for (std::size_t n = 0; n < kWritten.size(); ++n) page += "---|";
  page += '\n';
  for (const auto& [tag, objects] : in) {
    page += "| " + std::string(DcmTag(tag).getTagName()) + " | " + tag_text(tag) + " |";
    for (std::size_t n = 0; n < kWritten.size(); ++n) page += objects.contains(n) ? " x |" : " |";
    page += '\n';
  }
  return page;
}

}  // namespace

std::string objects_conformance() {
  dicom::quiet_dcmtk();
  std::string page =
      "## Files that are read\n\n"
      "Slices are taken by what they hold and not by a list of classes: any image of one sample a pixel, 8, 16 or 32 "
      "bits, with position, orientation, spacing and a rescale slope, single frames or many. `import` wants CT "
      "(`--any-modality` "
      "takes others). Segmentations (SEG and LABELMAP) are read as structures. Values of an attribute that "
      "DICOM "
      "does not allow are named, not guessed ([the verdict](../formats/verdict.md)).\n\n"
      "| transfer syntax | UID | pixels |\n|---|---|---|\n";
  for (const dicom::Encoding& e : dicom::encodings()) {
    // What a build lacks is said by its refusal; the page is of one that has all.
    page += "| " + std::string(e.name) + " | " + std::string(e.uid) + " | " +
            (e.codec == dicom::Codec::unread ? "not read: UNSUPPORTED_ENCODING" : "read") + " |\n";
  }
  page +=
      "\nPatient, study and frame of reference of what is written beside a scan are the scan's. Character sets: texts "
      "of the scan keep their SpecificCharacterSet; where a structure's name is not ASCII, all become UTF-8 "
      "(ISO_IR 192).\n\n"
      "## Objects that are written\n\n| class | UID | by |\n|---|---|---|\n";
  for (const WrittenObject& w : kWritten)
    page += "| " + std::string(w.name) + " | " + std::string(w.uid) + " | " + std::string(w.made_by) + " |\n";
  page +=
      "\nAll in Explicit VR Little Endian. UIDs are of the form 2.25 (a UUID); those of all but CT slices are made "
      "from "
      "the content and the study: the same content, the same UID. Attributes at the top of the data set, of objects "
      "written beside a series for this page:\n\n" +
      attribute_table();
  return page;
}

}  // namespace osteo::inline imaging
