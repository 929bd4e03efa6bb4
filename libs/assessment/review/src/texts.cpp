// A review as JSON and as a sheet, and into its folder.
#include <algorithm>
#include <cmath>

#include "charts.h"
#include "osteo/assessment/review/review.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline assessment {
namespace {

using review::reported_value;

Tone tone_of(FindingSeverity s) {
  return s == FindingSeverity::serious   ? Tone::bad
         : s == FindingSeverity::caution ? Tone::caution
         : s == FindingSeverity::good    ? Tone::good
                                         : Tone::plain;
}

const ReviewPicture* picture_with(const Review& r, std::string_view id) {
  const auto at =
      std::find_if(r.pictures.begin(), r.pictures.end(), [&](const ReviewPicture& p) { return p.id == id; });
  return at == r.pictures.end() ? nullptr : &*at;
}

Json points(const std::vector<IsotonicQuantile::Point>& curve) {
  Json list = Json::list();
  for (const auto& p : curve) {
    Json point = Json::list();
    point.push_back(std::round(p.distance_mm * 1000) / 1000);
    point.push_back(std::round(p.value * 1e5) / 1e5);
    list.push_back(std::move(point));
  }
  return list;
}

}  // namespace

Json review_json(const Review& r) {
  const EnglishHere files;
  Json j{{"osteotome_review", 1}};
  j["labels"] = r.labels;
  j["procedure"] = r.procedure.empty() ? Json() : Json(r.procedure);
  j["damaged"] = r.damaged;
  j["removed_by_burrs"] = {
      {"seen_mm3", r.seen_mm3}, {"hidden_mm3", r.hidden_mm3}, {"sight_unknown_mm3", r.unknown_mm3}};
  j["findings"] = findings_json(r.findings, true);
  j["score"] = score_json(r.score, false);
  j["timeline"] = timeline_json(r.timeline);
  Json compared = Json::object();
  compared["earlier_sessions"] = r.earlier;
  compared["expert_sessions"] = r.experts;
  compared["novice_sessions"] = r.novices;
  compared["metrics"] = Json::list();
  for (const Comparison& c : r.comparison) {
    Json m{{"name", c.row->name},
           {"plain_name", review::plain_name(c.row->name)},
           {"unit", c.row->unit},
           {"better", name_of(c.row->better)}};
    m["value"] = c.value ? Json(*c.value) : Json();
    m["earlier"] = Json::list();
    for (const auto& v : c.earlier) m["earlier"].push_back(v ? Json(*v) : Json());
    m["experts"] = c.experts;
    m["novices"] = c.novices;
    compared["metrics"].push_back(std::move(m));
  }
  j["comparison"] = std::move(compared);
  j["force_by_distance"] = Json::list();
  for (const ForceProfile& p : r.profiles) {
    Json f{{"structure", p.structure}, {"drilled_s", p.drilled_s}};
    f["half_n"] = points(p.middle);
    f["nine_in_ten_n"] = points(p.most);
    f["experts_half_n"] = points(p.experts_middle);
    f["experts_nine_in_ten_n"] = points(p.experts_most);
    j["force_by_distance"].push_back(std::move(f));
  }
  j["pictures"] = Json::list();
  for (const ReviewPicture& p : r.pictures) {
    Json picture = Json::object();
    picture["id"] = p.id;
    picture["caption"] = p.caption;
    j["pictures"].push_back(std::move(picture));
  }
  j["meshes"] = Json::list();
  for (const ReviewMesh& m : r.meshes) {
    Json mesh{{"id", m.id}, {"name", m.name}};
    mesh["triangles"] = m.mesh.triangles.size();
    j["meshes"].push_back(std::move(mesh));
  }
  j["left_out"] = r.left_out;
  return j;
}

