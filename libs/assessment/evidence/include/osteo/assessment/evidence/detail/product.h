// What is left at the end: the primitives of docs/validation/evidence.md on a lattice, and the items of a scale built on them.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/procedure.h"
#include "osteo/core/base/context.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

/// A voxel of bone that is gone, where it lay before any piece was moved.
struct RemovedVoxel {
  Vec3 own_mm;
  float mm3 = 0;
};

/// Bone before and after on one lattice, in the frame of the first body, with all pieces where they lay at the
/// beginning. All distances in mm. The lattice: cubes of the bone's voxel, of 0.5 mm where that is larger, around all
/// that was removed and all structures named, with 5 mm around; more than kMaxCells cubes make it coarser, which it
/// says (`word`). Solid: density of at least a half, between voxels linear. Structures but those to be opened are solid
/// too: a cavity ends at them. Cavity: what a ball of kBallMm reaches from the lattice's faces through bone that is
/// gone, and on through spaces that were closed (those to be opened, and all that nothing else led to).
class Product {
 public:
  /// A margin nearer to 0 than this is a draw: on a lattice laid otherwise the item may come out the other way. An item
  /// whose places would have to be off by no more than the lattice can be (0.7 of a cube, docs/validation/evidence.md) for that
  /// has such a margin, and says so.
  static constexpr double kDraw = 0.2;
  static constexpr double kBallMm = 0.5, kOpenedMm = 2, kAroundMm = 5, kCoarsestMm = 0.5;
  static constexpr std::size_t kMaxCells = 24'000'000;

  /// All but `removed` must outlive this. O(cells): a few bits each; distances to the cavity only where an item of the
  /// procedure asks for them.
  Product(const World& before, const World& after, const StructureMap& structures, const Procedure& procedure,
          std::vector<RemovedVoxel> removed, const Context& context = {});
  ~Product();
  Product(const Product&) = delete;
  Product& operator=(const Product&) = delete;

  struct Result {
    const ScaleItem* item = nullptr;
    bool measured = false, pass = false;
    double value = 0, threshold = 0;
    double margin = 0;       ///< (value - threshold) / spread, positive where it passes
    std::string unit, word;  ///< why it was not measured, or what else is to be said
    std::vector<Vec3>
        evidence_mm;  ///< the places that prove it: bare, left, hidden, violated, ... by kind; at most 20000
    std::size_t evidence_count = 0;  ///< of all
    double evidence_each = 0;        ///< mm2 or mm3 that one place stands for
  };
  /// `item`: of the procedure. From several threads at once if wanted. `approach`: unit, from the bone to who drills,
  /// in the first body's frame: the middle of the cone of views of no_overhang; zero where it is not known. `injured`:
  /// names of structures that a running burr or a saw reached.
  [[nodiscard]] Result evaluate(const ScaleItem& item, Vec3 approach, const std::vector<std::string>& injured) const;

  /// Of an item that asks for no more than pieces and plates.
  [[nodiscard]] static Result count(const ScaleItem& item, const World& world);

  struct RegionResult {
    const ProcedureRegion* region = nullptr;
    double bone_mm3 = 0, removed_mm3 = 0;  ///< bone in it before, and how much of it is gone
  };
  [[nodiscard]] std::vector<RegionResult> regions() const;
  /// Removed bone that lies in no target region; all of it where there is none.
  [[nodiscard]] double outside_targets_mm3() const;
  [[nodiscard]] double cavity_mm3() const;
  [[nodiscard]] const std::string& word() const { return word_; }
  [[nodiscard]] double spacing_mm() const { return frame_.spacing_mm.x; }

 private:
  // A triangle of a structure's face.
  struct Patch {
    Vec3 at_mm, normal;
    double area_mm2 = 0;
    double cover_mm = 0;  // to the cavity
  };
  [[nodiscard]] bool value_of(const std::string& name, std::uint8_t& value) const;
  [[nodiscard]] std::vector<Patch> patch_of(std::uint8_t value, const ScaleItem& item) const;
  [[nodiscard]] double cavity_distance_mm(Vec3 own_mm) const;
  [[nodiscard]] Vec3 index_of(Vec3 own_mm) const;                      // in cells
  [[nodiscard]] bool cell(Vec3 own_mm, std::array<int, 3>& at) const;  // the nearest; false outside
  [[nodiscard]] std::size_t cell(Vec3 own_mm) const;                   // frame_.voxel_count() outside
  [[nodiscard]] Vec3 place(int i, int j, int k) const;
  [[nodiscard]] std::size_t offset(int i, int j, int k) const;
  [[nodiscard]] double distance_to(std::uint8_t value, Vec3 own_mm) const;
  void keep(Result& r, Vec3 at) const;
  // What a distance may be off by because of the lattice.
  [[nodiscard]] double off_mm() const;
  void settle(Result& r, bool passes_at_worst, bool passes_at_best) const;
  // Why there is no cavity to measure from.
  [[nodiscard]] std::string no_cavity() const;
  static std::string joined(const std::string& a, const std::string& b);
  void exposed(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void violated(const ScaleItem& item, std::uint8_t s, const std::vector<std::string>& injured, Result& r) const;
  void hole(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void cells_left(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void overhang(const ScaleItem& item, std::uint8_t s, Vec3 approach, Result& r) const;
  void thinned(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void sharp(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void followed(const ScaleItem& item, std::uint8_t s, Result& r) const;
  void margin(const ScaleItem& item, Vec3 approach, Result& r) const;

  struct Lattice;  // cells and distances
  void lay_lattice(const World& before);
  void measure_cavity_distances(const Context& context);
  const World& after_world_;
  const StructureMap& structures_;
  const Procedure& procedure_;
  std::vector<RemovedVoxel> removed_;
  Frame frame_;
  Mat3 turn_;  // of the lattice, back
  std::unique_ptr<Lattice> cells_;
  std::array<std::size_t, 256> number_{};  // of each structure, by value
  std::string word_;
};

}  // namespace osteo::inline assessment
