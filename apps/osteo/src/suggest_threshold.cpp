// guide: which threshold suits the bone of a scan.
#include <algorithm>
#include <cmath>
#include <ostream>
#include <sstream>
#include <vector>

#include "commands/suggest_threshold.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/shell.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {

namespace {

// Voxels by value on a logarithmic scale, with what was found among them.
std::string histogram_svg(const Image& ct, const BoneGuide& g) {
  constexpr int kFrom = -1200, kTo = 3000, kStep = 20, kHeight = 300, kTop = 70;
  std::vector<double> bins((kTo - kFrom) / kStep);
  for (const std::int16_t v : ct.span()) {
    if (v >= kFrom && v < kTo) bins[static_cast<std::size_t>((v - kFrom) / kStep)] += 1;
  }
  const double most = std::max(2.0, *std::max_element(bins.begin(), bins.end()));
  const auto x = [](double hu) { return 40 + (hu - kFrom) / 5; };
  std::ostringstream svg;
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"920\" height=\"430\" font-family=\"sans-serif\" "
         "font-size=\"12\">\n"
      << "<rect width=\"920\" height=\"430\" fill=\"white\"/>\n<g fill=\"#889\">\n";
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double h = bins[i] < 1 ? 0 : kHeight * std::log1p(bins[i]) / std::log1p(most);
    svg << "<rect x=\"" << x(kFrom + kStep * static_cast<int>(i)) << "\" y=\"" << kTop + kHeight - h
        << "\" width=\"4\" height=\"" << h << "\"/>\n";
  }
  svg << "</g>\n";
  for (int hu = -1000; hu <= kTo; hu += 500)
    svg << "<text x=\"" << x(hu) << "\" y=\"" << kTop + kHeight + 18 << "\" text-anchor=\"middle\">" << hu
        << "</text>\n";
  svg << "<text x=\"460\" y=\"" << kTop + kHeight + 40
      << "\" text-anchor=\"middle\">HU; voxels on a logarithmic scale</text>\n";
  const auto mark = [&](double hu, const std::string& what, const char* colour, int line) {
    svg << "<line x1=\"" << x(hu) << "\" x2=\"" << x(hu) << "\" y1=\"" << 18 + 14 * line << "\" y2=\"" << kTop + kHeight
        << "\" stroke=\"" << colour << "\"/>\n<text x=\"" << x(hu) + 3 << "\" y=\"" << 26 + 14 * line << "\" fill=\""
        << colour << "\">" << what << ' ' << std::lround(hu) << "</text>\n";
  };
  mark(g.soft_tissue_hu, "soft tissue", "#b40", 0);
  mark(g.dense_bone_hu, "dense bone", "#b40", 0);
  for (std::size_t n = 0; n < g.presets.size(); ++n)
    mark(g.presets[n].lower_hu,
         std::string(EnumNames<BonePreset>::values[static_cast<std::size_t>(g.presets[n].preset)]), "#06c",
         static_cast<int>(g.presets.size() - n));
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace

cli::CommandInfo SuggestThresholdCommand::info() {
  return {"suggest-threshold",
          "which bone threshold suits a scan",
          "Finds soft tissue and dense bone in the values and proposes a threshold for thick bone (cortical), for the "
          "walls of air cells "
          "(cellular) and for thin plates (thin), with the volume of bone each gives and how much that depends on the "
          "exact number.",
          {{"source", "DICOM folder or zip, or a volume file"}},
          "osteo suggest-threshold DICOM_FOLDER",
          false,
          {},
          {"picture"},
          {"source"}};
}

int SuggestThresholdCommand::run(const Params& p, cli::Invocation& io) {
  if (!p.picture.empty() && fs::path(p.picture).extension() != ".svg")
    throw Error(ExitCode::usage, "--picture '" + p.picture + "': the histogram is written as .svg");
  if (!p.picture.empty() && output_exists(p.picture) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + p.picture + "' exists already",
                "give another name, or --force to replace it");
  ImportParams import;
  import.series = p.series;
  import.hu_offset = p.hu_offset;
  const Image ct = import_ct(io.arguments[0], import, io.context).image;
  const BoneGuide g = guide_threshold(ct, io.context.threads);
  io.end_progress();
  if (!p.picture.empty()) write_file(p.picture, histogram_svg(ct, g));
  if (io.common.json) {
    Json j{{"soft_tissue_hu", g.soft_tissue_hu}, {"noise_hu", g.noise_hu}, {"dense_bone_hu", g.dense_bone_hu},
           {"confidence", g.confidence},         {"warning", g.doubt},     {"presets", Json::object()}};
    for (const PresetGuide& each : g.presets) {
      j["presets"][std::string(EnumNames<BonePreset>::values[static_cast<std::size_t>(each.preset)])] = {
          {"lower_hu", each.lower_hu},
          {"volume_mm3", each.volume_mm3},
          {"change_percent_per_50_hu", each.change_percent}};
    }
    io.out << j.dump(2) << '\n';
    return 0;
  }
  const auto r = [](double v) { return std::lround(v); };
  io.out << "soft tissue " << r(g.soft_tissue_hu) << " HU (noise " << r(g.noise_hu) << "), dense bone "
         << r(g.dense_bone_hu) << " HU; confidence " << std::round(g.confidence * 100) / 100
         << (g.confidence > 0.7   ? " (good)"
             : g.confidence > 0.4 ? " (look at the mask)"
             : g.doubt.empty()    ? " (poor: decide by eye)"
                                  : " (" + g.doubt + ")")
         << "\n\npreset     lower HU  volume cm3  changes per 50 HU  for\n";
  static constexpr const char* kFor[] = {"skull vault, jaw, long bones", "mastoid air cells, cancellous bone",
                                         "orbit, sinus walls, tegmen"};
  for (std::size_t n = 0; n < g.presets.size(); ++n) {
    const PresetGuide& each = g.presets[n];
    char line[160];
    std::snprintf(line, sizeof line, "%-10s %-9.0f %-11.1f %-18s %s\n",
                  std::string(EnumNames<BonePreset>::values[static_cast<std::size_t>(each.preset)]).c_str(),
                  each.lower_hu, each.volume_mm3 / 1000, (std::to_string(r(each.change_percent)) + " %").c_str(),
                  kFor[n]);
    io.out << line;
  }
  if (!g.doubt.empty()) return 0;
  io.out << "\nosteo prepare " << shell_path(io.arguments[0]) << " -o CASE --preset cellular"
         << (p.series.empty() ? "" : " --series " + p.series)
         << (p.hu_offset == 0 ? "" : " --hu-offset " + format_number(p.hu_offset)) << '\n';
  return 0;
}

}  // namespace osteo
