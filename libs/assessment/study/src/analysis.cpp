#include "analyst.h"
#include "charts.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/compare.h"

namespace osteo::inline assessment::study {

Analysis Analyst::run() {
  check();
  opening();
  primary();
  sources();
  agreement();
  compare();
  correlate();
  decide();
  power();
  not_found();
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
  sheet_.footer = "Osteotome. Definitions, sources and limits of every number: docs/guides/study.md";
  sheet_.pages = 5;
  // By a hand in sessions.csv too.
  const bool simulated = p.simulated || std::any_of(study_.sessions.begin(), study_.sessions.end(),
                                                    [](const Session& s) { return s.source.simulated; });
  if (simulated) {
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
               {"resamples", settings_.resamples},   {"simulated", simulated}};
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
  // A session that one rater left out still has a value, of the others.
  Json by_rater = Json::list();
  const std::size_t all = study_.sessions.size() * p.items.size();
  for (const RaterSheet& r : study_.raters) {
    std::size_t given = 0;
    for (const Session& s : study_.sessions) {
      const auto sheet = r.sessions.find(s.blind);
      if (sheet == r.sessions.end()) continue;
      for (const auto& [item, value] : sheet->second) given += value ? 1 : 0;
    }
    by_rater.push_back({{"rater", r.rater}, {"given", given}, {"of", all}});
    if (given < all)
      say(r.rater + ": " + std::to_string(all - given) + " of " + counted(all, "rating", "ratings") +
              " were not given; agreement is of what more than one rater gave.",
          Tone::caution);
  }
  json_["ratings"] = by_rater;
}

// What the study is about was to be said before it began.
void Analyst::primary() {
  const Plan& p = study_.plan;
  json_["primary"] = Json(p.primary);
  json_["primary_after"] = p.primary_after;
  std::string names;
  for (const std::string& n : p.primary) {
    names += (names.empty() ? "" : ", ") + n;
    if (std::none_of(outcomes_.begin(), outcomes_.end(), [&](const Outcome& o) { return o.name == n; }))
      refuse("Primary outcome " + n, "No session has a value of it.");
  }
  if (p.primary.empty()) {
    say("No primary outcome was named (osteo study plan): all outcomes are corrected together, and the more "
        "there are, the less can be found.",
        Tone::caution);
    return;
  }
  say("Primary outcomes: " + names + ". Only these are corrected together; all others are exploratory.");
  if (p.primary_after > 0)
    say("They were named when " + counted(static_cast<std::size_t>(p.primary_after), "session was", "sessions were") +
            " in the study already: who knew these may have chosen what came out.",
        Tone::caution);
}

// What the rows are of, and where they are not alike.
void Analyst::sources() {
  std::map<std::string, std::size_t> marks;
  std::set<std::string> procedures, versions;
  std::size_t unknown = 0;
  for (const Session& s : study_.sessions) {
    const Source& o = s.source;
    if (o.simulated) ++marks["simulated"];
    if (o.guided) ++marks["guided"];
    if (o.cut_short) ++marks["cut_short"];
    if (o.other_bone) ++marks["other_bone"];
    if (!o.known()) {
      ++unknown;
      continue;
    }
    procedures.insert(o.procedure.substr(0, o.procedure.find(' ')));
    versions.insert(o.recorded_by);
    versions.insert(o.scored_by);
  }
  json_["sources"] = Json{{"sessions", study_.sessions.size()},
                          {"unknown", unknown},
                          {"marks", Json(marks)},
                          {"procedures", procedures.size()},
                          {"versions", versions.size()}};
  const auto caution = [&](std::size_t n, const std::string& words) {
    if (n > 0) say(counted(n, "session", "sessions") + " " + words, Tone::caution);
  };
  caution(unknown,
          "came as bare numbers: on which bone, by which procedure and by whom they were drilled is not known.");
  if (!study_.plan.simulated) caution(marks["simulated"], "drilled by a program.");
  caution(marks["guided"], "guided by another hand.");
  caution(marks["cut_short"], "cut short, or with a part that is lost.");
  caution(marks["other_bone"], "on another bone than the rest of their case.");
  if (procedures.size() > 1)
    say("Sessions were scored by " + std::to_string(procedures.size()) +
            " different procedures: their items are different questions.",
        Tone::caution);
  if (versions.size() > 1)
    say("Sessions were recorded or scored by " + std::to_string(versions.size()) + " versions of the program.",
        Tone::caution);
}

PermutationSettings permutations(std::size_t comparisons, bool primary, std::uint64_t seed) {
  const double draws = 20 * static_cast<double>(comparisons) / kAlpha;
  return {static_cast<std::size_t>(primary ? kMaxWays : kMaxWaysOfMany),
          static_cast<int>(std::clamp(draws, 20000.0, 1e6)), seed};
}

std::vector<Reach> reach_of(const Study& study, std::size_t outcomes) {
  std::map<std::string, std::set<std::string>> seen;
  for (const Participant& p : study.participants) {
    if (study.sessions.empty() || std::any_of(study.sessions.begin(), study.sessions.end(),
                                              [&](const Session& s) { return s.participant == p.code; }))
      seen[p.group].insert(p.code);
  }
  std::vector<Reach> all;
  std::size_t pairs = 0;
  const auto& groups = study.plan.groups;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      all.push_back({groups[i], groups[j], seen[groups[i]].size(), seen[groups[j]].size()});
      pairs += all.back().people_a >= kPeopleToCompare && all.back().people_b >= kPeopleToCompare ? 1 : 0;
    }
  }
  const bool named = !study.plan.primary.empty();
  const std::size_t comparisons = std::max<std::size_t>(1, pairs * (named ? study.plan.primary.size() : outcomes));
  for (Reach& r : all) {
    r.comparisons = comparisons;
    r.alpha = kAlpha;
    r.power = kPower;
    r.detectable_effect = kUndefined;
    if (r.people_a < 2 || r.people_b < 2) continue;
    const PermutationSettings p = permutations(comparisons, named, 1);
    double ways = 1;
    for (std::size_t k = 1; k <= r.people_a; ++k) ways *= static_cast<double>(r.people_b + k) / static_cast<double>(k);
    r.smallest_p = std::min(1.0, 2 / (ways <= static_cast<double>(p.limit) ? std::round(ways) : p.draws + 1.0));
    const double level = r.alpha / static_cast<double>(comparisons);
    if (r.smallest_p > level) continue;
    PowerSettings s;
    s.seed = study.plan.seed;
    s.draws = 2000;
    s.alpha = level;
    r.detectable_effect = detectable_effect(r.people_a, r.people_b, r.power, s);
  }
  return all;
}

