#include "osteo/simulation/tissue/problem.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/inp_io.h"
#include "osteo/simulation/tissue/calibrate.h"

namespace osteo {
namespace {

TetMesh mesh_of(const test::Block& b) {
  TetMesh m;
  m.points_mm.resize(b.points.size());
  for (std::size_t p = 0; p < b.points.size(); ++p) m.points_mm[p] = to_floats(b.points[p]);
  m.tets.resize(b.tets.size());
  for (std::size_t t = 0; t < b.tets.size(); ++t) m.tets[t] = b.tets[t];
  return m;
}

TEST(TissueProblem, IsReadOntoAMesh) {
  const TetMesh mesh = mesh_of(test::block(4, 2, 2, 5.0));
  const TissueProblem p =
      parse_tissue_problem(R"({"osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.45},
    "regions": [{"box_mm": [[10, -1, -1], [21, 11, 11]], "young_kpa": 50, "poisson": 0.3}],
    "fixed": [{"box_mm": [[-1, -1, -1], [0.1, 11, 11]]}],
    "loads": [{"name": "A", "forces": [{"at_mm": [20, 5, 5], "radius_mm": 6, "total_n": [0, 0, 2]}]}, {"forces": [{"box_mm": [[19, 0, 0], [21, 10, 10]], "total_n": [1, 0, 0]}]}]})",
                           mesh);
  EXPECT_EQ(p.fixed.size(), 9u);
  ASSERT_EQ(p.materials.size(), mesh.tets.size());
  EXPECT_EQ(p.materials.front().young_mpa, 0.1);
  EXPECT_EQ(p.materials.back().poisson, 0.3);
  ASSERT_EQ(p.loads.size(), 2u);
  EXPECT_EQ(p.load_names[0], "A");
  EXPECT_EQ(p.load_names[1], "load 2");
  Vec3 total{};
  for (const auto& [point, f] : p.loads[0].forces_n) total += f;
  EXPECT_NEAR(total.z, 2, 1e-12);
  EXPECT_EQ(p.loads[1].forces_n.size(), 9u);
}

TEST(TissueProblem, ValuesOutOfRangeAreRefusedWithTheirLine) {
  const TetMesh mesh = mesh_of(test::block(4, 2, 2, 5.0));
  const std::string good = R"({"osteotome_tissue": 1,
    "material": {"young_kpa": 100, "poisson": 0.45},
    "fixed": [{"box_mm": [[-1, -1, -1], [0.1, 11, 11]]}],
    "loads": [{"name": "A",
      "forces": [{"at_mm": [20, 5, 5], "radius_mm": 6, "total_n": [0, 0, 2]}],
      "surfaces": [{"box_mm": [[19, -1, -1], [21, 11, 11]], "kpa": 2}]}]})";
  EXPECT_NO_THROW(static_cast<void>(parse_tissue_problem(good, mesh)));
  const auto says = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string changed = good;
    ASSERT_NE(changed.find(from), std::string::npos) << from;
    changed.replace(changed.find(from), from.size(), to);
    try {
      static_cast<void>(parse_tissue_problem(changed, mesh));
      ADD_FAILURE() << to << " was read";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  says("\"young_kpa\": 100", "\"young_kpa\": -100", "line 2: material: \"young_kpa\" is -100");
  says("0.45", "0.5", "line 2: material: \"poisson\"");
  says("0.45", "\"much\"", "line 2: material: \"poisson\" (Poisson's ratio) must be a number");
  says("100, \"poisson\"", "100, \"density\": 1, \"poisson\"", "line 2: material: the key \"density\" is not known");
  says("[0.1, 11, 11]", "[-0.1, -11, 11]", "line 3: fixed 1: \"box_mm\" must be its lower corner, then its upper");
  says("[0.1, 11, 11]", "[0.1, 11]", "line 3: fixed 1: \"box_mm\" must have 3 items");
  says("[0.1, 11, 11]", "[0.1, 11, 1e9]", "line 3: fixed 1: \"box_mm\" is 1e+09");
  says("[0.1, 11, 11]]", "[0.1, 11, 11]], \"axes\": \"xw\"", "line 3: fixed 1: \"axes\" are made of x, y and z");
  says("[0.1, 11, 11]]", "[0.1, 11, 11]], \"at_mm\": [0, 0, 0]", "line 3: fixed 1: it needs a place");
  says("\"radius_mm\": 6", "\"radius_mm\": 0", "line 5: load 1, force 1: \"radius_mm\" is 0");
  says("\"radius_mm\": 6, ", "", "line 5: load 1, force 1: it needs a place");
  says("[0, 0, 2]", "[0, 0, 2e9]", "line 5: load 1, force 1: \"total_n\"");
  says("\"kpa\": 2", "\"kpa\": true", "line 6: load 1, surface 1: \"kpa\" must be a number");
  says("\"kpa\": 2", "\"kpa\": -2e6", "line 6: load 1, surface 1: \"kpa\" is -2e+06");
  says("\"fixed\"", "\"fixde\"", "line 3: the key \"fixde\" is not known: did you mean \"fixed\"?");
  says("\"osteotome_tissue\": 1", "\"osteotome_tissue\": 2", "line 1: \"osteotome_tissue\" must be 1");
}

