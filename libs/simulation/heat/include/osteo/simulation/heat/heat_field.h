// Temperature in bone: heat conduction on cubes of the bone's own grid, only where it is warm.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/data/vec.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline simulation {

/// What conducts. Cortical bone as measured by several (0.3 to 0.8 W/(m K); the default is bovine, 0.55); wet soft
/// tissue from tables. Blood carries nothing off: its time constant in bone is above half an hour.
struct HeatMaterials {
  double bone_w_per_m_k = 0.55, bone_kg_per_m3 = 1900, bone_j_per_kg_k = 1300;
  double tissue_w_per_m_k = 0.5, tissue_kg_per_m3 = 1050, tissue_j_per_kg_k = 3600;
};

/// Shares of a cell, each 0 to 1, together at most 1; what is left is air, which neither holds nor conducts.
struct HeatMatter {
  float bone = 0, tissue = 0;
};

/// Where all heat went, J. added == stored + chips + cooled + forgotten.
struct HeatLedger {
  double added_j = 0;
  double chips_j = 0;      ///< left with bone that was removed
  double cooled_j = 0;     ///< into water; below 0: it warmed
  double forgotten_j = 0;  ///< of bricks that had become as cool as the rest
};

/// Finite volumes in cubes of `cell_mm`, explicit in time. Each cell exchanges heat with its 6 neighbours at faces and
/// 12 at edges, 2 to 1 (the 19-point Laplacian, whose error has no direction); at a sixth of h2 / alpha a step's own
/// error takes that one away, so that inside one material the method is of fourth order in space. Where one of the four
/// cells about an edge is emptier, that much goes through faces only: a wall inside the lattice is exact for heat along
/// it. Between two cells heat goes through as much matter as the emptier one has, so a boundary inside cells needs no
/// smaller step, and what one loses the other gains to the last bit. Bricks of 8^3 cells are made where heat comes and
/// forgotten where nothing is warmer or cooler than kMinK, so the cost follows what is warm. Deterministic: the same
/// calls give the same bits. Temperatures are differences to the body's, K. Error against analytic solutions and cost,
/// at 0.25 mm: docs/validation/heat.md.
class HeatField {
 public:
  /// `matter` is asked once for each cell of a brick that is made; it must answer for any cell and see what
  /// set_matter() told.
  using MatterAt = std::function<HeatMatter(Ijk cell)>;
  HeatField(double cell_mm, const HeatMaterials& materials, MatterAt matter);

  /// A source's or water's place: the cells whose centres lie within a ball, in cells (centre of cell i at i).
  struct Ball {
    Vec3 centre;
    double radius = 0;
  };
  /// Heat that comes during the next step(), into the cells of a ball, to each by what it holds. `when`: in the middle
  /// of which time, 0 the step's beginning, 1 its end, as a share of it; a source that moves is told place by place,
  /// each with its own, and is then as exact as one that stands. Where step() has to make more than one of it, heat
  /// comes evenly. Returns what found matter: nothing where there is none.
  double add(const Ball& where, double joules, double when = 0.5);
  /// What the cells of a ball hold, J/K.
  [[nodiscard]] double holds(const Ball& where);
  [[nodiscard]] double full_cell_j_per_k() const { return bone_j_per_k_; }
  /// Water on the open faces within a ball, for the next step() only; between a cell's centre and its face lies bone.
  /// Colder or warmer than the body it makes bricks there.
  void cool(const Ball& where, double film_w_per_m2_k, double water_k);
  /// Bone went (or came, by undo, cool): it takes its heat along.
  void set_matter(Ijk cell, HeatMatter now);
  /// On by seconds, in as many equal steps as stability asks for. Most exact when that is a whole number of
  /// longest_step_s().
  void step(double seconds);

  /// Over the body's temperature; 0 where nothing is warm.
  [[nodiscard]] double at(Ijk cell) const noexcept;
  /// Between the centres of cells; cells of air do not count. `where` in cells.
  [[nodiscard]] double at(Vec3 where) const noexcept;
  [[nodiscard]] const HeatLedger& ledger() const { return ledger_; }
  [[nodiscard]] double stored_j() const;
  /// The highest of cells that are at least half matter: a crumb of a cell gets as hot as the chip that it will be.
  [[nodiscard]] double hottest() const;
  [[nodiscard]] std::size_t bricks() const { return bricks_.size(); }
  [[nodiscard]] double cell_mm() const { return cell_mm_; }
  /// The longest step that is stable, under water too, s: h2 / (6 alpha) of what conducts best.
  [[nodiscard]] double longest_step_s() const;
  /// Bricks (cells / 8) that are kept, in a fixed order.
  [[nodiscard]] std::vector<Ijk> warm_bricks() const;
  /// The 512 temperatures of a kept brick, x fastest; 0 in air. Until the next call that changes anything.
  [[nodiscard]] std::span<const double> brick(Ijk at) const;

  static constexpr double kMinK = 1e-3;

 private:
  static constexpr int kCells = 512;
  static constexpr int kLinks = 729;  // 9^3: from the layer before the brick's own cells on
  struct Brick {
    Ijk at;                           // in bricks
    std::array<Brick*, 27> around{};  // x fastest, itself in the middle; null: none is made
    std::array<double, kCells> kelvin{}, change{};
    std::array<float, kCells> capacity{};       // J/K
    std::array<float, kCells> conducts{};       // W/K through a whole face
    std::array<float, kCells> share{};          // of the cell that is matter
    std::array<double, kCells> source{};        // J, during the next step
    std::array<double, kCells> late{};          // of which so much comes behind it
    std::array<float, kCells> film{}, water{};  // W/K; K: of the next step
    // W/K to the cell at +x, +y, +z, and along both diagonals of the square that begins there, normal to x, y, z.
    std::array<std::array<float, kLinks>, 3> face{}, diagonal{};
    bool heated = false, cooled = false, links_old = true;
  };
  using Key = std::uint64_t;
  [[nodiscard]] static Key key_of(Ijk brick);
  [[nodiscard]] const Brick* find(Ijk brick) const;
  Brick& make(Ijk brick);
  void fill(Brick& b, int cell, HeatMatter m) const;
  static void link(Brick& b);
  static void links_are_old_around(Brick& b);
  void heat(double all, double late);
  void conduct(double seconds);
  void wake_and_forget();
  template <class F>
  void for_ball(const Ball& ball, bool make_bricks, F&& f);

  double cell_mm_, bone_j_per_k_, tissue_j_per_k_, bone_w_per_k_, tissue_w_per_k_;
  MatterAt matter_;
  std::map<Key, std::unique_ptr<Brick>> bricks_;
  HeatLedger ledger_;
};

// -- How much heat does to tissue.

/// Cumulative equivalent minutes at 43 C (Sapareto and Dewey 1984): minutes of dose a second at a temperature. R = 0.5
/// from 43 C on, 0.25 below, nothing below 39 C. Trusted to about 52 C only: above kCoagulatedC tissue is coagulated,
/// whatever the minutes.
[[nodiscard]] double cem43_per_s(double celsius) noexcept;
inline constexpr double kCoagulatedC = 57;
/// 47 C for a minute, the classic limit of bone (Eriksson and Albrektsson 1983), as such minutes.
inline constexpr double kBoneLimitCem43 = 16;

/// Of one place: what it has been through.
struct ThermalDose {
  double peak_c = 0;        ///< highest temperature
  double cem43_min = 0;     ///< dose
  bool coagulated = false;  ///< it was at kCoagulatedC or above
  void stay(double celsius, double seconds) noexcept;
};

}  // namespace osteo::inline simulation
