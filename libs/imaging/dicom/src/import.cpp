#include "osteo/imaging/dicom/import.h"

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/io/volume_io.h"
#include "pixels.h"
#include "value_check.h"

namespace osteo::inline imaging {
namespace {

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

// A volume file says nothing of slices; its values are judged as those of a series are.
Verdict judge_file(Image& image, const ImportParams& params) {
  DicomHeader header;
  header.columns = image.frame.dims[0];
  header.rows = image.frame.dims[1];
  header.is_signed = true;
  header.bits_allocated = 16;
  header.frames.resize(1);
  header.frames[0].intercept = params.hu_offset;
  dicom::ValueCount count;
  const std::size_t area = header.pixels_per_frame();
  const auto lowest = *std::min_element(image.span().begin(), image.span().end());
  const auto out = lowest < -1200 || params.hu_offset != 0 ? make_voxels<std::int16_t>(image.frame.voxel_count()) : nullptr;
  std::vector<std::int16_t> scratch(out ? 0 : area);
  for (int k = 0; k < image.frame.dims[2]; ++k) {
    std::int16_t* const to = out ? out.get() + static_cast<std::size_t>(k) * area : scratch.data();
    dicom::convert_values(header, image.voxels.get() + static_cast<std::size_t>(k) * area, to, count);
    std::replace(to, to + area, dicom::kNoValue, dicom::kAirHu);
  }
  if (out) image.voxels = out;
  Verdict v;
  v.source = "volume file";
  v.output = image.frame;
  if (params.hu_offset != 0) {
    v.add(code::hu_offset, Severity::warning, format_number(params.hu_offset) + " HU are added to all values, as asked for",
          "look at the mask before you rely on a threshold");
  }
  dicom::check_values(v, count, image.frame.voxel_volume_mm3(), params.any_modality);
  if (v.refused()) throw Refused(v);
  return v;
}

}  // namespace

void tell_verdict(const Verdict& v, const Context& context) {
  for (const Finding& f : v.findings) {
    if (f.severity == Severity::warning) context.warn(f.message + " [" + f.code + "]" + (f.advice.empty() ? "" : "; " + f.advice));
    if (f.severity == Severity::info) context.info(f.message + " [" + f.code + "]");
  }
  context.report("verdict", v.status());
  context.report("source_kind", v.source);
  if (v.source == "DICOM") {
    context.report("slices", static_cast<std::int64_t>(v.slices.size()));
    context.report("slice_gap_min_mm", v.gap_min_mm);
    context.report("slice_gap_max_mm", v.gap_max_mm);
    context.report("gantry_tilt_deg", v.tilt_deg);
    context.report("resampled", v.resampled);
    context.report("position_error_mm", v.position_error_mm);
  }
  context.report("axes", orientation_code(v.output));
  context.report("hu_min", v.values.hu_min);
  context.report("hu_max", v.values.hu_max);
  context.report("looks_like_hu", v.values.plausible);
}

Imported import_ct(const fs::path& source, const ImportParams& params, const Context& context) {
  require_readable(source);
  Imported result;
  if (!fs::is_directory(source) && is_volume_file(source)) {
    result.image = load_image(source, context);
    result.verdict = judge_file(result.image, params);
  } else {
    if (fs::is_directory(source) && fs::is_empty(source)) {
      throw Error(ExitCode::no_input, "the folder '" + source.string() + "' is empty", "give the folder with the CT's slices");
    }
    const PlaceOptions options = place_options(params);
    const DicomScan scan = scan_dicom(source, options, context.sub(0, 0.2));
    const DicomSeries& series = choose_series(scan, params.series, source.string());
    DicomVolume loaded = load_dicom_series(series, options, context.sub(0.2, 1.0));
    result = {std::move(loaded.image), std::move(loaded.verdict)};
  }
  if (!params.axes.empty()) {
    Frame& frame = result.image.frame;
    const Vec3 centre = frame.centre_mm();
    frame.direction = direction_of(params.axes);
    frame.origin_mm += centre - frame.centre_mm();
    result.verdict.output = frame;
  }
  tell_verdict(result.verdict, context);
  return result;
}

}  // namespace osteo::imaging