TEST(TissueProblem, FactorsOfAGridAreAppliedAsTheyWereFitted) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const auto b = test::block(6, 3, 3, 2.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  CalibrationCase c;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].x < 1e-9) c.load.fixed.push_back(p);
    if (b.points[p].x > 11.99) c.load.forces_n.push_back({p, {0, 0, 0.002}});
  }
  TissueModel truth = model;
  truth.scale({2, 1.5, 1, 0.5});
  EquilibriumSolver solver(truth, truth.rest(), c.load.fixed);
  c.truth_mm = solver.solve(truth, truth.rest(), c.load.forces_n).points_mm;
  for (const bool shared : {true, false}) {
    TissueModel fitted = model;
    CalibrateOptions o;
    o.grid = {3, 1, 2};
    o.shared_grid = shared;
    const Calibration r = calibrate(fitted, std::span(&c, 1), o);
    ASSERT_EQ(r.log_factors.size(), 6u * kTissueClasses);
    const TissueModel again = with_log_factors(model, o.grid, r.log_factors);
    for (std::size_t k = 0; k < again.constraints().size(); ++k)
      EXPECT_NEAR(again.constraints()[k].stiffness, fitted.constraints()[k].stiffness,
                  1e-9 * fitted.constraints()[k].stiffness)
          << shared;
    EXPECT_LT(r.after[0].nrms, 0.05);
  }
  EXPECT_THROW(with_log_factors(model, {2, 2, 2}, std::vector<double>(5)), Error);
}

// Which elements: by name, as the flags say it; what is not known is reported with its line.
TEST(TissueProblem, NamesItsLawAndItsElements) {
  const TetMesh mesh = mesh_of(test::block(2, 1, 1, 5.0));
  const auto problem = [&](const std::string& keys) {
    return parse_tissue_problem(
        "{\"osteotome_tissue\": 1,\n" + keys + R"( "material": {"young_kpa": 100, "poisson": 0.4999},
      "fixed": [{"box_mm": [[-1, -1, -1], [0.1, 11, 11]]}]})",
        mesh, false);
  };
  EXPECT_FALSE(problem("").law.has_value() || problem("").order.has_value());
  const TissueProblem p = problem(R"("law": "corotated", "order": "t4_mean",)");
  EXPECT_EQ(p.law, ElasticLaw::corotated);
  EXPECT_EQ(p.order, TetOrder::t4_mean);
  EXPECT_EQ(problem(R"("order": "t10",)").order, TetOrder::t10);
  for (const std::string& wrong :
       {std::string(R"("order": "t5",)"), std::string(R"("law": "hooke",)"), std::string(R"("order": 4,)")}) {
    try {
      static_cast<void>(problem(wrong));
      ADD_FAILURE() << wrong;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("line 2"), std::string::npos) << e.what();
    }
  }
  // Neither has a counterpart in an .inp file.
  for (const auto& [law, order] :
       {std::pair{ElasticLaw::corotated, TetOrder::t4}, {ElasticLaw::linear, TetOrder::t4_mean}}) {
    const FemBody body(points_of(mesh), tets_of(mesh), p.materials, law, order);
    EXPECT_THROW(static_cast<void>(inp_text(body, {})), Error);
  }
}

