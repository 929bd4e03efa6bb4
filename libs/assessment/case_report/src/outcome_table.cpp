// What came of a plan, from the file that 'osteo outcome' wrote into the case.
#include <array>
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

// Reasons of the file that hold a name or a number; others are in the catalogues as they are.
constexpr std::array kReasons{
    tr_later("'{name}' is not found"),
    tr_later("'{name}' has no closed section in its planes"),
    tr_later("the surface of the '{bone}' shows no condyle on this side"),
    tr_later("the target has no closed section {mm} mm from resection plane a"),
    tr_later("no plane of symmetry: {share} % of the surface lies within 1 mm of its mirror image, fewer than half"),
};

std::string reason(const std::string& why) {
  for (const char* const form : kReasons) {
    const std::string_view f = form;
    const std::string_view begin = f.substr(0, f.find('{')), end = f.substr(f.find('}') + 1);
    if (why.size() < begin.size() + end.size() || !why.starts_with(begin) || !why.ends_with(end)) continue;
    return filled(tr(form), {{f.substr(begin.size() + 1, f.size() - begin.size() - end.size() - 2),
                              why.substr(begin.size(), why.size() - begin.size() - end.size())}});
  }
  return tr(why);
}

// A name, and either two values or why they are not known.
std::vector<sheet::Cell> row(const std::string& name, const Json& of, const std::string& a, const std::string& b) {
  if (flag(of, "known")) return {{name}, {a}, {b}};
  return {{name}, {filled(tr("not known: {why}"), {{"why", reason(text(of, "why"))}}), Tone::caution}, {""}};
}

// Of a fragment, a condyle or a plate. `along`: what it may slide along, where that was not seen.
std::vector<sheet::Cell> pose_row(const std::string& name, const Json& of, const char* along) {
  const std::string all = of.find("slides_along") == nullptr ? name : name + " (" + along + ")";
  return row(all, of, all_text(of, "shift_mm"), all_text(of, "turn_deg"));
}

std::vector<sheet::Cell> reference_row(const std::string& name) {
  return {{name}, {tr("the others are held against it"), Tone::quiet}, {""}};
}

sheet::Table moved_table(const Json& o) {
  sheet::Table moved{
      {tr("Fragment, condyle"), tr("shift x, y, z (mm)"), tr("turn x, y, z (degrees)")}, {}, {0.28, 0.36, 0.36}};
  std::string reference;
  for (const Json& f : items(o, "fragments")) {
    const std::string name = text(f, "name");
    if (flag(f, "reference")) reference = name;
    moved.rows.push_back(flag(f, "reference") ? reference_row(name) : pose_row(name, f, tr("not known along itself")));
  }
  for (const Json& c : items(o, "condyles")) {
    const char* const name = text(c, "side") == "left" ? tr("left condyle") : tr("right condyle");
    moved.rows.push_back(!reference.empty() && text(c, "fragment") == reference
                             ? reference_row(name)
                             : pose_row(name, c, tr("not known along its fragment")));
  }
  return moved;
}

const char* against_text(const std::string& against) {
  return against == "plan"            ? tr("against the plan")
         : against == "mirrored side" ? tr("against the mirrored side")
                                      : tr("against the bone's own outline");
}

void add_screws(const Json& o, SheetBlocks& out) {
  int screws = 0, known = 0, odd = 0;
  for (const Json& s : items(o, "screws")) {
    ++screws;
    known += flag(s, "known") ? 1 : 0;
    odd += s.find("finding") == nullptr ? 0 : 1;
  }
  if (screws > 0)
    out.push_back({sheet::Paragraph{filled(tr("Screws and holes: {known} of {all} are known."),
                                           {{"known", std::to_string(known)}, {"all", std::to_string(screws)}})}});
  if (odd > 0)
    out.push_back({sheet::Paragraph{
        filled(tr("Far from their place, so that they may be others than the planned ones: {count} of {all}."),
               {{"count", std::to_string(odd)}, {"all", std::to_string(screws)}}),
        Tone::caution}});
}

}  // namespace

SheetBlocks outcome_blocks(const std::string& json) {
  const Json o = Json::parse(json).value_or(Json());
  SheetBlocks out{{sheet::Heading{tr("Outcome against the plan")}}};
  if (o.find("osteotome_outcome") == nullptr) {
    out.push_back({sheet::Paragraph{tr("outcome.json of the case is no file of 'osteo outcome'."), Tone::caution}});
    return out;
  }
  out.push_back(
      {sheet::Paragraph{tr("It was measured after surgery, and is no part of what was approved."), Tone::quiet}});
  out.push_back({moved_table(o)});
  sheet::Table cuts{{tr("Cut"), tr("off the plan (mm)"), tr("tilt (degrees)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& c : items(o, "cuts"))
    cuts.rows.push_back(row(text(c, "plane") + " (" + text(c, "fragment") + ")", c, interval_text(c.find("off_mm")),
                            all_text(c, "tilt_deg")));
  if (!cuts.rows.empty()) out.push_back({std::move(cuts)});
  sheet::Table contours{{tr("Contour"), tr("mean (mm)"), tr("95 % within (mm)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& c : items(o, "contours"))
    contours.rows.push_back(
        row(against_text(text(c, "against")), c, interval_text(c.find("mean_mm")), interval_text(c.find("p95_mm"))));
  if (!contours.rows.empty()) out.push_back({std::move(contours)});
  add_screws(o, out);
  sheet::Table plates{{tr("Plate"), tr("shift x, y, z (mm)"), tr("turn x, y, z (degrees)")}, {}, {0.28, 0.36, 0.36}};
  for (const Json& p : items(o, "plates"))
    plates.rows.push_back(pose_row(
        filled(tr("{plate} against {fragment}"), {{"plate", text(p, "name")}, {"fragment", text(p, "against")}}), p,
        tr("not known along itself")));
  if (!plates.rows.empty()) out.push_back({std::move(plates)});
  out.push_back({sheet::Paragraph{
      tr("Value ± half the width of the 95 % interval; x, y, z grow to the patient's left, back and head. How it was "
         "measured and what may not be concluded: docs/guides/planning.md."),
      Tone::quiet}});
  return out;
}

}  // namespace osteo::inline assessment::case_report
