// The three linked cuts at the side of the window, one of which can take the middle, and the list of structures.
// Private to libs/app/window.
#pragma once
#include <array>
#include <optional>
#include <string>

#include "cuts_control.h"
#include "cuts_drawer.h"
#include "looks.h"
#include "osteo/display/view/planned_regions.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/saw.h"
#include "view_layout.h"

namespace osteo::inline app {

class CutsPanel {
 public:
  /// With an OpenGL context: makes and frees the textures.
  void create();
  void release();
  /// CT values (the scan's, else what the case keeps, may be null) and density as the case has it, the finest first.
  void set_case(const std::optional<Image>& scan, const SparseGrid* hu, const std::vector<SparseGrid>& bone);
  /// A rehearsal has begun. `structures` and `regions` (may be null) must live until the next call.
  void begin(Rehearsal& rehearsal, StructuresView* structures, RegionsView* regions);

  /// As they looked in another session.
  void take(const CutsLook& look);

  /// Before the rest of a frame: where things lie. On the picture, three or the one that is chosen, or four up.
  void lay_out(const ViewLayout& layout);
  /// Side of the cuts on the picture as the person dragged it; 0: as the layout has it.
  [[nodiscard]] float wished_width() const { return wished_width_; }
  /// What is left of the layout's side for the instrument in hand; empty where there is no side.
  [[nodiscard]] const ScreenBox& room() const { return room_; }
  /// Where the bone is drawn: the middle, or the place of the cut that has taken it.
  [[nodiscard]] const ScreenBox& scene() const { return scene_; }
  /// Between ImGui::NewFrame and Render. `planned`: a saw cut that is being placed; null: none.
  void draw(Rehearsal& rehearsal, const SawCut* planned);
  [[nodiscard]] CutsControl& control() { return control_; }
  [[nodiscard]] double last_ms() const { return drawer_.last_ms(); }
  /// Images of cuts that were put in so far.
  [[nodiscard]] std::uint64_t uploads() const { return uploads_; }

 private:
  void header(const Rehearsal& rehearsal);
  void foot(const Rehearsal& rehearsal);
  void one_cut(int cut, const Rehearsal& rehearsal, const SawCut* planned);
  void mouse_over(int cut, float corner_x, float corner_y);
  void readout(const Rehearsal& rehearsal);
  void list_structures(Rehearsal& rehearsal);
  void list_in_side(Rehearsal& rehearsal);
  void list_rows(Rehearsal& rehearsal);
  [[nodiscard]] std::string far_text(const StructureMap& map, std::uint8_t value) const;
  void look_as(std::size_t number, StructureLook look, Rehearsal& rehearsal);
  void take(Rehearsal& rehearsal);
  void upload(DrawnCut cut);
  [[nodiscard]] CutsLook look() const;

  CutsControl control_;
  CutsDrawer drawer_;
  StructuresView* structures_ = nullptr;
  RegionsView* regions_ = nullptr;
  CutsNotes notes_;
  std::shared_ptr<const CtValues> ct_, ct_under_mouse_;  // one for each thread
  std::vector<std::shared_ptr<const GridSampler>> before_;
  std::array<unsigned, CutsControl::kCuts> textures_{};
  std::array<std::optional<DrawnCut>, CutsControl::kCuts> drawn_;
  CutsScene shown_;
  std::array<ScreenBox, CutsControl::kCuts> boxes_;
  ScreenBox header_, footer_, middle_, scene_, foot_;  // foot_: below cuts that lie on the picture
  ScreenBox list_, room_;                              // in the layout's side
  float wished_width_ = 0;
  std::uint64_t uploads_ = 0;
  int chosen_ = 0;  // where one alone has room
  bool list_open_ = false, mouse_in_ = false, any_ = false, settings_open_ = false, one_alone_ = false;
};

}  // namespace osteo::inline app
