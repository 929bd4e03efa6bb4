#include "segment.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/points_io.h"
#include "osteo/imaging/image/structures.h"

namespace osteo::inline app {
namespace {

/// To so many decimals; as text it has no more.
double rounded(double x, double decimals) {
  return std::round(x * decimals) / decimals;
}

std::vector<Vec3> parse_points(const std::string& text) {
  std::vector<Vec3> points;
  std::stringstream all(text);
  std::string item;
  while (std::getline(all, item, ';')) {
    if (trimmed(item).empty()) continue;
    std::stringstream words(item);
    std::string word;
    std::vector<double> v;
    while (std::getline(words, word, ',')) v.push_back(parse_number(trimmed(word), "--points-mm"));
    if (v.size() != 3)
      throw Error(ExitCode::usage, "--points-mm: '" + item + "' is not x,y,z", "like --points-mm '41,7,-16; 43,8,-22'");
    points.push_back({v[0], v[1], v[2]});
  }
  return points;
}

Labels with_colours(const Labels& labels) {
  return name_structures(labels, {}, nullptr, Context());
}

}  // namespace

StageInfo TubeStage::info() {
  return {
      .name = "tube",
      .version = 2,
      .synopsis = "a nerve or vessel from a few points on it: centre line, radius, mask",
      .description =
          "Finds the cheapest way between the points through what looks like a tube, moves it to the middle of the "
          "walls across it, "
          "measures its radius, and draws it into a label map. Each place has a confidence: the chance that it "
          "lies in the tube. Says where that is below one half; where no walls are seen the line is a smooth curve "
          "through "
          "the points. Points that no tube joins are rejected. docs/validation/structures.md has how far off it is.",
      .inputs =
          {{"image", {DataKind::image}, "CT in HU"},
           {"points",
            {DataKind::source},
            "text file, a point x, y, z (LPS mm) a line, or .mrk.json or .fcsv of 3D Slicer; in place of --points-mm",
            true},
           {"labels", {DataKind::labels}, "label map of this CT to which it is added", true}},
      .outputs = {{"structures", {DataKind::labels}, "label map with the tube"},
                  {"line",
                   {DataKind::document},
                   "centre line as text (.csv): x, y, z, radius, way and confidence of each point",
                   true}},
      .references = {"Y. Sato et al., Three-dimensional multi-scale line filter, Med. Image Anal. 1998",
                     "S. Prevrhal et al., Accuracy limits for the determination of cortical width and density, Phys. "
                     "Med. Biol. 1999"},
      .example = "osteo tube ct.nrrd nerve.seg.nrrd --points-mm '36,-2,-12; 42,7,-18; 46,8,-38' --line-out nerve.csv"};
}

namespace {

// Walls are met on a wrong way as well: among air cells each has its own. What tells is that it is long.
void warn_of_detours(const Tube& tube, std::span<const Vec3> points, const Context& context) {
  constexpr double kLong = 1.35, kExtraMm = 2.5;
  std::size_t from = 0;
  for (std::size_t leg = 1; leg < points.size() && from < tube.stations.size(); ++leg) {
    std::size_t to = from;
    for (std::size_t s = from; s < tube.stations.size(); ++s) {
      if (length(tube.stations[s].at_mm - points[leg]) < length(tube.stations[to].at_mm - points[leg])) to = s;
    }
    const double way = tube.stations[to].arc_mm - tube.stations[from].arc_mm,
                 straight = length(points[leg] - points[leg - 1]);
    if (way > kLong * straight && way > straight + kExtraMm) {
      context.warn(
          "from point " + std::to_string(leg) + " to " + std::to_string(leg + 1) + " the way is " +
          format_number(rounded(way, 10)) + " mm for " + format_number(rounded(straight, 10)) +
          " mm of straight line: it may be a detour; look at it, and give a point before and behind each bend");
    }
    from = to;
  }
}

}  // namespace

std::vector<Data> TubeStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const auto& ct = std::get<Image>(inputs[0]);
  const auto* const file = std::get_if<Source>(&inputs[1]);
  const auto* const onto = std::get_if<Labels>(&inputs[2]);
  if (p.name.empty()) throw Error(ExitCode::usage, "--name is empty");
  if ((file != nullptr) == !p.points_mm.empty())
    throw Error(ExitCode::usage, "give the tube's points by --points-mm or by --points FILE, not both");
  const std::vector<Vec3> points = file != nullptr ? load_points(file->path) : parse_points(p.points_mm);
  // A tube of this name is not wider than any such structure is.
  TubeParams params = p.tube;
  const auto limits = structure_limits(p.name);
  if (limits && limits->radius_mm > 0 && params.max_radius_mm > limits->radius_mm) {
    params.max_radius_mm = limits->radius_mm;
    context.report("max_radius_mm", params.max_radius_mm);
  }
  const Tube tube = trace_tube(ct, points, params, context);
  context.report("length_mm", rounded(tube.length_mm, 10));
  context.report("radius_mean_mm", rounded(tube.radius_mean_mm, 100));
  context.report("radius_min_mm", rounded(tube.radius_min_mm, 100));
  context.report("radius_max_mm", rounded(tube.radius_max_mm, 100));
  context.report("confidence", rounded(tube.confidence, 100));
  std::string unsure;
  for (const auto& u : tube.unsure_mm) {
    unsure +=
        (unsure.empty() ? "" : ", ") + format_number(rounded(u[0], 10)) + " to " + format_number(rounded(u[1], 10));
  }
  if (!unsure.empty()) {
    context.report("unsure_mm", unsure);
    context.warn("not sure of the " + p.name + " from " + unsure +
                 " mm: walls are not seen there, or are as likely those of something else");
  }
  warn_of_detours(tube, points, context);
  std::string csv = "x_mm,y_mm,z_mm,radius_mm,along_mm,confidence\n";
  for (const TubeStation& s : tube.stations) {
    for (const double v : {s.at_mm.x, s.at_mm.y, s.at_mm.z, s.radius_mm, s.arc_mm})
      csv += format_number(rounded(v, 1000)) + ",";
    csv += format_number(rounded(s.confidence, 100)) + "\n";
  }
  Labels drawn = draw_tube(tube, ct.frame, p.name, onto);
  double volume = 0;
  for (Structure& s : drawn.structures) {
    if (s.name != p.name) continue;
    s.origin = origin_of(TubeStage::info());
    for (const std::uint8_t v : drawn.span()) volume += v == s.value ? ct.frame.voxel_volume_mm3() : 0;
  }
  if (const std::string why = implausible_volume(p.name, volume); !why.empty()) context.warn(why);
  return {with_colours(drawn), Document{csv}};
}

