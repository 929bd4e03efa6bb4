// A review as one page: text and charts stand in it as they are; a script makes the timeline livelier and shows the
// scene in 3D.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "charts.h"
#include "osteo/assessment/review/review.h"
#include "osteo/core/base/translate.h"
#include "page_parts.h"

namespace osteo::inline assessment {
namespace {

using review::clock;
using review::reported_value;
using review::shown_caption;
using review::texts_of;

std::string e(std::string_view text) {
  return html_escaped(text);
}

struct Sign {
  const char *glyph, *word;
};
Sign sign_of(FindingSeverity s) {
  switch (s) {
    case FindingSeverity::serious:
      return {"&#9679;", tr("harm")};
    case FindingSeverity::caution:
      return {"&#9650;", tr("do otherwise")};
    case FindingSeverity::note:
      return {"&#8211;", tr("to know")};
    case FindingSeverity::good:
      break;
  }
  return {"&#10003;", tr("good")};
}

const ReviewPicture* picture_of(const Review& r, std::string_view id) {
  const auto at =
      std::find_if(r.pictures.begin(), r.pictures.end(), [&](const ReviewPicture& p) { return p.id == id; });
  return at == r.pictures.end() ? nullptr : &*at;
}

std::string figure(const ReviewPicture& p, bool caption) {
  return "<figure><img id=\"picture-" + e(p.id) + "\" alt=\"" + e(shown_caption(p)) + "\" width=\"" +
         std::to_string(p.picture.width) + "\" height=\"" + std::to_string(p.picture.height) + "\" src=\"" +
         png_url_of(p.picture) + "\">" + (caption ? "<figcaption>" + e(shown_caption(p)) + "</figcaption>" : "") +
         "</figure>\n";
}

std::optional<double> value_of(const Score& score, MetricName name) {
  for (const Measured& m : score.values) {
    if (m.is(name) && m.of.empty()) return m.value;
  }
  return std::nullopt;
}

// The figures that people ask for first.
std::string key_figures(const Review& r) {
  std::string out;
  const auto put = [&](const std::string& value, const std::string& name) {
    out += "<div><b>" + e(value) + "</b><span>" + e(name) + "</span></div>\n";
  };
  if (!r.score.items.empty() && r.score.judged() > 0)
    put(filled(tr("{n} of {all}"),
               {{"n", std::to_string(r.score.passed())}, {"all", std::to_string(r.score.judged())}}),
        tr("items passed"));
  if (const auto v = value_of(r.score, "seen_share"))
    put(reported_value(MetricName("seen_share").row(), *v), tr("of the bone that is gone was seen as it went"));
  double touches = 0;
  bool any = false;
  for (const Measured& m : r.score.values) {
    if (!m.is("touches") || !m.value) continue;
    any = true;
    touches += *m.value;
  }
  if (any) put(reported_number(touches), tr_n("touch of a structure", "touches of structures", touches));
  if (const auto v = value_of(r.score, "force_p95_n"))
    put(reported_number(*v) + " N", tr("95 % of the pressing was below"));
  if (const auto v = value_of(r.score, "removed_mm3")) put(reported_number(*v) + " mm³", tr("of bone taken by burrs"));
  if (const auto v = value_of(r.score, "duration_s")) put(reported_seconds(*v), tr("in all"));
  return out;
}

template <class T>
std::string packed(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return base64_of(bytes);
}

Json rounded(Vec3 p) {
  Json j = Json::list();
  for (std::size_t a = 0; a < 3; ++a) j.push_back(std::round(p[a] * 100) / 100);
  return j;
}

// Places in 16 bits of the mesh's box, normals in 8: a page of a few megabytes.
Json mesh_json(const ReviewMesh& m, Vec3& lo_all, Vec3& hi_all) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (const auto& p : m.mesh.points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(p[a]));
      hi[a] = std::max(hi[a], static_cast<double>(p[a]));
    }
  }
  std::vector<std::uint16_t> points, small;
  std::vector<std::int8_t> normals;
  std::vector<std::uint32_t> large;
  for (const auto& p : m.mesh.points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double size = std::max(1e-6, hi[a] - lo[a]);
      points.push_back(static_cast<std::uint16_t>(std::lround(65535 * (static_cast<double>(p[a]) - lo[a]) / size)));
    }
  }
  for (const auto& n : m.mesh.normals) {
    for (std::size_t a = 0; a < 3; ++a)
      normals.push_back(static_cast<std::int8_t>(std::lround(127 * std::clamp(static_cast<double>(n[a]), -1.0, 1.0))));
  }
  const bool wide = m.mesh.points_mm.size() > 65535;
  for (const auto& t : m.mesh.triangles) {
    for (const std::uint32_t p : t) {
      if (wide) {
        large.push_back(p);
      } else {
        small.push_back(static_cast<std::uint16_t>(p));
      }
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    lo_all[a] = std::min(lo_all[a], lo[a]);
    hi_all[a] = std::max(hi_all[a], hi[a]);
  }
  Json j{{"id", m.id}, {"name", tr(m.name)}};
  j["rgb"] = std::vector<int>{m.rgb[0], m.rgb[1], m.rgb[2]};
  j["lo"] = rounded(lo);
  j["size"] = Json::list();
  for (std::size_t a = 0; a < 3; ++a) j["size"].push_back(std::round(std::max(1e-6, hi[a] - lo[a]) * 1e5) / 1e5);
  j["count"] = 3 * m.mesh.triangles.size();
  j["wide"] = wide;
  j["points"] = packed(points);
  j["normals"] = packed(normals);
  j["triangles"] = wide ? packed(large) : packed(small);
  return j;
}

