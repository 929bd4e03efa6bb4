#include "scene_tools.h"

#include <imgui.h>

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/bone/plate_fit.h"
#include "osteo/bone/plates.h"
#include "osteo/bone/world_mesh.h"
#include "osteo/view/actors.h"

namespace osteo {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kKeyTurn = 5 * kDegree;
constexpr double kTurnPerMm = 0.6 * kDegree;
constexpr double kCrumbMm3 = 30;  // what is smaller than that and hangs together with nothing becomes dust

RigidTransform grip_of(float turn_deg, float tilt_deg) {
  return rotation_about({}, {1, 0, 0}, static_cast<double>(tilt_deg) * kDegree) *
         rotation_about({}, {0, 0, 1}, static_cast<double>(turn_deg) * kDegree);
}

}  // namespace

std::optional<BoneHit> bone_on_ray(const World& world, Vec3 from, Vec3 direction, double reach_mm) {
  std::optional<BoneHit> first;
  double nearest = reach_mm;
  for (const PlacedBody& placed : world.bodies()) {
    const RigidTransform own = placed.world_from_body.inverse();
    const BrickGrid& bone = placed.body->bone;
    const Vec3 start = own(from), way = own.rotation * direction;
    const double step = bone.frame().spacing_mm.x / 2;
    for (double s = 0; s < nearest; s += step) {
      if (bone.nearest(start + way * s) < 0.5F) continue;
      nearest = s;
      first = BoneHit{from + direction * s, placed.body->id};
      break;
    }
  }
  return first;
}

SceneTools::SceneTools(vtkRenderer* renderer) : renderer_(renderer) {
  plane_data_ = vtkSmartPointer<vtkPolyData>::New();
  plane_ = vtkSmartPointer<vtkActor>::New();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(plane_data_);
  plane_->SetMapper(mapper);
  plane_->GetProperty()->SetColor(0.35, 0.75, 1.0);
  plane_->GetProperty()->SetOpacity(0.4);
  plane_->GetProperty()->LightingOff();
  plane_->GetProperty()->EdgeVisibilityOn();
  plane_->GetProperty()->SetEdgeColor(0.6, 0.9, 1.0);
  plane_->VisibilityOff();
  renderer_->AddActor(plane_);
}

SceneTools::~SceneTools() {
  renderer_->RemoveActor(plane_);
  if (plate_actor_) renderer_->RemoveActor(plate_actor_);
}

void SceneTools::renew(Vec3 centre_mm, double size_mm) {
  tool_ = Tool::drill;
  piece_ = SceneAction::kNobody;
  size_mm_ = size_mm;
  handle_mm_ = centre_mm;
  cut_ = SawCut{};
  cut_.at_mm = centre_mm;
  note_.clear();
}

void SceneTools::choose(Tool tool, Rehearsal& rehearsal, const ViewAxes& view) {
  if (tool == tool_) tool = Tool::drill;  // the same key puts it away
  if (tool_ == Tool::plate && tool != Tool::plate) rehearsal.act(SceneAction::grip(SceneAction::kNobody));
  tool_ = tool;
  note_.clear();
  if (tool == Tool::saw) {
    // As one sees it: across the view, from above to below.
    cut_.normal = view.right;
    cut_.along = view.up;
  }
  if (tool == Tool::plate) grip(rehearsal);
}

RigidTransform SceneTools::plate_grip() const {
  return grip_of(turn_deg_, tilt_deg_);
}

void SceneTools::grip(Rehearsal& rehearsal) {
  rehearsal.act(SceneAction::grip(static_cast<std::uint32_t>(plate_), grip_of(turn_deg_, tilt_deg_)));
}

void SceneTools::turn_saw(Vec3 axis, double angle) {
  const Mat3 r = rotation_about({}, axis, angle).rotation;
  cut_.normal = normalized(r * cut_.normal);
  cut_.along = normalized(r * cut_.along);
}

