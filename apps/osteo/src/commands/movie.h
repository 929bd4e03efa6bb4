// osteo movie
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/assessment/movie/movie_options.h"

namespace osteo {

struct MovieCommand {
  struct Params {
    MovieCamera camera = MovieCamera::surgeon;
    double speed = 1, from_s = 0, to_s = -1;
    bool skip_idle = false, no_overlay = false, blind = false, deep = false;
    std::string size = "1280x720";
    int fps = 30;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera",
           "surgeon: from where was looked (notes of the session); fixed: from one place, all that was drilled"},
          p.camera);
    visit({"speed", "speed in multiples of the recorded one", "", 0.1, 100}, p.speed);
    visit({"from_s", "start in the session", "s", 0, 1e6}, p.from_s);
    visit({"to_s", "end in the session (-1: the session's end)", "s", -1, 1e6}, p.to_s);
    visit({"skip_idle", "leave out where for over 2 s neither hand nor camera moves and no pedal is down"},
          p.skip_idle);
    visit({"no_overlay", "leave out time, force, nearest structure and volume removed"}, p.no_overlay);
    visit({"blind", "blinded movie for raters: no overlay, and a random name where the output is a folder"}, p.blind);
    visit({"size", "pixels, width and height, both even"}, p.size);
    visit({"fps", "frames a second", "Hz", 1, 120}, p.fps);
    visit({"deep", "creases shaded and edges smoothed, which without a graphics card takes several times as long"},
          p.deep);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
