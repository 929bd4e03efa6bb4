#include "osteo/assessment/case_report/case_report.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "measures.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "osteo/core/report/sheet.h"
#include "osteo/display/view/pictures.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/approval.h"
#include "osteo/session/scene/case.h"
#include "osteo/simulation/bone/live_surface.h"
#include "pictures.h"
#include "texts.h"

namespace osteo::inline assessment {
namespace {

using namespace case_report;

// Raise it when pictures are drawn otherwise: those of an earlier report are then drawn again.
constexpr int kPicturesVersion = 3;

// Same state, same pictures.
std::string state_of(const fs::path& folder) {
  return hash_text(std::to_string(kPicturesVersion) + case_hash(folder));
}

// What 'osteo outcome' wrote into the case; empty where it did not.
std::string outcome_of(const fs::path& folder) {
  const fs::path file = folder / "outcome.json";
  return output_exists(file) ? read_text(file) : std::string();
}
std::string outcome_mark(const fs::path& folder) {
  const std::string json = outcome_of(folder);
  return json.empty() ? json : hash_text(json).substr(0, 16);
}

std::string earlier_html(const fs::path& folder) {
  const fs::path html = report_file(folder, ".html");
  std::error_code ec;
  return fs::is_regular_file(html, ec) ? read_text(html) : std::string();
}

// Outward, of the triangles around, where the file has none.
void complete_normals(TriMesh& mesh) {
  if (mesh.normals.size() == mesh.points_mm.size()) return;
  std::vector<Vec3> sum(mesh.points_mm.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = from_floats(mesh.points_mm[t[0]]);
    const Vec3 n = cross(from_floats(mesh.points_mm[t[1]]) - a, from_floats(mesh.points_mm[t[2]]) - a);
    for (const auto p : t) sum[p] += n;
  }
  mesh.normals.clear();
  for (const Vec3& n : sum) mesh.normals.push_back(to_floats(normalized(n)));
}

// Everything that is known of a case, read once.
struct Content {
  CaseFacts facts;
  Case the_case;
  std::shared_ptr<const BrickGrid> bone;
  std::shared_ptr<const TriMesh> surface;
  std::optional<SparseGrid> hu;
  std::optional<Labels> structures;
  Subject subject;
  Pictures pictures;
  std::vector<double> histogram;
  double thin_percent = -1;  // of the surface, with less than a millimetre of bone below; -1: not measured

  explicit Content(const fs::path& folder)
      : facts(folder), the_case(load_case(folder)), bone(std::make_shared<BrickGrid>(to_bricks(the_case.bone))) {
    const auto file = [&](const char* role) {
      const auto it = the_case.files.find(role);
      return it == the_case.files.end() ? fs::path() : it->second;
    };
    if (const fs::path path = file("structures"); !path.empty()) structures = load_labels(path);
    subject.bone = bone.get();
    if (structures) subject.structures = &*structures;
    std::tie(subject.lo_mm, subject.hi_mm) = bounds_of_bone(*bone);
    if (const auto lower = facts.reported("threshold", "lower_hu")) subject.lower_hu = *lower;
    if (const std::string upper = facts.param("threshold", "upper"); !upper.empty())
      subject.upper_hu = std::atof(upper.c_str());
  }

