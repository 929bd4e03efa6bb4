#include "osteo/study/analysis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "osteo/base/param.h"
#include "osteo/statistics/compare.h"
#include "osteo/statistics/correlation.h"
#include "osteo/statistics/decide.h"
#include "osteo/statistics/repeated.h"
#include "outcomes.h"

namespace osteo::study {
namespace {

using namespace statistics;

// Below these nothing is computed, and the report says so.
constexpr std::size_t kPeopleToCompare = 3, kPeopleToCorrelate = 5, kPeopleForAMark = 5, kTargetsToAgree = 5;

std::string text(double v, int digits = 3) {
  if (!std::isfinite(v)) return "-";
  char out[40];
  std::snprintf(out, sizeof out, "%.*g", digits, v);
  return out;
}
std::string p_text(double p) {
  return !std::isfinite(p) ? "-" : p < 0.0001 ? "< 0.0001" : text(p, 2);
}
std::string with(const Estimate& e) {
  return std::isfinite(e.interval.lo) ? text(e.value) + " (" + text(e.interval.lo) + " to " + text(e.interval.hi) + ")" : text(e.value);
}
std::string counted(std::size_t n, const std::string& one, const std::string& more) {
  return std::to_string(n) + " " + (n == 1 ? one : more);
}
Json json_of(const Interval& i) {
  return std::isfinite(i.lo) && std::isfinite(i.hi) ? Json{i.lo, i.hi} : Json();
}
Json json_of(const Estimate& e) {
  return Json{{"value", e.value}, {"interval", json_of(e.interval)}};
}
Json json_of(const Summary& s) {
  return Json{{"people", s.n}, {"mean", s.mean}, {"sd", s.sd},       {"median", s.median},
              {"q1", s.q1},    {"q3", s.q3},     {"least", s.least}, {"most", s.most}};
}

class Analyst {
 public:
  Analyst(const Study& study, const AnalysisSettings& settings)
      : study_(study),
        settings_(settings),
        outcomes_(outcomes_of(study)),
        resampling_{settings.resamples, settings.level, study.plan.seed} {}

  Analysis run() {
    check();
    opening();
    agreement();
    compare();
    correlate();
    decide();
    power();
    closing();
    json_["refused"] = refused_;
    return {std::move(json_), std::move(sheet_)};
  }

 private:
  const Study& study_;
  const AnalysisSettings& settings_;
  std::vector<Outcome> outcomes_;
  Resampling resampling_;
  Json json_;
  Json refused_ = Json::list();
  Sheet sheet_;

  void add(auto block) { sheet_.blocks.push_back({std::move(block)}); }
  void say(const std::string& words, Tone tone = Tone::plain) { add(sheet::Paragraph{words, tone}); }
  void refuse(const std::string& what, const std::string& why) {
    refused_.push_back({{"what", what}, {"why", why}});
    say(what + ": not computed. " + why, Tone::caution);
  }
  [[nodiscard]] const std::string& group_of(const Session& s) const {
    return std::find_if(study_.participants.begin(), study_.participants.end(),
                        [&](const Participant& p) { return p.code == s.participant; })
        ->group;
  }
  [[nodiscard]] std::vector<int> people_of(const Outcome& o) const {
    std::map<std::string, int> number;
    for (const Participant& p : study_.participants) number.emplace(p.code, static_cast<int>(number.size()));
    std::vector<int> people;
    for (const std::size_t s : o.session) people.push_back(number.at(study_.sessions[s].participant));
    return people;
  }

  void check() const {
    if (study_.participants.empty())
      throw Error(ExitCode::no_input, "the study has no participants", "add them with: osteo study add STUDY --group GROUP");
    if (study_.sessions.empty())
      throw Error(ExitCode::no_input, "the study has no sessions",
                  "add them with: osteo study add STUDY metrics.json --participant CODE --case-name CASE");
  }

