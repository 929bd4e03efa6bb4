#include "osteo/display/view/instrument_view.h"

#include <vtkActor.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "instrument_shapes.h"
#include "osteo/display/view/actors.h"

namespace osteo::inline display {

void BurrSpin::turn(double speed_rpm, double seconds, int flutes) {
  const double by = 2 * std::numbers::pi * speed_rpm / 60 * seconds, apart = 2 * std::numbers::pi / std::max(flutes, 1);
  angle_rad = std::fmod(angle_rad + by, 2 * std::numbers::pi);
  // Of a diamond no grain is like another, but the eye follows none that turns by more than a tenth.
  const double share = flutes > 0 ? by / apart : by / (0.1 * apart);
  sharp = std::clamp((0.5 - share) / 0.25, 0.0, 1.0);
}

bool is_bone(const World& world, Vec3 at_mm) {
  return std::any_of(world.bodies().begin(), world.bodies().end(), [&](const PlacedBody& placed) {
    return placed.body->bone.nearest(placed.world_from_body.inverse()(at_mm)) >= 0.5F;
  });
}

struct InstrumentView::Impl {
  struct Part {
    vtkNew<vtkActor> actor;
    vtkNew<vtkPolyDataMapper> mapper;
    vtkNew<vtkMatrix4x4> matrix;
    Part() {
      actor->SetMapper(mapper);
      actor->SetUserMatrix(matrix);
      actor->VisibilityOff();
      actor->GetProperty()->SetAmbient(0.12);
      actor->GetProperty()->SetDiffuse(0.8);
      actor->GetProperty()->SetSpecular(0.45);
      actor->GetProperty()->SetSpecularPower(35);
    }
  };
  vtkRenderer* renderer;
  Part head, shaft, ghost;
  int tool = -1;
  BurrSpin spin;
  double drawn_sharp = -1, in_bone = 0;
  bool cut = false;  // the shaft as drawn misses what is in bone
  std::optional<std::uint64_t> tick;

  void choose(int number) {
    tool = number;
    const Instrument& held = instrument_of(static_cast<std::uint8_t>(number));
    spin = {};
    drawn_sharp = -1;
    cut = false;
    if (held.as_burr() == nullptr) head.mapper->SetInputData(tip_surface(held));
    shaft.mapper->SetInputData(shaft_surface(held).data);
    ghost.mapper->SetInputData(round_cone_surface(held.head));
  }
};

InstrumentView::InstrumentView(vtkRenderer* renderer) : impl_(std::make_unique<Impl>()) {
  impl_->renderer = renderer;
  for (Impl::Part* const p : {&impl_->head, &impl_->shaft, &impl_->ghost}) renderer->AddActor(p->actor);
  impl_->ghost.mapper->ScalarVisibilityOff();
  vtkProperty* const p = impl_->ghost.actor->GetProperty();
  p->SetRepresentationToWireframe();
  p->SetColor(0.55, 0.80, 1.0);
  p->LightingOff();
}

InstrumentView::~InstrumentView() {
  for (Impl::Part* const p : {&impl_->head, &impl_->shaft, &impl_->ghost}) impl_->renderer->RemoveActor(p->actor);
}

void InstrumentView::hide() {
  for (Impl::Part* const p : {&impl_->head, &impl_->shaft, &impl_->ghost}) p->actor->VisibilityOff();
}

void InstrumentView::report_apart(Vec3 colour, double opacity) {
  impl_->shaft.mapper->ScalarVisibilityOff();
  impl_->shaft.actor->GetProperty()->SetColor(colour.x, colour.y, colour.z);
  for (Impl::Part* const p : {&impl_->head, &impl_->shaft}) p->actor->GetProperty()->SetOpacity(opacity);
}

void InstrumentView::show(const TickRecord& tick, double rate_hz, const std::function<bool(Vec3)>& solid,
                          const CuttingGuide& guide) {
  Impl& m = *impl_;
  if ((tick.flags & kPlateInHand) != 0) return hide();
  if (m.tool != tick.device.tool) m.choose(tick.device.tool);
  const Instrument& held = instrument_of(tick.device.tool);
  const Vec3 axis = tool_axis(tick, guide), hand = from_floats(tick.device.position_mm);
  const Vec3 off = from_floats(tick.shown_offset_mm);
  // At the bone's surface, not in it, however far the hand has sunk in.
  RigidTransform pose{frame_of_axis(axis), hand + off};
  // A blade lies flat in its guide; the hand does not tell how it is turned otherwise.
  if ((tick.flags & kInSlot) != 0 && guide.on()) pose.rotation = {{guide.normal, cross(axis, guide.normal), axis}};
  if (const Burr* const burr = held.as_burr()) {
    const double seconds = m.tick && tick.tick > *m.tick ? static_cast<double>(tick.tick - *m.tick) / rate_hz : 0;
    if (seconds > 0) m.spin.turn(static_cast<double>(tick.speed_rpm), seconds, flutes_of(*burr));
    // In few steps: each is another surface.
    const double sharp = std::round(m.spin.sharp * 8) / 8;
    if (sharp != m.drawn_sharp) m.head.mapper->SetInputData(burr_surface(*burr, sharp));
    m.drawn_sharp = sharp;
  }
  m.tick = tick.tick;
  const double c = std::cos(m.spin.angle_rad), s = std::sin(m.spin.angle_rad);
  set_matrix(m.head.matrix, pose * RigidTransform{Mat3{{Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}}, {}});
  set_matrix(m.shaft.matrix, pose);
  m.in_bone = 0;
  const bool touches = (tick.flags & kShaftContact) != 0 && solid;
  if (touches || m.cut) {
    ShaftSurface drawn = touches ? shaft_surface(held, [&](Vec3 p) { return solid(pose(p)); }) : shaft_surface(held);
    m.shaft.mapper->SetInputData(drawn.data);
    m.in_bone = drawn.in_bone;
    m.cut = touches;
  }
  m.head.actor->VisibilityOn();
  m.shaft.actor->VisibilityOn();
  set_matrix(m.ghost.matrix, RigidTransform{pose.rotation, hand});
  m.ghost.actor->SetVisibility(length(off) > kGhostMm ? 1 : 0);
}

double InstrumentView::shaft_in_bone() const {
  return impl_->in_bone;
}

bool InstrumentView::ghost_shown() const {
  return impl_->ghost.actor->GetVisibility() != 0;
}

}  // namespace osteo::inline display
