// One head's sizes, lines and cells, and the solids made of them. head_model.cpp sets sizes and lines, head_solids.cpp
// has skull, jaw and soft parts, head_ear.cpp the ear and the mastoid's cells, head_anatomy.cpp asks them all for a
// point's tissue.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "anatomy_shapes.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::inline imaging {
namespace anatomy {

// What differs between individuals, as sizes in mm or factors.
struct Build {
  Vec3 vault{1, 1, 1};    // factors of the cranium
  double sinus_back = 0;  // sigmoid sinus
  double bulb_up = 0;     // jugular bulb
  double nerve_back = 0, nerve_out = 0, nerve_long = 0, nerve_thick = 1;
  double canal_wide = 1;
  double tegmen_up = 0;
  double tip_down = 0, mastoid_out = 0;
  double pneumatisation = 1, cell_size = 1;
  double cochlea = 1, canals = 1;
  double gonion_out = 0, jaw_height = 0;
};

struct Tooth {
  Vec3 centre, along;  // middle of the crown; direction of the row
  Vec3 half;           // along the row, across it, height
  double root = 0, up = 0;
};

inline constexpr Vec3 kMarker{72, -8, 46};
inline constexpr double kMarkerRadius = 6;

}  // namespace anatomy

struct HeadAnatomy::Model {
  explicit Model(std::uint64_t individual);
  [[nodiscard]] Sample sample(Vec3 p) const;

  anatomy::Build build;
  anatomy::Tube nerve, chorda, sinus, alveolar, carotid, cochlea, auditory_tube, arch_tube, meatus, canal;
  NerveMarks marks{};
  std::array<anatomy::Tooth, 16> teeth;
  std::vector<AirCell> cells;
  std::vector<TubePoint> jaw_line;  // of the body, from above; no radius

 private:
  // What is needed of a point more than once.
  struct Ear {
    double canal = 1e9, drum = 1e9, cavity = 1e9, labyrinth = 1e9, nerve = 1e9, chorda = 1e9, meatus = 1e9,
           carotid = 1e9;
  };
  [[nodiscard]] Ear ear(Vec3 p) const;
  [[nodiscard]] double outer_vault(Vec3 p) const;
  [[nodiscard]] double orbit(Vec3 p) const;
  [[nodiscard]] double ossicles(Vec3 p) const;
  [[nodiscard]] double tooth(Vec3 p) const;
  [[nodiscard]] double brain(Vec3 p, double vault, double sinus, const Ear& e, double orbit, double air) const;
  [[nodiscard]] double skin(Vec3 p, double vault) const;
  [[nodiscard]] double mandible(Vec3 p) const;
  [[nodiscard]] double nasal(Vec3 p) const;
  [[nodiscard]] double face(Vec3 p, double orbit, double nasal) const;
  [[nodiscard]] double cell_region(Vec3 p, double bone, double brain, double sinus, const Ear& e) const;
  [[nodiscard]] double in_cell(Vec3 p) const;
  [[nodiscard]] double in_duct(Vec3 p) const;
  [[nodiscard]] std::optional<std::size_t> lattice_index(Vec3 p) const;
  [[nodiscard]] double skull(Vec3 p, double vault, double brain, double orbit, double nasal, double air, double sinus,
                             const Ear& e) const;
  void place_canal();
  void place_nerves();
  void place_vessels();
  void place_jaw();
  void place_cochlea();
  void place_teeth(int row);
  void place_cells(std::uint64_t seed);

  // Cells that can matter in each box of a lattice, and the openings between them.
  static constexpr double kPitch = 2;
  Vec3 lattice_lo{};
  std::array<int, 3> lattice{};
  std::vector<std::vector<std::uint16_t>> near_cells, near_ducts;
  struct Duct {
    Vec3 a, b;
    double radius;
  };
  std::vector<Duct> ducts;
};

}  // namespace osteo::inline imaging
