#include "osteo/imaging/dicom/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/detail/verdict_codes.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/io/volume_io.h"
#include "pixels.h"
#include "slice_judge.h"
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

// What the file leaves open; where the axes are given by hand, it need not state them.
void report_findings(Verdict& v, const std::vector<VolumeFinding>& findings, bool axes_given) {
  for (const VolumeFinding& f : findings) {
    switch (f.what) {
      case VolumeFinding::What::axes_not_stated:
        if (!axes_given)
          v.add(code::axes_not_stated, Severity::warning, f.text,
                "see which side is which ('osteo snapshot'); --axes states it");
        break;
      case VolumeFinding::What::lengths_converted:
        v.add(code::lengths_converted, Severity::warning, f.text, "see that the size is that of a body");
        break;
      case VolumeFinding::What::places_disagree:
        v.add(code::places_disagree, Severity::warning, f.text,
              "find out which of them is right before the sides of the body matter");
        break;
    }
  }
}

// A file that is in centimetres and says millimetres: its head is as long as a thumb, in voxels that no scanner of
// patients makes.
void check_size(Verdict& v, const Frame& frame) {
  const Vec3 h = frame.spacing_mm;
  const double finest = std::min({h.x, h.y, h.z});
  const Vec3 size{h.x * frame.dims[0], h.y * frame.dims[1], h.z * frame.dims[2]};
  const double longest = std::max({size.x, size.y, size.z});
  if ((longest >= kSpecimenMm || finest >= kSpecimenVoxelMm) && longest <= kLongestMm) return;
  const auto mm = [](double x) {
    const double parts = x < 1 ? 1e4 : 10;
    return format_number(std::round(x * parts) / parts);
  };
  v.add(code::size_implausible, Severity::warning,
        "it is " + mm(size.x) + " x " + mm(size.y) + " x " + mm(size.z) + " mm large, in voxels of " + mm(finest) +
            " mm: " + (longest < kSpecimenMm ? "a specimen in micro-CT, or " : "") +
            "a scan whose lengths are not in the unit that the file states",
        "if it is a patient's, save it with its lengths in millimetres");
}

// A header beside its voxels, as of SPM and Analyze: true to the letter it is no DICOM, but nobody is helped by hearing
// so.
void refuse_pair(const fs::path& source) {
  fs::path header = source;
  const std::string suffix = lower_case(source.extension().string());
  if (suffix != ".hdr" && suffix != ".img") return;
  if (suffix == ".img") header.replace_extension(source.extension() == ".IMG" ? ".HDR" : ".hdr");
  std::array<unsigned char, 4> size{};
  std::ifstream(header, std::ios::binary).read(reinterpret_cast<char*>(size.data()), 4);
  const auto is = [&](int a, int b, int c, int d) {
    return size[0] == a && size[1] == b && size[2] == c && size[3] == d;
  };
  if (is(0x5C, 1, 0, 0) || is(0, 0, 1, 0x5C))  // 348, the length of such a header, in either byte order
    throw Error(ExitCode::corrupt,
                "'" + source.string() +
                    "' is of a pair of files (.hdr and .img, Analyze or NIfTI); pairs are not read, for the older of "
                    "them do not state left and right",
                "save it as one file (.nii.gz)");
}

// A volume file says nothing of slices; its values are judged as those of a series are.
Verdict judge_file(Image& image, const ImportParams& params, const std::vector<VolumeFinding>& findings) {
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
  const auto out =
      lowest < -1200 || params.hu_offset != 0 ? make_voxels<std::int16_t>(image.frame.voxel_count()) : nullptr;
  std::vector<std::int16_t> scratch(out ? 0 : area);
  std::vector<dicom::SliceFigure> figures;
  for (int k = 0; k < image.frame.dims[2]; ++k) {
    std::int16_t* const to = out ? out.get() + static_cast<std::size_t>(k) * area : scratch.data();
    dicom::convert_values(header, image.voxels.get() + static_cast<std::size_t>(k) * area, to, count);
    figures.emplace_back(to, header.columns, header.rows);
    std::replace(to, to + area, dicom::kNoValue, dicom::kAirHu);
  }
  if (out) image.voxels = out;
  Verdict v;
  v.source = "volume file";
  v.output = image.frame;
  if (params.hu_offset != 0) {
    v.add(code::hu_offset, Severity::warning,
          format_number(params.hu_offset) + " HU are added to all values, as asked for",
          "look at the mask before you rely on a threshold");
  }
  report_findings(v, findings, !params.axes.empty());
  check_size(v, image.frame);
  dicom::check_values(v, count, image.frame.voxel_volume_mm3(), params.any_modality);
  std::vector<dicom::JudgedSlice> layers;
  for (int k = 0; k < image.frame.dims[2]; ++k)
    layers.push_back({"layer " + std::to_string(k), k * image.frame.spacing_mm.z});
  dicom::judge_slices(v, layers, figures,
                      header.columns * image.frame.spacing_mm.x * header.rows * image.frame.spacing_mm.y);
  if (v.refused()) throw Refused(v);
  return v;
}

}  // namespace

void report_verdict(const Verdict& v, const Context& context) {
  for (const Finding& f : v.findings) {
    if (f.severity == Severity::warning)
      context.warn(f.message + " [" + f.code + "]" + (f.advice.empty() ? "" : "; " + f.advice));
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
    std::vector<VolumeFinding> findings;
    result.image = load_image(source, context, &findings);
    result.verdict = judge_file(result.image, params, findings);
  } else {
    if (fs::is_directory(source) && fs::is_empty(source)) {
      throw Error(ExitCode::no_input, "the folder '" + source.string() + "' is empty",
                  "give the folder with the CT's slices");
    }
    if (!fs::is_directory(source)) refuse_pair(source);
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
  report_verdict(result.verdict, context);
  return result;
}

}  // namespace osteo::inline imaging
