// Movements, gravity and contact, against what is known in closed form and against CalculiX.
#include "osteo/simulation/tissue/fem.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "block.h"
#include "calculix.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/inp_io.h"
#include "osteo/imaging/io/tet_io.h"
#include "osteo/simulation/tissue/problem.h"
#include "scratch.h"

namespace osteo {
namespace {

constexpr const char* kColumn = R"({"osteotome_tissue": 1,
  "material": {"young_kpa": 100, "poisson": 0.3, "density_kg_m3": 1000},
  "fixed": [{"box_mm": [[-1,-1,-0.1],[21,21,0.1]], "axes": "z"}, {"box_mm": [[-0.1,-1,-1],[0.1,21,61]], "axes": "x"},
            {"box_mm": [[-1,-0.1,-1],[21,0.1,61]], "axes": "y"}],
  "loads": [ LOAD ]})";

TetMesh mesh_of(const test::Block& b) {
  TetMesh m;
  for (const Vec3& p : b.points) m.points_mm.push_back(to_floats(p));
  for (const auto& t : b.tets) m.tets.push_back(t);
  return m;
}

TissueProblem problem_of(const std::string& load, const TetMesh& mesh) {
  std::string text = kColumn;
  text.replace(text.find("LOAD"), 4, load);
  return parse_tissue_problem(text, mesh);
}

// A column of 20 x 20 x 60 mm in three planes of symmetry.
struct Column {
  TetMesh mesh = mesh_of(test::block(2, 2, 6, 10.0));
  Statics solve(const std::string& load, ElasticLaw law, TetOrder order) const {
    const TissueProblem p = problem_of(load, mesh);
    const FemBody body(points_of(mesh), tets_of(mesh), p.materials, law, order);
    return statics(body, body.on_all_points(p.loads[0]));
  }
  // Mean height of the points at z at rest.
  [[nodiscard]] double rise(const Statics& r, double z) const {
    double sum = 0;
    int n = 0;
    for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
      if (std::abs(mesh.points_mm[p][2] - z) > 1e-6) continue;
      sum += r.points_mm[p].z - z;
      ++n;
    }
    return sum / n;
  }
};

TEST(Statics, PrescribedMovementOfABar) {
  const Column c;
  // Pulled by 3 mm: strain 0.05 everywhere, the section 0.3 of it narrower; reaction E A strain.
  const std::string pull =
      R"({"name": "pull", "moved": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "axes": "z", "by_mm": [0,0,3]}]})";
  for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
    const Statics r = c.solve(pull, ElasticLaw::linear, order);
    ASSERT_TRUE(r.converged) << r.why;
    EXPECT_NEAR(c.rise(r, 60), 3, 1e-12);
    EXPECT_NEAR(c.rise(r, 30), 1.5, 1e-9);
    double widest = 0;
    for (std::size_t p = 0; p < c.mesh.points_mm.size(); ++p) widest = std::max(widest, r.points_mm[p].x);
    EXPECT_NEAR(widest, 20 * (1 - 0.3 * 0.05), 1e-9);
  }
  // To 2.5 times its length, where a step at once turns elements inside out: the law's own stress, P = mu (l - 1/l
  // ...), by its energy.
  const std::string far = R"({"moved": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "axes": "z", "by_mm": [0,0,90]}]})";
  const Statics r = c.solve(far, ElasticLaw::neo_hooke, TetOrder::t10);
  ASSERT_TRUE(r.converged) << r.why;
  EXPECT_NEAR(c.rise(r, 30), 45, 1e-6);
  const double mu = 0.1 / 2.6, lambda = 0.1 * 0.3 / (1.3 * 0.4), l = 2.5;
  double narrow = 1;  // mu (n^2 - 1) + lambda ln(l n^2) = 0: no stress on the sides
  for (int i = 0; i < 100; ++i)
    narrow -=
        (mu * (narrow * narrow - 1) + lambda * std::log(l * narrow * narrow)) / (2 * mu * narrow + 2 * lambda / narrow);
  double widest = 0;
  for (std::size_t p = 0; p < c.mesh.points_mm.size(); ++p) widest = std::max(widest, r.points_mm[p].x);
  EXPECT_NEAR(widest, 20 * narrow, 1e-6);
  // Pressed to two thirds (below about a half its sides wrinkle).
  const Statics s = c.solve(R"({"moved": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "axes": "z", "by_mm": [0,0,-20]}]})",
                            ElasticLaw::neo_hooke, TetOrder::t10);
  ASSERT_TRUE(s.converged) << s.why;
  EXPECT_NEAR(c.rise(s, 30), -10, 1e-6);
}

