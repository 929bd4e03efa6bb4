// What came of a plan, from the file that 'osteo outcome' wrote into the case.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "osteo/core/base/translate.h"
#include "texts.h"

namespace osteo::inline assessment::case_report {
namespace {

std::string text(const Json& of, std::string_view key) {
  const Json* const j = of.find(key);
  return j == nullptr || j->text() == nullptr ? std::string() : *j->text();
}
bool flag(const Json& of, std::string_view key) {
  const Json* const j = of.find(key);
  return j != nullptr && j->flag() != nullptr && *j->flag();
}
const Json::List& items(const Json& of, std::string_view key) {
  static const Json nothing;
  const Json* const j = of.find(key);
  return (j == nullptr ? nothing : *j).items();
}

std::string interval_text(const Json* m) {
  const auto part = [&](std::string_view key) {
    const Json* const j = m == nullptr ? nullptr : m->find(key);
    return number_text(j == nullptr ? 0 : j->number().value_or(0), 2);
  };
  return part("value") + " ± " + part("half_width_95");
}
std::string all_text(const Json& of, std::string_view key) {
  std::string all;
  for (const Json& m : items(of, key)) all += (all.empty() ? "" : "; ") + interval_text(&m);
  return all;
}

// A name, and either two values or why they are not known.
std::vector<sheet::Cell> row(const std::string& name, const Json& of, const std::string& a, const std::string& b) {
  if (flag(of, "known")) return {{name}, {a}, {b}};
  return {{name}, {filled(tr("not known: {why}"), {{"why", text(of, "why")}}), Tone::caution}, {""}};
}

}  // namespace

SheetBlocks outcome_blocks(const std::string& json) {
  const Json o = Json::parse(json).value_or(Json());
  SheetBlocks out{{sheet::Heading{tr("Outcome against the plan")}}};
  if (o.find("osteotome_outcome") == nullptr) {
    out.push_back({sheet::Paragraph{tr("outcome.json of the case is no file of 'osteo outcome'."), Tone::caution}});
    return out;
  }
  sheet::Table moved{
      {tr("Fragment, condyle"), tr("shift x, y, z (mm)"), tr("turn x, y, z (degrees)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& f : items(o, "fragments")) {
    const std::string name = text(f, "name");
    if (flag(f, "reference"))
      moved.rows.push_back({{name}, {tr("the others are held against it"), Tone::quiet}, {""}});
    else
      moved.rows.push_back(row(name, f, all_text(f, "shift_mm"), all_text(f, "turn_deg")));
  }
  for (const Json& c : items(o, "condyles"))
    moved.rows.push_back(row(text(c, "side") == "left" ? tr("left condyle") : tr("right condyle"), c,
                             all_text(c, "shift_mm"), all_text(c, "turn_deg")));
  out.push_back({std::move(moved)});
  sheet::Table cuts{{tr("Cut"), tr("off the plan (mm)"), tr("tilt (degrees)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& c : items(o, "cuts"))
    cuts.rows.push_back(row(text(c, "plane"), c, interval_text(c.find("off_mm")), all_text(c, "tilt_deg")));
  if (!cuts.rows.empty()) out.push_back({std::move(cuts)});
  sheet::Table contours{{tr("Contour"), tr("mean (mm)"), tr("95 % within (mm)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& c : items(o, "contours"))
    contours.rows.push_back(row(text(c, "against") == "plan" ? tr("against the plan") : tr("against the mirrored side"),
                                c, interval_text(c.find("mean_mm")), interval_text(c.find("p95_mm"))));
  if (!contours.rows.empty()) out.push_back({std::move(contours)});
  int screws = 0, known = 0;
  for (const Json& s : items(o, "screws")) {
    ++screws;
    known += flag(s, "known") ? 1 : 0;
  }
  if (screws > 0)
    out.push_back({sheet::Paragraph{filled(tr("Screws and holes: {known} of {all} are known."),
                                           {{"known", std::to_string(known)}, {"all", std::to_string(screws)}})}});
  out.push_back({sheet::Paragraph{
      tr("Value ± half the width of the 95 % interval; x, y, z grow to the patient's left, back and head. How it was "
         "measured and what may not be concluded: docs/guides/planning.md."),
      Tone::quiet}});
  return out;
}

}  // namespace osteo::inline assessment::case_report
