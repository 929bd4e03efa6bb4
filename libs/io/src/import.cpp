#include "osteo/io/import.h"

#include <algorithm>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/io/dicom.h"
#include "osteo/io/volume_io.h"

namespace osteo {
namespace {

const DicomSeries& choose(const std::vector<DicomSeries>& all, const std::string& wanted, const fs::path& source) {
  for (const DicomSeries& s : all) {
    if (wanted.empty() ? s.recommended : (std::to_string(s.number) == wanted || s.uid == wanted)) return s;
  }
  std::string list;
  for (const DicomSeries& s : all) list += (list.empty() ? "" : "; ") + std::to_string(s.number) + ": " + s.what;
  if (wanted.empty()) {
    throw Error(ExitCode::no_input, "'" + source.string() + "' holds no CT series that makes a volume (" + list + ")",
                "'osteo import --list FOLDER' shows what each series is");
  }
  throw Error(ExitCode::usage, "there is no series '" + wanted + "' (" + list + ")", "'osteo import --list FOLDER' shows the series");
}

// Direction columns from letters: L R A P H F, with S and I for H and F.
Mat3 direction_of(const std::string& axes) {
  Mat3 m;
  int used = 0;
  for (std::size_t a = 0; a < 3 && axes.size() == 3; ++a) {
    static constexpr std::string_view kLetters = "LPSRAIHF";
    static constexpr int kAxis[] = {0, 1, 2, 0, 1, 2, 2, 2}, kSign[] = {1, 1, 1, -1, -1, -1, 1, -1};
    const std::size_t at = kLetters.find(static_cast<char>(std::toupper(static_cast<unsigned char>(axes[a]))));
    if (at == std::string_view::npos) break;
    m.column[a] = {};
    m.column[a][static_cast<std::size_t>(kAxis[at])] = kSign[at];
    used |= 1 << kAxis[at];
  }
  if (used != 7) {
    throw Error(ExitCode::usage, "--axes: '" + axes + "' is not three letters, one of L R, one of A P, one of S I",
                "LPS is the usual order; LPI when the first slice is the top of the head");
  }
  return m;
}

void report_values(const Image& image, const Context& context) {
  std::int16_t lo = 32767, hi = -32768;
  std::size_t air = 0, soft = 0;
  for (const std::int16_t v : image.span()) {
    lo = std::min(lo, v);
    hi = std::max(hi, v);
    air += v < -800 ? 1 : 0;
    soft += v > -200 && v < 200 ? 1 : 0;
  }
  context.report("hu_min", static_cast<std::int64_t>(lo));
  context.report("hu_max", static_cast<std::int64_t>(hi));
  const auto n = static_cast<double>(image.frame.voxel_count());
  const bool like_hu = static_cast<double>(air) / n > 0.001 && static_cast<double>(soft) / n > 0.01 && hi > 300;
  context.report("looks_like_hu", like_hu);
  if (!like_hu) {
    context.warn("the values (" + std::to_string(lo) + " to " + std::to_string(hi) +
                 ") do not look like a CT in Hounsfield units: check the bone threshold by eye");
  }
}

}  // namespace

Image import_ct(const fs::path& source, const ImportParams& params, const Context& context) {
  require_readable(source);
  Image image;
  if (!fs::is_directory(source) && is_volume_file(source)) {
    image = load_image(source, context);
    context.report("source_kind", std::string("volume file"));
  } else {
    if (fs::is_directory(source) && fs::is_empty(source)) {
      throw Error(ExitCode::no_input, "the folder '" + source.string() + "' is empty", "give the folder with the CT's slices");
    }
    const auto all = scan_dicom(source, context.sub(0, 0.2));
    const DicomSeries& series = choose(all, params.series, source);
    image = load_dicom_series(series, params.max_gap_mm, context.sub(0.2, 1.0));
    context.report("source_kind", std::string("DICOM"));
  }
  if (!params.axes.empty()) {
    const Vec3 centre = image.frame.centre_mm();
    image.frame.direction = direction_of(params.axes);
    image.frame.origin_mm += centre - image.frame.centre_mm();
  }
  context.report("axes", orientation_code(image.frame));
  report_values(image, context);
  return image;
}

StageInfo ImportStage::info() {
  return {.name = "import",
          .version = 1,
          .synopsis = "a CT from DICOM, NRRD, NIfTI, MetaImage or VTI as one volume in HU",
          .description =
              "Takes a folder of DICOM files (or one volume file), applies the HU scale and places each voxel in LPS mm. Even, "
              "straight slices are taken voxel for voxel; a tilted gantry or uneven gaps are resampled onto straight slices. "
              "What cannot be placed rightly is refused. 'osteo import --list FOLDER' shows the series of a folder.",
          .inputs = {{"source", {DataKind::source}, "DICOM folder or file, or a volume file"}},
          .outputs = {{"image", {DataKind::image}, "CT in HU"}},
          .references = {"DICOM PS3.3 C.7.6.2, Image Plane Module"},
          .example = "osteo import DICOM_FOLDER ct.nrrd"};
}

std::vector<Data> ImportStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  return {import_ct(std::get<Source>(inputs[0]).path, params, context)};
}

}  // namespace osteo
