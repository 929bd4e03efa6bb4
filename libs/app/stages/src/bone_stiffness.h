// The stage that gives a mesh of bone the stiffness of its CT.
#pragma once
#include <vector>

#include "osteo/core/stage/stage.h"
#include "osteo/simulation/tissue/bone_stiffness.h"
#include "tissue.h"

namespace osteo::inline app {

struct BoneStiffnessParams {
  BoneDensity density;
  double step_percent = 2;
  bool keep_floating = false;
  std::string load;
  OrderChoice order = OrderChoice::automatic;
};
struct BoneStiffnessStage {
  using Params = BoneStiffnessParams;
  static void describe(Params& p, auto& visit) {
    visit({"law",
           "Young's modulus in MPa by density in g/cm3. morgan_2003: 6850 r^1.49 of apparent density (femoral neck); "
           "keller_1994: 10500 "
           "r^2.29 of ash (femur); carter_hayes_1977: 2875 r^3 of apparent density; keyak_1998: of ash, in three parts "
           "(femur)"},
          p.density.law);
    visit({"density_per_1000_hu",
           "mineral at 1000 HU above that at 0 HU, in g/cm3: the slope of the scanner's calibration phantom; 0.8 is a "
           "guess that "
           "may be 15 % off",
           "", 1e-3, 100},
          p.density.per_1000_hu);
    visit({"density_at_0_hu", "mineral at 0 HU, in g/cm3: from the same phantom", "", -1, 1}, p.density.at_0_hu);
    visit({"ash_correction",
           "ash is (mineral + 0.09) / 1.14, as was measured with a phantom of hydroxyapatite; off: they are the same"},
          p.density.ash_correction);
    visit({"weight",
           "what the bone weighs, in the file (*DENSITY) and under gravity. apparent: as the laws' specimens, wet and "
           "without marrow; "
           "in_situ: "
           "with the marrow in its pores, 1.017 + 0.000592 HU g/cm3 above 100 HU"},
          p.density.weight);
    visit({"min_mpa", "softer places are made so stiff, which is counted", "MPa", 1e-6, 1e6}, p.density.min_mpa);
    visit({"max_mpa", "stiffer places (metal) are made so soft, which is counted", "MPa", 1e-6, 1e6},
          p.density.max_mpa);
    visit(
        {"step_percent",
         "materials are so far apart, each with the mean of its tetrahedra (0: each tetrahedron its own)", "%", 0, 100},
        p.step_percent);
    visit({"keep_floating",
           "parts of the mesh that nothing holds are written too; without, small ones are left out and large ones "
           "rejected"},
          p.keep_floating);
    visit({"load", "name of the load (empty: the first)"}, p.load);
    visit({"order",
           "t4: linear tetrahedra; t10: quadratic; auto: what the problem says, else quadratic, but for large meshes "
           "linear"},
          p.order);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