void SceneTools::move_piece(Rehearsal& rehearsal, const RigidTransform& by) {
  if (piece_ == SceneAction::kNobody) return;
  pose_ = by * pose_;
  // Rounding of many small turns must not add up.
  auto& c = pose_.rotation.column;
  c[0] = normalized(c[0]);
  c[1] = normalized(c[1] - c[0] * dot(c[0], c[1]));
  c[2] = cross(c[0], c[1]);
  handle_mm_ = by(handle_mm_);
  rehearsal.act(SceneAction::move(piece_, pose_));
}

void SceneTools::pick(Rehearsal& rehearsal, Vec3 from, Vec3 direction) {
  if (tool_ != Tool::piece) return;
  rehearsal.look([&](const World& world, SceneReaders&) {
    const auto hit = bone_on_ray(world, from, direction, 10 * size_mm_ + length(from - handle_mm_));
    if (!hit) return;
    piece_ = hit->body;
    if (world.find(piece_)->of_region) piece_ = world.bodies().front().body->id;
    pose_ = world.find(piece_)->world_from_body;
    handle_mm_ = hit->at_mm;
  });
}

void SceneTools::attach(Rehearsal& rehearsal) {
  const TickRecord tick = rehearsal.latest();
  const RigidTransform pose = plate_pose(from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                                         normalized(from_floats(tick.device.axis)), grip_of(turn_deg_, tilt_deg_));
  std::vector<std::uint32_t> under;
  rehearsal.look(
      [&](const World& world, SceneReaders&) { under = bodies_under(world, plate_library()[static_cast<std::size_t>(plate_)], pose); });
  if (under.empty()) {
    note_ = "no bone within 2 mm below the plate";
    return;
  }
  rehearsal.act(
      SceneAction::attach(static_cast<std::uint32_t>(plate_), pose, under[0], under.size() > 1 ? under[1] : SceneAction::kNobody));
  note_ = under.size() > 1 ? "fixed to two pieces" : "fixed to one piece";
  tool_ = Tool::drill;
}

void SceneTools::drag(double right_mm, double up_mm, bool turn, Rehearsal& rehearsal, const ViewAxes& view) {
  const Vec3 by = view.right * right_mm + view.up * up_mm;
  if (tool_ == Tool::saw) {
    if (turn) {
      turn_saw(view.up, right_mm * kTurnPerMm);
      turn_saw(view.right, -up_mm * kTurnPerMm);
    } else {
      cut_.at_mm += by;
    }
  } else if (tool_ == Tool::piece) {
    move_piece(rehearsal, turn ? rotation_about(handle_mm_, view.up, right_mm * kTurnPerMm) *
                                     rotation_about(handle_mm_, view.right, -up_mm * kTurnPerMm)
                               : RigidTransform{{}, by});
  }
}

void SceneTools::push(double deeper_mm, Rehearsal& rehearsal, const ViewAxes& view) {
  if (tool_ == Tool::saw) cut_.at_mm += view.forward * deeper_mm;
  if (tool_ == Tool::piece) move_piece(rehearsal, {{}, view.forward * deeper_mm});
}

bool SceneTools::key(Command command, Rehearsal& rehearsal, const ViewAxes& view) {
  switch (command) {
    case Command::saw:
      choose(Tool::saw, rehearsal, view);
      return true;
    case Command::pieces:
      choose(Tool::piece, rehearsal, view);
      return true;
    case Command::plates:
      choose(Tool::plate, rehearsal, view);
      return true;
    case Command::undo:
      rehearsal.act(SceneAction::plain(ActionKind::undo));
      piece_ = SceneAction::kNobody;
      return true;
    case Command::turn_left:
    case Command::turn_right: {
      const double turn = command == Command::turn_left ? kKeyTurn : -kKeyTurn;
      if (tool_ == Tool::saw) turn_saw(view.forward, turn);
      if (tool_ == Tool::piece) move_piece(rehearsal, rotation_about(handle_mm_, view.forward, turn));
      if (tool_ == Tool::plate) {
        turn_deg_ += static_cast<float>(turn / kDegree);
        turn_deg_ -= 360 * std::round(turn_deg_ / 360);
        grip(rehearsal);
      }
      return tool_ != Tool::drill;
    }
    case Command::perform:
      if (tool_ == Tool::saw) rehearsal.act(SceneAction::saw(cut_));
      if (tool_ == Tool::piece) rehearsal.act(SceneAction::split(kCrumbMm3));
      if (tool_ == Tool::plate) attach(rehearsal);
      return tool_ != Tool::drill || !in_hand();
    case Command::put_away:
      if (tool_ == Tool::drill) return false;
      choose(tool_, rehearsal, view);
      return true;
    default:
      return false;
  }
}

