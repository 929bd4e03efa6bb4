#include "movie_stage.h"

#include <vtkGenericOpenGLRenderWindow.h>
#include <utility>

#include <algorithm>
#include <cmath>
#include <utility>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/slices.h"

namespace osteo::inline assessment {

MovieStage::MovieStage(int width, int height, const StructureMap* structures, bool deep)
    : area_{0, 0, static_cast<double>(width), static_cast<double>(height)}, window_(width, height) {
  window_.window()->AddRenderer(renderer_);
  set_up_scene(renderer_);
  world_view_ = std::make_unique<WorldView>(renderer_, structures);
  if (structures != nullptr) structures_ = std::make_unique<StructuresView>(renderer_, *structures);
  for (auto& hand : hands_) hand = std::make_unique<InstrumentView>(renderer_);
  deep_ = deep;
}

MovieStage::~MovieStage() {
  window_.make_current();
  for (auto& hand : hands_) hand.reset();
  structures_.reset();
  world_view_.reset();
}

Picture MovieStage::draw(SessionScene& scene, const ScopeView& view, std::size_t hands, double rate_hz) {
  window_.make_current();
  scene.refresh();
  world_view_->update(*scene.world(), scene.readers(), WorldView::Work::all);
  if (structures_ && !std::exchange(faded_, true))
    structures_->fade_at_border(scene.world()->bodies().front().body->bone.frame());
  const auto solid = [&](Vec3 p) { return is_bone(*scene.world(), p); };
  for (std::size_t h = 0; h < hands_.size(); ++h) {
    if (h < hands && scene.in_use(h)) {
      hands_[h]->show(scene.latest(h), rate_hz, solid, scene.world()->cutting_guide(static_cast<std::uint32_t>(h)));
    } else {
      hands_[h]->hide();
    }
  }
  aim(renderer_, view, area_);
  renderer_->ResetCameraClippingRange();
  set_depth(renderer_, {deep_, 1});
  return window_.render();
}

void write_strip(Picture& picture, const std::vector<std::string>& words) {
  const int size = std::max(9, picture.height / 30), height = 2 * size, top = picture.height - height;
  for (int y = std::max(0, top); y < picture.height; ++y) {
    std::uint8_t* const row =
        picture.rgb.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) * 3;
    for (int n = 0; n < 3 * picture.width; ++n) row[n] = static_cast<std::uint8_t>(row[n] * 2 / 5);
  }
  // So wide, about, are letters of this font.
  int x = size;
  for (const std::string& word : words) {
    const int wide = static_cast<int>(0.62 * size * static_cast<double>(word.size()));
    if (x + wide > picture.width) break;
    write_text(picture, word, x, picture.height - size * 2 / 3, size);
    x += std::max(wide, size * 5) + size;
  }
}

}  // namespace osteo::inline assessment