Sheet review_sheet(const Review& r) {
  const ReviewTexts shown = review::texts_of(r);
  Sheet s;
  s.title = r.procedure.empty() ? tr("Review of a session") : r.procedure;
  s.code = tr("review");
  s.footer =
      tr("Osteotome. Thresholds are starting values, fitted to no rated session; a rehearsal is no proof of skill.");
  s.pages = 4;
  for (const std::string& label : shown.labels) {
    const auto colon = label.find(": ");
    s.blocks.push_back({sheet::Band{label.substr(0, colon), colon == std::string::npos ? "" : label.substr(colon + 2),
                                    Tone::caution}});
  }
  std::string summary;
  for (const std::string& line : shown.findings.summary) summary += (summary.empty() ? "" : " ") + line;
  s.blocks.push_back({sheet::Paragraph{summary}});
  for (const std::string& w : shown.findings.words) s.blocks.push_back({sheet::Paragraph{w, Tone::caution}});
  sheet::Table list{{tr("what was found"), tr("look at")}, {}, {84, 16}};
  for (const ScoreFinding& f : shown.findings.list) {
    std::string when;
    for (std::size_t n = 0; n < std::min<std::size_t>(3, f.times_s.size()); ++n)
      when += (n > 0 ? ", " : "") + review::clock(f.times_s[n]);
    if (f.times_s.size() > 3) when += ", ...";
    list.rows.push_back({{f.text, tone_of(f.severity)}, {when, Tone::quiet}});
  }
  s.blocks.push_back({sheet::Heading{tr("What was found")}});
  if (list.rows.empty()) {
    s.blocks.push_back({sheet::Paragraph{tr("There is nothing to tell."), Tone::quiet}});
  } else {
    s.blocks.push_back({list});
  }
  const auto row = [&](const char* heading, std::initializer_list<const char*> ids, double height_mm) {
    sheet::Pictures pictures{{}, height_mm};
    for (const char* const id : ids) {
      if (const ReviewPicture* const p = picture_with(r, id))
        pictures.row.push_back({p->id, p->picture, review::shown_caption(*p)});
    }
    if (pictures.row.empty()) return;
    s.blocks.push_back({sheet::Heading{heading}});
    s.blocks.push_back({pictures});
  };
  row(tr("Before and after"), {"before", "after"}, 66);
  row(tr("What was removed, seen and unseen"), {"unseen", "unseen-side"}, 66);
  s.blocks.push_back({sheet::Heading{tr("Over time")}});
  s.blocks.push_back({review::timeline_chart(r)});
  sheet::Pictures evidence{{}, 40};
  bool first = true;
  const auto flush = [&] {
    if (evidence.row.empty()) return;
    if (first) s.blocks.push_back({sheet::Heading{tr("Where to look")}});
    first = false;
    s.blocks.push_back({evidence});
    evidence.row.clear();
  };
  for (const ScoreFinding& f : shown.findings.list) {
    const ReviewPicture* const p = picture_with(r, f.id);
    if (p == nullptr) continue;
    evidence.row.push_back({p->id, p->picture, review::shown_caption(*p)});
    if (evidence.row.size() == 3) flush();
  }
  flush();
  if (!r.profiles.empty()) {
    s.blocks.push_back({sheet::Heading{tr("Force by distance")}});
    for (std::size_t n = 0; n < std::min<std::size_t>(4, r.profiles.size()); n += 2) {
      sheet::Columns two;
      for (std::size_t k = n; k < n + 2; ++k) {
        if (k < std::min<std::size_t>(4, r.profiles.size())) {
          two.columns.push_back({{review::profile_chart(r.profiles[k], r.experts > 0)}});
        } else {
          two.columns.push_back({{sheet::Paragraph{""}}});
        }
      }
      s.blocks.push_back({two});
    }
  }
  if (!r.comparison.empty()) {
    s.blocks.push_back({sheet::Heading{tr("Beside other sessions")}});
    s.blocks.push_back(
        {sheet::Paragraph{filled(tr("Orange: this session. Diamonds: {earlier} earlier ones, the later the "
                                    "darker. Band: {experts} of experts; ticks: {novices} of novices."),
                                 {{"earlier", std::to_string(r.earlier)},
                                  {"experts", std::to_string(r.experts)},
                                  {"novices", std::to_string(r.novices)}}),
                          Tone::quiet}});
    for (const Comparison& c : r.comparison) s.blocks.push_back({review::comparison_chart(c)});
  }
  if (!shown.findings.not_measured.empty()) {
    s.blocks.push_back({sheet::Heading{tr("What could not be measured")}});
    for (const auto& [why, what] : shown.findings.not_measured) {
      std::string names;
      for (const std::string& w : what) names += (names.empty() ? "" : ", ") + w;
      s.blocks.push_back({sheet::Paragraph{why + ": " + names, Tone::quiet}});
    }
  }
  for (const std::string& l : shown.left_out)
    s.blocks.push_back({sheet::Paragraph{filled(tr("Left out: {what}"), {{"what", l}}), Tone::quiet}});
  return s;
}

void may_write_review(const fs::path& path, bool force) {
  const fs::path folder = output_folder(path);
  if (!output_exists(folder)) return;
  constexpr std::array<std::string_view, 3> kFiles{"review.html", "review.json", "review.pdf"};
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (std::find(kFiles.begin(), kFiles.end(), name) == kFiles.end())
      throw Error(ExitCode::cannot_write, "'" + path.string() + "' holds '" + name + "', which is no part of a review",
                  "name another folder");
    if (!force)
      throw Error(ExitCode::cannot_write, "'" + path.string() + "' holds a review already", "--force replaces it");
  }
}

void write_review(const Review& r, const fs::path& folder, bool force) {
  const auto may_replace = [&](const fs::path&) { may_write_review(folder, force); };
  write_folder_atomically(folder, may_replace, [&](const fs::path& to) {
    write_file(to / "review.json", review_json(r).dump() + "\n");
    write_file(to / "review.html", review_html(r));
    write_file(to / "review.pdf", sheet_pdf(review_sheet(r)));
  });
}

}  // namespace osteo::inline assessment