// What the script says, which finds it in the page by these.
constexpr const char* kScriptTexts[] = {tr_later("Force"),
                                        tr_later("N, of the burr"),
                                        tr_later("Clearance"),
                                        tr_later("mm, nearest"),
                                        tr_later("Bone"),
                                        tr_later("mm³/s; orange unseen"),
                                        tr_later("Tip speed"),
                                        tr_later("mm/s"),
                                        tr_later("In hand"),
                                        tr_later("nothing"),
                                        tr_later("{mm} mm inside"),
                                        tr_later("{mm} mm"),
                                        tr_later("{from} to {to}: {taken} mm³ taken, {unseen} mm³ of what is gone "
                                                 "unseen; hardest press {force} N; nearest {nearest}"),
                                        tr_later("nothing in this time"),
                                        tr_later("the first {n} of {all}"),
                                        tr_later("1 event"),
                                        tr_later("{n} events"),
                                        tr_later("no structure near"),
                                        tr_later("{mm} mm to the {structure}"),
                                        tr_later(", drilling"),
                                        tr_later("not recorded")};

Json shown_timeline(const Timeline& line) {
  Json j = timeline_json(line);
  if (language() == Language::english) return j;
  Json events = Json::list();
  std::size_t n = 0;
  for (const Json& event : j["events"].items()) {
    Json shown = event;
    shown["what"] = line.events[n++].shown();
    events.push_back(std::move(shown));
  }
  j["events"] = std::move(events);
  Json structures = Json::object();
  for (const auto& [value, name] : j["structures"].members())
    structures[value] = name.text() == nullptr ? std::string() : tr(*name.text());
  j["structures"] = std::move(structures);
  Json instruments = Json::object();
  for (const auto& [value, name] : j["instruments"].members())
    instruments[value] = name.text() == nullptr ? std::string() : tr_sized(*name.text());
  j["instruments"] = std::move(instruments);
  return j;
}

