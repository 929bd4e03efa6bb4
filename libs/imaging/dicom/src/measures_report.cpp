// Measures of a case and of rehearsals on it as a structured report, TID 1500.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "dcmtk_tools.h"
#include "object_identity.h"
#include "osteo/core/base/param.h"
#include "segment_codes.h"

namespace osteo::inline imaging {
namespace {

// Of a concept: value, scheme, meaning.
struct Code {
  const char *value, *scheme, *meaning;
};
constexpr Code kVolume{"118565006", "SCT", "Volume"}, kLength{"410668003", "SCT", "Length"},
    kDistance{"121206", "DCM", "Distance"}, kThreshold{"bone-threshold", "99OSTEOTOME", "Bone threshold"},
    kCubicMm{"mm3", "UCUM", "cubic millimeter"}, kMm{"mm", "UCUM", "millimeter"},
    kHounsfield{"[hnsf'U]", "UCUM", "Hounsfield unit"}, kFinding{"121071", "DCM", "Finding"},
    kFindingSite{"363698007", "SCT", "Finding Site"}, kBone{"272673000", "SCT", "Bone"},
    kYes{"373066001", "SCT", "Yes"}, kNo{"373067005", "SCT", "No"};

constexpr const char *kContains = "CONTAINS", *kObserved = "HAS OBS CONTEXT", *kModified = "HAS CONCEPT MOD";

// Writes content items; each function adds one below `parent` and returns it.
class ContentTree {
 public:
  explicit ContentTree(const fs::path& path) : path_(path) {}

  void code_of(DcmItem& in, const DcmTagKey& sequence, Code c) const {
    dicom::put_code(in, sequence, {c.value, c.meaning}, c.scheme, path_);
  }
  DcmItem& next(DcmItem& in, const DcmTagKey& sequence) const {
    DcmItem* made = nullptr;
    dicom::require(in.findOrCreateSequenceItem(sequence, made, -2), path_);
    return *made;
  }
  DcmItem& item(DcmItem& parent, const char* relation, const char* type, Code concept_name) const {
    DcmItem& i = next(parent, DCM_ContentSequence);
    dicom::put(i, DCM_RelationshipType, relation, path_);
    dicom::put(i, DCM_ValueType, type, path_);
    code_of(i, DCM_ConceptNameCodeSequence, concept_name);
    return i;
  }
  DcmItem& container(DcmItem& parent, Code concept_name, const char* tid = nullptr) const {
    DcmItem& i = item(parent, kContains, "CONTAINER", concept_name);
    dicom::put(i, DCM_ContinuityOfContent, "SEPARATE", path_);
    if (tid != nullptr) is_of(i, tid);
    return i;
  }
  void is_of(DcmItem& container, const char* tid) const {
    DcmItem& t = next(container, DCM_ContentTemplateSequence);
    dicom::put(t, DCM_MappingResource, "DCMR", path_);
    dicom::put(t, DCM_TemplateIdentifier, tid, path_);
  }
  void text(DcmItem& parent, const char* relation, Code concept_name, const std::string& value) const {
    dicom::put(item(parent, relation, "TEXT", concept_name), DCM_TextValue, value, path_);
  }
  void uid(DcmItem& parent, const char* relation, Code concept_name, const std::string& value) const {
    dicom::put(item(parent, relation, "UIDREF", concept_name), DCM_UID, value, path_);
  }
  void code(DcmItem& parent, const char* relation, Code concept_name, Code value) const {
    code_of(item(parent, relation, "CODE", concept_name), DCM_ConceptCodeSequence, value);
  }
  DcmItem& number(DcmItem& parent, Code concept_name, double value, Code unit) const {
    DcmItem& i = item(parent, kContains, "NUM", concept_name);
    DcmItem& v = next(i, DCM_MeasuredValueSequence);
    code_of(v, DCM_MeasurementUnitsCodeSequence, unit);
    dicom::put(v, DCM_NumericValue, dicom::decimal(value), path_);
    return i;
  }