// Written and read back as .inp: the same body under the same load, forces on faces and sliders too.
TEST(TissueProblem, GoesThroughAnInpFile) {
  const TetMesh mesh = mesh_of(test::block(4, 2, 2, 5.0));
  const TissueProblem p =
      parse_tissue_problem(R"({"osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.45},
    "regions": [{"box_mm": [[10, -1, -1], [21, 11, 11]], "young_kpa": 50, "poisson": 0.3}],
    "fixed": [{"box_mm": [[-1, -1, -1], [0.1, 0.1, 11]]}, {"box_mm": [[-1, -1, -1], [0.1, 11, 11]], "axes": "xz"}],
    "loads": [{"surfaces": [{"box_mm": [[19.9, 0, 0], [21, 10, 10]], "kpa": -2}, {"box_mm": [[0, 0, 9.9], [20, 10, 11]], "kpa": [0.1, 0, 0]}],
               "forces": [{"at_mm": [20, 5, 5], "radius_mm": 3, "total_n": [0, 0.01, 0]}]}]})",
                           mesh);
  EXPECT_EQ(p.fixed.size(), 3u);
  EXPECT_EQ(p.sliders.size(), 9u);
  Vec3 total{};
  for (const auto& [point, f] : p.loads[0].forces_n) total += f;
  EXPECT_NEAR(total.x, 0.002 * 100 + 0.0001 * 200, 1e-9);
  EXPECT_NEAR(total.y, 0.01, 1e-9);
  for (const auto& [law, order] : {std::pair{ElasticLaw::linear, TetOrder::t4},
                                   {ElasticLaw::stvk, TetOrder::t10},
                                   {ElasticLaw::neo_hooke_split, TetOrder::t10}}) {
    const FemBody body(points_of(mesh), tets_of(mesh), p.materials, law, order);
    const TissueLoad load = body.on_all_points(p.loads[0]);
    const std::string text = inp_text(body, load);
    const TetMesh read = parse_inp(text, "x").mesh;
    ASSERT_EQ(read.tets.size(), mesh.tets.size());
    const TissueProblem again = parse_tissue_problem(text, read);
    EXPECT_EQ(again.law, law);
    EXPECT_EQ(again.order, order);
    const FemBody other(points_of(read), tets_of(read), again.materials, law, order);
    const TissueLoad other_load = other.on_all_points(again.loads[0]);
    EquilibriumSolver a(body, body.rest(), load), b(other, other.rest(), other_load);
    const Equilibrium ra = a.solve(body, body.rest(), load.forces_n),
                      rb = b.solve(other, other.rest(), other_load.forces_n);
    ASSERT_TRUE(ra.converged && rb.converged) << ra.why << rb.why;
    for (std::size_t q = 0; q < mesh.points_mm.size(); ++q) EXPECT_LT(length(ra.points_mm[q] - rb.points_mm[q]), 1e-9);
  }
}

