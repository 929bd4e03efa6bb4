#include "analyst.h"
#include "charts.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/decide.h"

namespace osteo::inline assessment::study {

Analysis Analyst::run() {
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

void Analyst::add_charts(std::vector<sheet::Plot> charts, const std::string& legend) {
  if (charts.empty()) return;
  for (SheetBlock& row : in_rows(std::move(charts))) sheet_.blocks.push_back(std::move(row));
  say(legend, Tone::quiet);
}

void Analyst::check() const {
  if (study_.participants.empty())
    throw Error(ExitCode::no_input, "the study has no participants",
                "add them with: osteo study add STUDY --group GROUP");
  if (study_.sessions.empty())
    throw Error(ExitCode::no_input, "the study has no sessions",
                "add them with: osteo study add STUDY metrics.json --participant CODE --case-name CASE");
}

void Analyst::opening() {
  const Plan& p = study_.plan;
  sheet_.title = p.title.empty() ? "Study" : p.title;
  sheet_.code = std::to_string(study_.participants.size()) + " people";
  sheet_.footer = "Osteotome. Definitions, sources and limits of every number: docs/study.md";
  sheet_.pages = 5;
  if (p.simulated) {
    sheet_.title = "SIMULATED: " + sheet_.title;
    sheet_.footer = "Simulated sessions and ratings: nothing here is about people. " + sheet_.footer;
    add(sheet::Band{"Simulated",
                    "Programs drilled these sessions and gave these ratings, from skills that were drawn for them. It "
                    "shows that the "
                    "chain from session to report works, and nothing about people.",
                    Tone::caution});
  }
  std::map<std::string, std::set<std::string>> seen;
  for (const Session& s : study_.sessions) seen[group_of(s)].insert(s.participant);
  Json people = Json::object();
  std::string words;
  for (const std::string& g : p.groups) {
    const auto all = static_cast<std::size_t>(std::count_if(study_.participants.begin(), study_.participants.end(),
                                                            [&](const Participant& q) { return q.group == g; }));
    people[g] = Json{{"participants", all}, {"with_sessions", seen[g].size()}};
    words += (words.empty() ? "" : ", ") + g + " " + std::to_string(seen[g].size()) +
             (seen[g].size() == all ? "" : " (of " + std::to_string(all) + ")");
  }
  Json raters = Json::list();
  for (const RaterSheet& r : study_.raters) raters.push_back(r.rater);
  json_ = Json{{"osteotome_study_analysis", 1},      {"title", p.title},
               {"procedure", p.procedure},           {"seed", p.seed},
               {"level", settings_.level},           {"people", people},
               {"sessions", study_.sessions.size()}, {"raters", raters},
               {"resamples", settings_.resamples},   {"simulated", p.simulated}};
  add(sheet::Facts{{{"Procedure", p.procedure.empty() ? "not named" : p.procedure},
                    {"People with sessions", words},
                    {"Sessions", std::to_string(study_.sessions.size())},
                    {"Raters", std::to_string(study_.raters.size())},
                    {"Meant to pass", p.competent},
                    {"Intervals", text(100 * settings_.level) + " %, resamples " + std::to_string(settings_.resamples) +
                                      ", seed " + std::to_string(p.seed)}},
                   2});
  // What is missing is told before anything is made of the rest.
  Json missing = Json::list();
  for (const Outcome& o : outcomes_) {
    const std::size_t without = study_.sessions.size() - o.values.size();
    if (without == 0) continue;
    missing.push_back({{"outcome", o.name}, {"sessions_without", without}});
    say(o.name + ": " + std::to_string(without) + " of " +
            counted(study_.sessions.size(), "session has", "sessions have") + " no value and " +
            (without == 1 ? "is" : "are") + " left out of it.",
        Tone::caution);
  }
  json_["missing"] = missing;
}

void Analyst::power() {
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
                                    " standard deviations of people is found four times out of five (Welch's test at "
                                    "0.05, simulated). "
                                    "Smaller ones are more likely missed, and their absence is not shown."));
    }
  }
  if (study_.plan.groups.size() < 2) refuse("Power", "There is one group.");
}

void Analyst::closing() {
  Json limits = Json::list();
  add(sheet::Heading{"What may not be concluded"});
  for (const char* const words :
       {"That two groups are equal, because a difference is not significant.",
        "That whoever passes may operate: groups of unlike experience differ in much besides skill, and a pass mark is "
        "only as good as "
        "those groups.",
        "That a metric measures skill, because it correlates with ratings here: both may follow time or experience.",
        "Anything about people, if sessions were simulated.",
        "Anything from one of many rows picked afterwards: the question belongs into the plan before the first "
        "session."}) {
    limits.push_back(words);
    say(words);
  }
  json_["may_not_be_concluded"] = limits;
}

Analysis analyse(const Study& study, const AnalysisSettings& settings) {
  if (!(settings.level > 0 && settings.level < 1))
    throw Error(ExitCode::usage, "the level of intervals lies between 0 and 1");
  if (settings.resamples < 100) throw Error(ExitCode::usage, "a bootstrap of fewer than 100 resamples says nothing");
  for (const std::string& g : settings.given) {
    if (std::find(study.metrics.begin(), study.metrics.end(), g) != study.metrics.end()) continue;
    const std::string near = nearest_name(g, study.metrics);
    throw Error(ExitCode::usage, "'" + g + "' is no metric of this study",
                near.empty() ? "sessions.csv has one a column" : "did you mean '" + near + "'?");
  }
  return Analyst(study, settings).run();
}

}  // namespace osteo::inline assessment::study