 private:
  const fs::path& path_;
};

std::string spoken(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return dicom::lo_text(name);
}

// A unit as UCUM has it; a word, like "bodies", is a count with that word.
struct Unit {
  explicit Unit(const std::string& unit) {
    static const std::map<std::string, std::pair<std::string, std::string>> kUnits{
        {"mm", {"mm", "millimeter"}},
        {"mm2", {"mm2", "square millimeter"}},
        {"mm3", {"mm3", "cubic millimeter"}},
        {"mm3/s", {"mm3/s", "cubic millimeter per second"}},
        {"mm/s", {"mm/s", "millimeter per second"}},
        {"s", {"s", "second"}},
        {"1/s", {"/s", "per second"}},
        {"min", {"min", "minute"}},
        {"N", {"N", "newton"}},
        {"N s", {"N.s", "newton second"}},
        {"mJ", {"mJ", "millijoule"}},
        {"C", {"Cel", "degree Celsius"}},
        {"1", {"1", "no units"}},
        {"", {"1", "no units"}}};
    const auto found = kUnits.find(unit);
    code = found != kUnits.end() ? found->second.first : "{" + unit + "}";
    meaning = found != kUnits.end() ? found->second.second : unit;
  }
  std::string code, meaning;
};

// What the report needs to know of the segmentation that it refers to.
struct ReferredSegmentation {
  std::string sop_class, instance, series, study;
  std::vector<std::pair<std::string, Uint16>> segments;  // labels and numbers

  // Of the segment of a structure; of the n-th where several have one name, which is foreign. 0 where there is none.
  [[nodiscard]] Uint16 number(const std::string& name, std::size_t nth = 0) const {
    const std::string label = dicom::segment_label(name);
    for (const auto& [called, number] : segments) {
      if (called == label && nth-- == 0) return number;
    }
    return 0;
  }
};

// How many before this one have its name.
std::size_t namesakes_before(const std::vector<MeasuredStructure>& all, const MeasuredStructure& one) {
  return static_cast<std::size_t>(std::count_if(all.data(), &one, [&](const auto& s) { return s.name == one.name; }));
}

std::string text_at(DcmItem& d, const DcmTagKey& tag) {
  OFString value;
  return d.findAndGetOFString(tag, value).good() ? std::string(value.c_str()) : std::string();
}

// Refuses what is not of these structures: a report that points at other voxels would be worse than none.
ReferredSegmentation refer_to_segmentation(const MeasuresReport& report, const DicomObjectOptions& o,
                                           const Context& context) {
  const Labels labels = load_segmentation(report.segmentation, context);
  DcmFileFormat file;
  dicom::require(file.loadFile(report.segmentation.c_str(), EXS_Unknown, EGL_noChange, 64), report.segmentation);
  DcmDataset& d = *file.getDataset();
  ReferredSegmentation s{text_at(d, DCM_SOPClassUID),
                         text_at(d, DCM_SOPInstanceUID),
                         text_at(d, DCM_SeriesInstanceUID),
                         text_at(d, DCM_StudyInstanceUID),
                         {}};
  const auto refuse = [&](const std::string& why) {
    return Error(ExitCode::usage, "the segmentation '" + report.segmentation.string() + "' " + why,
                 "write it from the case: osteo convert CASE/structures.seg.nrrd SEG.dcm --source DICOM_FOLDER");
  };
  if (o.source != nullptr) {
    DcmFileFormat source;
    Context quiet;
    dicom::load_identity(*o.source, source, quiet);
    if (text_at(*source.getDataset(), DCM_StudyInstanceUID) != s.study) throw refuse("is of another study");
  }
  std::array<std::size_t, 256> count{};
  for (const std::uint8_t v : labels.span()) ++count[v];
  for (const MeasuredStructure& m : report.structures) {
    std::size_t nth = namesakes_before(report.structures, m);
    const auto found = std::find_if(labels.structures.begin(), labels.structures.end(), [&](const Structure& x) {
      return x.name == dicom::segment_label(m.name) && nth-- == 0;
    });
    if (found == labels.structures.end()) throw refuse("has no segment '" + m.name + "'");
    const double volume = static_cast<double>(count[found->value]) * labels.frame.voxel_volume_mm3();
    if (std::abs(volume - m.volume_mm3) > 0.005 * m.volume_mm3)
      throw refuse("has " + format_number(volume) + " mm3 of '" + m.name + "', the case has " +
                   format_number(m.volume_mm3));
  }
  DcmItem* segment = nullptr;
  for (long n = 0; d.findAndGetSequenceItem(DCM_SegmentSequence, segment, n).good(); ++n) {
    Uint16 number = 0;
    if (segment->findAndGetUint16(DCM_SegmentNumber, number).good())
      s.segments.emplace_back(text_at(*segment, DCM_SegmentLabel), number);
  }
  return s;
}

class MeasuresWriter {
 public:
  MeasuresWriter(const MeasuresReport& report, const fs::path& path, const DicomObjectOptions& o,
                 const Context& context)
      : report_(report), path_(path), o_(o), context_(context), tree_(path_) {}

