// What is to be done on a case and what counts: a file that names a case's structures.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"

namespace osteo::inline assessment {

/// What a structure is to the procedure.
enum class ProcedureRole : int {
  expose,       ///< to be shown, intact
  keep,         ///< to be left as it is
  thin,         ///< its wall is to be thinned, not opened
  never_touch,  ///< no tool that turns may reach it
  enter,        ///< a space that is to be opened: an antrum, cells
};
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(ProcedureRole) {
  return {"expose", "keep", "thin", "never_touch", "enter"};
}

/// What an item of the scale asks of the final product. What each computes: docs/validation/evidence.md, and the fields
/// of ScaleItem.
enum class ItemKind : int {
  exposed,
  not_violated,
  no_hole,
  no_cells_left,
  no_overhang,
  thinned,
  sharp_angle,
  followed,
  margin,
  pieces,
  fixed
};
[[nodiscard]] constexpr std::array<std::string_view, 11> enum_names(ItemKind) {
  return {"exposed",     "not_violated", "no_hole", "no_cells_left", "no_overhang", "thinned",
          "sharp_angle", "followed",     "margin",  "pieces",        "fixed"};
}

struct ProcedureStructure {
  using Params = ProcedureStructure;
  std::string name;
  ProcedureRole role = ProcedureRole::keep;
  bool optional = false;
  std::size_t line = 0;
  static void describe(Params& p, auto& visit) {
    visit({"name", "as the case has it", "", 0, 0, true}, p.name);
    visit({"role", "what it is to the procedure", "", 0, 0, true}, p.role);
    visit({"optional", "a case may lack it"}, p.optional);
  }
};

enum class RegionKind : int { target, forbidden };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(RegionKind) {
  return {"target", "forbidden"};
}
/// Bone at most `within_mm` from a structure's face, or inside it.
struct ProcedureRegion {
  using Params = ProcedureRegion;
  std::string name, structure;
  RegionKind kind = RegionKind::target;
  double within_mm = 1;
  std::size_t line = 0;
  static void describe(Params& p, auto& visit) {
    visit({"name", "name of the region", "", 0, 0, true}, p.name);
    visit({"kind", "whether it is to be removed or to be left", "", 0, 0, true}, p.kind);
    visit({"structure", "around which it lies", "", 0, 0, true}, p.structure);
    visit({"within_mm", "bone at most so far from it", "mm", 0, 8}, p.within_mm);
  }
};

/// Near a structure only some burrs are allowed.
struct InstrumentRule {
  using Params = InstrumentRule;
  std::string structure;
  double within_mm = 2, most_diameter_mm = 7;
  bool diamond_only = false;
  std::size_t line = 0;
  static void describe(Params& p, auto& visit) {
    visit({"structure", "near which it holds", "", 0, 0, true}, p.structure);
    visit({"within_mm", "and how near: from the burr's surface", "mm", 0, 8, true}, p.within_mm);
    visit({"most_diameter_mm", "the largest burr allowed there", "mm", 0.5, 20}, p.most_diameter_mm);
    visit({"diamond_only", "no cutting burr there"}, p.diamond_only);
  }
};

/// Near a structure the burr may press no harder.
struct ForceLimit {
  using Params = ForceLimit;
  std::string structure;
  double within_mm = 2, most_n = 1;
  std::size_t line = 0;
  static void describe(Params& p, auto& visit) {
    visit({"structure", "near which it holds", "", 0, 0, true}, p.structure);
    visit({"within_mm", "and how near: from the burr's surface", "mm", 0, 8, true}, p.within_mm);
    visit({"most_n", "the burr presses on bone", "N", 0, 100, true}, p.most_n);
  }
};

/// A part of a structure's face, by place: all of it at most `within_mm` from a point, or from the line through
/// several. What a burr hole or a window is about, where the whole face is far larger.
struct FacePatch {
  using Params = FacePatch;
  std::string name, structure;
  std::vector<Vec3> points_mm;  ///< one at least; where the bone lay at the beginning
  double within_mm = 5;
  std::size_t line = 0;
  static void describe(Params& p, auto& visit) {
    visit({"name", "of the patch", "", 0, 0, true}, p.name);
    visit({"structure", "of whose face it is a part", "", 0, 0, true}, p.structure);
    visit({"within_mm", "from its points, or the line through them", "mm", 0.5, 200, true}, p.within_mm);
  }
};

/// An item of the scale. Which fields it goes by depends on its kind; the others are rejected in files.
struct ScaleItem {
  using Params = ScaleItem;
  std::string name, structure, second, cells, patch;
  ItemKind kind = ItemKind::exposed;
  std::array<double, 3> towards{0, 0, 0};
  double within_deg = 90, within_mm = 3, cover_mm = 1, threshold = 0, most = 0, spread = 0;
  std::vector<Vec3> curve_mm;
  std::size_t line = 0;
  bool threshold_given = false, spread_given = false;
  static void describe(Params& p, auto& visit) {
    visit({"name", "in words of our own", "", 0, 0, true}, p.name);
    visit({"kind", "what is asked", "", 0, 0, true}, p.kind);
    visit({"structure", "structure that the region surrounds"}, p.structure);
    visit({"second", "sharp_angle: the other plate"}, p.second);
    visit({"cells", "no_cells_left: the structure that is cells"}, p.cells);
    visit({"patch", "only this part of its face (empty: all of it)"}, p.patch);
    visit({"towards", "only the part of its face that looks this way, LPS (0,0,0: all of it)", "", -1e4, 1e4},
          p.towards);
    visit({"within_deg", "and at most so far off", "deg", 1, 180}, p.within_deg);
    visit({"within_mm", "how far around the structure one looks", "mm", 0.5, 8}, p.within_mm);
    visit({"cover_mm", "what still counts as shown: bone between it and the cavity", "mm", 0, 8}, p.cover_mm);
    visit({"threshold",
           "the item's value has to reach it, or stay below it; see docs/validation/evidence.md for each kind", "", 0,
           1e6},
          p.threshold);
    visit({"most", "thinned: 90 % of the wall is at most so thick; margin: not beyond; fragments: at most so many", "",
           0, 1e6},
          p.most);
    visit({"spread", "spread of the value among good results: the unit of the margin", "", 1e-6, 1e6}, p.spread);
  }
};

struct ProcedureStep {
  std::string name;
  std::vector<std::string> items;  ///< it is done when these pass
};

struct Procedure {
  std::string name, about, file;
  std::string hash;    ///< of the text, its first 16 digits; of mirrored() with " mirrored" behind it
  double usual_s = 0;  ///< 0: nothing is said about time
  std::vector<ProcedureStructure> structures;
  std::vector<ProcedureRegion> regions;
  std::vector<InstrumentRule> instruments;
  std::vector<ForceLimit> force_limits;
  std::vector<FacePatch> patches;
  std::vector<ScaleItem> items;
  std::vector<ProcedureStep> steps;