TEST(Statics, AColumnUnderItsOwnWeight) {
  const Column c;
  // u(z) = -rho g (H z - z^2 / 2) / E for nu 0; the mean over a section is that for any nu, whose sides only curve. rho
  // g = 9.81e-6 N/mm3.
  const double rho_g = 1e-6 * 9.81, height = 60, young = 0.1;
  const Statics r = c.solve(R"({"gravity_m_s2": [0, 0, -9.81]})", ElasticLaw::linear, TetOrder::t10);
  ASSERT_TRUE(r.converged) << r.why;
  EXPECT_NEAR(r.reaction_n.z, rho_g * 20 * 20 * 60, 1e-9);
  EXPECT_NEAR(c.rise(r, 60), -rho_g * height * height / 2 / young, 0.02 * rho_g * height * height / 2 / young);
  EXPECT_NEAR(c.rise(r, 30), -rho_g * (height * 30 - 450) / young, 0.02 * rho_g * height * height / 2 / young);
  // A force spread over the volume is the same.
  const Statics same = c.solve(R"({"volumes": [{"box_mm": [[-1,-1,-1],[21,21,61]], "total_n": [0, 0, -0.235440]}]})",
                               ElasticLaw::linear, TetOrder::t10);
  EXPECT_NEAR(c.rise(same, 60), c.rise(r, 60), 1e-9);
}

TEST(Statics, APlateStopsWhatIsPressed) {
  const Column c;
  // Pressed up by 2 kPa of 100: free it would rise by 1.2 mm; a plate 0.5 mm above holds all but what 0.5 mm takes, and
  // gives way by that over its stiffness.
  const std::string load = R"({"surfaces": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "kpa": [0, 0, 2]}],
    "contacts": [{"at_mm": [0, 0, 60.5], "normal": [0, 0, -1], "stiffness_n_per_mm": 1000}]})";
  for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
    const Statics r = c.solve(load, ElasticLaw::linear, order);
    ASSERT_TRUE(r.converged) << r.why;
    EXPECT_GE(r.touching, 4u);
    EXPECT_NEAR(c.rise(r, 60), 0.5, 2e-3);
    EXPECT_NEAR(r.contact_n.z, -(0.002 * 400 - 0.1 * 400 * 0.5 / 60), 0.02);
    EXPECT_NEAR(r.contact_n.z + r.reaction_n.z + 0.8, 0, 1e-8);  // all forces balance
    if (order != TetOrder::t10) continue;
    // A plate pushes quadratic faces by its pressure, which corners do not bear: all of the end stays flat.
    double lowest = 1e9, highest = -1e9;
    for (const Vec3& p : r.points_mm) {
      if (p.z < 60) continue;
      lowest = std::min(lowest, p.z);
      highest = std::max(highest, p.z);
    }
    EXPECT_LT(highest - lowest, 1e-9);
  }
  // A ball that is pressed in leaves its shape: no point is in it by more than its force over its stiffness.
  const std::string pressed = R"({"contacts": [{"at_mm": [10, 10, 68], "radius_mm": 10, "stiffness_n_per_mm": 100}]})";
  const Statics ball = c.solve(pressed, ElasticLaw::neo_hooke, TetOrder::t4);
  ASSERT_TRUE(ball.converged) << ball.why;
  EXPECT_GT(ball.touching, 0u);
  for (const Vec3& p : ball.points_mm)
    EXPECT_GT(length(p - Vec3{10, 10, 68}), 10 - length(ball.contact_n) / 100 - 1e-9);
  EXPECT_LT(ball.contact_n.z, 0);
  // Of quadratic elements the faces leave it, on the whole.
  const Statics faces = c.solve(pressed, ElasticLaw::neo_hooke, TetOrder::t10);
  ASSERT_TRUE(faces.converged) << faces.why;
  EXPECT_GT(faces.touching, 0u);
  EXPECT_LT(faces.contact_n.z, 0);
  EXPECT_LT(length(faces.contact_n + faces.reaction_n), 1e-8);
  // However stiff it is and however deep the body starts in it.
  const Statics stiff = c.solve(R"({"contacts": [{"at_mm": [10, 10, 58], "normal": [-0.05, 0.04, -1],
                                   "stiffness_n_per_mm": 1e5}]})",
                                ElasticLaw::linear, TetOrder::t10);
  ASSERT_TRUE(stiff.converged) << stiff.why;
  EXPECT_LT(length(stiff.contact_n + stiff.reaction_n), 1e-5 * length(stiff.contact_n));
  // Contact holds nothing by itself.
  TissueProblem p = problem_of(load, c.mesh);
  const FemBody body(points_of(c.mesh), tets_of(c.mesh), p.materials, ElasticLaw::linear, TetOrder::t4);
  p.loads[0].sliders.clear();
  EXPECT_THROW(static_cast<void>(statics(body, p.loads[0])), Error);
}