  void write() {
    if (!report_.segmentation.empty()) segmentation_ = refer_to_segmentation(report_, o_, context_);
    DcmFileFormat file;
    DcmDataset& d = *file.getDataset();
    put_document(d);
    tree_.is_of(d, "1500");
    put_context(d);
    put_images(d);
    DcmItem& measurements = tree_.container(d, {"126010", "DCM", "Imaging Measurements"});
    if (report_.bone_mm3 >= 0) put_bone(measurements);
    for (const MeasuredStructure& s : report_.structures) put_structure(measurements, s);
    for (const MeasuredGap& g : report_.gaps) put_gap(measurements, g);
    for (const ScoredGroup& g : report_.scores) put_score(measurements, g);
    put_remarks(d);
    write_atomically(path_, [&](const fs::path& temporary) {
      dicom::require(file.saveFile(temporary.c_str(), EXS_LittleEndianExplicit), path_);
    });
  }

 private:
  void put(DcmItem& d, const DcmTagKey& tag, const std::string& value) const { dicom::put(d, tag, value, path_); }

  [[nodiscard]] std::string content() const {
    std::string all = report_.code + report_.program + dicom::decimal(report_.bone_mm3) +
                      dicom::decimal(report_.bone_lower_hu.value_or(1e9)) + segmentation_.instance;
    for (const MeasuredStructure& s : report_.structures)
      all += s.name + "\n" + s.origin + "\n" + dicom::decimal(s.volume_mm3) + " " + dicom::decimal(s.length_mm) + "\n";
    for (const MeasuredGap& g : report_.gaps) all += g.a + "\n" + g.b + "\n" + dicom::decimal(g.mm) + "\n";
    for (const ScoredGroup& g : report_.scores) {
      all += g.name + "\n" + g.structure + "\n";
      for (const auto& n : g.numbers) all += n.name + " " + dicom::decimal(n.value) + n.unit + "\n";
      for (const auto& v : g.verdicts) all += v.name + (v.passed ? " yes\n" : " no\n");
    }
    for (const std::string& r : report_.remarks) all += r + "\n";
    return all;
  }

  // PS3.3 A.35.3: everything but the content.
  void put_document(DcmDataset& d) {
    content_ = content();
    dicom::put_identity(d, o_, content_, false, path_, context_);
    dicom::speak_utf8(d, content_ + o_.description);  // every text that follows
    content_ += text_at(d, DCM_StudyInstanceUID);     // the same case can stand in two studies
    const auto [date, time] = dicom::now_text();
    put(d, DCM_SOPClassUID, UID_ComprehensiveSRStorage);
    put(d, DCM_SOPInstanceUID, uid("instance"));
    put(d, DCM_InstanceCreationDate, date);
    put(d, DCM_InstanceCreationTime, time);
    put(d, DCM_Modality, "SR");
    put(d, DCM_SeriesInstanceUID, uid("series"));
    put(d, DCM_SeriesNumber, "9004");
    put(d, DCM_SeriesDescription, dicom::lo_text(o_.description));
    put(d, DCM_Manufacturer, "Osteotome");
    put(d, DCM_ManufacturerModelName, "osteo");
    put(d, DCM_DeviceSerialNumber, "0");
    put(d, DCM_SoftwareVersions, dicom::lo_text(report_.program));
    put(d, DCM_InstanceNumber, "1");
    put(d, DCM_ContentDate, date);
    put(d, DCM_ContentTime, time);
    put(d, DCM_CompletionFlag, "COMPLETE");
    put(d, DCM_VerificationFlag, "UNVERIFIED");
    for (const auto& tag : {DCM_ReferencedPerformedProcedureStepSequence, DCM_PerformedProcedureCodeSequence})
      dicom::require(d.insertEmptyElement(DcmTag(tag)), path_);
    DcmItem& scheme = tree_.next(d, DCM_CodingSchemeIdentificationSequence);
    put(scheme, DCM_CodingSchemeDesignator, "99OSTEOTOME");
    put(scheme, DCM_CodingSchemeName, "Osteotome");
    put_evidence(d);
    put(d, DCM_ValueType, "CONTAINER");
    put(d, DCM_ContinuityOfContent, "SEPARATE");
    tree_.code_of(d, DCM_ConceptNameCodeSequence, {"126000", "DCM", "Imaging Measurement Report"});
  }

  [[nodiscard]] std::string uid(const std::string& of) const { return dicom::uid_of(hash_text(content_ + of)); }

  void put_reference(DcmItem& in, const DcmTagKey& sequence, const std::string& sop_class,
                     const std::string& instance) const {
    DcmItem& r = tree_.next(in, sequence);
    put(r, DCM_ReferencedSOPClassUID, sop_class);
    put(r, DCM_ReferencedSOPInstanceUID, instance);
  }