TEST(TissueProblem, ForeignInpFiles) {
  // As another program might write it: sets, GENERATE, several lines an element, a pressure on faces, lower case.
  const std::string text = R"(*heading
a tetrahedron, and one on it
*Node, nset=all
 10, 0., 0., 0.
 11, 1., 0., 0.
 12, 0., 1., 0.
 13, 0., 0., 1.
 14, 1., 1., 1.
*Element, type=C3D4, elset=body
 5, 10, 11,
    12, 13
 6, 11, 12, 13, 14
*Nset, nset=base, generate
 10, 12, 1
*Material, name=gel
*Elastic
 0.1, 0.3
*Solid Section, elset=body, material=gel
*Boundary
 base, 1, 3
*Step
*Static
*Dload
 6, P3, 0.002
*Cload
 13, 3, -1e-3
*End Step
)";
  const TetMesh mesh = parse_inp(text, "x").mesh;
  const TissueProblem p = parse_tissue_problem(text, mesh);
  EXPECT_EQ(p.fixed.size(), 3u);
  EXPECT_EQ(p.law, ElasticLaw::linear);
  ASSERT_EQ(p.loads.size(), 1u);
  Vec3 total{};
  for (const auto& [point, f] : p.loads[0].forces_n) total += f;
  // P3: the face of nodes 2, 4, 3 (12, 14, 13), pressed inwards, away from it: (0, 1, 1) x (0, 0, 1)...
  const Vec3 a{0, 1, 0}, b{1, 1, 1}, c{0, 0, 1}, area = cross(b - a, c - a) * 0.5;
  const double side = dot(area, Vec3{1, 0, 0} - a) > 0 ? 1 : -1;
  const Vec3 expected = area * (0.002 * side) + Vec3{0, 0, -1e-3};
  EXPECT_LT(length(total - expected), 1e-12);
  std::string named = text;
  named.replace(named.find(" base, 1, 3"), 11, " base, PINNED\n 13, zsymm");
  const TissueProblem q = parse_tissue_problem(named, mesh);
  EXPECT_EQ(q.fixed, p.fixed);
  ASSERT_EQ(q.sliders.size(), 1u);
  EXPECT_EQ(q.sliders[0].held, 4);
  // Damaged in any way it is read or rejected, never anything else.
  std::mt19937 random(8);
  for (int n = 0; n < 20000; ++n) {
    std::string damaged = text;
    for (std::uint32_t k = random() % 4 + 1; k > 0 && !damaged.empty(); --k) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0:
          damaged[at] = static_cast<char>(random() % 96 + 32);
          break;
        case 1:
          damaged.erase(at, random() % 20);
          break;
        case 2:
          damaged.insert(at, damaged.substr(random() % damaged.size(), random() % 30));
          break;
        default:
          damaged[at] = "0123456789,.*-=e\n"[random() % 17];
      }
    }
    try {
      const TetMesh other = parse_inp(damaged, "x").mesh;
      static_cast<void>(parse_tissue_problem(damaged, other, false));
    } catch (const Error&) {
    }
  }
  const auto says = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    try {
      static_cast<void>(parse_tissue_problem(changed, mesh));
      ADD_FAILURE() << to << " was read";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  says("C3D4", "C3D8", "C3D8");
  says("0.1, 0.3", "0.1, x", "'X' is no number");
  says("12, 13\n 6", "12, 99\n 6", "no node 99");
  says("*Solid Section, elset=body", "*Solid Section, elset=bdy", "BDY");
  says("*Static\n", "*Static\n*Contact\n", "might change the answer");
  says("base, 1, 3", "base, 1, 3, 0.5", "moved");
  says("6, P3", "7, P3", "no element 7");
  // CalculiX and Abaqus turn pressures with the body where displacements are large.
  says("*Step", "*Step, nlgeom", "pressures follow the body");
  says("*Elastic\n 0.1, 0.3", "*Hyperelastic, neo hooke\n 0.1, 0.3", "pressures follow the body");
  says("*Cload", "*Cload, follower", "might change the answer");
  std::string large = text;
  large.replace(large.find("*Step"), 5, "*Step, nlgeom");
  large.erase(large.find("*Dload"), std::strlen("*Dload\n 6, P3, 0.002\n"));
  EXPECT_EQ(parse_tissue_problem(large, mesh).law, ElasticLaw::stvk);
}