std::string reported(const Reach& r) {
  std::string words = r.a + " and " + r.b + " (" + std::to_string(r.people_a) + ", " + std::to_string(r.people_b) +
                      " people, " + counted(r.comparisons, "comparison", "comparisons") + " together): ";
  const double level = r.alpha / static_cast<double>(r.comparisons);
  if (r.people_a < 2 || r.people_b < 2) return words + "too few people for any comparison.";
  if (r.smallest_p > level)
    return words + "nothing can be found, however large the difference: people who do not overlap at all give p = " +
           p_text(r.smallest_p) + ", and the first of " + std::to_string(r.comparisons) + " needs " + p_text(level) +
           ".";
  if (std::isnan(r.detectable_effect)) return words + "no difference, however large, is found four times out of five.";
  return words + "a difference of " + text(r.detectable_effect, 2) +
         " standard deviations of people is found four times out of five (Welch's test at " + p_text(level) +
         (r.comparisons > 1 ? ", which is 0.05 for all comparisons together" : "") +
         ", simulated). Smaller ones are more likely missed, and their absence is not shown.";
}

Json json_of(const Reach& r) {
  return Json{{"a", r.a},
              {"b", r.b},
              {"people_a", r.people_a},
              {"people_b", r.people_b},
              {"comparisons", r.comparisons},
              {"power", r.power},
              {"alpha", r.alpha},
              {"alpha_of_one", r.alpha / static_cast<double>(r.comparisons)},
              {"smallest_p", r.smallest_p},
              {"detectable_effect", r.detectable_effect}};
}

void Analyst::power() {
  json_["power"] = Json::list();
  add(sheet::Heading{"What could be found with so few?"});
  for (const Reach& r : reach_of(study_, outcomes_.size())) {
    if (r.people_a < 2 || r.people_b < 2) {
      refuse("Power for " + r.a + " and " + r.b, "Each group needs two people with sessions.");
      continue;
    }
    json_["power"].push_back(json_of(r));
    say(reported(r));
  }
  if (study_.plan.groups.size() < 2) refuse("Power", "There is one group.");
}

// Of primary outcomes that came to nothing: what they would have had to differ by, in their own unit.
void Analyst::not_found() {
  json_["not_found"] = Json::list();
  if (study_.plan.primary.empty()) return;
  const std::vector<Reach> reach = reach_of(study_, outcomes_.size());
  for (const Json& row : json_.find("comparisons")->items()) {
    const auto p = row.find("p_holm")->number();
    if (!p || *p <= kAlpha) continue;
    const std::string &a = *row.find("a")->text(), &b = *row.find("b")->text(), &name = *row.find("outcome")->text();
    const auto r = std::find_if(reach.begin(), reach.end(), [&](const Reach& x) { return x.a == a && x.b == b; });
    const auto o = std::find_if(outcomes_.begin(), outcomes_.end(), [&](const Outcome& x) { return x.name == name; });
    if (r == reach.end() || o == outcomes_.end()) continue;
    const std::vector<double> first = means_of_people(study_, *o, a), second = means_of_people(study_, *o, b);
    const double na = static_cast<double>(first.size()), nb = static_cast<double>(second.size());
    const double pooled =
        std::sqrt(((na - 1) * variance(first) + (nb - 1) * variance(second)) / std::max(1.0, na + nb - 2));
    const double least = r->detectable_effect * pooled;
    json_["not_found"].push_back({{"outcome", name}, {"a", a}, {"b", b}, {"least_difference", least}});
    say(name + ", " + a + " and " + b + ": no difference was found. " +
            (std::isfinite(least) ? "One below " + text(least, 2) +
                                        " (in its own unit, by the spread of these people) would have been missed more "
                                        "often than one time in five."
                                  : "With so few people and so many comparisons none could have been.") +
            " That they are equal is not shown.",
        Tone::caution);
  }
}

void Analyst::closing() {
  Json limits = Json::list();
  add(sheet::Heading{"What may not be concluded"});
  for (const char* const words :
       {"That two groups are equal, because a difference is not significant.",
        "That who passes may operate: groups of unlike experience differ in much besides skill, and a pass mark is "
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