TEST(Statics, AgreesWithCalculixNearZeroAndMoved) {
  if (!test::calculix_is_here()) GTEST_SKIP() << "CalculiX (ccx) is not installed: agreement with it not tested";
  const Column c;
  // Coordinates that are nearly zero, as turned bodies have them: over 20 characters with all their digits.
  TetMesh mesh = c.mesh;
  int near_zero = 0;
  for (auto& p : mesh.points_mm) {
    for (float& v : p) {
      if (v == 0) v = ++near_zero % 2 == 0 ? 1.2345678e-15F : -6.5432119e-17F;
    }
  }
  for (const std::string load :
       {R"({"gravity_m_s2": [0, 0, -9.81]})",
        R"({"moved": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "axes": "z", "by_mm": [0,0,3.3333333333333333]}]})",
        R"({"forces": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "total_n": [0, 0, 0.1234567891234567]}]})"}) {
    const TissueProblem p = problem_of(load, mesh);
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(points_of(mesh), tets_of(mesh), p.materials, ElasticLaw::linear, order);
      const TissueLoad all = body.on_all_points(p.loads[0]);
      const std::string inp = inp_text(body, all);
      std::istringstream lines(inp);
      for (std::string line; std::getline(lines, line);) {
        std::istringstream fields(line);
        for (std::string f; line[0] != '*' && std::getline(fields, f, ',');)
          ASSERT_LE(f.size() - f.find_first_not_of(' '), 20u) << line;
      }
      const Statics ours = statics(body, all);
      ASSERT_TRUE(ours.converged) << ours.why;
      const std::vector<Vec3> u = test::by_calculix(inp, body.point_count());
      ASSERT_EQ(u.size(), body.point_count()) << load;
      double off = 0, most = 0;
      for (std::size_t q = 0; q < u.size(); ++q) {
        off = std::max(off, length(u[q] - (ours.points_mm[q] - body.rest()[q])));
        most = std::max(most, length(u[q]));
      }
      EXPECT_LT(off, 1e-5 * most) << load;
      // And what was written is read as the same problem.
      const InpFile file = parse_inp(inp, "x");
      const TissueProblem again = parse_tissue_problem(inp, file.mesh);
      ASSERT_EQ(again.loads.size(), 1u);
      const Statics there = statics(body, body.on_all_points(again.loads[0]));
      EXPECT_NEAR(there.energy_mj, ours.energy_mj, 1e-9 * ours.energy_mj) << load;
    }
  }
}

