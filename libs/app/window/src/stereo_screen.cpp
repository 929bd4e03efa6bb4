#include "stereo_screen.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdint>

#include "gl_texture.h"
#include "osteo/display/view/actors.h"

namespace osteo::inline app {
namespace {

ImTextureID id_of(unsigned texture) {
  return reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture));
}

// ImGui calls it between two parts of its list: the colours that are written from here on, as bits.
void set_channels(const ImDrawList*, const ImDrawCmd* command) {
  const auto bits = reinterpret_cast<std::intptr_t>(command->UserCallbackData);
  glColorMask((bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, GL_TRUE);
}

void write_to(ImDrawList* list, const std::array<bool, 3>& channels) {
  const std::intptr_t bits = (channels[0] ? 1 : 0) | (channels[1] ? 2 : 0) | (channels[2] ? 4 : 0);
  list->AddCallback(set_channels, reinterpret_cast<void*>(bits));
}

}  // namespace

bool StereoScreen::has_quad_buffer() {
  if (quad_buffer_ < 0) {
    GLboolean has = GL_FALSE;
    glGetBooleanv(GL_STEREO, &has);
    quad_buffer_ = has == GL_TRUE ? 1 : 0;
  }
  return quad_buffer_ == 1;
}

void StereoScreen::draw(vtkRenderer* renderer, vtkGenericOpenGLRenderWindow* window, const ScopeView& view,
                        const PictureArea& area, int window_height) {
  const int width = static_cast<int>(area.width), height = static_cast<int>(area.height);
  if (width < 1 || height < 1) return;
  if (textures_[0] == 0) textures_ = {make_texture(), make_texture()};
  for (int eye = 0; eye < 2; ++eye) {
    aim_eye(renderer, view, params, area, eye);
    renderer->ResetCameraClippingRange();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    window->GetState()->Reset();
    window->Render();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    window->BlitDisplayFramebuffer();  // VTK's window shows nothing by itself
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glReadBuffer(GL_BACK);
    const unsigned texture = textures_[static_cast<std::size_t>(eye)];
    if (width != width_ || height != height_) {
      put_pixels(texture, width, height, 3, nullptr);
      if (eye == 1) {
        width_ = width;
        height_ = height;
      }
    }
    glBindTexture(GL_TEXTURE_2D, texture);
    glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, static_cast<int>(area.x),
                        window_height - static_cast<int>(area.y) - height, width, height);
    glBindTexture(GL_TEXTURE_2D, 0);
  }
  aim(renderer, view, area);
  renderer->ResetCameraClippingRange();

  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const auto at = [&](double x, double y) {
    return ImVec2(static_cast<float>(area.x + x * width), static_cast<float>(area.y + y * height));
  };
  constexpr std::array<bool, 3> kAll{true, true, true};
  std::array<bool, 3> channels = kAll;
  for (const StereoPiece& p : stereo_pieces(params, height, static_cast<int>(area.y))) {
    if (p.channels != channels) write_to(list, channels = p.channels);
    // Pictures of OpenGL stand on their heads.
    list->AddImage(id_of(textures_[static_cast<std::size_t>(p.eye)]), at(p.to[0], p.to[1]), at(p.to[2], p.to[3]),
                   {static_cast<float>(p.from[0]), static_cast<float>(1 - p.from[1])},
                   {static_cast<float>(p.from[2]), static_cast<float>(1 - p.from[3])});
  }
  if (channels != kAll) write_to(list, kAll);
}

void StereoScreen::show(const std::function<void()>& clear) {
  if (params.mode != StereoMode::quad_buffer || !has_quad_buffer()) {
    clear();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    return;
  }
  for (int eye = 0; eye < 2; ++eye) {
    glDrawBuffer(eye == 0 ? GL_BACK_LEFT : GL_BACK_RIGHT);
    clear();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    for (ImDrawCmd& command : ImGui::GetBackgroundDrawList()->CmdBuffer) {
      if (command.TextureId == id_of(textures_[0])) command.TextureId = id_of(textures_[1]);
    }
  }
  glDrawBuffer(GL_BACK);
}

void StereoScreen::release() {
  if (textures_[0] != 0) glDeleteTextures(2, textures_.data());
  textures_ = {};
}

}  // namespace osteo::inline app