  void draw(const std::optional<CaseScan>& scan, const Context& context) {
    PictureMesh drawn;
    if (const auto it = the_case.files.find("surface"); it != the_case.files.end()) {
      auto mesh = std::make_shared<TriMesh>(*load_surface(it->second));
      complete_normals(*mesh);
      surface = mesh;
      drawn = mesh_for_pictures(*mesh);
      shade_mesh(drawn.mesh, *bone, context);  // measures go by the triangles' own normals
      subject.surface = std::make_shared<const TriMesh>(std::move(drawn.mesh));
    }
    if (const auto it = the_case.files.find("hu"); it != the_case.files.end()) hu = load_grid(it->second);
    if (hu) subject.hu = &*hu;
    if (scan) subject.scan = &*scan;
    context.progress(0.2, "report: cuts");
    draw_cuts(subject, pictures, context);
    draw_slices(subject, pictures);
    draw_removed(subject, pictures);
    if (scan) histogram = histogram_of(scan->ct);
    std::vector<float> below;
    if (surface && !surface->points_mm.empty()) {
      context.progress(0.5, "report: thin bone");
      const std::vector<float> all = thickness_below(*surface, *bone, kPaleMm, context);
      thin_percent = 100.0 * static_cast<double>(std::count_if(all.begin(), all.end(), [](float t) { return t < 1; })) /
                     static_cast<double>(all.size());
      thin_percent =
          std::round(100 * thin_percent) / 100;  // as the report keeps it: it says the same when it is read back
      for (const std::uint32_t p : drawn.point) below.push_back(all[p]);
    }
    context.progress(0.7, "report: bone");
    draw_bone(subject, below, pictures);
    draw_structures(subject, pictures, context);
  }
};

void add_row(Sheet& s, const Pictures& pictures, double height_mm,
             const std::vector<std::pair<std::string, std::string>>& wanted) {
  sheet::Pictures row{{}, height_mm};
  for (const auto& [id, caption] : wanted) {
    if (const auto it = pictures.find(id); it != pictures.end()) row.row.push_back({id, it->second, caption});
  }
  if (!row.row.empty()) s.blocks.push_back({row});
}

void add_cuts(Sheet& s, const Content& c) {
  const bool scan = c.pictures.contains("soft-axial");
  const Vec3 p = cut_point(c.subject);
  s.blocks.push_back({sheet::Heading{c.subject.measures.empty()
                                         ? std::string(tr("Cuts through the middle of the bone"))
                                         : filled(tr("Cuts through the {structure}"),
                                                  {{"structure", tr(c.subject.measures.front().structure.name)}})}});
  if (scan)
    add_row(s, c.pictures, 62,
            {{"soft-axial", tr("soft tissue (-160 to 240 HU); axial, seen from the feet")},
             {"soft-coronal", tr("coronal, seen from the front")},
             {"soft-sagittal", tr("sagittal, front to the left")}});
  add_row(s, c.pictures, 62,
          {{"bone-axial", filled(scan ? tr("bone (-500 to 1500 HU); z {mm} mm")
                                      : tr("bone only: the scan was not at hand; z {mm} mm"),
                                 {{"mm", number_text(p.z, 0)}})},
           {"bone-coronal", "y " + number_text(p.y, 0) + " mm"},
           {"bone-sagittal", "x " + number_text(p.x, 0) + " mm"}});
  s.blocks.push_back({sheet::Paragraph{
      c.structures
          ? tr("Orange: where the bone of the case ends. Other colours: structures. L and R are the patient's. "
               "x, y, z grow to the patient's left, back and head.")
          : tr("Orange: where the bone of the case ends. L and R are the patient's. x, y, z grow to the "
               "patient's left, back and head."),
      Tone::quiet}});
}

void add_slices_and_sides(Sheet& s, const Content& c) {
  std::vector<std::pair<std::string, std::string>> slices;
  for (int n = 1; n <= 8; ++n)
    slices.emplace_back("slice-" + std::to_string(n), n == 1 ? tr("lowest") : n == 8 ? tr("highest") : "");
  s.blocks.push_back({sheet::Heading{tr("Eight slices, from the feet up")}});
  add_row(s, c.pictures, 27, slices);
  s.blocks.push_back({sheet::Heading{tr("The bone from six sides")}});
  add_row(s, c.pictures, 32,
          {{"side-front", tr_of("seen from", "front")},
           {"side-back", tr_of("seen from", "back")},
           {"side-left", tr("patient's left")},
           {"side-right", tr("patient's right")},
           {"side-above", tr_of("seen from", "above")},
           {"side-below", tr_of("seen from", "below")}});
}

// Where the threshold lies, beside what was taken off.
void add_threshold_and_removed(Sheet& s, const Content& c) {
  const CaseFacts& f = c.facts;
  const bool scan = c.pictures.contains("soft-axial");
  SheetBlocks left{{sheet::Heading{tr("Values of the scan, and the threshold")}}},
      right{{sheet::Heading{tr("Taken off, and left on")}}};
  if (!c.histogram.empty()) {
    sheet::Bars bars{
        "histogram", kHistogramFrom, kHistogramTo, 500, c.histogram, {}, tr("HU; voxels on a logarithmic scale"), 30};
    if (const auto v = f.reported("threshold", "soft_tissue_hu"))
      bars.marks.push_back({*v, filled(tr("soft tissue {hu}"), {{"hu", number_text(*v, 0)}}), Tone::quiet});
    if (const auto v = f.reported("threshold", "lower_hu"))
      bars.marks.push_back({*v, filled(tr("threshold {hu} HU"), {{"hu", number_text(*v, 0)}}), Tone::bad});
    if (const auto v = f.reported("threshold", "dense_bone_hu"))
      bars.marks.push_back({*v, filled(tr("dense bone {hu}"), {{"hu", number_text(*v, 0)}}), Tone::quiet});
    left.push_back({bars});
  } else {
    left.push_back({sheet::Paragraph{tr("The histogram needs the scan, which was not at hand."), Tone::quiet}});
  }
  right.push_back({sheet::Facts{removed_rows(f), 1}});
  sheet::Pictures removed{{}, 36};
  for (const char* const id : {"removed-axial", "removed-front", "removed-side"}) {
    if (const auto it = c.pictures.find(id); it != c.pictures.end())
      removed.row.push_back({id, it->second,
                             std::string(id) == "removed-axial"   ? tr("from the feet")
                             : std::string(id) == "removed-front" ? tr("from the front")
                                                                  : tr("from the left")});
  }
  if (!removed.row.empty()) {
    right.push_back({removed});
    right.push_back({sheet::Paragraph{
        tr("Red: above the threshold, but not in the case. Grey: the bone of the case, seen through."), Tone::quiet}});
  } else {
    right.push_back({sheet::Paragraph{
        scan ? tr("Nothing above the threshold was taken off.") : tr("Pictures of it need the scan."), Tone::quiet}});
  }
  s.blocks.push_back({sheet::Columns{{left, right}, {}}});
}

void add_thin_bone_and_resolution(Sheet& s, const Content& c) {
  SheetBlocks thin{{sheet::Heading{tr("Thin bone")}}}, small{{sheet::Heading{tr("What the scan can resolve")}}};
  sheet::Pictures thin_row{{}, 46};
  for (const auto& [id, caption] :
       {std::pair{"thin-left-front", tr("from the left front")}, std::pair{"thin-below", tr("from below")}}) {
    if (const auto it = c.pictures.find(id); it != c.pictures.end()) thin_row.row.push_back({id, it->second, caption});
  }
  if (!thin_row.row.empty()) thin.push_back({thin_row});
  if (c.thin_percent >= 0)
    thin.push_back({sheet::Paragraph{
        filled(tr("Red: less than 1 mm of bone beneath the surface ({share} % of it); yellow 1 mm; pale 2 mm and more. "
                  "Bone thinner than a voxel of the scan is too thin or missing here."),
               {{"share", number_text(c.thin_percent, c.thin_percent < 9.95 ? 1 : 0)}})}});
  small.push_back({resolution_table(c.facts)});
  small.push_back({sheet::Paragraph{tr("Sizes are of adults, from textbooks. Two voxels across are the least by which "
                                       "a structure is seen everywhere."),
                                    Tone::quiet}});
  for (const auto& note : verdict_notes(c.facts)) small.push_back({note});
  s.blocks.push_back({sheet::Columns{{thin, small}, {}}});
}

void add_structures(Sheet& s, const Content& c) {
  s.blocks.push_back({sheet::Heading{tr("Structures")}});
  if (c.subject.measures.empty()) {
    s.blocks.push_back(
        {sheet::Paragraph{tr("None were given: nerves and vessels are not marked in this case."), Tone::caution}});
  } else if (const auto it = c.pictures.find("structures"); it != c.pictures.end()) {
    s.blocks.push_back({sheet::Columns{
        {{{structure_table(c.subject.measures)}, {sheet::Paragraph{sources_of(c.subject.measures), Tone::quiet}}},
         {{sheet::Pictures{{{"structures", it->second, tr("structures in clear bone")}}, 48}}}},
        {76, 24}}});
  } else {
    s.blocks.push_back({structure_table(c.subject.measures)});
    s.blocks.push_back({sheet::Paragraph{sources_of(c.subject.measures), Tone::quiet}});
  }
}

void add_how_made(Sheet& s, const fs::path& folder, const Content& c, const std::string& asked_for,
                  const std::vector<std::string>& left_out) {
  s.blocks.push_back({sheet::Heading{tr("How it was made")}});
  const auto manifest_text = [&](const char* key) {
    const Json* const v = c.facts.manifest().find(key);
    return v == nullptr || v->text() == nullptr ? std::string(tr("not known")) : *v->text();
  };
  s.blocks.push_back(
      {sheet::Facts{{{tr("Asked for"), asked_for.substr(std::min(asked_for.size(), asked_for.find_first_not_of(' ')))},
                     {tr("Pipeline"), manifest_text("pipeline")},
                     {tr("Made by"), "Osteotome " + manifest_text("program")},
                     {tr("Bone"), c.bone->hash().substr(0, 16)},
                     {tr("Content of the case"), case_hash(folder).substr(0, 16)},
                     {tr("Left out"), left_out.empty() ? std::string(tr("nothing")) : tr(left_out.front())}},
                    2}});
}

sheet::Signature signature_of(const fs::path& folder) {
  const ApprovalNow now = approval_of(folder);
  sheet::Signature line;
  line.state = now.words();
  line.tone = now.state == ApprovalState::valid      ? Tone::good
              : now.state == ApprovalState::outdated ? Tone::bad
                                                     : Tone::plain;
  if (now.approval) {
    line.by = now.approval->by;
    line.date = shown_date(now.approval->date);
    line.note = now.approval->note;
    line.state =
        now.state == ApprovalState::valid
            ? tr("Approved")
            : filled(tr("Approved before the last change ({changed}): no longer valid"), {{"changed", now.changed}});
  } else {
    line.state = tr("Not approved: sign here, or osteo approve CASE --by NAME --note TEXT");
  }
  return line;
}

Sheet sheet_of(const fs::path& folder, const Content& c, const std::string& asked_for,
               const std::vector<std::string>& left_out) {
  const CaseFacts& f = c.facts;
  Sheet s;
  s.title = tr("Case report");
  s.code = case_code(folder);
  s.footer =
      filled(tr("Osteotome {version}. Not a medical device. The cuts are pictures of the patient: keep this page as "
                "you keep the scan."),
             {{"version", std::string(program_version())}});
  s.blocks.push_back({verdict_band(f)});

  Rows rows = scan_rows(f);
  const Rows bone = bone_rows(f);
  rows.insert(rows.end(), bone.begin(), bone.end());
  s.blocks.push_back({sheet::Facts{rows, 2}});

  add_cuts(s, c);
  add_slices_and_sides(s, c);

  s.blocks.push_back({sheet::PageBreak{}});
  add_threshold_and_removed(s, c);
  add_thin_bone_and_resolution(s, c);
  add_structures(s, c);
  if (const std::string outcome = outcome_of(folder); !outcome.empty())
    for (SheetBlock& block : outcome_blocks(outcome)) s.blocks.push_back(std::move(block));
  add_how_made(s, folder, c, asked_for, left_out);
  s.blocks.push_back({signature_of(folder)});
  return s;
}

bool write_if_other(const fs::path& path, const std::string& text) {
  std::error_code ec;
  if (fs::is_regular_file(path, ec) && read_text(path) == text) return false;
  write_file(path, text);
  return true;
}

}  // namespace

std::string case_code(const fs::path& folder) {
  const CaseFacts facts(folder);
  std::string hash;
  if (const Json* const recipe = facts.manifest().find("recipe")) {
    if (const Json* const source = recipe->find("source_hash"); source != nullptr && source->text() != nullptr)
      hash = *source->text();
  }
  if (hash.empty()) {
    const Json* const files = facts.manifest().find("files");
    const Json* const bone = files == nullptr ? nullptr : files->find("bone");
    const Json* const of_bone = bone == nullptr ? nullptr : bone->find("hash");
    if (of_bone != nullptr && of_bone->text() != nullptr) hash = *of_bone->text();
  }
  // Hashed once more: the code must not be a part of a hash that a file of the case shows.
  const auto bits = static_cast<std::uint32_t>(std::stoul(hash_text("case code " + hash).substr(0, 8), nullptr, 16));
  constexpr std::string_view kConsonants = "bdfghjklmnprstvz", kVowels = "aiou";
  std::string code;
  for (const int shift : {16, 0}) {
    const std::uint32_t word = bits >> shift & 0xffffU;
    if (!code.empty()) code += '-';
    code += kConsonants[word >> 12 & 15];
    code += kVowels[word >> 10 & 3];
    code += kConsonants[word >> 6 & 15];
    code += kVowels[word >> 4 & 3];
    code += kConsonants[word & 15];
  }
  return code;
}

std::vector<std::pair<std::string, std::string>> case_facts(const fs::path& folder) {
  const CaseFacts f(folder);
  const sheet::Band verdict = verdict_band(f);
  Rows rows{{"Case", case_code(folder)},
            {"Approval", approval_of(folder).words()},
            {"Verdict", verdict.word + ": " + verdict.text}};
  for (const Rows& more : {scan_rows(f), bone_rows(f), removed_rows(f)})
    rows.insert(rows.end(), more.begin(), more.end());
  if (const Json* const files = f.manifest().find("files")) {
    std::string roles;
    for (const auto& [role, file] : files->members()) roles += (roles.empty() ? "" : ", ") + role;
    rows.emplace_back("Holds", roles);
  }
  const fs::path html = report_file(folder, ".html");
  rows.emplace_back("Report", !output_exists(html)
                                  ? "none: osteo report " + folder.string()
                                  : html.string() + (report_shows(folder) ? "" : " (of an earlier state)"));
  return rows;
}

bool report_shows(const fs::path& folder) {
  const std::string html = earlier_html(folder);
  return !html.empty() && mark_of_html(html, "state") == state_of(folder) &&
         mark_of_html(html, "outcome") == outcome_mark(folder);
}

bool has_full_report(const fs::path& folder) {
  const std::string html = earlier_html(folder);
  return !html.empty() && output_exists(report_file(folder, ".pdf")) &&
         mark_of_html(html, "state") == state_of(folder) && mark_of_html(html, "left-out").empty();
}

CaseReport write_case_report(const fs::path& folder, const std::string& asked_for, const std::optional<CaseScan>& scan,
                             const Context& context) {
  CaseReport report{report_file(folder, ".html"), report_file(folder, ".pdf"), false, {}, {}};
  context.progress(0, "report");
  const std::string earlier_language = mark_of_html(earlier_html(folder), "language");
  const bool same_language = language_named(earlier_language.empty() ? "en" : earlier_language) == language();
  if (approval_of(folder).state == ApprovalState::valid && has_full_report(folder) && report_shows(folder) &&
      same_language && earlier_html(folder).find("class=\"signature good\"") != std::string::npos) {
    report.unchanged = true;
    return report;
  }
  Content c(folder);
  if (c.structures) c.subject.measures = measure_structures(*c.structures, context);
  const std::string state = state_of(folder), earlier = earlier_html(folder);
  const bool of_this_state = !earlier.empty() && mark_of_html(earlier, "state") == state;
  if (of_this_state && (!scan || mark_of_html(earlier, "left-out").empty())) {
    c.pictures = pictures_of_html(earlier);
    const auto bars = bars_of_html(earlier);
    if (const auto it = bars.find("histogram"); it != bars.end()) c.histogram = it->second;
    if (const std::string thin = mark_of_html(earlier, "thin-percent"); !thin.empty())
      c.thin_percent = std::atof(thin.c_str());
  } else {
    c.draw(scan, context);
  }
  if (!c.pictures.contains("soft-axial"))
    report.left_out.emplace_back(
        tr_later("soft tissue, histogram and what was taken off: these need the scan (osteo report CASE --scan SCAN)"));
  if (!c.pictures.contains("side-front"))
    report.left_out.emplace_back(tr_later("the bone in 3D: the case holds no surface"));
  Sheet s = sheet_of(folder, c, asked_for, report.left_out);
  s.marks["state"] = state;
  if (language() != Language::english)
    s.marks["language"] = enum_names(Language{})[static_cast<std::size_t>(language())];
  if (const std::string mark = outcome_mark(folder); !mark.empty()) s.marks["outcome"] = mark;
  s.marks["left-out"] = report.left_out.empty() ? "" : "scan";
  if (c.thin_percent >= 0) s.marks["thin-percent"] = format_number(std::round(100 * c.thin_percent) / 100);
  context.progress(0.9, "report: pages");
  const std::string html = sheet_html(s);
  report.says_other = !earlier.empty() && html_without_signature(earlier) != html_without_signature(html);
  const bool wrote_html = write_if_other(report.html, html);
  report.unchanged = !write_if_other(report.pdf, sheet_pdf(s)) && !wrote_html;
  context.progress(1.0);
  return report;
}

CaseMeasures case_measures(const fs::path& folder, const Context& context) {
  const CaseFacts facts(folder);
  const Case the_case = load_case(folder);
  CaseMeasures out;
  out.bone_mm3 = facts.reported("resample", "volume_after_mm3");
  out.lower_hu = facts.reported("threshold", "lower_hu");
  const auto file = the_case.files.find("structures");
  if (file == the_case.files.end()) return out;
  const std::vector<StructureMeasure> all = measure_structures(load_labels(file->second), context);
  for (const StructureMeasure& m : all) {
    out.structures.push_back({m.structure, m.volume_mm3, m.length_mm});
    for (const StructureMeasure& other : all) {
      if (other.structure.value <= m.structure.value) continue;
      for (const StructureMeasure::Gap& g : m.gaps)
        if (g.other == other.structure.value) out.gaps.push_back({m.structure.name, other.structure.name, g.mm});
    }
  }
  return out;
}

}  // namespace osteo::inline assessment
