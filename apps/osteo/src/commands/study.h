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
    bool mirror = false;
    std::string accept, primary;
    std::string rater;
    std::string out, given;
    int resamples = 2000;
    double level = 0.95;
    bool no_movies = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"title", "new: what the study is called"}, p.title);
    visit({"procedure",
           "new: what is done on each case, in words, or a procedure's file (.json), which is kept in the study and by "
           "which its sessions are scored"},
          p.procedure);
    visit({"groups", "new: groups of people, like 'novice, expert'"}, p.groups);
    visit({"competent", "new: the group that is meant to pass (empty: the last)"}, p.competent);
    visit({"cases", "new: cases that everybody does, like 'left-1, right-1'"}, p.cases);
    visit({"items", "new: what raters rate"}, p.items);
    visit({"attempts", "new: of each case by each participant", "", 1, 100}, p.attempts);
    visit({"lowest", "new: of the scale of each item", "", -1000, 1000}, p.lowest);
    visit({"highest", "new: of the scale of each item", "", -1000, 1000}, p.highest);
    visit({"participant", "add, remove: a code, never a name (empty, for a new person: the next free one)"},
          p.participant);
    visit({"group", "add: of a new participant"}, p.group);
    visit({"case_name", "add: of the session; remove: only this one (empty: the person with all that is kept)"},
          p.case_name);
    visit({"attempt", "add, remove: of the session", "", 1, 100}, p.attempt);
    visit({"mirror", "add: a session on the other side of the body than the study's procedure is written for"},
          p.mirror);
    visit({"accept",
           "add: differences from the study's other sessions that are meant to be: cut-short, other-bone, procedure, "
           "program"},
          p.accept);
    visit({"primary", "plan: outcomes that the study is about, like 'force_p95_n, seen_share, rating: overall'"},
          p.primary);
    visit({"rater", "form: a code of who rates"}, p.rater);
    visit({"out", "analyse: files OUT.json, OUT.html and OUT.pdf (empty: STUDY/report; also -o)"}, p.out);
    visit({"resamples", "analyse: of each bootstrap", "", 100, 1000000}, p.resamples);
    visit({"level", "analyse: of intervals", "", 0.5, 0.999}, p.level);
    visit({"given",
           "analyse: metrics to hold, like 'duration_s, removed_mm3': correlations are given with and without them"},
          p.given);
    visit({"no_movies",
           "demo: without the blinded movies (320x240, 15 times as fast, 10 frames a second, one a session)"},
          p.no_movies);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
