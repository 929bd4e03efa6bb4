// CT volumes and label maps in the formats of the field: NRRD, NIfTI, MetaImage, VTI.
#pragma once
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// True for .nrrd .nhdr .nii .nii.gz .mha .mhd .vti (any case).
[[nodiscard]] bool is_volume_file(const std::filesystem::path& path);

/// What a volume file does not state, states in other units, or states twice.
struct VolumeFinding {
  enum class What {
    axes_not_stated,    ///< nothing says which way left, back and head are: NRRD without an anatomical space, NIfTI
                        ///< without a form
    lengths_converted,  ///< lengths were not in mm
    places_disagree,    ///< NIfTI's two forms put the voxels at different places
  };
  What what = What::axes_not_stated;
  std::string text;  ///< a sentence, for people
};

/// By suffix. The frame comes out in LPS mm whatever the format's own axes and units are (NIfTI and some NRRD: RAS;
/// xyzt_units, space units, DistanceUnits). NIfTI: sform when present, else qform; a sheared sform is rejected, as are
/// two forms of which one mirrors the other. A file of several volumes is rejected. What the file leaves open goes into
/// `findings`, or to the log where that is null. Errors: no_input, cannot_read, corrupt.
[[nodiscard]] Image load_image(const std::filesystem::path& path, const Context& context = {},
                               std::vector<VolumeFinding>* findings = nullptr);
/// The same for values that are whole numbers from 0 to 255. NRRD of 3D Slicer (.seg.nrrd): names and colours come
/// along, and several layers become one label map (a warning says how many voxels overlapped).
[[nodiscard]] Labels load_labels(const std::filesystem::path& path, const Context& context = {});
/// Where both are accepted: labels when the file's scalars are 8-bit unsigned, else an image.
[[nodiscard]] std::variant<Image, Labels> load_volume(const std::filesystem::path& path, const Context& context = {});

/// By suffix, written atomically. Names of structures are kept by NRRD (.seg.nrrd, as 3D Slicer reads it) only. Same
/// volume, same bytes. Errors: usage for an unknown suffix, cannot_write.
void save_image(const Image& image, const std::filesystem::path& path);
void save_labels(const Labels& labels, const std::filesystem::path& path);

}  // namespace osteo::inline imaging
