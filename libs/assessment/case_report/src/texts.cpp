#include "texts.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline assessment::case_report {
namespace {

const Json* at(const Json* json, std::string_view key) {
  return json == nullptr ? nullptr : json->find(key);
}
double number(const Json* json, double otherwise = 0) {
  return json == nullptr ? otherwise : json->number().value_or(otherwise);
}
std::string text(const Json* json) {
  return json == nullptr || json->text() == nullptr ? std::string() : *json->text();
}

Json read_json(const fs::path& path) {
  return output_exists(path) ? Json::parse(read_text(path)).value_or(Json()) : Json();
}

// "0.45 x 0.45 x 1 mm"
std::string edges_text(const Json* three) {
  if (three == nullptr || three->items().size() != 3) return tr("not known");
  std::string all;
  for (const Json& v : three->items()) all += (all.empty() ? "" : " x ") + number_text(v.number().value_or(0), 2);
  return all + " mm";
}

// "left, back, head" for LPS: where the three axes of the voxels go.
std::string axes_text(const std::string& letters) {
  std::string words;
  for (const char c : letters) {
    const char* word = c == 'L'   ? tr_of("towards", "left")
                       : c == 'R' ? tr_of("towards", "right")
                       : c == 'A' ? tr_of("towards", "front")
                       : c == 'P' ? tr_of("towards", "back")
                       : c == 'I' ? tr_of("towards", "feet")
                       : c == 'S' ? tr_of("towards", "head")
                                  : nullptr;
    if (word == nullptr) return letters;
    words += (words.empty() ? "" : ", ") + std::string(word);
  }
  return filled(tr("to the {directions} ({letters})"), {{"directions", words}, {"letters", letters}});
}

}  // namespace

CaseFacts::CaseFacts(const fs::path& folder)
    : manifest_(read_json(folder / "manifest.json")), verdict_(read_json(folder / "import.json")) {}

const Json* CaseFacts::verdict(std::string_view a, std::string_view b) const {
  const Json* const first = verdict_.find(a);
  return b.empty() ? first : at(first, b);
}

const Json* CaseFacts::step(std::string_view stage) const {
  const Json* const steps = manifest_.find("steps");
  if (steps == nullptr) return nullptr;
  for (const Json& s : steps->items()) {
    if (text(s.find("stage")) == stage) return &s;
  }
  return nullptr;
}

std::optional<double> CaseFacts::reported(std::string_view stage, std::string_view key) const {
  const Json* const value = at(at(step(stage), "report"), key);
  return value == nullptr ? std::nullopt : value->number();
}
std::string CaseFacts::reported_text(std::string_view stage, std::string_view key) const {
  return text(at(at(step(stage), "report"), key));
}
std::string CaseFacts::param(std::string_view stage, std::string_view key) const {
  return text(at(at(step(stage), "params"), key));
}

std::string number_text(double value, int decimals) {
  const double scale = std::pow(10, decimals);
  return shown_figures(format_number(std::round(value * scale) / scale));
}

std::string volume_text(double mm3) {
  if (std::abs(mm3) < 10) return number_text(mm3, 1) + " mm³";
  if (std::abs(mm3) < 1000) return number_text(mm3, 0) + " mm³";
  const double cm3 = mm3 / 1000;
  return number_text(cm3, cm3 < 10 ? 2 : cm3 < 100 ? 1 : 0) + " cm³";
}

sheet::Band verdict_band(const CaseFacts& f) {
  const std::string status = text(f.verdict("status"));
  std::string first;
  const Json* const findings = f.verdict("findings");
  std::size_t warnings = 0;
  if (findings != nullptr) {
    for (const Json& e : findings->items()) {
      if (text(e.find("severity")) != "warning") continue;
      ++warnings;
      if (first.empty()) first = text(e.find("message"));
    }
  }
  // Less than any table has, and teeth and the tip of a nose reach so far (libs/imaging/image, threshold).
  constexpr double kMinHolderMm3 = 1000;
  if (const auto left = f.reported("threshold", "outside_body_left_mm3");
      status == "good" && left.value_or(0) >= kMinHolderMm3) {
    return {
        tr("Look"),
        filled(tr("{volume} outside the body are left in the bone, which may be table or head holder; 'osteo prepare "
                  "--remove-table' takes them off."),
               {{"volume", volume_text(*left)}}),
        Tone::caution};
  }
  if (status == "good" && text(f.verdict("source")) == "DICOM")
    return {tr("Good"), tr("Every slice was taken as the scanner stored it; nothing was guessed, moved or left out."),
            Tone::good};
  if (status == "good")
    return {tr("Good"),
            tr("Values and places are as the file has them; what was done to the scan before is not known."),
            Tone::good};
  if (status == "repaired") {
    std::string said = first.empty() ? tr("Slices were resampled onto upright, even ones.") : first;
    if (warnings > 1)
      said += " " +
              filled(tr_n("And {n} more note, below.", "And {n} more notes, below.", static_cast<double>(warnings - 1)),
                     {{"n", std::to_string(warnings - 1)}});
    // A warning alone mends nothing.
    const Json* const resampled = f.verdict("geometry", "resampled");
    const Json* const aside = f.verdict("set_aside");
    const bool moved = resampled != nullptr && resampled->flag() != nullptr && *resampled->flag();
    const bool left_out = aside != nullptr && !aside->items().empty();
    return {first.empty() || moved || left_out ? tr("Repaired") : tr("Look"), said, Tone::caution};
  }
  return {tr("Not known"), tr("This case holds no verdict of its import."), Tone::caution};
}

