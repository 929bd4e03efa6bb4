// osteo heat
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct HeatCommand {
  struct Params {
    double cutting_share = 0.03, diamond_w_per_n = 0.5, water_c = 22, film = 3000, cell_mm = 0.5;
    std::string report, case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"cutting_share", "share of a cutting burr's power (force times surface speed) that becomes heat in bone", "",
           0, 1},
          p.cutting_share);
    visit({"diamond_w_per_n", "heat of a diamond burr in bone, for each newton", "W/N", 0, 20}, p.diamond_w_per_n);
    visit({"water_c", "temperature of the irrigation water", "C", 0, 60}, p.water_c);
    visit({"film", "how well running water cools", "W/(m2 K)", 0, 100000}, p.film);
    visit({"cell_mm", "wanted width of the cells that heat is computed in", "mm", 0.1, 2}, p.cell_mm);
    visit({"report",
           "write sections through the warmest bone that is left, and the course of each structure: a .html or .pdf"},
          p.report);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
