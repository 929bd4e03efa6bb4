// A case to another program and back: its CT, its bone and its structures out; what was edited there in again, if it is
// of the same scan.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::inline session {

/// Tag of a segment that holds the mark of its scan.
inline constexpr std::string_view kScanTag = "Osteotome.Scan";

/// What a case is made from, in the frame of its CT.
struct CaseImages {
  Image ct;                          ///< as cropped for the case
  Labels bone;                       ///< the mask its bone is made from
  std::optional<Labels> structures;  ///< on a lattice of their own
  std::string mark;                  ///< scan_mark of the CT
};

/// Of dims and voxels: the same whatever program writes the file again, in whatever order of fields, compression or
/// world axes.
[[nodiscard]] std::string scan_mark(const Image& ct);

/// A pipeline of a case as it is on disk. The stages "resample" and what it takes as image and mask must be there.
struct CasePipeline {
  std::string text;                             ///< as a pipeline file
  std::map<std::string, std::string> settings;  ///< of its variables, with source and case
};
/// Reads and masks the scan again as the case's pipeline does. Errors: usage for a pipeline without such stages (one
/// that never has the volume in memory), and those of the stages.
[[nodiscard]] CaseImages images_of_case(const CasePipeline& pipeline, const std::filesystem::path& case_folder,
                                        const Registry& registry, const Context& context = {});

/// ct.nrrd, bone.seg.nrrd and, where there are any, structures.seg.nrrd. Atomic as a folder, which must be new or
/// empty. Each segment carries kScanTag. Nothing in them names the patient, but a CT of a head shows a face.
void export_slicer(const CaseImages& images, const std::filesystem::path& folder);

/// What became of one structure.
struct SegmentChange {
  std::string name, was;  ///< `was` is empty for what is new, `name` for what is gone
  bool is_bone = false;
  double before_mm3 = 0, after_mm3 = 0, added_mm3 = 0, removed_mm3 = 0;
  [[nodiscard]] bool changed() const { return added_mm3 > 0 || removed_mm3 > 0 || name != was; }
};

struct SlicerImport {
  std::optional<Labels> bone;        ///< on the lattice of the CT; none when it did not come back
  std::optional<Labels> structures;  ///< none when no file of structures came back
  std::vector<SegmentChange> changes;
  bool bone_changed = false, structures_changed = false;
};

struct SlicerImportOptions {
  bool match_by_position = false;  ///< also what bears no mark, if it lies where the case's bone lies
};

/// Reads all .seg.nrrd of `folder` (or the file itself). Segments are told by kStructureTag, else by name; "bone" is
/// the bone. What proves the scan: the mark in the segments' tags, else ct.nrrd beside them, whose voxels must be those
/// of the case. A colour that was changed counts as no change. Errors, each with its reason: corrupt for segments of
/// another scan, without any proof, or that lie elsewhere (less than half of the bone where it was, or a structure
/// outside the CT); no_input without a file. Warns of what was resampled, overlaps or sticks out.
[[nodiscard]] SlicerImport import_slicer(const CaseImages& images, const std::filesystem::path& folder,
                                         const SlicerImportOptions& options = {}, const Context& context = {});

/// The pipeline with kCorrectedBone in place of the stage that made the mask; its fixed threshold stays that of the
/// boundary. It names the file by the variable "case" alone, so that no folder's name gets into the case, and the case
/// can be moved.
[[nodiscard]] std::string with_corrected_bone(const CasePipeline& pipeline);

/// Files that a correction leaves in its case.
inline constexpr std::string_view kCorrectedBone = "corrected-bone.nrrd",
                                  kCorrectedPipeline = "corrected-pipeline.json";

/// The pipeline file of this content: where it was last seen, or the corrected one in the case. None where it is not
/// known.
[[nodiscard]] std::optional<std::filesystem::path> pipeline_file(const std::filesystem::path& case_folder,
                                                                 const std::string& hash);

}  // namespace osteo::inline session
