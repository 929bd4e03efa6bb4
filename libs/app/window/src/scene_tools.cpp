#include "scene_tools.h"

#include <imgui.h>

#include <algorithm>
#include <cstdio>

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include "osteo/core/base/translate.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/instrument_view.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

using Tool = HandTools::Tool;

void saw_panel(HandTools& tools, Rehearsal& rehearsal, const ViewAxes& view, const CutPreview& preview,
               std::array<char, 64>& plan_name) {
  SawCut cut = tools.cut();
  const auto slider = [](const char* name, double& mm, float least, float most, const char* format) {
    float value = static_cast<float>(mm);
    if (ImGui::SliderFloat(name, &value, least, most, format)) mm = static_cast<double>(value);
  };
  slider(tr("kerf"), cut.kerf_mm, 0.2F, 5, "%.1f mm");
  slider(tr("long"), cut.length_mm, 0, 150, cut.length_mm > 0 ? "%.0f mm" : tr("through"));
  slider(tr("deep"), cut.depth_mm, 0, 150, cut.depth_mm > 0 ? "%.0f mm" : tr("through"));
  tools.set_cut(cut);
  if (!tools.planned().empty()) ImGui::SetNextItemWidth(-1);
  if (!tools.planned().empty() && ImGui::BeginCombo("##planned", tr("planned cuts"))) {
    for (std::size_t i = 0; i < tools.planned().size(); ++i) {
      if (ImGui::Selectable(tools.planned()[i].name.c_str())) tools.choose_planned(i);
    }
    ImGui::EndCombo();
  }
  if (ImGui::Button(tr("as I see it"))) tools.aim_saw(view, false);
  ImGui::SameLine();
  if (ImGui::Button(tr("flat"))) tools.aim_saw(view, true);
  if (!preview.text().empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(preview.cuts() ? ink_of(palette::kVermillion) : theme().text));
    ImGui::TextWrapped("%s%s", preview.cuts() ? "! " : "", preview.text().c_str());
    ImGui::PopStyleColor();
  }
  if (ImGui::Button(tr("Cut (Enter)"), {-1, 0})) tools.perform(rehearsal);
  // By force and time, with this plane as the cutting guide.
  if (ImGui::Button(tr("By hand, along this plane"), {-1, 0})) tools.take_saw(rehearsal);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::InputTextWithHint("##plan", tr("keep as planned: name, Enter"), plan_name.data(), plan_name.size(),
                               ImGuiInputTextFlags_EnterReturnsTrue)) {
    tools.keep_planned(plan_name.data());
    plan_name.fill(0);
  }
}

void piece_panel(HandTools& tools, Rehearsal& rehearsal) {
  if (ImGui::Button(tr("Separate fragments (Enter)"), {-1, 0})) tools.perform(rehearsal);
  if (tools.piece() == SceneAction::kNobody) {
    ImGui::TextWrapped("%s", tr("Press on a piece and drag it; with Shift it turns."));
    return;
  }
  const Vec3 by = tools.piece_pose().shift_mm;
  char moved[64];
  std::snprintf(moved, sizeof moved, "%+.1f %+.1f %+.1f mm", by.x, by.y, by.z);
  ImGui::TextUnformatted(
      filled(tr("piece {n}  {moved}"), {{"n", std::to_string(tools.piece())}, {"moved", shown_figures(moved)}})
          .c_str());
  if (ImGui::Button(tr("Put back"), {-1, 0})) tools.put_piece_back(rehearsal);
}

void plate_panel(HandTools& tools, Rehearsal& rehearsal) {
  std::size_t plate = tools.plate();
  float turn = tools.plate_turn_deg(), tilt = tools.plate_tilt_deg();
  bool changed = false;
  if (ImGui::BeginCombo(tr("plate"), plate_library()[plate].name.c_str())) {
    for (std::size_t i = 0; i < plate_library().size(); ++i) {
      if (ImGui::Selectable(plate_library()[i].name.c_str(), i == plate)) {
        plate = i;
        changed = true;
      }
    }
    ImGui::EndCombo();
  }
  ImGui::TextWrapped("%s", tr(plate_library()[plate].about).c_str());
  changed |= ImGui::SliderFloat(tr("turn"), &turn, -180, 180, "%.0f deg");
  changed |= ImGui::SliderFloat(tr("tilt"), &tilt, -90, 90, "%.0f deg");
  if (changed) tools.set_plate(plate, turn, tilt, rehearsal);
  if (ImGui::Button(tr("Fix it here (Enter)"), {-1, 0})) tools.perform(rehearsal);
}