  void opening() {
    const Plan& p = study_.plan;
    sheet_.title = p.title.empty() ? "Study" : p.title;
    sheet_.code = std::to_string(study_.participants.size()) + " people";
    sheet_.footer = "Osteotome. Definitions, sources and limits of every number: docs/study.md";
    sheet_.pages = 3;
    std::map<std::string, std::set<std::string>> seen;
    for (const Session& s : study_.sessions) seen[group_of(s)].insert(s.participant);
    Json people = Json::object();
    std::string words;
    for (const std::string& g : p.groups) {
      const auto all = static_cast<std::size_t>(
          std::count_if(study_.participants.begin(), study_.participants.end(), [&](const Participant& q) { return q.group == g; }));
      people[g] = Json{{"participants", all}, {"with_sessions", seen[g].size()}};
      words += (words.empty() ? "" : ", ") + g + " " + std::to_string(seen[g].size()) +
               (seen[g].size() == all ? "" : " (of " + std::to_string(all) + ")");
    }
    Json raters = Json::list();
    for (const RaterSheet& r : study_.raters) raters.push_back(r.rater);
    json_ = Json{{"osteotome_study_analysis", 1},   {"title", p.title}, {"procedure", p.procedure},           {"seed", p.seed},
                 {"level", settings_.level},        {"people", people}, {"sessions", study_.sessions.size()}, {"raters", raters},
                 {"resamples", settings_.resamples}};
    add(sheet::Facts{{{"Procedure", p.procedure.empty() ? "not named" : p.procedure},
                      {"People with sessions", words},
                      {"Sessions", std::to_string(study_.sessions.size())},
                      {"Raters", std::to_string(study_.raters.size())},
                      {"Meant to pass", p.competent},
                      {"Intervals", text(100 * settings_.level) + " %, resamples " + std::to_string(settings_.resamples) + ", seed " +
                                        std::to_string(p.seed)}},
                     2});
    // What is missing is told before anything is made of the rest.
    Json missing = Json::list();
    for (const Outcome& o : outcomes_) {
      const std::size_t without = study_.sessions.size() - o.values.size();
      if (without == 0) continue;
      missing.push_back({{"outcome", o.name}, {"sessions_without", without}});
      say(o.name + ": " + std::to_string(without) + " of " + counted(study_.sessions.size(), "session has", "sessions have") +
              " no value and " + (without == 1 ? "is" : "are") + " left out of it.",
          Tone::caution);
    }
    json_["missing"] = missing;
  }

  void agreement() {
    json_["agreement"] = Json::object();
    add(sheet::Heading{"Do raters agree?"});
    if (study_.raters.size() < 2) {
      refuse("Agreement", study_.raters.empty() ? "There are no ratings." : "There is one rater: nobody to agree with.");
      return;
    }
    std::vector<double> categories;
    for (int v = study_.plan.lowest; v <= study_.plan.highest; ++v) categories.push_back(v);
    sheet::Table table{{"item", "sessions", "same, %", "kappa", "weighted kappa", "AC1", "ICC(A,1)", "ICC(A,k)", "ICC(C,1)"},
                       {},
                       {16, 8, 7, 7, 8, 16, 16, 16, 16}};
    for (const std::string& item : study_.plan.items) {
      const Ratings r = ratings_of(study_, item);
      const CategoryAgreement c = category_agreement(r, categories, settings_.level);
      if (c.targets < kTargetsToAgree) {
        refuse("Agreement on " + item, counted(c.targets, "session was", "sessions were") + " rated twice or more; " +
                                           std::to_string(kTargetsToAgree) + " are needed.");
        continue;
      }
      const Icc i = icc(r, settings_.level);
      json_["agreement"][item] = Json{{"sessions_rated_twice", c.targets},
                                      {"percent", c.percent},
                                      {"kappa", c.kappa},
                                      {"kappa_linear", c.kappa_linear},
                                      {"kappa_quadratic", c.kappa_quadratic},
                                      {"pairs_of_raters_without_kappa", c.pairs_without_kappa},
                                      {"ac1", json_of(c.ac1)},
                                      {"icc_sessions", i.targets},
                                      {"icc_sessions_left_out", i.left_out},
                                      {"icc_1_1", json_of(i.one_1)},
                                      {"icc_1_k", json_of(i.one_k)},
                                      {"icc_a_1", json_of(i.a_1)},
                                      {"icc_a_k", json_of(i.a_k)},
                                      {"icc_c_1", json_of(i.c_1)},
                                      {"icc_c_k", json_of(i.c_k)}};
      table.rows.push_back({{item},
                            {std::to_string(c.targets)},
                            {text(c.percent)},
                            {text(c.kappa)},
                            {text(c.kappa_quadratic)},
                            {with(c.ac1)},
                            {with(i.a_1)},
                            {with(i.a_k)},
                            {with(i.c_1)}});
      if (std::isnan(c.kappa)) say(item + ": kappa is not defined, since raters gave one value throughout.", Tone::caution);
      if (std::isnan(i.a_1.value))
        say(item + ": no intraclass correlation, since ratings do not vary or no two sessions were rated by all.", Tone::caution);
      if (i.left_out > 0)
        say(item + ": intraclass correlations leave out " + counted(i.left_out, "session", "sessions") + " not rated by all.", Tone::quiet);
    }
    if (table.rows.empty()) return;
    add(std::move(table));
    say("Kappas are means over pairs of raters; weighted: quadratic. A: agreement, C: consistency; 1: one rater, k: the mean of all.",
        Tone::quiet);
  }