// A step goes on from the one before, as CalculiX (2.20) prints it of these very cards: what a card names replaces what
// acted there, what it does not name stays, unless OP=NEW; within a step loads of one place add up.
TEST(TissueProblem, StepsOfAnInpFileGoOn) {
  const std::string head = R"(*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4, ELSET=E
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
1, 0.3
*DENSITY
1e-3
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
)";
  const TetMesh mesh = parse_inp(head, "x").mesh;
  struct Case {
    std::vector<std::string> steps;
    std::vector<Vec3> tip_mm;
  };
  for (const Case& c :
       {Case{{"*CLOAD\n4,1,.01\n", "*CLOAD\n4,1,.02\n", "*CLOAD\n4,3,.01\n", "*CLOAD,OP=NEW\n4,2,.02\n"},
             {{0.156, 0, 0}, {0.312, 0, 0}, {0.312, 0, 0.04457143}, {0, 0.312, 0}}},
        {{"*CLOAD\n4,1,.01\n4,1,.01\n*CLOAD\n4,2,.01\n*CLOAD\n4,2,.01\n"}, {{0.312, 0.312, 0}}},
        {{"*DLOAD\n1,P2,.01\n", "*DLOAD\n1,P2,.02\n", "*CLOAD\n4,1,.01\n", "*DLOAD,OP=NEW\n"},
         {{0, 0.026, 0}, {0, 0.052, 0}, {0.156, 0.052, 0}, {0.156, 0, 0}}},
        {{"*DLOAD\nE,GRAV,10,0,0,1\n", "*DLOAD\nE,GRAV,20,0,0,1\n", "*DLOAD\nE,GRAV,10,0,1,0\n"},
         {{0, 0, 1.857143e-3}, {0, 0, 3.714286e-3}, {0, 6.5e-3, 3.714286e-3}}},
        {{"*DLOAD\nE,GRAV,10,0,0,2\n"}, {{0, 0, 1.857143e-3}}},  // a direction, of any length
        {{"*DLOAD\nE,GRAV,10,0,0,1\nE,GRAV,10,0,0,1\n", "*DLOAD\nE,GRAV,10,0,0,1\n"},
         {{0, 0, 3.714286e-3}, {0, 0, 1.857143e-3}}},
        {{"*DLOAD\nE,GRAV,10,0,0,1\nE,GRAV,10,0,0,1\nE,GRAV,10,0,0,1\n", "*DLOAD\nE,GRAV,10,0,1,0\n",
          "*DLOAD\nE,GRAV,10,0,0,1\n*DLOAD\nE,GRAV,10,0,0,1\n"},
         {{0, 0, 5.571429e-3}, {0, 6.5e-3, 5.571429e-3}, {0, 6.5e-3, 3.714286e-3}}},
        {{"*BOUNDARY\n4,1,1,.01\n", "*BOUNDARY\n4,1,1,.02\n", "*BOUNDARY\n4,2,2,.02\n"},
         {{0.01, 0, 0}, {0.02, 0, 0}, {0.02, 0.02, 0}}}}) {
    std::string text = head;
    for (const std::string& step : c.steps) text += "*STEP\n*STATIC\n" + step + "*END STEP\n";
    const TissueProblem p = parse_tissue_problem(text, mesh);
    ASSERT_EQ(p.loads.size(), c.tip_mm.size());
    const FemBody body(points_of(mesh), tets_of(mesh), p.materials, ElasticLaw::linear, TetOrder::t4);
    for (std::size_t n = 0; n < p.loads.size(); ++n)
      EXPECT_LT(length(statics(body, p.loads[n]).points_mm[3] - body.rest()[3] - c.tip_mm[n]), 1e-6) << text << n;
  }
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  // The error names the line, here counted from the end.
  const auto rejected = [&](const std::string& steps, long from_end, const std::string& what) {
    try {
      static_cast<void>(parse_tissue_problem(head + steps, mesh));
      ADD_FAILURE() << steps << " was read";
    } catch (const Error& e) {
      const std::string said = e.what(), line = "line " + std::to_string(lines(head + steps) + 1 - from_end) + ",";
      EXPECT_NE(said.find(line), std::string::npos) << said;
      EXPECT_NE(said.find(what), std::string::npos) << said;
    }
  };
  rejected("*STEP\n*END STEP\n*STEP, NLGEOM\n*END STEP\n", 2, "different laws");
  // CalculiX solves the second step by the linear law: 1.56 mm after 1.11 mm.
  rejected("*STEP, NLGEOM\n*CLOAD\n4, 1, .1\n*END STEP\n*STEP, NLGEOM=NO\n*END STEP\n", 2, "different laws");
  rejected("*STEP\n*END STEP\n*STEP, PERTURBATION\n*END STEP\n", 2, "different laws");
  rejected("*STEP\n*DLOAD\nE, GRAV, 10, 0, 0, 0\n*END STEP\n", 3, "no direction");
  for (const std::string option : {"OP=NEW", "FIXED", "TYPE=VELOCITY", "AMPLITUDE=A", "USER"}) {
    const std::string name = option.substr(0, option.find('='));
    rejected("*STEP\n*BOUNDARY, " + option + "\n4, 1, 1, .1\n*END STEP\n", 3, name);
    rejected("*BOUNDARY, " + option + "\n4, 1\n*STEP\n*END STEP\n", 4, name);
  }
  // What says nothing new is read: CalculiX keeps to NLGEOM where a later step does not name it.
  for (const std::string steps :
       {"*STEP, NLGEOM\n*END STEP\n*STEP\n*END STEP\n", "*STEP, NLGEOM\n*END STEP\n*STEP, NLGEOM=YES\n*END STEP\n",
        "*STEP, NLGEOM\n*BOUNDARY, OP=MOD, TYPE=DISPLACEMENT\n4, 1, 1, .1\n*END STEP\n"})
    EXPECT_EQ(parse_tissue_problem(head + steps, mesh).law, ElasticLaw::stvk) << steps;
  EXPECT_EQ(parse_tissue_problem(head + "*STEP\n*END STEP\n*STEP, NLGEOM=NO\n*END STEP\n", mesh).law,
            ElasticLaw::linear);
}