// Where it should lie on bone.
void report_collision(double mm) {
  if (mm > kPlateCollisionMm)
    ImGui::TextColored({1.0F, 0.45F, 0.35F, 1}, "%s",
                       filled(tr("{mm} mm deep in bone"), {{"mm", shown_number(mm, 1)}}).c_str());
}

}  // namespace

void draw_saw_line(const HandTools& tools, const CutPreview& preview, const Project& project, const ScreenBox& area,
                   ImDrawList* draw) {
  const Colour colour = preview.cuts() ? palette::kVermillion : palette::kSkyBlue;
  if (tools.tool() != Tool::saw && !tools.saw_in_hand()) return;
  const SawCut& cut = tools.cut();
  const auto middle = project(cut.at_mm);
  if (!middle) return;
  // As far as the cut goes, or as can be told from here: what lies behind the eye has no place in the picture.
  const double half_mm = (cut.length_mm > 0 ? cut.length_mm : 1.4 * tools.size_mm()) / 2;
  const float e = em();
  draw->PushClipRect({area.x, area.y}, {area.right(), area.bottom()});
  for (const double way : {-1.0, 1.0}) {
    for (double mm = half_mm; mm > 1; mm /= 2) {
      const auto end = project(cut.at_mm + normalized(cut.along) * (way * mm));
      if (!end) continue;
      draw->AddLine({(*middle)[0], (*middle)[1]}, {(*end)[0], (*end)[1]}, IM_COL32(0, 0, 0, 160), e / 4);
      draw->AddLine({(*middle)[0], (*middle)[1]}, {(*end)[0], (*end)[1]}, im_colour32(colour), e / 8);
      break;
    }
  }
  draw->AddCircleFilled({(*middle)[0], (*middle)[1]}, e * 0.35F, IM_COL32(0, 0, 0, 160));
  draw->AddCircle({(*middle)[0], (*middle)[1]}, e * 0.35F, im_colour32(colour), 16, e / 8);
  if (preview.cuts()) {
    const ImVec2 at{(*middle)[0] + e * 0.8F, (*middle)[1] - e * 0.5F},
        wide = ImGui::CalcTextSize(preview.text().c_str());
    draw->AddRectFilled({at.x - e * 0.25F, at.y}, {at.x + wide.x + e * 0.25F, at.y + wide.y}, IM_COL32(0, 0, 0, 190),
                        e / 4);
    draw->AddText(at, im_colour32(palette::kVermillion), preview.text().c_str());
  }
  draw->PopClipRect();
}

SceneTools::SceneTools(vtkRenderer* renderer) : renderer_(renderer), hand_plate_(renderer) {
  plane_data_ = vtkSmartPointer<vtkPolyData>::New();
  plane_ = make_late_actor(Late::all);
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
}

