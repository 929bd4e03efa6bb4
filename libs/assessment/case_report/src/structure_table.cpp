// The structures of a case in a table: how large, how near to each other, and how far each may be trusted.
#include <algorithm>
#include <cmath>

#include "measures.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "texts.h"

namespace osteo::inline assessment::case_report {
namespace {

// Of a distance between two boundaries, each within so many mm in 95 % of places; empty where that is not known of
// both.
std::string uncertainty_text(const Structure& a, const Structure& b) {
  if (a.within_mm <= 0 || b.within_mm <= 0) return {};
  const double mm = std::hypot(a.within_mm, b.within_mm);
  return std::isfinite(mm) ? " ± " + number_text(mm, 1) : " ± ?";
}

// What the one who drew it says of it, and whether it looks like what it is called.
sheet::Cell judged(const StructureMeasure& m, const Plausibility& p) {
  std::string why = m.structure.doubt;
  if (!p.fits && p.known) why += (why.empty() ? "" : "; ") + p.doubt;
  if (!m.structure.doubt.empty()) return {filled(tr("not to be trusted: {why}"), {{"why", why}}), Tone::caution};
  std::string text = !p.known ? "" : p.fits ? tr("plausible") : filled(tr("look: {why}"), {{"why", p.doubt}});
  if (m.structure.within_mm > 0)
    text += (text.empty() ? "" : "; ") +
            (std::isfinite(m.structure.within_mm)
                 ? filled(tr("boundary within {mm} mm"), {{"mm", number_text(m.structure.within_mm, 1)}})
                 : std::string(tr("boundary uncertain")));
  const bool doubtful = !p.fits || !std::isfinite(m.structure.within_mm);
  return {text, doubtful && !text.empty() ? Tone::caution : p.known ? Tone::good : Tone::plain};
}

}  // namespace

sheet::Table structure_table(const std::vector<StructureMeasure>& measures) {
  sheet::Table t;
  t.head = {tr("structure"), tr("volume"), tr("parts"), tr("length"), tr("nearest to it"), tr("usual"), ""};
  t.widths = {18, 12, 10, 11, 25, 30, 17};
  const auto of = [&](std::uint8_t value) {
    const auto m = std::find_if(measures.begin(), measures.end(),
                                [&](const auto& other) { return other.structure.value == value; });
    return m == measures.end() ? Structure{} : m->structure;
  };
  for (const StructureMeasure& m : measures) {
    const Plausibility p = plausibility_of(m);
    std::string near;
    for (std::size_t g = 0; g < std::min<std::size_t>(2, m.gaps.size()); ++g)
      near += (near.empty() ? "" : "; ") +
              filled(m.gaps[g].mm < 0.05 ? tr("{structure} touches") : "{structure} {mm} mm",
                     {{"structure", tr(of(m.gaps[g].other).name)},
                      {"mm", number_text(m.gaps[g].mm, 1) + uncertainty_text(m.structure, of(m.gaps[g].other))}});
    std::string pieces = std::to_string(m.parts);
    if (m.specks > 0)
      pieces = filled(tr_n("{parts} and {n} speck", "{parts} and {n} specks", static_cast<double>(m.specks)),
                      {{"parts", pieces}, {"n", std::to_string(m.specks)}});
    t.rows.push_back({{tr(m.structure.name), Tone::plain},
                      {volume_text(m.volume_mm3), Tone::plain},
                      {pieces, Tone::plain},
                      {m.length_mm > 0 ? number_text(m.length_mm, 0) + " mm" : "", Tone::plain},
                      {near, Tone::plain},
                      {p.known ? p.expected : tr("no usual size known"), p.known ? Tone::plain : Tone::quiet},
                      judged(m, p)});
  }
  return t;
}

std::string sources_of(const std::vector<StructureMeasure>& measures) {
  std::vector<std::string> said;
  for (const StructureMeasure& m : measures) {
    const Plausibility p = plausibility_of(m);
    if (!p.known) continue;
    const std::string text = lower_case(m.structure.name).find("facial") != std::string::npos
                                 ? filled(tr("facial nerve: {source}"), {{"source", p.source}})
                                 : p.source;
    if (std::find(said.begin(), said.end(), text) == said.end()) said.push_back(text);
  }
  std::string all;
  for (const std::string& s : said) all += (all.empty() ? "" : "; ") + s;
  return all.empty()
             ? all
             : filled(tr("Usual sizes: {sources}. Lengths are along the structure, up to 8 % long; distances to "
                         "half a voxel."),
                      {{"sources", all}});
}

}  // namespace osteo::inline assessment::case_report
