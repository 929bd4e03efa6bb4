// Tools, structures and buttons at the left of the editor. Private to libs/app/window.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "edit_control.h"
#include "osteo/app/window/edit_window.h"

namespace osteo::inline app {

class EditPanel {
 public:
  /// What the window has to do itself.
  struct Wishes {
    bool save = false, close = false;
    bool find = false;  ///< structures by the network of network()
  };
  /// Between ImGui::NewFrame and Render.
  Wishes draw(EditControl& control, float width, float height, bool saving);
  /// Offered above the structures; `can` is whether there is one who runs it.
  void set_network(bool can, std::string folder) {
    can_find_ = can;
    network_ = std::move(folder);
  }
  [[nodiscard]] const std::string& network() const { return network_; }
  /// Where its button was drawn, as threshold_slider().
  [[nodiscard]] const std::array<float, 4>& find_button() const { return find_button_; }
  /// Where the first of them was drawn, as threshold_slider().
  [[nodiscard]] const std::array<float, 4>& first_place() const { return first_place_; }
  /// Where the slider of the lower threshold was drawn last, for tests: x, y, width, height; no width: it was not.
  [[nodiscard]] const std::array<float, 4>& threshold_slider() const { return slider_; }

 private:
  void tools(EditControl& control);
  void options(EditControl& control);
  void greys(EditControl& control);
  void structures(EditControl& control);
  bool draw_colour(const EditStructure& s, std::array<float, 3>& rgb);
  void places(EditControl& control);
  bool network(const EditControl& control);
  std::string new_name_, name_;
  int named_ = -1;  // whose name stands in name_
  std::array<float, 3> colour_{};
  int coloured_ = -1;
  std::array<float, 4> slider_{}, first_place_{}, find_button_{};
  bool can_find_ = false;
  std::string network_;
};

}  // namespace osteo::inline app
