// Segments of 3D Slicer (.seg.nrrd) one by one, as they may overlap; load_labels of volume_io.h makes one label map of
// them.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// Tag of a segment that holds the name under which it was written, whatever it is called since.
inline constexpr std::string_view kStructureTag = "Osteotome.Structure";

/// Tag of a segment that tells what drew it (Structure::origin), where that is known.
inline constexpr std::string_view kOriginTag = "Osteotome.Origin";
/// Tags of Structure::within_mm ("0.6", "inf") and Structure::doubt, where they are known.
inline constexpr std::string_view kWithinTag = "Osteotome.BoundaryWithinMm", kDoubtTag = "Osteotome.NotTrusted";

/// What the tags say of a segment's certainty; what is no distance there counts as not known.
void read_certainty(const std::map<std::string, std::string>& tags, Structure& structure);

/// A text as the value of a tag: the bar parts tags.
[[nodiscard]] std::string tag_value(std::string text);

struct Segment {
  std::string id, name;
  std::array<std::uint8_t, 3> rgb{0, 0, 0};
  std::map<std::string, std::string> tags;
  /// 1 where it is, cut to the box that holds it; none when it is empty.
  std::optional<Volume<std::uint8_t>> mask;
};

/// In the order of the file. Memory: a byte for each voxel of each box. Errors: no_input, cannot_read, corrupt (also
/// when the file names no segment).
[[nodiscard]] std::vector<Segment> load_segments(const std::filesystem::path& path, const Context& context = {});

/// A label map as .seg.nrrd whose segments carry `tags` and kStructureTag, which Slicer writes back as they are. Keys
/// without ':' and '|', values without '|'. Atomic. Errors: usage for another suffix, cannot_write.
void save_segments(const Labels& labels, const std::filesystem::path& path,
                   const std::map<std::string, std::string>& tags);

}  // namespace osteo::inline imaging