// Of what the script shows; the whole is in review.json.
std::string page_data(const Review& r) {
  constexpr std::size_t kPlaces = 600;
  Json j;
  j["timeline"] = shown_timeline(r.timeline);
  if (language() != Language::english) {
    j["decimal"] = shown_number(0.5, 1).substr(1, 1);
    j["texts"] = Json::object();
    for (const char* const text : kScriptTexts) j["texts"][text] = tr(text);
  }
  j["findings"] = Json::list();
  for (const ScoreFinding& f : r.findings.list) {
    if (!f.at_mm) continue;
    Json v{{"id", f.id}};
    v["at_mm"] = rounded(*f.at_mm);
    v["radius"] = 12;
    v["places"] = Json::list();
    const std::size_t n = std::min(kPlaces, f.places_mm.size());
    for (std::size_t k = 0; k < n; ++k) v["places"].push_back(rounded(f.places_mm[k * f.places_mm.size() / n]));
    j["findings"].push_back(std::move(v));
  }
  j["meshes"] = Json::list();
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (const ReviewMesh& m : r.meshes) j["meshes"].push_back(mesh_json(m, lo, hi));
  Json view{{"radius", r.view_radius_mm}};
  view["centre"] = rounded(r.view_centre_mm);
  view["eye"] = Json::list();
  for (std::size_t a = 0; a < 3; ++a) view["eye"].push_back(std::round(r.view_eye[a] * 1e4) / 1e4);
  j["view"] = std::move(view);
  // A script's text ends at "</": no "<" may stand in it.
  std::string safe;
  for (const char c : j.dump()) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

void findings(std::ostream& out, const Review& r) {
  const Findings shown = texts_of(r).findings;
  out << "<section id=\"findings\"><h2>" << tr("What was found") << "</h2>\n";
  if (shown.list.empty()) out << "<p>" << tr("There is nothing to tell.") << "</p>\n";
  out << "<ol class=\"findings\">\n";
  std::string passed;
  for (const ScoreFinding& f : shown.list) {
    const Sign sign = sign_of(f.severity);
    const ReviewPicture* const p = picture_of(r, f.id);
    // What passed is one entry: one reads on where something is to be done.
    if (f.severity == FindingSeverity::good && f.kind == "item") {
      passed += "<span id=\"finding-" + e(f.id) + "\">" + e(f.text) + "</span>\n";
      continue;
    }
    out << "<li class=\"" << name_of(f.severity) << (p != nullptr ? " shown" : "") << "\" id=\"finding-" << e(f.id)
        << "\"><div class=\"mark\"><i>" << sign.glyph << "</i>" << sign.word << "</div><div><p class=\"said\">"
        << e(f.text) << "</p>";
    if (!f.why.empty()) out << "<p class=\"small whence\">" << e(f.why) << "</p>";
    out << "<div class=\"screen\">";
    for (std::size_t n = 0; n < std::min<std::size_t>(6, f.times_s.size()); ++n)
      out << "<button type=\"button\" data-t=\"" << format_number(f.times_s[n]) << "\">" << clock(f.times_s[n])
          << "</button>";
    if (f.times_s.size() > 6)
      out << "<span class=\"small\">" << filled(tr("and {n} more"), {{"n", std::to_string(f.times_s.size() - 6)}})
          << "</span> ";
    if (f.at_mm && !r.meshes.empty())
      out << "<button type=\"button\" data-f=\"" << e(f.id) << "\">" << tr("show in 3D") << "</button>";
    out << "</div></div>";
    if (p != nullptr) out << figure(*p, false);
    out << "</li>\n";
  }
  if (!passed.empty()) {
    const Sign sign = sign_of(FindingSeverity::good);
    out << "<li class=\"good\"><div class=\"mark\"><i>" << sign.glyph << "</i>" << sign.word
        << "</div><div class=\"passed small\">" << passed << "</div></li>\n";
  }
  out << "</ol></section>\n";
}

void pictures(std::ostream& out, const Review& r) {
  const auto pair = [&](const char* id, const char* heading, const std::string& text, const char* a, const char* b) {
    const ReviewPicture *const pa = picture_of(r, a), *const pb = picture_of(r, b);
    if (pa == nullptr || pb == nullptr) return;
    out << "<section id=\"" << id << "\"><h2>" << heading << "</h2>\n"
        << text << "<div class=\"pair\">" << figure(*pa, true) << figure(*pb, true) << "</div></section>\n";
  };
  pair("before-after", tr("Before and after"), "", "before", "after");
  const double known = r.seen_mm3 + r.hidden_mm3;
  std::string text = "<p class=\"legend\">";
  if (known > 0)
    text += "<span class=\"swatch\" style=\"background:var(--seen);margin-left:0\"></span>" +
            filled(tr("{mm3} mm³ seen as it went"), {{"mm3", reported_number(r.seen_mm3)}}) +
            " <span class=\"swatch\" style=\"background:var(--accent)\"></span>" +
            filled(tr("{mm3} mm³ unseen"), {{"mm3", reported_number(r.hidden_mm3)}});
  if (r.unknown_mm3 > 0)
    text +=
        " <span class=\"swatch\" style=\"background:#969696\"></span>" +
        filled(tr("{mm3} mm³ before it was known from where one looked"), {{"mm3", reported_number(r.unknown_mm3)}});
  pair("seen-unseen", tr("What was removed, seen and unseen"), text + "</p>\n", "unseen", "unseen-side");
}

void in_3d(std::ostream& out, const Review& r) {
  if (r.meshes.empty()) return;
  out << "<section id=\"in-3d\"><h2>" << tr("In 3D") << "</h2>\n<p class=\"small\" id=\"no-view\" hidden>"
      << tr("This browser shows no 3D (WebGL 2): the pictures above say the same.")
      << "</p>\n<div id=\"view\"><canvas tabindex=\"0\" aria-label=\""
      << tr("The bone, structures and what was removed; drag or use the arrow keys to turn")
      << "\"></canvas><div class=\"small hint screen\">" << tr("drag turns · wheel zooms · shift and drag moves")
      << "</div></div>\n<div class=\"bar screen\" id=\"parts\"></div><div class=\"bar screen\"><label class=\"small\" "
         "for=\"clear\">"
      << tr("bone clear")
      << "</label><input type=\"range\" id=\"clear\" min=\"0\" max=\"90\" value=\"0\"><button type=\"button\" "
         "id=\"home\">"
      << tr("as at first") << "</button></div></section>\n";
}

void over_time(std::ostream& out, const Review& r) {
  const sheet::Drawing still = review::timeline_chart(r);
  out << "<section id=\"over-time\"><h2>" << tr("Over time") << "</h2>\n";
  if (r.timeline.size() == 0) {
    out << "<p>" << tr("Nothing was recorded.") << "</p></section>\n";
    return;
  }
  out << "<p class=\"small screen\">"
      << tr("Drag across it to look at a part of the session; arrow keys move, + and - zoom, Escape shows all again.")
      << "</p>\n<p class=\"small\" id=\"readout\" aria-live=\"off\"></p>\n<div id=\"timeline\" tabindex=\"0\" "
         "data-alt=\""
      << e(still.alt) << "\">" << svg_of(still)
      << "</div>\n<div class=\"bar\"><span class=\"small\" id=\"range\"></span><button type=\"button\" id=\"whole\" "
         "class=\"screen\">"
      << tr("whole session")
      << "</button></div>\n<p class=\"small\" id=\"event-count\"></p>\n<div class=\"scroll\"><table "
         "id=\"events\"><thead><tr><th>"
      << tr("at") << "</th><th>" << tr("what happened") << "</th><th>" << tr("for") << "</th></tr></thead><tbody>\n";
  // Without a script the table is whole.
  for (const TimelineEvent& ev : r.timeline.events) {
    out << "<tr" << (ev.kind == EventKind::injury ? " class=\"bad\"" : "") << "><td class=\"n\">" << clock(ev.t_s)
        << "</td><td>" << e(ev.shown()) << "</td><td class=\"n\">"
        << (ev.end_s - ev.t_s > 0.05 ? reported_seconds(ev.end_s - ev.t_s) : "") << "</td></tr>\n";
    if (&ev - r.timeline.events.data() > 300) break;
  }
  out << "</tbody></table></div></section>\n";
}

void force(std::ostream& out, const Review& r) {
  out << "<section id=\"force\"><h2>" << tr("Force by distance") << "</h2>\n";
  if (r.profiles.empty()) {
    out << "<p>"
        << (r.timeline.structure_names.empty()
                ? tr("No burr drilled near a structure for a second or longer: the case has no structures.")
                : tr("No burr drilled near a structure for a second or longer."))
        << "</p></section>\n";
    return;
  }
  out << "<p class=\"small\">"
      << tr("How hard the burr pressed on bone at each distance of its surface from a structure: orange, what nine in "
            "ten "
            "moments stay below; dashed, half of them; dots, moments.")
      << " ";
  if (r.experts > 0) {
    out << filled(tr_n("Grey: below it lie nine in ten of the moments of {n} session of experts.",
                       "Grey: below it lie nine in ten of the moments of {n} sessions of experts.",
                       static_cast<double>(r.experts)),
                  {{"n", std::to_string(r.experts)}});
  } else {
    out << tr("Without a reference there is no band of experts.");
  }
  out << "</p>\n<div class=\"profiles\">";
  for (std::size_t n = 0; n < std::min<std::size_t>(6, r.profiles.size()); ++n)
    out << "<figure>" << svg_of(review::profile_chart(r.profiles[n], r.experts > 0)) << "</figure>";
  out << "</div></section>\n";
}

void comparison(std::ostream& out, const Review& r) {
  if (r.comparison.empty()) return;
  const auto swatch = [&](const char* style, const char* text, std::size_t n) {
    out << "<span class=\"swatch\" style=\"" << style << "\"></span>" << filled(text, {{"n", std::to_string(n)}});
  };
  out << "<section id=\"comparison\"><h2>" << tr("Beside other sessions") << "</h2>\n<p class=\"legend\">";
  swatch("background:var(--accent);margin-left:0", tr("this session"), 1);
  if (r.earlier > 0) swatch("background:var(--ink)", tr("{n} earlier, the later the darker"), r.earlier);
  if (r.experts > 0) swatch("background:var(--band)", tr("band of {n} by experts"), r.experts);
  if (r.novices > 0) swatch("background:var(--quiet);width:.15rem;border-radius:0", tr("{n} by novices"), r.novices);
  out << "</p>\n<div class=\"chart\">\n";
  for (const Comparison& c : r.comparison) out << svg_of(review::comparison_chart(c));
  out << "</div></section>\n";
}

void tables(std::ostream& out, const Review& r) {
  if (!r.score.items.empty()) {
    out << "<section id=\"items\"><h2>" << tr("The scale") << "</h2>\n<table><thead><tr><th>" << tr("item")
        << "</th><th>" << tr("value") << "</th><th>" << tr("asked") << "</th><th>" << tr("margin")
        << "</th><th></th></tr></thead><tbody>\n";
    for (const Product::Result& i : r.score.items) {
      const std::string unit = unit_text(i.unit).empty() ? "" : " " + unit_text(i.unit);
      out << "<tr><td>" << e(i.item->name) << "</td>";
      if (i.measured) {
        out << "<td class=\"n\">" << e(reported_number(i.value) + unit) << "</td><td class=\"n\">"
            << e(reported_number(i.threshold) + unit) << "</td><td class=\"n\">" << e(reported_number(i.margin))
            << "</td><td" << (i.pass ? ">&#10003; " : " class=\"bad\">") << (i.pass ? tr("passed") : tr("not passed"));
      } else {
        out << "<td colspan=\"3\">" << e(filled(tr("not judged: {why}"), {{"why", tr(i.word)}})) << "</td><td>";
      }
      out << "</td></tr>\n";
    }
    out << "</tbody></table>\n<p class=\"small\">"
        << tr("Margin: distance from what is asked, in units of what good results differ by; negative where it does "
              "not "
              "pass.")
        << "</p>\n";
    if (!r.score.steps.empty()) {
      out << "<p>" << tr("Steps:") << " ";
      for (std::size_t n = 0; n < r.score.steps.size(); ++n) {
        const auto& [name, state] = r.score.steps[n];
        out << (n > 0 ? "; " : "") << e(name) << " &#8211; " << e(tr(state));
        for (const Measured& m : r.score.values) {
          if (m.is("step_s") && m.of == name && m.value && *m.value > 0)
            out << ", " << e(reported_value(*m.row, *m.value));
        }
      }
      out << ".</p>\n";
    }
    out << "</section>\n";
  }
  out << "<section id=\"figures\"><h2>" << tr("All figures") << "</h2><details><summary>"
      << filled(tr("{n} figures, each with what it is"), {{"n", std::to_string(r.score.values.size())}})
      << "</summary>\n<table><thead><tr><th>" << tr("figure") << "</th><th>" << tr("of") << "</th><th>" << tr("value")
      << "</th><th>" << tr("what it is") << "</th></tr></thead><tbody>\n";
  for (const Measured& m : r.score.values) {
    out << "<tr><td>" << m.row->name << "</td><td>" << e(tr(m.of)) << "</td><td class=\"n\">"
        << (m.value ? e(reported_value(*m.row, *m.value)) : "&#8211;") << "</td><td>" << e(tr(std::string(m.row->help)))
        << (m.value ? "" : e(filled(tr("; not measured: {why}"), {{"why", tr(m.word)}}))) << "</td></tr>\n";
  }
  out << "</tbody></table></details></section>\n";
  const ReviewTexts shown = texts_of(r);
  if (shown.findings.not_measured.empty() && shown.left_out.empty()) return;
  out << "<section id=\"not-measured\"><h2>" << tr("What could not be determined") << "</h2>\n";
  for (const auto& [why, what] : shown.findings.not_measured) {
    out << "<p class=\"small\"><b>" << e(why) << "</b>: ";
    for (std::size_t n = 0; n < what.size(); ++n) out << (n > 0 ? ", " : "") << e(what[n]);
    out << "</p>\n";
  }
  for (const std::string& l : shown.left_out)
    out << "<p class=\"small\">" << e(filled(tr("Left out: {what}"), {{"what", l}})) << "</p>\n";
  out << "</section>\n";
}

}  // namespace