// Contact pairs push faces where we push points: the same against a plane but for the depth that is left, and against a
// ball as far as the mesh resolves what it touches.
TEST(Statics, ContactAgreesWithCalculix) {
  if (!test::calculix_is_here()) GTEST_SKIP() << "CalculiX (ccx) is not installed: agreement with it not tested";
  const Column c;
  const std::string press = R"("surfaces": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "kpa": [0, 0, 2]}])";
  struct Case {
    std::string load;
    ElasticLaw law;
    TetOrder order;
    double bound;
  };
  const std::string plane =
                        "{" + press +
                        R"(, "contacts": [{"at_mm": [0, 0, 60.5], "normal": [0, 0, -2], "stiffness_n_per_mm": 100}]})",
                    side =
                        R"({"contacts": [{"at_mm": [19, 0, 60], "normal": [-1, 0, -0.2], "stiffness_n_per_mm": 100}]})",
                    ball = R"({"contacts": [{"at_mm": [10, 10, 118], "radius_mm": 60, "stiffness_n_per_mm": 100}]})",
                    soft =
                        "{" + press +
                        R"(, "contacts": [{"at_mm": [0, 0, 60.5], "normal": [0, 0, -1], "stiffness_n_per_mm": 0.2}]})",
                    both = "{" + press +
                           R"(, "contacts": [{"at_mm": [0, 0, 60.5], "normal": [0, 0, -1], "stiffness_n_per_mm": 100},
                                                          {"at_mm": [79.5, 10, 30], "radius_mm": 60, "stiffness_n_per_mm": 100}]})";
  for (const Case& k : {Case{plane, ElasticLaw::linear, TetOrder::t4, 2e-3},
                        {plane, ElasticLaw::linear, TetOrder::t10, 1e-6},
                        {plane, ElasticLaw::stvk, TetOrder::t10, 1e-6},
                        {soft, ElasticLaw::linear, TetOrder::t10, 1e-6},
                        {soft, ElasticLaw::linear, TetOrder::t4, 0.045},
                        {side, ElasticLaw::linear, TetOrder::t10, 0.07},
                        {ball, ElasticLaw::linear, TetOrder::t10, 0.04},
                        {ball, ElasticLaw::linear, TetOrder::t4, 0.2},
                        {both, ElasticLaw::linear, TetOrder::t10, 0.045}}) {
    const TissueProblem p = problem_of(k.load, c.mesh);
    const FemBody body(points_of(c.mesh), tets_of(c.mesh), p.materials, k.law, k.order);
    const TissueLoad all = body.on_all_points(p.loads[0]);
    const Statics ours = statics(body, all);
    ASSERT_TRUE(ours.converged) << ours.why;
    const std::vector<Vec3> u = test::by_calculix(inp_text(body, all), body.point_count());
    ASSERT_EQ(u.size(), body.point_count()) << k.load;
    double off = 0, sum = 0;
    for (std::size_t q = 0; q < u.size(); ++q) {
      const Vec3 own = ours.points_mm[q] - body.rest()[q];
      off += dot(u[q] - own, u[q] - own);
      sum += dot(u[q], u[q]);
    }
    std::printf("contact, order %d, law %d: %.2e off CalculiX\n", static_cast<int>(k.order), static_cast<int>(k.law),
                std::sqrt(off / sum));
    EXPECT_LT(std::sqrt(off / sum), k.bound) << k.load;
  }
}

TEST(Statics, ContactThatAnInpFileCannotHold) {
  class Cylinder final : public RigidShape {
   public:
    [[nodiscard]] Ball bounds() const override { return {{}, 1e300}; }
    double distance_mm(Vec3 at, Vec3& outwards) const override {
      outwards = normalized(Vec3{at.x, at.y, 0});
      return std::hypot(at.x, at.y) - 1;
    }
  };
  const Column c;
  const TissueProblem p = problem_of(R"({"gravity_m_s2": [0, 0, -9.81]})", c.mesh);
  const FemBody body(points_of(c.mesh), tets_of(c.mesh), p.materials, ElasticLaw::linear, TetOrder::t4);
  TissueLoad load = p.loads[0];
  load.contacts.push_back({std::make_shared<Cylinder>(), 1});
  try {
    (void)inp_text(body, load);
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("only planes and balls"), std::string::npos) << e.what();
  }
}