void SceneTools::saw_panel(Rehearsal& rehearsal, const ViewAxes& view) {
  float kerf = static_cast<float>(cut_.kerf_mm), length = static_cast<float>(cut_.length_mm), depth = static_cast<float>(cut_.depth_mm);
  if (ImGui::SliderFloat("kerf", &kerf, 0.2F, 5, "%.1f mm")) cut_.kerf_mm = static_cast<double>(kerf);
  if (ImGui::SliderFloat("long", &length, 0, 150, length > 0 ? "%.0f mm" : "through")) cut_.length_mm = static_cast<double>(length);
  if (ImGui::SliderFloat("deep", &depth, 0, 150, depth > 0 ? "%.0f mm" : "through")) cut_.depth_mm = static_cast<double>(depth);
  if (ImGui::Button("as I see it")) {
    cut_.normal = view.right;
    cut_.along = view.up;
  }
  ImGui::SameLine();
  if (ImGui::Button("flat")) {
    cut_.normal = view.up;
    cut_.along = view.right;
  }
  if (ImGui::Button("Cut (Enter)", {-1, 0})) rehearsal.act(SceneAction::saw(cut_));
}

void SceneTools::piece_panel(Rehearsal& rehearsal) {
  if (ImGui::Button("Take apart (Enter)", {-1, 0})) rehearsal.act(SceneAction::split(kCrumbMm3));
  if (piece_ == SceneAction::kNobody) {
    ImGui::TextWrapped("Press on a piece and drag it; with Shift it turns.");
    return;
  }
  const Vec3 by = pose_.shift_mm;
  ImGui::Text("piece %u  %+.1f %+.1f %+.1f mm", piece_, by.x, by.y, by.z);
  if (ImGui::Button("Put back", {-1, 0})) move_piece(rehearsal, pose_.inverse());
}

void SceneTools::plate_panel(Rehearsal& rehearsal) {
  bool changed = false;
  if (ImGui::BeginCombo("plate", plate_library()[static_cast<std::size_t>(plate_)].name.c_str())) {
    for (std::size_t i = 0; i < plate_library().size(); ++i) {
      if (ImGui::Selectable(plate_library()[i].name.c_str(), static_cast<int>(i) == plate_)) {
        plate_ = static_cast<int>(i);
        changed = true;
      }
    }
    ImGui::EndCombo();
  }
  ImGui::TextWrapped("%s", plate_library()[static_cast<std::size_t>(plate_)].about.c_str());
  changed |= ImGui::SliderFloat("turn", &turn_deg_, -180, 180, "%.0f deg");
  changed |= ImGui::SliderFloat("tilt", &tilt_deg_, -90, 90, "%.0f deg");
  if (changed) grip(rehearsal);
  if (ImGui::Button("Fix it here (Enter)", {-1, 0})) attach(rehearsal);
}