std::string review_html(const Review& r) {
  std::ostringstream out;
  const ReviewTexts shown = texts_of(r);
  out << "<!DOCTYPE html>\n<html lang=\"" << tr_of("the language of these texts, as HTML names it", "en")
      << "\"><head><meta charset=\"utf-8\">\n"
         // The browser itself keeps the page from asking for anything.
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
         "'unsafe-inline'; script-src 'unsafe-inline'\">\n<meta name=\"viewport\" content=\"width=device-width, "
         "initial-scale=1\">\n<title>"
      << tr("Review of a session") << "</title>\n<style>\n"
      << kReviewCss << "</style></head>\n<body>\n<header><p>" << tr("Review of a session") << "</p><h1>"
      << e(r.procedure.empty() ? std::string(tr("A rehearsal, without a procedure")) : r.procedure)
      << "</h1></header>\n<section id=\"summary\">\n";
  for (const std::string& label : shown.labels) {
    const auto colon = label.find(": ");
    out << "<p class=\"label\"><b>" << e(label.substr(0, colon)) << ":</b> "
        << e(colon == std::string::npos ? "" : label.substr(colon + 2)) << "</p>\n";
  }
  out << "<p class=\"lead\">";
  for (std::size_t n = 0; n < shown.findings.summary.size(); ++n)
    out << (n > 0 ? " " : "") << e(shown.findings.summary[n]);
  out << "</p>\n";
  for (const std::string& w : shown.findings.words) out << "<p class=\"words\">" << e(w) << "</p>\n";
  out << "<div class=\"figures\">\n" << key_figures(r) << "</div></section>\n";
  findings(out, r);
  pictures(out, r);
  in_3d(out, r);
  over_time(out, r);
  force(out, r);
  comparison(out, r);
  tables(out, r);
  out << "<footer class=\"small\">"
      << tr("Osteotome. Thresholds are starting values, fitted to no rated session; near means within 2 mm; what each "
            "figure means and may not be used for: docs/how-to/review.md and docs/validation/evidence.md. A rehearsal "
            "is "
            "no proof of skill.")
      << "</footer>\n<script type=\"application/json\" id=\"review-data\">" << page_data(r) << "</script>\n<script>\n"
      << kReviewJs << "</script>\n</body></html>\n";
  return std::move(out).str();
}

}  // namespace osteo::inline assessment
