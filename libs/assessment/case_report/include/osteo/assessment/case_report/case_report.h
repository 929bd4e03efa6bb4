// The report of a case: what was scanned, what became of it, and what a person who signs has to know.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline assessment {

/// The CT that the bone came from, cut to the region, and its mask: at hand while a case is made, never kept in it.
struct CaseScan {
  Image ct;
  Labels mask;
};

struct CaseReport {
  std::filesystem::path html, pdf;  ///< CASE.report.html and CASE.report.pdf, beside the case: they show more than bone
  bool unchanged = false;           ///< both were there already, byte for byte
  bool says_other =
      false;  ///< one was there that said something else, its signature aside: of another state, or another version
  std::vector<std::string> left_out;  ///< what could not be shown, and what is needed for it
};

/// Writes both. `asked_for`: the flags that the case was made with, as a person writes them. Pictures of a report that
/// is there and of this state of the case are kept, so that the scan is needed once. Says nothing that identifies the
/// patient but what the cuts show. The case itself is not touched. A report that was signed and still holds is left as
/// it is, also by a later version of the program. About 11 s of one core for a head of 3 million triangles drawn in
/// software, most of it OpenGL; 1.5 s where the pictures are kept. Errors: as of load_case; cannot_write; failed
/// without OpenGL or fonts.
CaseReport write_case_report(const std::filesystem::path& case_folder, const std::string& asked_for,
                             const std::optional<CaseScan>& scan, const Context& context = {});

/// Whether a report with all its pictures is there and shows the case as it is: then the scan is not needed.
[[nodiscard]] bool has_full_report(const std::filesystem::path& case_folder);

/// Whether the report that is there shows the case as it is.
[[nodiscard]] bool report_shows(const std::filesystem::path& case_folder);

/// Names and values of what a person wants to know of a case: its code, verdict, scan, bone, what was taken off,
/// approval, report. A row without a name goes on with the one before.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> case_facts(const std::filesystem::path& case_folder);

/// What the report says of a case in numbers.
struct CaseMeasures {
  std::optional<double> bone_mm3, lower_hu;  ///< volume of the bone and its threshold, where the case knows them
  struct OfStructure {
    Structure is;
    double volume_mm3 = 0;
    double length_mm = 0;  ///< of a tube, along itself, 0 to 8 % long; 0: not measured
  };
  struct Gap {
    std::string a, b;  ///< names
    double mm = 0;     ///< between the nearest faces of voxels, to half a voxel; 0: they touch
  };
  std::vector<OfStructure> structures;  ///< that hold a voxel
  std::vector<Gap> gaps;                ///< of each two, once, in the order of the structures
};
/// About a second for the structures of an ear. Errors: as of load_case.
[[nodiscard]] CaseMeasures case_measures(const std::filesystem::path& case_folder, const Context& context = {});

/// A short name that can be said and says nothing: two words of five letters, for the first 32 bits of the hash of the
/// scan (of the bone where the case knows no scan). D. Wilkerson, A proposal for proquints, arXiv:0901.4016.
[[nodiscard]] std::string case_code(const std::filesystem::path& case_folder);

}  // namespace osteo::inline assessment
