#include "osteo/display/view/actors.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkLight.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLActor.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {
namespace {

// Chosen by eye beside photographs of bone under irrigation, such that nothing burns out.
constexpr double kDrySpecular = 0.05, kDryPower = 20, kWetSpecular = 0.22, kWetPower = 70;
constexpr double kWetDarker[3] = {0.19, 0.25, 0.33};  // of red, green, blue: water takes the white off the surface

// VTK's own translucent pass loses the depth of what is opaque where the window's depth buffer has another format than
// the pass', and then draws through bone; and without depth peeling it sorts nothing.
class LateActor : public vtkOpenGLActor {
 public:
  static LateActor* New();
  vtkTypeMacro(LateActor, vtkOpenGLActor);
  vtkTypeBool HasTranslucentPolygonalGeometry() override { return 0; }
  int RenderOpaqueGeometry(vtkViewport*) override { return 0; }
  int RenderOverlay(vtkViewport* viewport) override {
    if (GetVisibility() == 0) return 0;
    SetIsRenderingTranslucentPolygonalGeometry(how_ != Late::nearest);  // writes no depth
    auto* const window = vtkOpenGLRenderWindow::SafeDownCast(viewport->GetVTKWindow());
    const bool through = how_ == Late::through_all && window != nullptr;
    if (through) window->GetState()->vtkglDisable(GL_DEPTH_TEST);
    const int drawn = vtkOpenGLActor::RenderOpaqueGeometry(viewport);
    if (through) window->GetState()->vtkglEnable(GL_DEPTH_TEST);
    SetIsRenderingTranslucentPolygonalGeometry(false);
    return drawn;
  }
  Late how_ = Late::nearest;
};
vtkStandardNewMacro(LateActor);

}  // namespace

vtkSmartPointer<vtkActor> make_late_actor(Late how) {
  auto actor = vtkSmartPointer<LateActor>::New();
  actor->how_ = how;
  actor->ForceOpaqueOn();
  actor->PickableOff();
  return actor;
}

bool is_late(vtkProp* prop) {
  return LateActor::SafeDownCast(prop) != nullptr;
}

vtkSmartPointer<vtkActor> make_bone_actor(vtkPolyData* data) {
  auto actor = vtkSmartPointer<vtkActor>::New();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  mapper->ScalarVisibilityOff();
  mapper->StaticOn();
  actor->SetMapper(mapper);
  vtkProperty* const p = actor->GetProperty();
  p->SetColor(0.93, 0.88, 0.77);
  p->SetAmbient(kBoneAmbient);
  p->SetDiffuse(0.82);
  p->SetSpecular(kDrySpecular);
  p->SetSpecularPower(kDryPower);
  return actor;
}

void set_bone_wet(vtkActor* bone, bool wet) {
  vtkShaderProperty* const shaders = bone->GetShaderProperty();
  shaders->ClearAllFragmentShaderReplacements();
  bone->SetForceOpaque(wet);
  if (!wet) return;
  char code[400];
  std::snprintf(code, sizeof code,
                "//VTK::Color::Impl\n"
                "  float wet = 1.0 - vertexColorVSOutput.a;\n"
                "  opacity = 1.0;\n"
                "  vec3 kept = 1.0 - wet * vec3(%.3f, %.3f, %.3f);\n"
                "  ambientColor *= kept;\n"
                "  diffuseColor *= kept;\n"
                "  specularColor = vec3(mix(%.3f, %.3f, wet));\n"
                "  specularPower = mix(%.1f, %.1f, wet);\n",
                kWetDarker[0], kWetDarker[1], kWetDarker[2], kDrySpecular, kWetSpecular, kDryPower, kWetPower);
  shaders->AddFragmentShaderReplacement("//VTK::Color::Impl", true, code, false);
}

void set_matrix(vtkMatrix4x4* matrix, const RigidTransform& t) {
  for (int r = 0; r < 3; ++r) {
    const auto a = static_cast<std::size_t>(r);
    for (int c = 0; c < 3; ++c) matrix->SetElement(r, c, t.rotation.column[static_cast<std::size_t>(c)][a]);
    matrix->SetElement(r, 3, t.shift_mm[a]);
  }
}