void SceneTools::panel(HandTools& tools, Rehearsal& rehearsal, const ViewAxes& view) {
  if (tools.tool() == Tool::saw) saw_panel(tools, rehearsal, view, preview_, plan_name_);
  if (tools.tool() == Tool::piece) piece_panel(tools, rehearsal);
  if (tools.tool() == Tool::plate) {
    plate_panel(tools, rehearsal);
    report_collision(hand_in_bone_mm_);
  }
  std::vector<Fixture> fixtures;
  std::vector<double> in_bone_mm;
  rehearsal.look([&](const World& world, SceneReaders&) {
    fixtures = world.fixtures();
    for (const Fixture& f : fixtures)
      in_bone_mm.push_back(plate_in_bone_mm(world, plate_library()[f.plate], pose_of(world, f), f.opening_mm));
  });
  for (const Fixture& f : fixtures) {
    const PlateModel& model = plate_library()[f.plate];
    ImGui::PushID(static_cast<int>(f.id));
    ImGui::Text("%u: %s", f.id, model.name.c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton(tr("take off"))) rehearsal.act(SceneAction::detach(f.id));
    report_collision(in_bone_mm[static_cast<std::size_t>(&f - fixtures.data())]);
    if (model.most_opening_mm > 0 && f.other != SceneAction::kNobody) {
      float opening = static_cast<float>(f.opening_mm);
      if (ImGui::SliderFloat(tr("open"), &opening, 0, static_cast<float>(model.most_opening_mm), "%.1f mm"))
        rehearsal.act(SceneAction::open(f.id, static_cast<double>(opening)));
    }
    ImGui::PopID();
  }
  if (const std::string& note = tools.note(rehearsal); !note.empty()) ImGui::TextWrapped("%s", note.c_str());
}

void SceneTools::show(const HandTools& tools, const TickRecord& tick, const World& world,
                      const StructureMap* structures, double now_s) {
  const SawCut& cut = tools.cut();
  const bool shown = tools.tool() == Tool::saw || tools.saw_in_hand();
  plane_->SetVisibility(shown ? 1 : 0);
  // By hand it cuts where it is led, as a burr does: the servo looks after that.
  if (tools.tool() == Tool::saw) {
    preview_.look(world, structures, cut, now_s);
  } else {
    preview_.clear();
  }
  if (preview_.cuts()) {
    plane_->GetProperty()->SetColor(1.0, 0.3, 0.2);
  } else {
    plane_->GetProperty()->SetColor(0.35, 0.75, 1.0);
  }
  if (shown) {
    const Vec3 n = normalized(cut.normal), along = normalized(cut.along - n * dot(n, cut.along)),
               across = cross(n, along);
    const double half_long = (cut.length_mm > 0 ? cut.length_mm : 1.4 * tools.size_mm()) / 2;
    const double half_deep = (cut.depth_mm > 0 ? cut.depth_mm : 1.4 * tools.size_mm()) / 2;
    std::vector<Vec3> corners;
    // The blade's two faces.
    for (const double side : {-0.5, 0.5}) {
      for (const auto& [a, b] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
        corners.push_back(cut.at_mm + n * (side * cut.kerf_mm) + along * (a * half_long) + across * (b * half_deep));
    }
    if (corners != blade_mm_) {
      blade_mm_ = corners;
      vtkNew<vtkPoints> points;
      vtkNew<vtkCellArray> cells;
      for (const Vec3 p : corners) points->InsertNextPoint(p.x, p.y, p.z);
      for (const vtkIdType first : {0, 4}) {
        const vtkIdType quad[4] = {first, first + 1, first + 2, first + 3};
        cells->InsertNextCell(4, quad);
      }
      plane_data_->SetPoints(points);
      plane_data_->SetPolys(cells);
      plane_data_->Modified();
    }
  }
  if ((tick.flags & kPlateInHand) == 0) {
    hand_in_bone_mm_ = 0;
    held_.reset();
    return hand_plate_.hide_in_hand();
  }
  const HeldPlate now{tools.plate(), world.undo_steps(),
                      plate_pose(from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                                 normalized(from_floats(tick.device.axis)), tools.plate_grip())};
  // A hand that holds still is not drawn anew for what nobody sees.
  constexpr double kUnseenMm = 0.005, kArmMm = 20;
  if (held_ && held_->plate == now.plate && held_->undo_steps == now.undo_steps) {
    double off = length(now.pose.shift_mm - held_->pose.shift_mm);
    for (std::size_t c = 0; c < 3; ++c)
      off = std::max(off, kArmMm * length(now.pose.rotation.column[c] - held_->pose.rotation.column[c]));
    if (off < kUnseenMm) return;
  }
  held_ = now;
  hand_plate_.show_in_hand(world, static_cast<std::uint32_t>(now.plate), now.pose);
  hand_in_bone_mm_ = plate_in_bone_mm(world, plate_library()[now.plate], now.pose);
}

}  // namespace osteo::inline app