  /// Null when the procedure does not name it.
  [[nodiscard]] const ProcedureStructure* find(std::string_view structure) const;
  [[nodiscard]] bool enters(std::string_view structure) const;
  /// Names of those that it enters (ProcedureRole::enter).
  [[nodiscard]] std::vector<std::string> opened() const;
};

/// The part of a structure's face that an item is about: by place (its patch), and by where it looks. Both must outlive
/// it.
class FacePart {
 public:
  FacePart(const Procedure& procedure, const ScaleItem& item);
  /// A place on the face and its normal, of any length but 0.
  [[nodiscard]] bool has(Vec3 at_mm, Vec3 normal) const;
  [[nodiscard]] bool whole() const { return patch_ == nullptr && all_sides_; }
  /// Why nothing of the face is in it.
  [[nodiscard]] std::string nothing() const;

 private:
  const FacePatch* patch_ = nullptr;
  Vec3 towards_;
  bool all_sides_ = true;
  double least_ = -1;
};

/// `name` as errors call it. Strict: Error(usage) with file, item and line for a key that is not known or says nothing
/// for its kind, a structure or an item that is not declared, two of one name, what is out of range.
[[nodiscard]] Procedure parse_procedure(std::string_view json, const std::string& name);
/// A file, or a name of built_in_procedures() where no file of that name is there. Errors as above; no_input.
[[nodiscard]] Procedure load_procedure(const std::filesystem::path& file);
/// Those that are part of the program, "mastoidectomy" first: the files in pipelines/procedures, without ".json".
[[nodiscard]] std::vector<std::string> built_in_procedures();
/// The text that load_procedure() reads.
[[nodiscard]] std::string procedure_text(const std::filesystem::path& file);
/// The same for the other side of the body: x of all directions, curves and patches turns its sign (about the plane x =
/// 0).
[[nodiscard]] Procedure mirrored(Procedure procedure);
/// Value and spread of an item's kind where the file gives none.
[[nodiscard]] double usual_threshold(ItemKind kind);
[[nodiscard]] double usual_spread(ItemKind kind);

}  // namespace osteo::inline assessment