vtkSmartPointer<vtkPolyData> round_cone_surface(const RoundCone& shape) {
  // Rings from pole to pole: over the first ball up to where the side begins, then over the second.
  constexpr int kAround = 32, kRings = 12;
  const double b = shape.slope(), waist = std::asin(b);  // latitude of the circles where side and balls touch
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> normals;
  normals->SetNumberOfComponents(3);
  vtkNew<vtkCellArray> cells;
  int rings = 0;
  const auto ring = [&](double centre, double radius, double latitude) {
    for (int a = 0; a < kAround; ++a) {
      const double angle = 2 * std::numbers::pi * a / kAround;
      const double n[3] = {std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
                           std::sin(latitude)};
      points->InsertNextPoint(radius * n[0], radius * n[1], centre + radius * n[2]);
      normals->InsertNextTuple(n);
    }
    if (++rings == 1) return;
    for (int a = 0; a < kAround; ++a) {
      const vtkIdType next = (a + 1) % kAround, below = (rings - 2) * kAround, above = below + kAround;
      const vtkIdType quad[4] = {below + a, below + next, above + next, above + a};
      cells->InsertNextCell(4, quad);
    }
  };
  constexpr double kPole = std::numbers::pi / 2;
  for (int r = 0; r <= kRings; ++r) ring(shape.start_mm, shape.start_radius_mm, -kPole + (waist + kPole) * r / kRings);
  for (int r = 0; r <= kRings; ++r)
    ring(shape.start_mm + shape.length_mm, shape.end_radius_mm, waist + (kPole - waist) * r / kRings);
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(cells);
  data->GetPointData()->SetNormals(normals);
  return data;
}

void set_up_scene(vtkRenderer* renderer) {
  // Of one colour: occlusion draws over a gradient.
  renderer->SetBackground(0.09, 0.115, 0.15);
  renderer->GradientBackgroundOff();
  renderer->AutomaticLightCreationOff();
  renderer->RemoveAllLights();
  const auto lamp = [&](double x, double y, double intensity, double r, double g, double b) {
    vtkNew<vtkLight> light;
    light->SetLightTypeToCameraLight();
    light->SetPosition(x, y, 1);
    light->SetFocalPoint(0, 0, 0);
    light->SetIntensity(intensity);
    light->SetColor(r, g, b);
    renderer->AddLight(light);
  };
  lamp(-0.26, 0.34, 0.88, 1, 0.985, 0.96);
  lamp(0.9, -0.7, 0.25, 0.92, 0.96, 1);
}

double seen_height_mm(vtkRenderer* renderer) {
  vtkCamera* const camera = renderer->GetActiveCamera();
  if (camera->GetParallelProjection() != 0) return 2 * camera->GetParallelScale();
  return 2 * camera->GetDistance() * std::tan(camera->GetViewAngle() * std::numbers::pi / 360);
}

void set_depth(vtkRenderer* renderer, const PictureStyle& style) {
  renderer->SetUseSSAO(style.effects);
  renderer->SetUseFXAA(style.effects);
  if (!style.effects) return;
  // VTK keeps places for it in half floats: from a microscope's eye, 250 mm away, in steps of 0.12 to 0.25 mm. What
  // lies less than two of them deeper is not seen as deeper, or flat bone would be striped along its depths.
  const double step_mm = std::exp2(std::floor(std::log2(1.15 * renderer->GetActiveCamera()->GetDistance())) - 10);
  const double radius_mm = std::clamp(std::max(0.035 * seen_height_mm(renderer), 8 * step_mm), 0.5, 8.0);
  renderer->SetSSAORadius(radius_mm);
  renderer->SetSSAOBias(std::max(0.06 * radius_mm, 2 * step_mm));
  renderer->SetSSAOKernelSize(32);
  renderer->SetSSAOBlur(true);
}

void look_at(vtkRenderer* renderer, Vec3 centre, double radius_mm, Vec3 eye) {
  vtkCamera* const camera = renderer->GetActiveCamera();
  const double distance = radius_mm / 0.24;  // view angle of 30 degrees
  camera->SetFocalPoint(centre.x, centre.y, centre.z);
  camera->SetPosition(centre.x + eye.x * distance, centre.y + eye.y * distance, centre.z + eye.z * distance);
  const bool along_z = std::abs(eye.z) > 0.95;
  camera->SetViewUp(0, along_z ? -1 : 0, along_z ? 0 : 1);
  renderer->ResetCameraClippingRange();
}

}  // namespace osteo::inline display
