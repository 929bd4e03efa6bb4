#include "cuts_panel.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "osteo/view/slices.h"

namespace osteo {

void CutsPanel::create() {
  glGenTextures(3, textures_.data());
  for (const unsigned t : textures_) {
    glBindTexture(GL_TEXTURE_2D, t);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  }
  glBindTexture(GL_TEXTURE_2D, 0);
}

void CutsPanel::release() {
  glDeleteTextures(3, textures_.data());
}

void CutsPanel::draw(Rehearsal& rehearsal, int tool, std::span<const Box> boxes) {
  const TickRecord tick = rehearsal.latest();
  const auto& p = tick.device.position_mm;
  const Vec3 burr{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  if (follow_drill_) cross_ = burr;
  age_s_ += static_cast<double>(ImGui::GetIO().DeltaTime);
  const bool redraw = age_s_ > 0.15;
  if (redraw) age_s_ = 0;
  const bool apart = boxes.size() == 3;
  const Box& box = boxes.front();
  const float em = ImGui::GetFontSize(), line = ImGui::GetFrameHeightWithSpacing();
  const ImVec2 pad = ImGui::GetStyle().WindowPadding;
  const auto begin = [](const char* name, const Box& at) {
    ImGui::SetNextWindowPos({at.x, at.y});
    ImGui::SetNextWindowSize({at.width, at.height});
    ImGui::Begin(name, nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoBringToFrontOnFocus);
  };
  const auto controls = [&] {
    ImGui::Checkbox("follow the drill", &follow_drill_);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(std::max(3 * em, std::min(8 * em, ImGui::GetContentRegionAvail().x - 2 * em)));
    ImGui::SliderFloat("mm", &span_mm_, 20, 250, "%.0f");
  };
  if (!apart) {
    begin("Cuts", box);
    controls();
  }

  // What is left of the bone, in the grey of its CT value where the case has it.
  struct Part {
    std::shared_ptr<const Body> body;
    RigidTransform own;
  };
  std::vector<Part> parts;
  if (redraw) {
    rehearsal.look([&](const World& world, SceneReaders&) {
      for (const PlacedBody& b : world.bodies()) parts.push_back({b.body, b.world_from_body.inverse()});
    });
  }
  const GreyAt grey = [&](Vec3 at) {
    for (const Part& part : parts) {
      // The grey is the case's where the piece came from.
      const Vec3 own = part.own(at);
      const double density = static_cast<double>(part.body->bone.nearest(own));
      if (density > 0) return density * (hu_ ? std::max(40.0, grey_of_hu(static_cast<double>(hu_->nearest(own)))) : 220.0);
    }
    return 0.0;
  };
  static constexpr const char* kNames[] = {"axial", "coronal", "sagittal"};
  for (std::size_t n = 0; n < 3; ++n) {
    SliceView view;
    view.plane = static_cast<Plane>(n);
    view.centre_mm = view.through_mm = cross_;
    const Box& own = apart ? boxes[n] : box;
    // One below the other: squares that share the height, each below its name.
    const float third = (box.height - 2 * pad.y - line) / 3 - ImGui::GetTextLineHeightWithSpacing() - ImGui::GetStyle().ItemSpacing.y;
    const float high = std::max(40.0F, apart ? own.height - 2 * pad.y - line : std::min(own.width - 2 * pad.x, third));
    const float wide = apart ? std::max(40.0F, own.width - 2 * pad.x) : high;
    view.width = static_cast<int>(wide);
    view.height = static_cast<int>(high);
    view.mm_per_pixel = static_cast<double>(span_mm_) / std::min(view.width, view.height);
    if (redraw) {
      Picture picture = draw_slice(view, grey);
      write_directions(picture, view, 0, 0);
      glBindTexture(GL_TEXTURE_2D, textures_[n]);
      glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB, picture.width, picture.height, 0, GL_RGB, GL_UNSIGNED_BYTE, picture.rgb.data());
      glBindTexture(GL_TEXTURE_2D, 0);
    }
    if (apart) begin(kNames[n], own);
    ImGui::Text("%s", kNames[n]);
    if (apart && n == 0) {
      ImGui::SameLine();
      controls();
    } else if (apart) {
      ImGui::SameLine();
      ImGui::Dummy({0, ImGui::GetFrameHeight()});
    }
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(textures_[n])), {wide, high});
    if (ImGui::IsItemClicked()) {
      const ImVec2 m = ImGui::GetMousePos();
      cross_ = view.world(static_cast<double>(m.x - corner.x), static_cast<double>(m.y - corner.y));
      follow_drill_ = false;
      renew();
    }
    ImDrawList* const draw = ImGui::GetWindowDrawList();
    draw->AddLine({corner.x + wide / 2, corner.y}, {corner.x + wide / 2, corner.y + high}, IM_COL32(90, 160, 255, 90));
    draw->AddLine({corner.x, corner.y + high / 2}, {corner.x + wide, corner.y + high / 2}, IM_COL32(90, 160, 255, 90));
    const auto at = view.pixel(burr);
    const double radius = burr_library()[static_cast<std::size_t>(tool)].diameter_mm / 2 / view.mm_per_pixel;
    draw->PushClipRect(corner, {corner.x + wide, corner.y + high}, true);
    draw->AddCircle({corner.x + static_cast<float>(at[0]), corner.y + static_cast<float>(at[1])}, static_cast<float>(std::max(2.0, radius)),
                    IM_COL32(255, 170, 60, 230), 24, 1.5F);
    draw->PopClipRect();
    if (apart) ImGui::End();
  }
  if (!apart) ImGui::End();
}

}  // namespace osteo
