#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "dcmtk_tools.h"
#include "labelmap.h"
#include "object_identity.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"
#include "segment_codes.h"

namespace osteo::inline imaging::dicom {
namespace {

// The first row whose words the name has counts.
struct StructureCode {
  std::string_view word, code, meaning;
};
constexpr std::array kStructureCodes{
    StructureCode{"facial nerve", "56052001", "Facial nerve"},
    StructureCode{"marrow", "14016003", "Bone marrow"},
    StructureCode{"mandible", "91609006", "Mandible"},
    StructureCode{"maxilla", "70925003", "Maxilla"},
    StructureCode{"tooth", "38199008", "Tooth"},
    StructureCode{"teeth", "38199008", "Tooth"},
    StructureCode{"air cells", "91716001", "Mastoid cells and antra"},
    StructureCode{"labyrinth", "22945000", "Inner ear"},
    StructureCode{"ear canal", "84301002", "External auditory canal"},
    StructureCode{"dura", "18545000", "Dura mater"},
    StructureCode{"carotid", "69105007", "Carotid artery"},
    StructureCode{"temporal bone", "60911003", "Temporal bone"},
    StructureCode{"skull", "89546000", "Skull"},
    StructureCode{"bone", "272673000", "Bone"},
};

// Families of algorithms, PS3.16 CID 7162, by the stage that draws.
struct Drawer {
  std::string_view stage, type;
  SegmentCode family;
};
constexpr std::array kDrawers{
    Drawer{"tube", "SEMIAUTOMATIC", {"123106", "Multi-scale/Resolution Filtering"}},
    Drawer{"find-structures", "AUTOMATIC", {"123104", "Morphological Operations"}},
    Drawer{"segment-network", "AUTOMATIC", {"123110", "Artificial Intelligence"}},
};
constexpr std::string_view kVersion = ", version ";

}  // namespace

SegmentCode code_of(const std::string& name, bool alone) {
  const std::string lower = lower_case(name);
  for (const StructureCode& c : kStructureCodes) {
    if (lower.find(c.word) != std::string::npos) return {c.code, c.meaning};
  }
  return alone ? SegmentCode{"272673000", "Bone"} : SegmentCode{"85756007", "Tissue"};
}

void put_code(DcmItem& in, const DcmTagKey& sequence, SegmentCode code, const char* scheme,
              const std::filesystem::path& path) {
  DcmItem* item = nullptr;
  require(in.findOrCreateSequenceItem(sequence, item, 0), path);
  // PS3.3 8.1: a code of more than 16 characters has another attribute.
  const DcmTagKey value = code.code.size() > 16 ? DCM_LongCodeValue : DCM_CodeValue;
  item->findAndDeleteElement(code.code.size() > 16 ? DCM_CodeValue : DCM_LongCodeValue);
  require(item->putAndInsertString(value, std::string(code.code).c_str()), path);
  require(item->putAndInsertString(DCM_CodingSchemeDesignator, scheme), path);
  require(item->putAndInsertString(DCM_CodeMeaning, std::string(code.meaning).c_str()), path);
}

namespace {

const Drawer* drawer_called(std::string_view stage) {
  const auto* const d =
      std::find_if(kDrawers.begin(), kDrawers.end(), [&](const Drawer& x) { return x.stage == stage; });
  return d == kDrawers.end() ? nullptr : d;
}

}  // namespace

namespace {
constexpr std::string_view kWithin = "Boundary within ", kOfPlaces = " mm in 95 % of places.",
                           kUnknown = "Boundary uncertain by more than can be said.",
                           kNotTrusted = "Not to be trusted: ";
}  // namespace

void put_certainty(DcmItem& segment, const Structure& structure, const std::filesystem::path& path) {
  std::string text;
  if (structure.within_mm > 0)
    text = std::isfinite(structure.within_mm)
               ? std::string(kWithin) + format_number(structure.within_mm) + std::string(kOfPlaces)
               : std::string(kUnknown);
  if (!structure.doubt.empty()) text += (text.empty() ? "" : " ") + std::string(kNotTrusted) + structure.doubt;
  if (!text.empty()) dicom::put(segment, DCM_SegmentDescription, text.substr(0, 1024), path);
}

void read_certainty(const std::string& text, Structure& structure) {
  if (text.starts_with(kUnknown)) structure.within_mm = std::numeric_limits<double>::infinity();
  if (text.starts_with(kWithin) && text.find(kOfPlaces) != std::string::npos) {
    double mm = 0;
    std::from_chars(text.data() + kWithin.size(), text.data() + text.size(), mm);
    structure.within_mm = mm > 0 && std::isfinite(mm) ? mm : 0;
  }
  if (const std::size_t at = text.find(kNotTrusted); at != std::string::npos && (at == 0 || structure.within_mm > 0))
    structure.doubt = text.substr(at + kNotTrusted.size());
}

DrawnBy drawn_by(const std::string& origin) {
  DrawnBy d;
  d.corrected = origin.ends_with(kCorrectedByHand);
  const std::string made = d.corrected ? origin.substr(0, origin.size() - kCorrectedByHand.size()) : origin;
  const std::size_t comma = made.rfind(kVersion);
  d.name = made.substr(0, comma);
  if (comma != std::string::npos) d.version = made.substr(comma + kVersion.size());
  d.own = drawer_called(d.name) != nullptr;
  return d;
}

void put_algorithm(DcmItem& segment, const std::string& origin, const std::filesystem::path& path) {
  const DrawnBy drawn = drawn_by(origin);
  const auto put = [&](DcmItem& in, const DcmTagKey& tag, const std::string& value) {
    dicom::put(in, tag, lo_text(value), path);
  };
  if (drawn.name == kDrawnByHand) {
    put(segment, DCM_SegmentAlgorithmType, "MANUAL");
    segment.findAndDeleteElement(DCM_SegmentAlgorithmName);
    return;
  }
  const Drawer* const drawer = drawer_called(drawn.name);
  // Without knowledge the type that claims least: a person may have had a part in it.
  put(segment, DCM_SegmentAlgorithmType,
      drawer != nullptr && !drawn.corrected ? std::string(drawer->type) : "SEMIAUTOMATIC");
  put(segment, DCM_SegmentAlgorithmName,
      (drawn.name.empty() ? std::string(kNotRecorded) : drawn.name) +
          (drawn.corrected ? std::string(kCorrectedByHand) : ""));
  if (drawer == nullptr || drawn.version.empty()) return;
  DcmItem* item = nullptr;
  require(segment.findOrCreateSequenceItem(DCM_SegmentationAlgorithmIdentificationSequence, item, 0), path);
  put_code(*item, DCM_AlgorithmFamilyCodeSequence, drawer->family, "DCM", path);
  put(*item, DCM_AlgorithmName, drawn.name);
  put(*item, DCM_AlgorithmVersion, drawn.version);
  put(*item, DCM_AlgorithmSource, "Osteotome");
}

std::string origin_from(const std::string& type, const std::string& name, const std::string& version) {
  if (type == "MANUAL") return std::string(kDrawnByHand);
  if (name.empty() || name.starts_with(kNotRecorded)) return {};
  const bool corrected = name.ends_with(kCorrectedByHand);
  const std::string made = corrected ? name.substr(0, name.size() - kCorrectedByHand.size()) : name;
  return made + (version.empty() ? "" : std::string(kVersion) + version) +
         (corrected ? std::string(kCorrectedByHand) : "");
}

}  // namespace osteo::inline imaging::dicom
