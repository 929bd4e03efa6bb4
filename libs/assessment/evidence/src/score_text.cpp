// A score as JSON, CSV and lines.
#include <algorithm>
#include <cmath>

#include "osteo/assessment/evidence/score.h"
#include "osteo/core/base/csv.h"

namespace osteo::inline assessment {
namespace {

Json place(Vec3 p) {
  const auto rounded = [](double x) { return std::round(x * 1000) / 1000; };
  return {rounded(p.x), rounded(p.y), rounded(p.z)};
}

std::string kind_of(const ScaleItem& item) {
  return std::string(EnumNames<ItemKind>::values[static_cast<std::size_t>(item.kind)]);
}

// "12.3": four digits that count.
std::string short_number(double x) {
  if (x == 0 || !std::isfinite(x)) return format_number(x);
  const double scale = std::pow(10, 3 - std::floor(std::log10(std::abs(x))));
  return format_number(std::round(x * scale) / scale);
}

std::string padded(std::string s, std::size_t n) {
  if (s.size() < n) s.append(n - s.size(), ' ');
  return s;
}

// A name, which a spreadsheet shall show and not work out.
std::string no_formula(const std::string& name) {
  return is_formula(name) ? "'" + name : name;
}

}  // namespace

std::string ScoreSource::marks() const {
  std::string words;
  for (const auto& [is, word] :
       {std::pair{simulated, "simulated"}, std::pair{guided, "guided"}, std::pair{cut_short, "cut-short"}})
    if (is) words += (words.empty() ? "" : " ") + std::string(word);
  return words;
}

Json score_json(const Score& score, bool evidence) {
  Json j{{"osteotome_score", 1},
         {"procedure", score.procedure.empty() ? Json() : Json(score.procedure)},
         {"words", score.words}};
  const ScoreSource& source = score.source;
  j["source"] =
      Json{{"stream", source.stream},           {"bone", source.bone},           {"procedure", source.procedure},
           {"recorded_by", source.recorded_by}, {"scored_by", source.scored_by}, {"marks", source.marks()}};
  j["metrics"] = Json::list();
  for (const Measured& m : score.values) {
    Json v{
        {"name", m.row->name}, {"of", m.of.empty() ? Json() : Json(m.of)}, {"value", m.value ? Json(*m.value) : Json()},
        {"unit", m.row->unit}, {"better", name_of(m.row->better)},         {"source", m.row->source}};
    if (!m.word.empty()) v["word"] = m.word;
    j["metrics"].push_back(std::move(v));
  }
  if (!score.procedure.empty()) {
    j["items_passed"] = score.passed();
    j["items_judged"] = score.judged();
    j["items"] = Json::list();
    for (const Product::Result& r : score.items) {
      Json i{{"name", r.item->name},
             {"kind", kind_of(*r.item)},
             {"structure", r.item->structure.empty() ? Json() : Json(r.item->structure)}};
      i["value"] = r.measured ? Json(r.value) : Json();
      i["threshold"] = r.threshold;
      i["unit"] = r.unit;
      i["pass"] = r.measured ? Json(r.pass) : Json();
      i["margin"] = r.measured ? Json(r.margin) : Json();
      if (!r.word.empty()) i["word"] = r.word;
      i["evidence_count"] = r.evidence_count;
      if (evidence) {
        i["evidence_mm"] = Json::list();
        for (const Vec3 p : r.evidence_mm) i["evidence_mm"].push_back(place(p));
      }
      j["items"].push_back(std::move(i));
    }
    j["steps"] = Json::list();
    for (const auto& [name, state] : score.steps) {
      Json step = Json::object();
      step["name"] = name;
      step["state"] = state;
      j["steps"].push_back(std::move(step));
    }
  }
  j["moments"] = Json::list();
  for (const Moment& m : score.moments) {
    j["moments"].push_back({{"t_s", m.t_s},
                            {"at_mm", place(m.at_mm)},
                            {"what", m.what},
                            {"structure", m.structure.empty() ? Json() : Json(m.structure)},
                            {"value", m.value},
                            {"limit", m.limit}});
  }
  if (evidence) {
    j["hidden"] = Json::list();
    for (const auto& [name, v] : score.hidden)
      j["hidden"].push_back({{"voxel", name}, {"at_mm", place(v.own_mm)}, {"tick", v.tick}});
  }
  return j;
}

std::string score_csv(const Score& score, const std::string& session) {
  std::vector<std::string> header{"session"}, row{no_formula(session)};
  const auto put = [&](const std::string& name, const std::string& value) {
    header.push_back(no_formula(name));
    row.push_back(value);
  };
  const ScoreSource& source = score.source;
  for (const auto& [name, value] :
       {std::pair{"stream", source.stream}, std::pair{"bone", source.bone}, std::pair{"procedure", source.procedure},
        std::pair{"recorded_by", source.recorded_by}, std::pair{"scored_by", source.scored_by},
        std::pair{"marks", source.marks()}})
    put(name, no_formula(value));
  for (const Measured& m : score.values) put(m.name(), m.value ? format_number(*m.value) : "");
  for (const Product::Result& r : score.items) {
    put("item[" + r.item->name + "]", r.measured ? format_number(r.value) : "");
    put("pass[" + r.item->name + "]", r.measured ? (r.pass ? "1" : "0") : "");
  }
  return csv_line(header) + csv_line(row);
}

std::string score_lines(const Score& score) {
  std::string out;
  for (const std::string& w : score.words) out += "note: " + w + "\n";
  for (const Measured& m : score.values) {
    const std::string unit = m.row->unit == "1" ? "" : " " + std::string(m.row->unit);
    out += padded(m.name(), 44) + " " + (m.value ? short_number(*m.value) + unit : "- (" + m.word + ")") + "\n";
  }
  if (!score.procedure.empty()) {
    out += score.procedure + ": " + std::to_string(score.passed()) + " of " + std::to_string(score.judged()) +
           " items passed";
    if (score.judged() < score.items.size())
      out += ", " + std::to_string(score.items.size() - score.judged()) + " not judged";
    out += "\n";
  }
  for (const Product::Result& r : score.items) {
    const std::string unit = r.unit == "1" || r.unit.empty() ? "" : " " + r.unit;
    out += padded(std::string(!r.measured ? "  ?    " : r.pass ? "  pass " : "  fail ") + r.item->name, 44) + " ";
    if (r.measured) {
      out += short_number(r.value) + unit + " (" + kind_of(*r.item) + ", threshold " + short_number(r.threshold) +
             ", margin " + short_number(r.margin) + ")";
      if (!r.word.empty()) out += "; " + r.word;
    } else {
      out += "not judged: " + r.word;
    }
    out += "\n";
  }
  for (const auto& [name, state] : score.steps) out += padded("  step " + name, 44) + " " + state + "\n";
  return out;
}

std::string metric_table_markdown() {
  std::string out = "| metric | unit | better | needs | what | source |\n|---|---|---|---|---|---|\n";
  for (const MetricRow& r : metric_table()) {
    out += "| `" + std::string(r.name) + "` | " + std::string(r.unit) + " | " + std::string(name_of(r.better)) + " | " +
           std::string(r.needs) + " | " + std::string(r.help) + " | " + std::string(r.source) + " |\n";
  }
  return out;
}

}  // namespace osteo::inline assessment
