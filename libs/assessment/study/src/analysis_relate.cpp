// Do raters agree, do metrics follow them, and can a value tell who is who?
#include "analyst.h"
#include "charts.h"
#include "osteo/core/statistics/compare.h"
#include "osteo/core/statistics/curves.h"

namespace osteo::inline assessment::study {

void Analyst::agreement() {
  json_["agreement"] = Json::object();
  add(sheet::Heading{"Do raters agree?"});
  if (study_.raters.size() < 2) {
    refuse("Agreement", study_.raters.empty() ? "There are no ratings." : "There is one rater: nobody to agree with.");
    return;
  }
  std::vector<double> categories;
  for (int v = study_.plan.lowest; v <= study_.plan.highest; ++v) categories.push_back(v);
  sheet::Table table{
      {"item", "sessions", "same, %", "kappa", "weighted kappa", "AC1", "ICC(A,1)", "ICC(A,k)", "ICC(C,1)"},
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
    if (std::isnan(c.kappa))
      say(item + ": kappa is not defined, since raters gave one value throughout.", Tone::caution);
    if (std::isnan(i.a_1.value))
      say(item + ": no intraclass correlation, since ratings do not vary or no two sessions were rated by all.",
          Tone::caution);
    if (i.left_out > 0)
      say(item + ": intraclass correlations leave out " + counted(i.left_out, "session", "sessions") +
              " not rated by all.",
          Tone::quiet);
  }
  if (table.rows.empty()) return;
  add(std::move(table));
  say("Kappas are means over pairs of raters; weighted: quadratic. A: agreement, C: consistency; 1: one rater, k: the "
      "mean of all.",
      Tone::quiet);
  std::vector<sheet::Plot> charts;
  for (const std::string& item : study_.plan.items) {
    const Ratings r = ratings_of(study_, item);
    for (std::size_t i = 0; i < r.raters(); ++i) {
      for (std::size_t j = i + 1; j < r.raters(); ++j) {
        std::vector<double> first, second;
        for (std::size_t t = 0; t < r.targets(); ++t) {
          if (!r.at(t, i) || !r.at(t, j)) continue;
          first.push_back(*r.at(t, i));
          second.push_back(*r.at(t, j));
        }
        if (first.size() < kTargetsToAgree || charts.size() >= 4) continue;
        charts.push_back(agreement_chart("agreement-" + std::to_string(charts.size() + 1),
                                         item + ": " + study_.raters[i].rater + " and " + study_.raters[j].rater, first,
                                         second));
      }
    }
  }
  add_charts(std::move(charts),
             "Each dot a session (equal ones side by side); red: mean difference and limits of agreement (1.96 SD).");
}

// The correlation without what the metrics given explain of both, of sessions that have all of them.
void Analyst::hold(const Outcome& metric, const Outcome& rating, std::vector<sheet::Cell>& row) {
  Json& j = json_["correlations"].back();
  j["given"] = Json(settings_.given);
  std::vector<double> x, y;
  std::vector<std::vector<double>> given(settings_.given.size());
  for (std::size_t i = 0; i < metric.session.size(); ++i) {
    const auto rated = std::find(rating.session.begin(), rating.session.end(), metric.session[i]);
    if (rated == rating.session.end()) continue;
    const auto& has = study_.sessions[metric.session[i]].metrics;
    if (!std::all_of(settings_.given.begin(), settings_.given.end(),
                     [&](const std::string& g) { return has.contains(g); }))
      continue;
    x.push_back(metric.values[i]);
    y.push_back(rating.values[static_cast<std::size_t>(rated - rating.session.begin())]);
    for (std::size_t g = 0; g < given.size(); ++g) given[g].push_back(has.at(settings_.given[g]));
  }
  const Correlation p = partial_pearson(x, y, given, settings_.level),
                    s = partial_spearman(x, y, given, settings_.level);
  const auto reported = [](const Correlation& c) {
    return Json{{"value", c.r}, {"p", c.p}, {"interval", json_of(c.interval)}};
  };
  j["sessions_with_all"] = x.size();
  j["partial_pearson"] = reported(p);
  j["partial_spearman"] = reported(s);
  if (std::isnan(p.r))
    refuse("Partial correlation of " + metric.name,
           std::find(settings_.given.begin(), settings_.given.end(), metric.name) != settings_.given.end()
               ? "It is among what is held."
               : counted(x.size(), "session has", "sessions have") +
                     " all of it, or what is held leaves nothing, or follows from each other.");
  row.insert(row.end(), {{std::to_string(x.size())}, {with({p.r, p.interval})}, {with({s.r, s.interval})}});
}

void Analyst::correlate() {
  json_["correlations"] = Json::list();
  add(sheet::Heading{"Do metrics follow the ratings?"});
  const Outcome* rating = nullptr;
  for (const Outcome& o : outcomes_) rating = o.rating ? &o : rating;
  if (rating == nullptr || study_.metrics.empty()) {
    refuse("Correlation", rating == nullptr ? "There are no ratings." : "There are no metrics.");
    return;
  }
  const bool holds = !settings_.given.empty();
  sheet::Table table{{"metric", "sessions", "people", "Pearson r", "R squared", "Spearman rho"}, {}, {}};
  if (holds) table.head.insert(table.head.end(), {"sessions, held", "r, held", "rho, held"});
  const std::vector<int> raters_people = people_of(*rating);
  std::vector<sheet::Plot> charts;
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
    std::vector<bool> able;
    for (std::size_t i = 0; i < o.session.size() && able.size() < x.size(); ++i)
      if (std::find(rating->session.begin(), rating->session.end(), o.session[i]) != rating->session.end())
        able.push_back(group_of(study_.sessions[o.session[i]]) == study_.plan.competent);
    if (std::isnan(c.pearson.r)) {
      refuse("Correlation of " + o.name, "Metric or rating never varies.");
      continue;
    }
    json_["correlations"].push_back(
        {{"metric", o.name},
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
    if (holds) hold(o, *rating, table.rows.back());
    if (charts.size() < kMaxCharts)
      charts.push_back(scatter_chart("scatter-" + std::to_string(charts.size() + 1), o.name, rating->name, x, y, able,
                                     settings_.level));
  }
  if (table.rows.empty()) return;
  add(std::move(table));
  say("With " + rating->name + "; intervals by drawing people, with all their sessions.", Tone::quiet);
  if (holds) {
    std::string names;
    for (const std::string& g : settings_.given) names += (names.empty() ? "" : ", ") + g;
    say("Held (partial correlation, by straight lines): " + names +
            ". Intervals by Fisher's transformation, as if sessions knew nothing of each other: too narrow where "
            "people come several "
            "times.",
        Tone::quiet);
  }
  add_charts(std::move(charts), "Full dots: sessions of " + study_.plan.competent +
                                    ", hollow ones: of others. Red: least squares; the band is the line's t interval "
                                    "as if sessions knew nothing of "
                                    "each other, so too narrow where people come several times.");
}

void Analyst::decide() {
  json_["roc"] = Json::list();
  json_["pass_marks"] = Json::list();
  add(sheet::Heading{"Can a value tell who is " + study_.plan.competent + "?"});
  if (study_.plan.groups.size() < 2) {
    refuse("ROC and pass mark", "There is one group.");
    return;
  }
  sheet::Table table{
      {"outcome", "people", "area under ROC", "pass mark", "fail though " + study_.plan.competent, "pass though other"},
      {},
      {}};
  std::set<std::string> said;
  std::vector<sheet::Plot> charts;
  for (const Outcome& o : outcomes_) {
    const std::vector<double> able = means_of_people(study_, o, study_.plan.competent);
    std::vector<double> others;
    for (const std::string& g : study_.plan.groups) {
      if (g == study_.plan.competent) continue;
      const std::vector<double> more = means_of_people(study_, o, g);
      others.insert(others.end(), more.begin(), more.end());
    }
    const std::string sizes = study_.plan.competent + " has " + counted(able.size(), "person", "people") + ", others " +
                              std::to_string(others.size());
    if (able.size() < kPeopleToCompare || others.size() < kPeopleToCompare) {
      if (said.insert(sizes).second)
        refuse("ROC and pass marks, wherever so few have a value",
               sizes + "; " + std::to_string(kPeopleToCompare) + " each are needed.");
      continue;
    }
    const Roc r = roc(able, others, settings_.level);
    Json curve = Json::list();
    for (const auto& p : r.curve)
      curve.push_back(
          {{"at_least", p.threshold}, {"true_positive", p.true_positive}, {"false_positive", p.false_positive}});
    json_["roc"].push_back({{"outcome", o.name},
                            {"positive", study_.plan.competent},
                            {"area", json_of(r.area)},
                            {"standard_error", r.standard_error},
                            {"best_threshold", r.best.threshold},
                            {"curve", curve}});
    std::vector<sheet::Cell> row{{o.name},       {std::to_string(able.size()) + ", " + std::to_string(others.size())},
                                 {with(r.area)}, {"-"},
                                 {"-"},          {"-"}};
    if (able.size() < kPeopleForAMark || others.size() < kPeopleForAMark) {
      if (said.insert("mark" + sizes).second)
        refuse("Pass marks, wherever so few have a value",
               sizes + "; " + std::to_string(kPeopleForAMark) + " each are needed.");
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
        row[4].text =
            text(100 * m.competent_fail_counted, 2) + " % (fitted " + text(100 * m.competent_fail_fitted, 2) + " %)";
        row[5].text = text(100 * m.other_pass_counted, 2) + " % (fitted " + text(100 * m.other_pass_fitted, 2) + " %)";
      }
    }
    table.rows.push_back(std::move(row));
    if (charts.size() < kMaxCharts)
      charts.push_back(roc_chart("roc-" + std::to_string(charts.size() + 1), o.name + ": " + with(r.area), r));
  }
  if (table.rows.empty()) return;
  add(std::move(table));
  add_charts(std::move(charts), "The dot: the threshold with the most true less false positives (Youden).");
  say("An area below a half: " + study_.plan.competent +
          " have the smaller values. Marks and areas were found on the very people they are given for; others will do "
          "worse.",
      Tone::quiet);
}

}  // namespace osteo::inline assessment::study
