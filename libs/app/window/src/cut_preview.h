// Which structures the saw would cut, before it does. Private to libs/app/window; no ImGui, no VTK.
#pragma once
#include <optional>
#include <string>

#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline app {

class CutPreview {
 public:
  /// As often as one likes: it is looked at again where the plane is another one and kEveryS have passed, or after
  /// kAgainS, since bone may have gone. Null: the case has no structures. Cost then: as voxels_sawn() and
  /// structures_cut().
  void look(const World& world, const StructureMap* structures, const SawCut& cut, double now_s);
  /// The saw is not being placed.
  void clear();

  /// It would go through a structure.
  [[nodiscard]] bool cuts() const { return cuts_; }
  /// "would cut the facial nerve (0.44 mm3)", "nearest: the sigmoid sinus, 1.2 mm", "no structure within 5 mm"; empty:
  /// nothing is known.
  [[nodiscard]] const std::string& text() const { return text_; }

  static constexpr double kEveryS = 0.15, kAgainS = 1;

 private:
  std::optional<SawCut> last_;
  double looked_s_ = -1e9;
  bool cuts_ = false;
  std::string text_;
};

}  // namespace osteo::inline app