std::vector<sheet::Paragraph> verdict_notes(const CaseFacts& f) {
  std::vector<sheet::Paragraph> notes;
  const Json* const findings = f.verdict("findings");
  if (findings == nullptr) return notes;
  bool first = true;
  constexpr std::size_t kMax = 8;
  for (const char* const wanted : {"warning", "info"}) {
    for (const Json& e : findings->items()) {
      const std::string severity = text(e.find("severity")), advice = text(e.find("advice"));
      if (severity != wanted || notes.size() >= kMax) continue;
      const bool in_band = severity == "warning" && std::exchange(first, false);
      if (in_band && advice.empty()) continue;
      notes.push_back({(in_band ? std::string() : text(e.find("message")) + (advice.empty() ? "" : " ")) + advice,
                       severity == "warning" ? Tone::caution : Tone::plain});
    }
  }
  return notes;
}

static std::string values_text(const CaseFacts& f) {
  const Json* const air = f.verdict("values", "air_hu");
  const bool known = air != nullptr && air->number();
  return filled(known ? tr("{from} to {to} HU; air at {air}") : tr("{from} to {to} HU"),
                {{"from", number_text(number(f.verdict("values", "hu_min")), 0)},
                 {"to", number_text(number(f.verdict("values", "hu_max")), 0)},
                 {"air", number_text(number(air), 0)}});
}

Rows scan_rows(const CaseFacts& f) {
  Rows rows;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) rows.emplace_back(name, value);
  };
  const bool dicom = text(f.verdict("source")) == "DICOM";
  if (dicom) {
    const std::string modality = text(f.verdict("series", "modality")), kernel = text(f.verdict("series", "kernel")),
                      scanner = text(f.verdict("series", "scanner"));
    add(tr("Scan"), modality + (scanner.empty() ? "" : ", " + scanner) + ", " +
                        (kernel.empty() ? tr("kernel not stated") : filled(tr("kernel {name}"), {{"name", kernel}})));
    const double usual = number(f.verdict("geometry", "gap_usual_mm")),
                 least = number(f.verdict("geometry", "gap_min_mm")),
                 most = number(f.verdict("geometry", "gap_max_mm"));
    const double thickness = number(f.verdict("series", "thickness_mm"));
    add(tr("Slices"),
        filled(thickness > 0 ? tr("{n} of {columns} x {rows}, {mm} mm thick") : tr("{n} of {columns} x {rows}"),
               {{"n", number_text(number(f.verdict("geometry", "slices")), 0)},
                {"columns", number_text(number(f.verdict("geometry", "columns")), 0)},
                {"rows", number_text(number(f.verdict("geometry", "rows")), 0)},
                {"mm", number_text(thickness, 2)}}));
    add(tr("Slice spacing"),
        filled(most - least > 0.02 ? tr("{from} to {to} mm, mostly {usual}") : tr("{usual} mm, even"),
               {{"from", number_text(least, 2)}, {"to", number_text(most, 2)}, {"usual", number_text(usual, 2)}}));
    const Json* const pixel = f.verdict("geometry", "pixel_mm");
    if (pixel != nullptr && pixel->items().size() == 2)
      add(tr("Pixel"), number_text(pixel->items()[0].number().value_or(0), 3) + " x " +
                           number_text(pixel->items()[1].number().value_or(0), 3) + " mm");
    const double tilt = number(f.verdict("geometry", "tilt_deg"));
    if (std::abs(tilt) >= 0.05)
      add(tr("Gantry tilt"), filled(tr("{n} degrees"), {{"n", number_text(std::abs(tilt), 1)}}));
    const Json* const resampled = f.verdict("geometry", "resampled");
    const bool was = resampled != nullptr && resampled->flag() != nullptr && *resampled->flag();
    const double off = number(f.verdict("geometry", "position_error_mm"));
    add(tr("Resampling"), was ? tr("yes, onto upright even slices") : tr_of("resampling", "none"));
    add(tr("Placing"), off < 0.005 ? filled(tr("exact to {mm} mm"), {{"mm", number_text(0.01, 2)}})
                                   : filled(tr("a pixel is at most {mm} mm off"), {{"mm", number_text(off, 2)}}));
  } else {
    add(tr("Scan"), tr("a volume file: of scanner, kernel and slices nothing is known"));
    const Json* const dims = f.verdict("output", "dims");
    if (dims != nullptr && dims->items().size() == 3)
      add(tr("Voxels"), number_text(dims->items()[0].number().value_or(0), 0) + " x " +
                            number_text(dims->items()[1].number().value_or(0), 0) + " x " +
                            number_text(dims->items()[2].number().value_or(0), 0));
  }
  const Json* const made = f.verdict("geometry", "resampled");
  add(made != nullptr && made->flag() != nullptr && *made->flag() ? tr("Voxel, resampled") : tr("Voxel of the scan"),
      edges_text(f.verdict("output", "spacing_mm")));
  if (const std::string axes = text(f.verdict("output", "axes")); !axes.empty()) add(tr("Axes"), axes_text(axes));
  if (const std::string given = f.param("import", "axes"); !given.empty())
    add(tr("Orientation"), filled(tr("given by hand as {axes}: the file does not know it"), {{"axes", given}}));
  if (f.verdict("values") != nullptr) add(tr("Values"), values_text(f));
  if (const std::string offset = f.param("import", "hu_offset"); !offset.empty() && offset != "0")
    add(tr("Offset"), filled(tr("{hu} HU were added by hand"), {{"hu", offset}}));
  return rows;
}