  // Every object that the content refers to.
  void put_evidence(DcmDataset& d) const {
    if (o_.source == nullptr && segmentation_.instance.empty()) return;
    DcmItem& study = tree_.next(d, DCM_CurrentRequestedProcedureEvidenceSequence);
    put(study, DCM_StudyInstanceUID, text_at(d, DCM_StudyInstanceUID));
    if (o_.source != nullptr) {
      DcmItem& series = tree_.next(study, DCM_ReferencedSeriesSequence);
      for (const DicomHeader& h : o_.source->headers)
        if (h.usable()) put_reference(series, DCM_ReferencedSOPSequence, h.sop_class, dicom::valid_uid(h.sop_uid));
      put(series, DCM_SeriesInstanceUID, dicom::valid_uid(o_.source->uid));
    }
    if (segmentation_.instance.empty()) return;
    DcmItem& series = tree_.next(study, DCM_ReferencedSeriesSequence);
    put_reference(series, DCM_ReferencedSOPSequence, segmentation_.sop_class, segmentation_.instance);
    put(series, DCM_SeriesInstanceUID, segmentation_.series);
  }

  // TID 1204, 1001, and what was reported on.
  void put_context(DcmItem& root) const {
    tree_.code(root, kModified, {"121049", "DCM", "Language of Content Item and Descendants"},
               {"en-US", "RFC5646", "English (United States)"});
    tree_.code(root, kObserved, {"121005", "DCM", "Observer Type"}, {"121007", "DCM", "Device"});
    tree_.uid(root, kObserved, {"121012", "DCM", "Device Observer UID"},
              dicom::uid_of(hash_text("osteotome " + report_.program)));
    tree_.text(root, kObserved, {"121013", "DCM", "Device Observer Name"}, "Osteotome " + report_.program);
    tree_.text(root, kObserved, {"121014", "DCM", "Device Observer Manufacturer"}, "Osteotome");
    tree_.text(root, kObserved, {"121015", "DCM", "Device Observer Model Name"}, "osteo");
    const bool ct = o_.source == nullptr || o_.source->modality == "CT";
    tree_.code(
        root, kModified, {"121058", "DCM", "Procedure reported"},
        ct ? Code{"25045-6", "LN", "CT unspecified body region"} : Code{"363679005", "SCT", "Imaging procedure"});
  }

  // TID 1600: the slices.
  void put_images(DcmItem& root) const {
    if (o_.source == nullptr) return;
    DcmItem& library = tree_.container(root, {"111028", "DCM", "Image Library"}, "1600");
    DcmItem& group = tree_.container(library, {"126200", "DCM", "Image Library Group"});
    constexpr Code kModalities[] = {{"CT", "DCM", "Computed Tomography"}, {"MR", "DCM", "Magnetic Resonance"}};
    for (const Code& m : kModalities)
      if (o_.source->modality == m.value) tree_.code(group, "HAS ACQ CONTEXT", {"121139", "DCM", "Modality"}, m);
    for (const DicomHeader& h : o_.source->headers) {
      if (!h.usable()) continue;
      DcmItem& image = tree_.next(group, DCM_ContentSequence);
      put(image, DCM_RelationshipType, kContains);
      put(image, DCM_ValueType, "IMAGE");
      put_reference(image, DCM_ReferencedSOPSequence, h.sop_class, dicom::valid_uid(h.sop_uid));
    }
  }

  DcmItem& group(DcmItem& measurements, const std::string& name, const char* tid) {
    DcmItem& g = tree_.container(measurements, {"125007", "DCM", "Measurement Group"}, tid);
    tree_.text(g, kObserved, {"112039", "DCM", "Tracking Identifier"}, name);
    // Two of one name are two things.
    const std::size_t nth = groups_[name]++;
    tree_.uid(g, kObserved, {"112040", "DCM", "Tracking Unique Identifier"},
              uid(nth == 0 ? name : name + "\n" + std::to_string(nth)));
    return g;
  }

  void put_algorithm(DcmItem& in, const std::string& name, const std::string& version) const {
    tree_.text(in, kModified, {"111001", "DCM", "Algorithm Name"}, name);
    tree_.text(in, kModified, {"111003", "DCM", "Algorithm Version"}, version);
  }

