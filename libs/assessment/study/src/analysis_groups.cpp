// Do groups differ?
#include "analyst.h"
#include "charts.h"
#include "osteo/core/statistics/repeated.h"

namespace osteo::inline assessment::study {

void Analyst::compare() {
  json_["comparisons"] = Json::list();
  add(sheet::Heading{"Do groups differ?"});
  if (study_.plan.groups.size() < 2) {
    refuse("Comparison", "There is one group.");
    return;
  }
  sheet::Table table{{"outcome", "groups", "people", "means", "difference", "p (Welch)", "p (exact)", "Holm",
                      "Hedges g", "Cliff's delta"},
                     {},
                     {15, 13, 6, 10, 16, 7, 7, 7, 15, 15}};
  std::vector<Json> rows;
  std::vector<double> p;
  std::set<std::string> said;
  Json groups = Json::list();
  for (const Outcome& o : outcomes_) {
    Json of_groups = Json::object();
    for (const std::string& g : study_.plan.groups) of_groups[g] = json_of(summarise(means_of_people(study_, o, g)));
    groups.push_back({{"outcome", o.name}, {"groups", of_groups}});
    for (std::size_t i = 0; i < study_.plan.groups.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        compare_two(o, study_.plan.groups[i], study_.plan.groups[j], rows, p, table, said);
    }
  }
  json_["groups"] = groups;
  std::vector<double> together;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (*rows[i].find("primary")->flag()) together.push_back(p[i]);
  const std::vector<double> adjusted = holm(together);
  for (std::size_t i = 0, n = 0; i < rows.size(); ++i) {
    const bool primary = *rows[i].find("primary")->flag();
    rows[i]["p_holm"] = primary ? Json(adjusted[n]) : Json();
    table.rows[i][7].text = primary ? p_text(adjusted[n]) : "explores";
    n += primary ? 1 : 0;
    json_["comparisons"].push_back(rows[i]);
  }
  if (rows.empty()) return;
  add(std::move(table));
  say("One value a person: the mean of that person's sessions. p (exact): of the difference of means, by exchanging "
      "people between "
      "groups. Holm: the latter, for all " +
          std::string(study_.plan.primary.empty() ? "rows of this table" : "primary outcomes") + " together" +
          (study_.plan.primary.empty() ? "." : "; a row that explores can give an idea for another study, no finding."),
      Tone::quiet);
  std::vector<sheet::Plot> charts;
  for (const Outcome& o : outcomes_) {
    std::vector<std::vector<double>> people;
    bool enough = false;
    for (const std::string& g : study_.plan.groups) {
      people.push_back(means_of_people(study_, o, g));
      enough = enough || people.back().size() >= kPeopleToCompare;
    }
    if (enough && charts.size() < kMaxCharts)
      charts.push_back(groups_chart("groups-" + std::to_string(charts.size() + 1), o.name, study_.plan.groups, people,
                                    settings_.level));
  }
  add_charts(std::move(charts),
             "Dots: people. Box: quartiles and ends. Red: mean with its t interval (one group by itself).");
  repeated_table();
}

std::size_t Analyst::family() const {
  std::size_t n = 0;
  for (const Outcome& o : outcomes_) {
    if (!counts(o)) continue;
    std::size_t able = 0;
    for (const std::string& g : study_.plan.groups) able += means_of_people(study_, o, g).size() >= kPeopleToCompare;
    n += able * (able - std::min<std::size_t>(able, 1)) / 2;
  }
  return std::max<std::size_t>(1, n);
}

void Analyst::compare_two(const Outcome& o, const std::string& first, const std::string& second,
                          std::vector<Json>& rows, std::vector<double>& p, sheet::Table& table,
                          std::set<std::string>& said) {
  const std::vector<double> a = means_of_people(study_, o, first), b = means_of_people(study_, o, second);
  if (a.size() < kPeopleToCompare || b.size() < kPeopleToCompare) {
    // Of the same two groups once, unless this outcome has others than the rest.
    const std::string why = first + " has " + counted(a.size(), "person", "people") + ", " + second + " " +
                            std::to_string(b.size()) + "; " + std::to_string(kPeopleToCompare) + " in each are needed.";
    if (said.insert(why).second)
      refuse("Comparison of " + first + " and " + second + ", wherever so few have a value", why);
    return;
  }
  const Welch w = welch(a, b, settings_.level);
  const MannWhitney u = mann_whitney(a, b);
  const bool named = !study_.plan.primary.empty();
  const Permutation exact =
      permutation_of_means(a, b, permutations(counts(o) ? family() : 1, named && counts(o), study_.plan.seed));
  const Estimate g = hedges_g(a, b, settings_.level), d = cliffs_delta(a, b, settings_.level);
  Json row{{"outcome", o.name},
           {"a", first},
           {"b", second},
           {"people_a", a.size()},
           {"people_b", b.size()},
           {"difference", w.difference},
           {"difference_interval", json_of(w.interval)},
           {"welch_t", w.t},
           {"welch_df", w.df},
           {"welch_p", w.p},
           {"mann_whitney_u", u.u},
           {"mann_whitney_p", u.p},
           {"mann_whitney_exact", u.exact},
           {"primary", counts(o)},
           {"permutation_p", exact.p},
           {"permutation_exact", exact.exact},
           {"permutation_smallest_p", exact.smallest_p},
           {"hedges_g", json_of(g)},
           {"cliffs_delta", json_of(d)},
           {"mixed_model", mixed(o, first, second)}};
  rows.push_back(std::move(row));
  p.push_back(exact.p);
  table.rows.push_back({{o.name},
                        {first + " - " + second},
                        {std::to_string(a.size()) + ", " + std::to_string(b.size())},
                        {text(mean(a)) + ", " + text(mean(b))},
                        {with({w.difference, w.interval})},
                        {p_text(w.p)},
                        {p_text(exact.p)},
                        {""},
                        {with(g)},
                        {with(d)}});
  if (exact.smallest_p > 0.05 && said.insert(first + second + "few").second)
    say(first + " and " + second + ": so few people that no result whatever could give an exact p below " +
            text(exact.smallest_p, 2) + ".",
        Tone::caution);
  if (std::isnan(g.value))
    say(o.name + ", " + first + " and " + second +
            ": nobody differs within a group, so there is no effect size in standard deviations.",
        Tone::caution);
}

// Sessions as they are, people as a random effect: null where nobody comes twice.
Json Analyst::mixed(const Outcome& o, const std::string& first, const std::string& second) const {
  const std::vector<int> people = people_of(o);
  std::vector<double> y, design;
  std::vector<int> person;
  for (std::size_t i = 0; i < o.values.size(); ++i) {
    const std::string& g = group_of(study_.sessions[o.session[i]]);
    if (g != first && g != second) continue;
    y.push_back(o.values[i]);
    design.insert(design.end(), {1, g == first ? 1.0 : 0.0});
    person.push_back(people[i]);
  }
  if (std::set<int>(person.begin(), person.end()).size() == person.size() || y.size() > 2000) return {};
  const MixedModel m = mixed_model(y, design, 2, person, settings_.level);
  const auto& c = m.coefficients[1];
  return Json{{"sessions", m.rows},
              {"difference", c.value},
              {"interval", json_of(c.interval)},
              {"df", c.df},
              {"t", c.t},
              {"p", c.p},
              {"variance_between_people", m.variance_people},
              {"variance_within_people", m.variance_error},
              {"icc", m.icc()}};
}

void Analyst::repeated_table() {
  sheet::Table table{{"outcome", "groups", "sessions", "difference", "df", "p", "share between people"}, {}, {}};
  bool at_edge = false;
  for (const Json& row : json_.find("comparisons")->items()) {
    const Json& m = *row.find("mixed_model");
    if (m.is_null()) continue;
    const auto value = [&](const char* key) { return m.find(key)->number().value_or(kUndefined); };
    const auto& ends = m.find("interval")->items();
    at_edge = at_edge || value("variance_between_people") == 0;
    Estimate e{value("difference"), {}};
    if (ends.size() == 2) e.interval = {*ends[0].number(), *ends[1].number()};
    table.rows.push_back({{*row.find("outcome")->text()},
                          {*row.find("a")->text() + " - " + *row.find("b")->text()},
                          {text(value("sessions"), 5)},
                          {with(e)},
                          {text(value("df"))},
                          {p_text(value("p"))},
                          {text(value("icc"), 2)}});
  }
  if (table.rows.empty()) return;
  say("People came several times. The same differences from single sessions, by a mixed model with a random intercept "
      "for each person "
      "(REML, Satterthwaite's degrees of freedom):");
  add(std::move(table));
  if (at_edge)
    say("Where the share between people is 0, the model takes sessions for people, and its p may be too small: go by "
        "the table of "
        "people.",
        Tone::caution);
}

}  // namespace osteo::inline assessment::study
