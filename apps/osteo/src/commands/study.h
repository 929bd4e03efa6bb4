// osteo study
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct StudyCommand {
  struct Params {
    std::string title, procedure, groups, competent, cases;
    std::string items = "overall";
    int attempts = 1, lowest = 1, highest = 5;
    std::string participant, group, case_name;
    int attempt = 1;
    std::string rater;
    std::string out, given;
    int resamples = 2000;
    double level = 0.95;
    bool no_movies = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"title", "new: what the study is called"}, p.title);
    visit({"procedure", "new: what is done on each case"}, p.procedure);
    visit({"groups", "new: groups of people, like 'novice, expert'"}, p.groups);
    visit({"competent", "new: the group that is meant to pass (empty: the last)"}, p.competent);
    visit({"cases", "new: cases that everybody does, like 'left-1, right-1'"}, p.cases);
    visit({"items", "new: what raters rate"}, p.items);
    visit({"attempts", "new: of each case by each participant", "", 1, 100}, p.attempts);
    visit({"lowest", "new: of the scale of each item", "", -1000, 1000}, p.lowest);
    visit({"highest", "new: of the scale of each item", "", -1000, 1000}, p.highest);
    visit({"participant", "add: a code, never a name (empty, for a person: the next free one)"}, p.participant);
    visit({"group", "add: of a new participant"}, p.group);
    visit({"case_name", "add: of the session"}, p.case_name);
    visit({"attempt", "add: of the session", "", 1, 100}, p.attempt);
    visit({"rater", "form: a code of who rates"}, p.rater);
    visit({"out", "analyse: files OUT.json, OUT.html and OUT.pdf (empty: STUDY/report; also -o)"}, p.out);
    visit({"resamples", "analyse: of each bootstrap", "", 100, 1000000}, p.resamples);
    visit({"level", "analyse: of intervals", "", 0.5, 0.999}, p.level);
    visit({"given",
           "analyse: metrics to hold, like 'duration_s, removed_mm3': correlations are told with and without them"},
          p.given);
    visit({"no_movies",
           "demo: without the blinded movies (320x240, 15 times as fast, 10 frames a second, one a session)"},
          p.no_movies);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
