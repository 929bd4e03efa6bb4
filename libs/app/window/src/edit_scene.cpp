#include "edit_scene.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkOpenGLState.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include "gl_texture.h"
#include "osteo/display/view/actors.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline app {

struct EditScene::Impl {
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  vtkNew<vtkRenderer> renderer;
  vtkSmartPointer<vtkActor> bone;
  std::vector<vtkSmartPointer<vtkActor>> parts;
  unsigned texture = 0;
  int width = 0, height = 0;
  bool dirty = true, looked = false;
  std::size_t triangles = 0;
  Vec3 eye{0.5, -0.8, 0.3};

  void look() {
    double b[6];
    renderer->ComputeVisiblePropBounds(b);
    if (b[0] > b[1]) return;
    const Vec3 lo{b[0], b[2], b[4]}, hi{b[1], b[3], b[5]};
    look_at(renderer, (lo + hi) * 0.5, std::max(1.0, 0.5 * length(hi - lo) * 0.85), normalized(eye));
    dirty = looked = true;
  }
};

EditScene::EditScene() : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  s.window->SetOwnContext(0);
  s.window->SetIsCurrent(true);
  s.window->SetReadyForRendering(true);
  s.window->SetMultiSamples(0);
  s.window->OpenGLInitContext();
  s.window->SetFrameBlitModeToBlitToCurrent();
  s.window->AddRenderer(s.renderer);
  set_up_scene(s.renderer);
  s.bone = make_bone_actor(to_vtk(TriMesh{}));
  s.renderer->AddActor(s.bone);
  s.texture = make_texture();
}

EditScene::~EditScene() {
  glDeleteTextures(1, &impl_->texture);
  impl_->window->Finalize();
}

void EditScene::show(const Preview& preview) {
  Impl& s = *impl_;
  s.triangles = preview.bone.triangles.size();
  vtkPolyDataMapper::SafeDownCast(s.bone->GetMapper())->SetInputData(to_vtk(preview.bone));
  for (const auto& part : s.parts) s.renderer->RemoveActor(part);
  s.parts.clear();
  for (const Preview::Part& p : preview.structures) {
    s.triangles += p.mesh.triangles.size();
    s.parts.push_back(make_bone_actor(to_vtk(p.mesh)));
    s.parts.back()->GetProperty()->SetColor(p.rgb[0] / 255.0, p.rgb[1] / 255.0, p.rgb[2] / 255.0);
    s.renderer->AddActor(s.parts.back());
  }
  // Bone hides what lies in it: with structures it is a veil.
  s.bone->GetProperty()->SetOpacity(preview.structures.empty() ? 1 : 0.45);
  s.bone->GetProperty()->SetBackfaceCulling(preview.structures.empty() ? 0 : 1);
  if (!s.looked) s.look();
  s.dirty = true;
}

void EditScene::look_from(Vec3 eye) {
  impl_->eye = eye;
  impl_->look();
}

void EditScene::turn(double dx, double dy) {
  vtkCamera* const camera = impl_->renderer->GetActiveCamera();
  camera->Azimuth(-0.4 * dx);
  camera->Elevation(0.4 * dy);
  camera->OrthogonalizeViewUp();
  impl_->dirty = true;
}

void EditScene::shift(double dx, double dy) {
  vtkCamera* const camera = impl_->renderer->GetActiveCamera();
  const double mm =
      2 * camera->GetDistance() * std::tan(camera->GetViewAngle() * 3.14159265 / 360) / std::max(1, impl_->height);
  double d[3], u[3], p[3], f[3];
  camera->GetDirectionOfProjection(d);
  camera->GetViewUp(u);
  camera->GetPosition(p);
  camera->GetFocalPoint(f);
  const Vec3 up{u[0], u[1], u[2]}, right = normalized(cross({d[0], d[1], d[2]}, up));
  const Vec3 by = right * (-dx * mm) + normalized(cross(right, {d[0], d[1], d[2]})) * (dy * mm);
  camera->SetPosition(p[0] + by.x, p[1] + by.y, p[2] + by.z);
  camera->SetFocalPoint(f[0] + by.x, f[1] + by.y, f[2] + by.z);
  impl_->dirty = true;
}

void EditScene::zoom(double factor) {
  impl_->renderer->GetActiveCamera()->Dolly(factor);
  impl_->dirty = true;
}

unsigned EditScene::texture(int width, int height) {
  Impl& s = *impl_;
  if (width != s.width || height != s.height) {
    s.width = width;
    s.height = height;
    s.dirty = true;
    put_pixels(s.texture, width, height, 3, nullptr);
  }
  if (s.dirty) {
    s.dirty = false;
    s.window->SetSize(width, height);
    s.renderer->ResetCameraClippingRange();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    s.window->GetState()->Reset();
    s.window->Render();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glReadBuffer(GL_BACK);
    glBindTexture(GL_TEXTURE_2D, s.texture);
    glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 0, 0, width, height);
    glBindTexture(GL_TEXTURE_2D, 0);
  }
  return s.texture;
}

std::array<double, 2> EditScene::pixel(Vec3 p) {
  Impl& s = *impl_;
  s.renderer->SetWorldPoint(p.x, p.y, p.z, 1);
  s.renderer->WorldToDisplay();
  const double* const d = s.renderer->GetDisplayPoint();
  return {d[0], s.height - 1 - d[1]};
}

std::size_t EditScene::triangles() const {
  return impl_->triangles;
}

}  // namespace osteo::inline app