static std::string tr_preset(const std::string& preset) {
  if (preset == "trabecular") return tr_of("bone", "trabecular");
  if (preset == "cortical") return tr_of("bone", "cortical");
  return preset;
}

Rows bone_rows(const CaseFacts& f) {
  Rows rows;
  const std::string region = f.param("crop", "region"), preset = f.param("threshold", "preset");
  if (!region.empty()) {
    std::string name = region;
    std::replace(name.begin(), name.end(), '_', ' ');
    rows.emplace_back(tr("Region"), name == "whole" ? tr("the whole scan")
                                    : name == "box" ? tr("a box, chosen by hand")
                                                    : tr(name));
  }
  if (const auto lower = f.reported("threshold", "lower_hu")) {
    rows.emplace_back(
        tr("Threshold"),
        filled(preset.empty() || preset == "fixed" ? tr("{hu} HU, given") : tr("{hu} HU, found for {preset} bone"),
               {{"hu", number_text(*lower, 0)}, {"preset", tr_preset(preset)}}));
    if (const auto change = f.reported("threshold", "change_percent_per_50_hu"))
      rows.emplace_back("", filled(tr("50 HU more or less change the volume by {share} %"),
                                   {{"share", number_text(*change, *change < 9.95 ? 1 : 0)}}));
    if (const auto sure = f.reported("threshold", "confidence"); sure && *sure < 0.7)
      rows.emplace_back(
          "", *sure < 0.4 ? tr("Poor: bone and tissue are hard to tell apart") : tr("Fair: look at the outline"));
  }
  if (const auto volume = f.reported("resample", "volume_after_mm3")) {
    rows.emplace_back(tr("Bone"), volume_text(*volume));
    const Json* const dims = f.verdict("output", "dims");
    const Json* const spacing = f.verdict("output", "spacing_mm");
    // Of a whole scan only: what a slice of a head holds on average (libs/imaging/image, bone_threshold: up to 45 cm2;
    // a pelvis 60).
    if (region == "whole" && dims != nullptr && spacing != nullptr && dims->items().size() == 3 &&
        spacing->items().size() == 3) {
      const double height = dims->items()[2].number().value_or(0) * spacing->items()[2].number().value_or(0);
      const double cm2 = height > 0 ? *volume / height / 100 : 0;
      rows.emplace_back(
          "", filled(cm2 > 45 ? tr("{cm2} cm2 in a slice on average; a head has up to 45: LOOK AT THE OUTLINE")
                              : tr("{cm2} cm2 in a slice on average; a head has up to 45"),
                     {{"cm2", number_text(cm2, 1)}}));
    } else {
      rows.emplace_back("", tr("no usual range known for this region"));
    }
    if (const auto change = f.reported("resample", "volume_change_percent"))
      rows.emplace_back(tr("Against the mask"), std::abs(*change) < 0.05 ? filled(tr("less than {share} % apart"),
                                                                                  {{"share", number_text(0.1, 1)}})
                                                                         : number_text(*change, 1) + " %");
  }
  if (const Json* const spacing = at(f.manifest().find("frame"), "spacing_mm"))
    rows.emplace_back(tr("Voxel of the case"), edges_text(spacing));
  return rows;
}

