// osteo review
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ReviewCommand {
  struct Params {
    std::string out;
    std::string procedure;
    bool mirror = false;
    std::string reference;
    std::string subject;
    std::string earlier;
    bool no_pictures = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for review.html, review.pdf and review.json, made when it is not there (also -o)"}, p.out);
    visit({"procedure",
           "what was to be done, by name (mastoidectomy, mastoid-window, mandible-split) or as JSON; empty: no items, "
           "regions or rules"},
          p.procedure);
    visit({"mirror",
           "the procedure is written for the other side of the body: its directions and curves turn about x = 0"},
          p.mirror);
    visit({"reference", "folder with reference.json and sessions of others on the same case; empty: no comparison"},
          p.reference);
    visit(
        {"subject", "who this is, by the reference's code: sessions of the same person are left out of the comparison"},
        p.subject);
    visit({"earlier", "earlier sessions of the same person in their order, with commas between (empty: none)"},
          p.earlier);
    visit({"no_pictures", "leave out pictures and the view in 3D; needs no OpenGL"}, p.no_pictures);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