// Between two faces that are held, each by itself, the body is free: also the middle of an edge that goes from one to
// the other. Both by places of JSON and by the nodes that an .inp names.
TEST(TissueProblem, MiddlesBetweenHeldFacesAreFree) {
  const TetMesh mesh = mesh_of(test::block(1, 1, 1, 10.0));
  const std::string json = R"({"osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.3},
    "fixed": [{"box_mm": [[-1, -1, -1], [11, 11, 0.1]]}],
    "loads": [{"moved": [{"box_mm": [[-1, -1, 9.9], [11, 11, 11]], "by_mm": [0, 0, 1]}]}]})";
  const TissueProblem p = parse_tissue_problem(json, mesh);
  const FemBody body(points_of(mesh), tets_of(mesh), p.materials, ElasticLaw::linear, TetOrder::t10);
  const TissueLoad load = body.on_all_points(p.loads[0]);
  const auto held_at_half = [&](const TissueLoad& l) {
    int count = 0;
    for (const std::uint32_t q : l.fixed) count += body.rest()[q].z == 5 ? 1 : 0;
    for (const Slider& s : l.sliders) count += body.rest()[s.point].z == 5 ? 1 : 0;
    for (const auto& m : l.moved) count += body.rest()[m.point].z == 5 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(held_at_half(load), 0);
  EXPECT_EQ(load.fixed.size(), 9u);  // four corners, four sides and a diagonal
  EXPECT_EQ(load.moved.size(), 9u);
  const Statics r = statics(body, load);
  double narrower = 0;
  for (std::size_t q = 0; q < body.point_count(); ++q)
    narrower = std::max(narrower, std::abs(r.points_mm[q].x - body.rest()[q].x));
  EXPECT_GT(narrower, 0.05);
  // As written, and as another program marks two surfaces; what of a surface is held is held wholly.
  const std::string text = inp_text(body, load);
  const TissueProblem again = parse_tissue_problem(text, parse_inp(text, "x").mesh);
  const TissueLoad same = body.on_all_points(again.loads[0]);
  EXPECT_EQ(held_at_half(same), 0);
  EXPECT_EQ(same.fixed.size(), 9u);
  // Places that share a face between them, or hold one face axis by axis, hold all of it.
  for (
      const std::string fixed :
      {R"({"box_mm": [[-1, -1, -1], [5, 11, 0.1]]}, {"box_mm": [[5, -1, -1], [11, 11, 0.1]]})",
       R"({"box_mm": [[-1, -1, -1], [11, 11, 0.1]], "axes": "xy"}, {"box_mm": [[-1, -1, -1], [11, 11, 0.1]], "axes": "z"})"}) {
    std::string other = json;
    const std::string whole = R"({"box_mm": [[-1, -1, -1], [11, 11, 0.1]]})";
    other.replace(other.find(whole), whole.size(), fixed);
    const Statics s = statics(body, body.on_all_points(parse_tissue_problem(other, mesh).loads[0]));
    for (std::size_t q = 0; q < body.point_count(); ++q) EXPECT_LT(length(s.points_mm[q] - r.points_mm[q]), 1e-9);
  }
}