void SceneTools::panel(Rehearsal& rehearsal, const ViewAxes& view) {
  static constexpr std::pair<const char*, Tool> kTools[] = {
      {"drill", Tool::drill}, {"saw (X)", Tool::saw}, {"pieces (P)", Tool::piece}, {"plates (L)", Tool::plate}};
  for (const auto& [name, tool] : kTools) {
    if (tool != Tool::drill && tool != Tool::piece) ImGui::SameLine();
    if (ImGui::RadioButton(name, tool_ == tool) && tool_ != tool) choose(tool, rehearsal, view);
  }
  if (tool_ == Tool::saw) saw_panel(rehearsal, view);
  if (tool_ == Tool::piece) piece_panel(rehearsal);
  if (tool_ == Tool::plate) plate_panel(rehearsal);
  std::vector<Fixture> fixtures;
  std::size_t steps = 0;
  rehearsal.look([&](const World& world, SceneReaders&) {
    fixtures = world.fixtures();
    steps = world.undo_steps();
  });
  for (const Fixture& f : fixtures) {
    const PlateModel& model = plate_library()[f.plate];
    ImGui::PushID(static_cast<int>(f.id));
    ImGui::Text("%u: %s", f.id, model.name.c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton("take off")) rehearsal.act(SceneAction::detach(f.id));
    if (model.most_opening_mm > 0 && f.other != SceneAction::kNobody) {
      float opening = static_cast<float>(f.opening_mm);
      if (ImGui::SliderFloat("open", &opening, 0, static_cast<float>(model.most_opening_mm), "%.1f mm"))
        rehearsal.act(SceneAction::open(f.id, static_cast<double>(opening)));
    }
    ImGui::PopID();
  }
  if (steps > 0 && ImGui::Button("Undo (Z)")) {
    rehearsal.act(SceneAction::plain(ActionKind::undo));
    piece_ = SceneAction::kNobody;
  }
  if (const std::string refused = rehearsal.take_refusal(); !refused.empty()) note_ = refused;
  if (!note_.empty()) ImGui::TextWrapped("%s", note_.c_str());
}

void SceneTools::show(const TickRecord& tick) {
  plane_->SetVisibility(tool_ == Tool::saw ? 1 : 0);
  if (tool_ == Tool::saw) {
    const Vec3 n = normalized(cut_.normal), along = normalized(cut_.along - n * dot(n, cut_.along)), across = cross(n, along);
    const double half_long = (cut_.length_mm > 0 ? cut_.length_mm : 1.4 * size_mm_) / 2;
    const double half_deep = (cut_.depth_mm > 0 ? cut_.depth_mm : 1.4 * size_mm_) / 2;
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> cells;
    // The blade's two faces.
    for (const double side : {-0.5, 0.5}) {
      const vtkIdType first = points->GetNumberOfPoints();
      for (const auto& [a, b] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
        const Vec3 p = cut_.at_mm + n * (side * cut_.kerf_mm) + along * (a * half_long) + across * (b * half_deep);
        points->InsertNextPoint(p.x, p.y, p.z);
      }
      const vtkIdType quad[4] = {first, first + 1, first + 2, first + 3};
      cells->InsertNextCell(4, quad);
    }
    plane_data_->SetPoints(points);
    plane_data_->SetPolys(cells);
    plane_data_->Modified();
  }
  const bool plate = (tick.flags & kPlateInHand) != 0;
  if (plate && plate_shown_ != plate_) {
    if (plate_actor_) renderer_->RemoveActor(plate_actor_);
    const PlateModel& model = plate_library()[static_cast<std::size_t>(plate_)];
    TriMesh mesh = model.mesh;
    append(mesh, model.moving);
    plate_actor_ = make_plate_actor(mesh);
    plate_actor_->SetUserMatrix(vtkNew<vtkMatrix4x4>());
    renderer_->AddActor(plate_actor_);
    plate_shown_ = plate_;
  }
  if (!plate_actor_) return;
  plate_actor_->SetVisibility(plate ? 1 : 0);
  set_matrix(plate_actor_->GetUserMatrix(), plate_pose(from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                                                       normalized(from_floats(tick.device.axis)), grip_of(turn_deg_, tilt_deg_)));
}

}  // namespace osteo