  void put_bone(DcmItem& measurements) {
    DcmItem& g = group(measurements, "Bone of the case " + report_.code, "1501");
    tree_.code(g, kContains, kFinding, kBone);
    tree_.number(g, kVolume, report_.bone_mm3, kCubicMm);
    if (report_.bone_lower_hu) tree_.number(g, kThreshold, *report_.bone_lower_hu, kHounsfield);
  }

  // Its code; as Code wants texts that end.
  void finding(DcmItem& in, const char* relation, Code concept_name, const std::string& name) const {
    const dicom::SegmentCode c = dicom::code_of(name, report_.structures.size() == 1);
    const std::string value(c.code), meaning(c.meaning);
    tree_.code(in, relation, concept_name, {value.c_str(), "SCT", meaning.c_str()});
  }

  void refer_to_segment(DcmItem& g, Uint16 number) const {
    DcmItem& image = tree_.item(g, kContains, "IMAGE", {"121191", "DCM", "Referenced Segment"});
    DcmItem& reference = tree_.next(image, DCM_ReferencedSOPSequence);
    put(reference, DCM_ReferencedSOPClassUID, segmentation_.sop_class);
    put(reference, DCM_ReferencedSOPInstanceUID, segmentation_.instance);
    dicom::require(reference.putAndInsertUint16(DCM_ReferencedSegmentNumber, number), path_);
    if (o_.source != nullptr)
      tree_.uid(g, kContains, {"121232", "DCM", "Source series for segmentation"}, dicom::valid_uid(o_.source->uid));
  }

  void put_structure(DcmItem& measurements, const MeasuredStructure& s) {
    const Uint16 segment = segmentation_.number(s.name, namesakes_before(report_.structures, s));
    DcmItem& g = group(measurements, s.name, segment > 0 ? "1411" : "1501");
    if (const dicom::DrawnBy drawn = dicom::drawn_by(s.origin); !drawn.version.empty())
      put_algorithm(g, (drawn.own ? "Osteotome " : "") + drawn.name,
                    drawn.version + (drawn.corrected ? std::string(kCorrectedByHand) : ""));
    finding(g, kContains, kFinding, s.name);
    if (segment > 0) refer_to_segment(g, segment);
    tree_.number(g, kVolume, s.volume_mm3, kCubicMm);
    if (s.length_mm > 0) tree_.number(g, kLength, s.length_mm, kMm);
  }

  void put_gap(DcmItem& measurements, const MeasuredGap& gap) {
    DcmItem& g = group(measurements, "Distance from " + gap.a + " to " + gap.b, "1501");
    DcmItem& n = tree_.number(g, kDistance, gap.mm, kMm);
    finding(n, kModified, kFindingSite, gap.a);
    finding(n, kModified, kFindingSite, gap.b);
  }

  void put_score(DcmItem& measurements, const ScoredGroup& score) {
    const Uint16 segment = score.structure.empty() ? Uint16{0} : segmentation_.number(score.structure);
    DcmItem& g = group(measurements, score.name, segment > 0 ? "1411" : "1501");
    if (!score.structure.empty()) finding(g, kContains, kFinding, score.structure);
    if (segment > 0) refer_to_segment(g, segment);
    for (const auto& n : score.numbers) {
      const std::string code = dicom::lo_text(n.name), meaning = spoken(n.name);
      const Code name{code.c_str(), "99OSTEOTOME", meaning.c_str()};
      const Unit unit(n.unit);
      tree_.number(g, name, n.value, {unit.code.c_str(), "UCUM", unit.meaning.c_str()});
    }
    for (const auto& v : score.verdicts) {
      const std::string code = dicom::lo_text(v.name), meaning = spoken(v.name);
      tree_.code(g, kContains, {code.c_str(), "99OSTEOTOME", meaning.c_str()}, v.passed ? kYes : kNo);
    }
  }

  void put_remarks(DcmItem& root) const {
    if (report_.remarks.empty()) return;
    DcmItem& said = tree_.container(root, {"C0034375", "UMLS", "Qualitative Evaluations"});
    for (const std::string& r : report_.remarks) tree_.text(said, kContains, {"121106", "DCM", "Comment"}, r);
  }

  const MeasuresReport& report_;
  const fs::path& path_;
  const DicomObjectOptions& o_;
  const Context& context_;
  const ContentTree tree_;
  ReferredSegmentation segmentation_;
  std::string content_;
  std::map<std::string, std::size_t> groups_;  // how many have each name
};

}  // namespace

void save_measures_report(const MeasuresReport& report, const fs::path& path, const DicomObjectOptions& options,
                          const Context& context) {
  dicom::quiet_dcmtk();
  MeasuresWriter(report, path, options, context).write();
}

}  // namespace osteo::inline imaging