// C3D4 elements name no middles. Solved by quadratic ones, an edge through the body between two held faces has a free
// middle; on a held face, and in a volume that is held, all of it is held.
TEST(TissueProblem, MiddlesOfLinearElementsThroughTheBodyAreFree) {
  const auto text_of = [](const TetMesh& mesh, const std::function<bool(Vec3)>& held) {
    std::string t = "*NODE\n", holds = "*BOUNDARY\n";
    for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
      const Vec3 x = from_floats(mesh.points_mm[p]);
      t += std::to_string(p + 1) + ", " + std::to_string(x.x) + ", " + std::to_string(x.y) + ", " +
           std::to_string(x.z) + "\n";
      if (held(x)) holds += std::to_string(p + 1) + ", 1, 3\n";
    }
    t += "*ELEMENT, TYPE=C3D4, ELSET=E\n";
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
      t += std::to_string(e + 1);
      for (const std::uint32_t p : mesh.tets[e]) t += ", " + std::to_string(p + 1);
      t += "\n";
    }
    return t + "*MATERIAL, NAME=M\n*ELASTIC\n1, 0.3\n*SOLID SECTION, ELSET=E, MATERIAL=M\n" + holds +
           "*STEP\n*STATIC\n*END STEP\n";
  };
  // The middles that are held.
  const auto held_middles = [&](const TetMesh& mesh, const std::function<bool(Vec3)>& held) {
    const TissueProblem p = parse_tissue_problem(text_of(mesh, held), mesh);
    const FemBody body(points_of(mesh), tets_of(mesh), p.materials, ElasticLaw::linear, TetOrder::t10);
    std::vector<Vec3> at;
    for (const std::uint32_t q : body.on_all_points(p.loads[0]).fixed) {
      if (q >= body.corner_count()) at.push_back(body.rest()[q]);
    }
    return at;
  };
  // One layer between two plates: only along the rim do edges of the surface join them.
  const TetMesh layer = mesh_of(test::block(3, 3, 1, 10.0));
  int between = 0, on_plates = 0, inside = 0;
  for (const Vec3 x : held_middles(layer, [](Vec3) { return true; })) {
    (x.z == 5 ? between : on_plates) += 1;
    inside += x.z == 5 && x.x > 0 && x.x < 30 && x.y > 0 && x.y < 30 ? 1 : 0;
  }
  EXPECT_EQ(inside, 0);
  EXPECT_GT(between, 0);
  EXPECT_EQ(on_plates, 2 * (2 * 3 * 4 + 9));  // two plates of 3 x 3 squares: sides and a diagonal each
  // The lower half of a block of 4 x 4 x 4 is held: so is each middle well inside of it, where an end is inside too.
  const TetMesh block = mesh_of(test::block(4, 4, 4, 10.0));
  const auto deep = [](const std::vector<Vec3>& middles) {
    return std::count_if(middles.begin(), middles.end(),
                         [](Vec3 x) { return x.x > 5 && x.x < 35 && x.y > 5 && x.y < 35 && x.z > 5 && x.z <= 20; });
  };
  const FemBody body(points_of(block), tets_of(block), std::vector<Material>{{1, 0.3}}, ElasticLaw::linear,
                     TetOrder::t10);
  const std::vector<Vec3> middles(body.rest().begin() + static_cast<std::ptrdiff_t>(body.corner_count()),
                                  body.rest().end());
  EXPECT_GT(deep(middles), 50);
  EXPECT_EQ(deep(held_middles(block, [](Vec3 c) { return c.z < 25; })), deep(middles));
}

}  // namespace
}  // namespace osteo