Rows removed_rows(const CaseFacts& f) {
  Rows rows;
  const std::string table = f.reported_text("threshold", "table");
  if (!table.empty()) {
    rows.emplace_back(tr("Table, holder"), tr(table));
  } else if (const auto outside = f.reported("threshold", "outside_body_mm3")) {
    rows.emplace_back(tr("Table, holder"), *outside > 0
                                               ? filled(tr("{volume} taken off"), {{"volume", volume_text(*outside)}})
                                               : std::string(tr("none found")));
  } else {
    rows.emplace_back(tr("Table, holder"), tr("not looked for"));
  }
  const auto found = f.reported("threshold", "pieces_found"), kept = f.reported("threshold", "pieces_kept");
  if (found && kept) {
    const double dropped = *found - *kept;
    const auto mm3 = f.reported("threshold", "small_pieces_mm3");
    std::string said = filled(
        dropped <= 0 ? tr("none dropped")
        : mm3        ? tr("{n} of {all} dropped, {volume} together")
                     : tr("{n} of {all} dropped"),
        {{"n", number_text(dropped, 0)}, {"all", number_text(*found, 0)}, {"volume", volume_text(mm3.value_or(0))}});
    const std::string least = f.param("threshold", "min_volume_mm3"), largest = f.param("threshold", "keep_largest");
    if (!least.empty()) said += "; " + filled(tr("each below {mm3} mm³"), {{"mm3", least}});
    if (!largest.empty() && largest != "0") said += ", " + filled(tr("or not among the {n} largest"), {{"n", largest}});
    rows.emplace_back(tr("Small components"), said);
  }
  if (const Json* const metal = f.verdict("values", "metal_mm3")) {
    const double mm3 = number(metal);
    std::string said =
        mm3 > 0 ? filled(tr("{volume} of very bright voxels (fillings, implants)"), {{"volume", volume_text(mm3)}})
                : std::string(tr_of("metal", "none"));
    if (const auto streaks = f.reported("threshold", "streaks_mm3")) {
      said += "; " + filled(tr("{volume} of streaks cleared near it"), {{"volume", volume_text(*streaks)}});
    } else if (mm3 > 0) {
      said += std::string("; ") + tr("streaks near it are kept");
    }
    rows.emplace_back(tr("Metal"), said);
    if (number(f.verdict("values", "saturated_mm3")) > 0)
      rows.emplace_back("", filled(tr("{volume} lie at the scanner's highest value"),
                                   {{"volume", volume_text(number(f.verdict("values", "saturated_mm3")))}}));
  }
  return rows;
}

sheet::Table resolution_table(const CaseFacts& f) {
  sheet::Table t;
  t.head = {tr("small structure"), tr("size"), tr("voxels across"), tr("so in this scan")};
  t.widths = {30, 12, 18, 40};
  const Json* const spacing = f.verdict("output", "spacing_mm");
  if (spacing == nullptr || spacing->items().size() != 3) return t;
  double finest = 1e30, coarsest = 0;
  for (const Json& v : spacing->items()) {
    finest = std::min(finest, v.number().value_or(1));
    coarsest = std::max(coarsest, v.number().value_or(1));
  }
  // What the scanner took, not what was interpolated between: the widest distance of slices, or their thickness where
  // that is more.
  if (text(f.verdict("source")) == "DICOM")
    coarsest =
        std::max({coarsest, number(f.verdict("geometry", "gap_max_mm")), number(f.verdict("series", "thickness_mm"))});
  // Slices further apart than a structure is wide hide it where it runs within them, however fine their pixels.
  constexpr std::pair<const char*, double> kSmall[] = {{tr_later("mandibular canal"), 2.5},
                                                       {tr_later("facial canal"), 1.3},
                                                       {tr_later("tegmen, sinus plate"), 1.0},
                                                       {tr_later("wall of an air cell, chorda"), 0.5}};
  for (const auto& [name, mm] : kSmall) {
    const double least = mm / coarsest, most = mm / finest;
    const bool shown = least >= 2, partly = least >= 1;
    const std::string across =
        most - least < 0.15
            ? number_text(least, 1)
            : filled(tr("{from} to {to}"), {{"from", number_text(least, 1)}, {"to", number_text(most, 1)}});
    t.rows.push_back({{tr(name), Tone::plain},
                      {number_text(mm, 1) + " mm", Tone::plain},
                      {across, Tone::plain},
                      {shown    ? tr("shown; its walls to about half a voxel")
                       : partly ? tr("seen, but its walls may have holes or be too thick")
                                : tr("not to be relied on: it may be missing"),
                       shown    ? Tone::good
                       : partly ? Tone::caution
                                : Tone::bad}});
  }
  return t;
}

}  // namespace osteo::inline assessment::case_report