StageInfo FindStructuresStage::info() {
  return {.name = "find-structures",
          .version = 3,
          .synopsis = "ear canal, air cells, sigmoid sinus, tegmen, dura, labyrinth found in a CT",
          .description =
              "Looks for structures of one ear by what bone, air and soft tissue bound: the external canal from the "
              "air outside, the air "
              "behind "
              "the drum, the round vessel in the groove of the sigmoid sinus, the plate of bone under the middle "
              "fossa, 2 mm of brain's "
              "side on "
              "the skull's inner surface, and, from a point in it, the fluid of the labyrinth. Each has a quality from "
              "0 to 1 or a reason "
              "why it "
              "was not found. A proposal to be looked at: docs/validation/structures.md says how far off it is and "
              "what it does "
              "not know.",
          .inputs = {{"image", {DataKind::image}, "CT in HU, of a head or around an ear"}},
          .outputs = {{"structures", {DataKind::labels}, "label map with names and colours of what was found"},
                      {"findings", {DataKind::document}, "what was found, how well, or why not, in JSON", true}},
          .references = {},
          .example = "osteo find-structures ct.nrrd ear.seg.nrrd --side left --what sigmoid_sinus,tegmen"};
}

namespace {

std::string name_of(EarStructure what) {
  return std::string(EnumNames<EarStructure>::values[static_cast<std::size_t>(what)]);
}

/// What was not found by its reason, each of which is said once: all that is placed by the canal has the canal's.
struct Missing {
  std::vector<std::string> names;
  std::string why;
};
std::vector<Missing> missing_by_reason(const std::vector<EarFinding>& findings) {
  const bool canal_has_it = std::any_of(findings.begin(), findings.end(), [](const EarFinding& f) {
    return f.what == EarStructure::ear_canal && !f.found;
  });
  std::vector<Missing> all;
  for (const EarFinding& f : findings) {
    if (f.found) continue;
    const std::string why = f.by_canal && canal_has_it ? "not placed without the ear canal" : f.why;
    const auto same = std::find_if(all.begin(), all.end(), [&](const Missing& m) { return m.why == why; });
    if (same == all.end()) {
      all.push_back({{name_of(f.what)}, why});
    } else {
      same->names.push_back(name_of(f.what));
    }
  }
  return all;
}

}  // namespace

std::vector<Data> FindStructuresStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  EarParams p = params.ear;
  // As the flag says: the scanner's zero is no point that anybody gives.
  if (params.labyrinth_mm != std::array<double, 3>{}) p.labyrinth_mm = params.labyrinth_mm;
  const EarFindings found = find_ear_structures(std::get<Image>(inputs[0]), p, context);
  Json j;
  j["side"] = EnumNames<Side>::values[static_cast<std::size_t>(p.side)];
  j["structures"] = Json::list();
  for (const EarFinding& f : found.findings) {
    const std::string name = name_of(f.what);
    j["structures"].push_back({{"name", name},
                               {"found", f.found},
                               {"quality", rounded(f.quality, 100)},
                               {"why", f.why},
                               {"volume_mm3", rounded(f.volume_mm3, 10)}});
    if (!f.found) continue;
    context.report(name + "_quality", rounded(f.quality, 100));
    context.report(name + "_mm3", rounded(f.volume_mm3, 10));
    if (!f.why.empty()) context.warn(name + ": " + f.why);
  }
  std::string missing;
  for (const Missing& m : missing_by_reason(found.findings)) {
    std::string names;
    for (const std::string& name : m.names) {
      context.report(name, names.empty() ? "not found: " + m.why : "not found, as " + m.names.front());
      names += (names.empty() ? "" : ", ") + name;
    }
    // Where nothing is found the error says it.
    if (!found.labels.structures.empty()) context.warn(names + " not found: " + m.why);
    missing += (missing.empty() ? "" : "; ") + names + ": " + m.why;
  }
  Document document{j.dump(1) + "\n"};
  if (found.labels.structures.empty()) {
    throw ErrorWithDocument(
        Error(ExitCode::failed,
              "nothing was found on the " + std::string(EnumNames<Side>::values[static_cast<std::size_t>(p.side)]) +
                  ": " + missing,
              "is it the right side, and is the ear within the image with air outside of it?"),
        "findings", document);
  }
  Labels labels = found.labels;
  for (Structure& s : labels.structures) s.origin = origin_of(FindStructuresStage::info());
  return {std::move(labels), document};
}

}  // namespace osteo::inline app
