#include <algorithm>
#include <cmath>
#include <sstream>

#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline imaging {
namespace {

constexpr int kFirstHu = -1200, kBinHu = 4, kBarHu = 20, kFromHu = -1400, kToHu = 3200;
constexpr double kLeft = 50, kTop = 96, kHeight = 260, kPerHu = 0.18;

double x_of(double hu) {
  return kLeft + (hu - kFromHu) * kPerHu;
}

// Bars of the bins moved by an offset, on a logarithmic scale; as an outline when asked for.
void bars(std::ostream& svg, const std::vector<std::uint32_t>& histogram, double offset, const char* style) {
  std::vector<double> sum((kToHu - kFromHu) / kBarHu);
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const double hu = kFirstHu + (static_cast<double>(i) + 0.5) * kBinHu + offset;
    if (hu < kFromHu || hu >= kToHu) continue;
    sum[static_cast<std::size_t>((hu - kFromHu) / kBarHu)] += histogram[i];
  }
  const double most = std::max(2.0, *std::max_element(sum.begin(), sum.end()));
  svg << "<path " << style << " d=\"M" << kLeft << ' ' << kTop + kHeight;
  for (std::size_t b = 0; b < sum.size(); ++b) {
    const double y = kTop + kHeight - (sum[b] < 1 ? 0 : kHeight * std::log1p(sum[b]) / std::log1p(most));
    svg << " V" << std::round(y * 10) / 10 << " H" << x_of(kFromHu + kBarHu * (static_cast<double>(b) + 1));
  }
  svg << " V" << kTop + kHeight << "\"/>\n";
}

void mark(std::ostream& svg, double hu, const std::string& what) {
  svg << "<line x1=\"" << x_of(hu) << "\" x2=\"" << x_of(hu) << "\" y1=\"" << kTop - 16 << "\" y2=\"" << kTop + kHeight
      << "\" stroke=\"#b40\" stroke-dasharray=\"4 3\"/>\n<text x=\"" << x_of(hu) + 3 << "\" y=\"" << kTop - 6
      << "\" fill=\"#b40\">" << what << "</text>\n";
}

}  // namespace

std::string picture_of(const Verdict& v) {
  const ValueCheck& c = v.values;
  if (c.histogram.empty()) return {};
  std::ostringstream svg;
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"920\" height=\"420\" font-family=\"sans-serif\" "
         "font-size=\"12\">\n"
      << "<rect width=\"920\" height=\"420\" fill=\"white\"/>\n<text x=\"50\" y=\"24\" font-size=\"16\">The values of "
         "this scan, and where "
         "air and soft tissue should be</text>\n"
      << "<rect x=\"50\" y=\"36\" width=\"12\" height=\"12\" fill=\"#99a\"/><text x=\"68\" y=\"47\">as the files have "
         "them</text>\n";
  bars(svg, c.histogram, 0, "fill=\"#99a\"");
  if (c.offset_hu != 0) {
    bars(svg, c.histogram, c.offset_hu, "fill=\"none\" stroke=\"#06c\" stroke-width=\"1.5\"");
    svg << "<rect x=\"250\" y=\"36\" width=\"12\" height=\"12\" fill=\"none\" stroke=\"#06c\"/><text x=\"268\" "
           "y=\"47\">with --hu-offset "
        << std::lround(c.offset_hu) << "</text>\n";
  }
  mark(svg, -1000, "air -1000");
  mark(svg, 40, "soft tissue 40");
  for (int hu = -1000; hu <= 3000; hu += 500)
    svg << "<text x=\"" << x_of(hu) << "\" y=\"" << kTop + kHeight + 18 << "\" text-anchor=\"middle\">" << hu
        << "</text>\n";
  svg << "<text x=\"" << x_of(900) << "\" y=\"" << kTop + kHeight + 40
      << "\" text-anchor=\"middle\">HU; voxels on a logarithmic scale</text>\n</svg>\n";
  return svg.str();
}

}  // namespace osteo::inline imaging
