// What goes back into the study that a case was made from.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/hospital/pacs/audit.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/recipe.h"

namespace osteo {

/// The pipeline of the case up to its mask, where the scan and all that it was asked for are at hand. `given`: a path
/// of the scan; empty: where this machine last saw it.
[[nodiscard]] std::optional<Pipeline> pipeline_at_hand(const std::filesystem::path& folder,
                                                       const std::optional<Recipe>& recipe, const std::string& given);

/// The very series that the case was made from: a report under another patient's name would be worse than none.
struct CaseSeries {
  DicomScan scan;
  const DicomSeries* series = nullptr;  ///< of `scan`
};
/// Errors: no_input (the scan is not at hand), usage (it was no DICOM series).
[[nodiscard]] CaseSeries series_of(const std::filesystem::path& folder, const std::optional<Pipeline>& pipeline,
                                   cli::Invocation& io);

/// A DICOM object that `flag` asks for, before anything is made: a name that ends in .dcm, and nothing there, or
/// --force. `example`: a name that would do.
void check_object(const std::string& object, const std::filesystem::path& example, const char* flag,
                  const cli::Invocation& io);

/// Tells the audit trail and the person that `written`, which names the patient, is there.
void handed_over(const AuditTrail& trail, const std::filesystem::path& case_folder, const std::string& written,
                 cli::Invocation& io);

/// Measures of the case, for a structured report. `segmentation`: DICOM SEG of its structures; empty: none.
[[nodiscard]] MeasuresReport measures_of_case(const std::filesystem::path& folder,
                                              const std::filesystem::path& segmentation, const Context& context);

}  // namespace osteo