TEST(Statics, GravityOfAnInpFile) {
  const Column c;
  const TissueProblem weight = problem_of(R"({"gravity_m_s2": [0, 0, -9.81]})", c.mesh);
  std::vector<Material> light = weight.materials;
  for (Material& m : light) m.density_kg_m3 = 0;
  const FemBody body(points_of(c.mesh), tets_of(c.mesh), light, ElasticLaw::linear, TetOrder::t4);
  std::string inp = inp_text(body, body.on_all_points(weight.loads[0]));
  inp.replace(inp.find("*CLOAD"), std::string::npos, "*DLOAD\nEALL, GRAV, 9810., 0., 0., -1.\n*END STEP\n");
  const InpFile file = parse_inp(inp, "x");
  EXPECT_THROW(static_cast<void>(parse_tissue_problem(inp, file.mesh)), Error);  // no *DENSITY
  inp.insert(inp.find("*ELSET"), "*DENSITY\n1e-9\n");
  EXPECT_THROW(static_cast<void>(parse_tissue_problem(inp, file.mesh, true, Weight::apart)), Error);
  const TissueProblem again = parse_tissue_problem(inp, file.mesh);
  const Statics ours = statics(body, weight.loads[0]), there = statics(body, again.loads[0]);
  EXPECT_NEAR(there.energy_mj, ours.energy_mj, 1e-9 * ours.energy_mj);
  // A density before the modulus, as others write it, is not forgotten.
  const std::string density = "*DENSITY\n1e-9\n";
  inp.erase(inp.find(density), density.size());
  inp.insert(inp.find("*ELASTIC"), density);
  EXPECT_EQ(statics(body, parse_tissue_problem(inp, file.mesh).loads[0]).energy_mj, there.energy_mj);
}

TEST(Statics, AllNodesAsVtu) {
  const Column c;
  const TissueProblem p = problem_of(R"({"gravity_m_s2": [0, 0, -9.81]})", c.mesh);
  const FemBody body(points_of(c.mesh), tets_of(c.mesh), p.materials, ElasticLaw::linear, TetOrder::t10);
  const Statics r = statics(body, body.on_all_points(p.loads[0]));
  const std::string text = nodes_vtu(body, r.points_mm);
  const test::ScratchFolder scratch;
  std::ofstream(scratch.path() / "n.vtu") << text;
  const Tets back = load_tets(scratch.path() / "n.vtu");  // as VTK reads it
  EXPECT_EQ(back->tets.size(), c.mesh.tets.size());
  ASSERT_EQ(back->points_mm.size(), c.mesh.points_mm.size());
  for (std::size_t q = 0; q < back->points_mm.size(); ++q) EXPECT_EQ(back->points_mm[q], to_floats(r.points_mm[q]));
  EXPECT_NE(text.find("NumberOfPoints=\"" + std::to_string(body.point_count()) + "\""), std::string::npos);
  // Doubles to the last digit.
  std::istringstream after(text.substr(text.find("displacement_mm\" NumberOfComponents") + 60));
  std::string line;
  std::getline(after, line);
  double z = 0;
  for (std::size_t q = 0; q < 5; ++q) after >> z >> z >> z;
  EXPECT_EQ(z, r.points_mm[4].z - body.rest()[4].z);
}

TEST(Statics, SaysWhatAProblemCannotMean) {
  const Column c;
  const auto says = [&](const std::string& load, const std::string& what) {
    try {
      static_cast<void>(problem_of(load, c.mesh));
      ADD_FAILURE() << load << " was read";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  says(R"({"gravity": [0,0,-9.81]})", "the key \"gravity\" is not known: did you mean \"gravity_m_s2\"?");
  says(R"({"name": "nothing"})", "it has none of");
  says(R"({"moved": [{"box_mm": [[-1,-1,59.9],[21,21,60.1]], "axes": "z", "by_mm": [1,0,0]}]})",
       "an axis that \"axes\" leaves free");
  says(R"({"moved": [{"box_mm": [[99,99,99],[100,100,100]], "by_mm": [1,0,0]}]})", "moved 1: no point lies in it");
  says(R"({"contacts": [{"at_mm": [0,0,0], "stiffness_n_per_mm": 1}]})", "it needs \"normal\"");
  says(R"({"contacts": [{"at_mm": [0,0,0], "normal": [0,0,0], "stiffness_n_per_mm": 1}]})", "no length");
  says(R"({"volumes": [{"at_mm": [99,0,0], "radius_mm": 1, "total_n": [0,0,1]}]})", "no tetrahedron lies in it");
}

}  // namespace
}  // namespace osteo