  void compare() {
    json_["comparisons"] = Json::list();
    add(sheet::Heading{"Do groups differ?"});
    if (study_.plan.groups.size() < 2) {
      refuse("Comparison", "There is one group.");
      return;
    }
    sheet::Table table{
        {"outcome", "groups", "people", "means", "difference", "p (Welch)", "p (exact)", "Holm", "Hedges g", "Cliff's delta"},
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
        for (std::size_t j = 0; j < i; ++j) compare_two(o, study_.plan.groups[i], study_.plan.groups[j], rows, p, table, said);
      }
    }
    json_["groups"] = groups;
    const std::vector<double> adjusted = holm(p);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i]["p_holm"] = adjusted[i];
      table.rows[i][7].text = p_text(adjusted[i]);
      json_["comparisons"].push_back(rows[i]);
    }
    if (rows.empty()) return;
    add(std::move(table));
    say("One value a person: the mean of that person's sessions. p (exact): of the difference of means, by exchanging people between "
        "groups. "
        "Holm: the latter, for all rows of this table together.",
        Tone::quiet);
    repeated_table();
  }

  void compare_two(const Outcome& o, const std::string& first, const std::string& second, std::vector<Json>& rows, std::vector<double>& p,
                   sheet::Table& table, std::set<std::string>& said) {
    const std::vector<double> a = means_of_people(study_, o, first), b = means_of_people(study_, o, second);
    if (a.size() < kPeopleToCompare || b.size() < kPeopleToCompare) {
      // Of the same two groups once, unless this outcome has others than the rest.
      const std::string why = first + " has " + counted(a.size(), "person", "people") + ", " + second + " " + std::to_string(b.size()) +
                              "; " + std::to_string(kPeopleToCompare) + " in each are needed.";
      if (said.insert(why).second) refuse("Comparison of " + first + " and " + second + ", wherever so few have a value", why);
      return;
    }
    const Welch w = welch(a, b, settings_.level);
    const MannWhitney u = mann_whitney(a, b);
    const Permutation exact = permutation_of_means(a, b, {200000, 20000, study_.plan.seed});
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
      say(first + " and " + second + ": so few people that no result whatever could give an exact p below " + text(exact.smallest_p, 2) +
              ".",
          Tone::caution);
    if (std::isnan(g.value))
      say(o.name + ", " + first + " and " + second + ": nobody differs within a group, so there is no effect size in standard deviations.",
          Tone::caution);
  }

  // Sessions as they are, people as a random effect: null where nobody comes twice.
  Json mixed(const Outcome& o, const std::string& first, const std::string& second) const {
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

  void repeated_table() {
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
    say("People came several times. The same differences from single sessions, by a mixed model with a random intercept for each person "
        "(REML, Satterthwaite's degrees of freedom):");
    add(std::move(table));
    if (at_edge)
      say("Where the share between people is 0, the model takes sessions for people, and its p may be too small: go by the table of "
          "people.",
          Tone::caution);
  }

  void correlate() {
    json_["correlations"] = Json::list();
    add(sheet::Heading{"Do metrics follow the ratings?"});
    const Outcome* rating = nullptr;
    for (const Outcome& o : outcomes_) rating = o.rating ? &o : rating;
    if (rating == nullptr || study_.metrics.empty()) {
      refuse("Correlation", rating == nullptr ? "There are no ratings." : "There are no metrics.");
      return;
    }
    sheet::Table table{{"metric", "sessions", "people", "Pearson r", "R squared", "Spearman rho"}, {}, {}};
    const std::vector<int> raters_people = people_of(*rating);
    for (const Outcome& o : outcomes_) {
      if (o.rating) continue;
      std::vector<double> x, y;
      std::vector<int> person;
      for (std::size_t i = 0, j = 0; i < o.session.size(); ++i) {
        while (j < rating->session.size() && rating->session[j] < o.session[i]) ++j;
        if (j == rating->session.size()) break;
        if (rating->session[j] != o.session[i]) continue;
        x.push_back(o.values[i]);
        y.push_back(rating->values[j]);
        person.push_back(raters_people[j]);
      }
      const std::size_t people = std::set<int>(person.begin(), person.end()).size();
      if (people < kPeopleToCorrelate) {
        refuse("Correlation of " + o.name, counted(people, "person has", "people have") + " both metric and rating; " +
                                               std::to_string(kPeopleToCorrelate) + " are needed.");
        continue;
      }
      const CorrelationByPeople c = correlation_by_people(x, y, person, resampling_);
      if (std::isnan(c.pearson.r)) {
        refuse("Correlation of " + o.name, "Metric or rating never varies.");
        continue;
      }
      json_["correlations"].push_back({{"metric", o.name},
                                       {"with", rating->name},
                                       {"sessions", c.pairs},
                                       {"people", c.people},
                                       {"pearson", Json{{"value", c.pearson.r}, {"interval", json_of(c.pearson_by_people.interval)}}},
                                       {"r_squared", c.pearson.r * c.pearson.r},
                                       {"spearman", Json{{"value", c.spearman.r}, {"interval", json_of(c.spearman_by_people.interval)}}},
                                       {"resamples_left_out", c.pearson_by_people.left_out}});
      table.rows.push_back({{o.name},
                            {std::to_string(c.pairs)},
                            {std::to_string(c.people)},
                            {with({c.pearson.r, c.pearson_by_people.interval})},
                            {text(c.pearson.r * c.pearson.r, 2)},
                            {with({c.spearman.r, c.spearman_by_people.interval})}});
    }
    if (table.rows.empty()) return;
    add(std::move(table));
    say("With " + rating->name + "; intervals by drawing people, with all their sessions.", Tone::quiet);
  }

  void decide() {
    json_["roc"] = Json::list();
    json_["pass_marks"] = Json::list();
    add(sheet::Heading{"Can a value tell who is " + study_.plan.competent + "?"});
    if (study_.plan.groups.size() < 2) {
      refuse("ROC and pass mark", "There is one group.");
      return;
    }
    sheet::Table table{
        {"outcome", "people", "area under ROC", "pass mark", "fail though " + study_.plan.competent, "pass though other"}, {}, {}};
    std::set<std::string> said;
    for (const Outcome& o : outcomes_) {
      const std::vector<double> able = means_of_people(study_, o, study_.plan.competent);
      std::vector<double> others;
      for (const std::string& g : study_.plan.groups) {
        if (g == study_.plan.competent) continue;
        const std::vector<double> more = means_of_people(study_, o, g);
        others.insert(others.end(), more.begin(), more.end());
      }
      const std::string sizes =
          study_.plan.competent + " has " + counted(able.size(), "person", "people") + ", others " + std::to_string(others.size());
      if (able.size() < kPeopleToCompare || others.size() < kPeopleToCompare) {
        if (said.insert(sizes).second)
          refuse("ROC and pass marks, wherever so few have a value", sizes + "; " + std::to_string(kPeopleToCompare) + " each are needed.");
        continue;
      }
      const Roc r = roc(able, others, settings_.level);
      Json curve = Json::list();
      for (const auto& p : r.curve)
        curve.push_back({{"at_least", p.threshold}, {"true_positive", p.true_positive}, {"false_positive", p.false_positive}});
      json_["roc"].push_back({{"outcome", o.name},
                              {"positive", study_.plan.competent},
                              {"area", json_of(r.area)},
                              {"standard_error", r.standard_error},
                              {"best_threshold", r.best.threshold},
                              {"curve", curve}});
      std::vector<sheet::Cell> row{
          {o.name}, {std::to_string(able.size()) + ", " + std::to_string(others.size())}, {with(r.area)}, {"-"}, {"-"}, {"-"}};
      if (able.size() < kPeopleForAMark || others.size() < kPeopleForAMark) {
        if (said.insert("mark" + sizes).second)
          refuse("Pass marks, wherever so few have a value", sizes + "; " + std::to_string(kPeopleForAMark) + " each are needed.");
      } else {
        const PassMark m = contrasting_groups(able, others, resampling_);
        if (std::isnan(m.mark.value)) {
          refuse("Pass mark (" + o.name + ")", "The curves of both groups do not cross between their means.");
        } else {
          json_["pass_marks"].push_back({{"outcome", o.name},
                                         {"mark", json_of(m.mark)},
                                         {"higher_is_better", m.higher_is_better},
                                         {"competent_fail", m.competent_fail_counted},
                                         {"competent_fail_fitted", m.competent_fail_fitted},
                                         {"others_pass", m.other_pass_counted},
                                         {"others_pass_fitted", m.other_pass_fitted}});
          row[3].text = (m.higher_is_better ? "at least " : "at most ") + with(m.mark);
          row[4].text = text(100 * m.competent_fail_counted, 2) + " % (fitted " + text(100 * m.competent_fail_fitted, 2) + " %)";
          row[5].text = text(100 * m.other_pass_counted, 2) + " % (fitted " + text(100 * m.other_pass_fitted, 2) + " %)";
        }
      }
      table.rows.push_back(std::move(row));
    }
    if (table.rows.empty()) return;
    add(std::move(table));
    say("An area below a half: " + study_.plan.competent +
            " have the smaller values. Marks and areas were found on the very people they are told for; others will do worse.",
        Tone::quiet);
  }

  void power() {
    json_["power"] = Json::list();
    add(sheet::Heading{"What could be found with so few?"});
    for (std::size_t i = 0; i < study_.plan.groups.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const std::string &first = study_.plan.groups[i], &second = study_.plan.groups[j];
        std::map<std::string, std::set<std::string>> seen;
        for (const Session& s : study_.sessions) seen[group_of(s)].insert(s.participant);
        const std::size_t a = seen[first].size(), b = seen[second].size();
        if (a < 2 || b < 2) {
          refuse("Power for " + first + " and " + second, "Each group needs two people with sessions.");
          continue;
        }
        PowerSettings s;
        s.seed = study_.plan.seed;
        s.draws = 2000;
        const double effect = detectable_effect(a, b, 0.8, s);
        json_["power"].push_back({{"a", first},
                                  {"b", second},
                                  {"people_a", a},
                                  {"people_b", b},
                                  {"power", 0.8},
                                  {"alpha", s.alpha},
                                  {"detectable_effect", effect}});
        say(first + " and " + second + " (" + std::to_string(a) + ", " + std::to_string(b) + " people): " +
            (std::isnan(effect) ? "no difference, however large, is found four times out of five."
                                : "a difference of " + text(effect, 2) +
                                      " standard deviations of people is found four times out of five (Welch's test at 0.05, simulated). "
                                      "Smaller ones are more likely missed, and their absence is not shown."));
      }
    }
    if (study_.plan.groups.size() < 2) refuse("Power", "There is one group.");
  }

  void closing() {
    Json limits = Json::list();
    add(sheet::Heading{"What may not be concluded"});
    for (const char* const words :
         {"That two groups are equal, because a difference is not significant.",
          "That whoever passes may operate: groups of unlike experience differ in much besides skill, and a pass mark is only as good as "
          "those groups.",
          "That a metric measures skill, because it correlates with ratings here: both may follow time or experience.",
          "Anything about people, if sessions were simulated.",
          "Anything from one of many rows picked afterwards: the question belongs into the plan before the first session."}) {
      limits.push_back(words);
      say(words);
    }
    json_["may_not_be_concluded"] = limits;
  }
};

}  // namespace

Analysis analyse(const Study& study, const AnalysisSettings& settings) {
  if (!(settings.level > 0 && settings.level < 1)) throw Error(ExitCode::usage, "the level of intervals lies between 0 and 1");
  if (settings.resamples < 100) throw Error(ExitCode::usage, "a bootstrap of fewer than 100 resamples says nothing");
  return Analyst(study, settings).run();
}

}  // namespace osteo::study
