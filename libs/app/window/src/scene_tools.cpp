#include "scene_tools.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
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
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

using Tool = HandTools::Tool;

std::string mm_or_through(double mm) {
  return mm > 0 ? shown_number(mm, 0) + " mm" : tr("through");
}

void saw_panel(HandTools& tools, Rehearsal& rehearsal, const ViewAxes& view, const CutPreview& preview,
               std::string& plan_name) {
  SawCut cut = tools.cut();
  bool changed = kit_slider(tr("Kerf"), shown_number(cut.kerf_mm, 1) + " mm", cut.kerf_mm, 0.2, 5, 0.1);
  changed |= kit_slider(tr("Length"), mm_or_through(cut.length_mm), cut.length_mm, 0, 150, 1);
  changed |= kit_slider(tr("Depth"), mm_or_through(cut.depth_mm), cut.depth_mm, 0, 150, 1);
  if (changed) tools.set_cut(cut);
  if (!tools.planned().empty()) {
    std::vector<std::string> names;
    for (const PlannedCut& p : tools.planned()) names.push_back(p.name);
    if (const int chosen = kit_list({}, names, -1, tr("Planned cuts")); chosen >= 0)
      tools.choose_planned(static_cast<std::size_t>(chosen));
  }
  if (kit_button(tr_of("saw", "Upright"), ButtonLook::usual, 0, kSmallControl)) tools.aim_saw(view, false);
  ImGui::SameLine();
  if (kit_button(tr_of("saw", "Flat"), ButtonLook::usual, 0, kSmallControl)) tools.aim_saw(view, true);
  if (!preview.text().empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(preview.cuts() ? ink_of(palette::kVermillion) : theme().text));
    ImGui::TextWrapped("%s%s", preview.cuts() ? "! " : "", preview.text().c_str());
    ImGui::PopStyleColor();
  }
  const float wide = ImGui::GetContentRegionAvail().x;
  if (kit_button(tr("Cut (Enter)"), ButtonLook::main, wide)) tools.perform(rehearsal);
  // By force and time, with this plane as the cutting guide.
  if (kit_button(tr("By hand, along this plane"), ButtonLook::usual, wide)) tools.take_saw(rehearsal);
  if (kit_field("##plan", tr("Name: keeps it as planned"), plan_name)) {
    tools.keep_planned(plan_name);
    plan_name.clear();
  }
}

void saw_in_hand_panel(HandTools& tools, Rehearsal& rehearsal) {
  ImGui::TextWrapped(
      "%s", filled(tr("Held in its plane. Kerf {mm} mm."), {{"mm", shown_number(tools.cut().kerf_mm, 1)}}).c_str());
  if (kit_button(tr("Put away (Esc)"), ButtonLook::usual, ImGui::GetContentRegionAvail().x))
    tools.put_saw_away(rehearsal);
}

void piece_panel(HandTools& tools, Rehearsal& rehearsal) {
  std::vector<std::uint32_t> bodies;
  rehearsal.look([&](const World& world, SceneReaders&) {
    for (const PlacedBody& b : world.bodies()) {
      if (!b.of_region) bodies.push_back(b.body->id);
    }
  });
  const float wide = ImGui::GetContentRegionAvail().x;
  if (kit_button(tr("Separate fragments (Enter)"), ButtonLook::main, wide)) tools.perform(rehearsal);
  if (bodies.size() < 2) {
    ImGui::TextWrapped("%s", tr("The bone is in one piece."));
    return;
  }
  ImGui::TextWrapped("%s", tr("Drag one in the picture; with Shift it turns."));
  constexpr std::size_t kShown = 5;
  ImGui::BeginChild("fragments", {0, kRow * unit() * static_cast<float>(std::min(kShown, bodies.size()))});
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 0});
  for (const std::uint32_t body : bodies) {
    const std::string name = filled(tr("Fragment {n}"), {{"n", std::to_string(body + 1)}});
    if (list_row(name, "", tools.piece() == body)) tools.take_piece(body, rehearsal);
  }
  ImGui::PopStyleVar();
  ImGui::EndChild();
  if (tools.piece() == SceneAction::kNobody) return;
  const Vec3 by = tools.piece_pose().shift_mm;
  char moved[64];
  std::snprintf(moved, sizeof moved, "%+.1f %+.1f %+.1f", by.x, by.y, by.z);
  ImGui::TextUnformatted(filled(tr("moved {mm} mm"), {{"mm", shown_figures(moved)}}).c_str());
  if (kit_button(tr("Put back"), ButtonLook::usual, wide)) tools.put_piece_back(rehearsal);
}

void plate_panel(HandTools& tools, Rehearsal& rehearsal) {
  std::size_t plate = tools.plate();
  double turn = static_cast<double>(tools.plate_turn_deg()), tilt = static_cast<double>(tools.plate_tilt_deg());
  bool changed = false;
  std::vector<std::string> names;
  for (const PlateModel& p : plate_library()) names.push_back(p.name);
  if (const int chosen = kit_list({}, names, static_cast<int>(plate));
      chosen >= 0 && chosen != static_cast<int>(plate)) {
    plate = static_cast<std::size_t>(chosen);
    changed = true;
  }
  ImGui::TextWrapped("%s", tr(plate_library()[plate].about).c_str());
  const auto degrees = [](double deg) { return std::to_string(std::lround(deg)) + "°"; };
  changed |= kit_slider(tr("Turn"), degrees(turn), turn, -180, 180, 1);
  changed |= kit_slider(tr("Tilt"), degrees(tilt), tilt, -90, 90, 1);
  if (changed) tools.set_plate(plate, static_cast<float>(turn), static_cast<float>(tilt), rehearsal);
  if (kit_button(tr("Fix it here (Enter)"), ButtonLook::main, ImGui::GetContentRegionAvail().x))
    tools.perform(rehearsal);
}

// Where it should lie on bone.
void report_collision(double mm) {
  if (mm > kPlateCollisionMm)
    ImGui::TextColored(im_colour(ink_of(palette::kVermillion)), "! %s",
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
    // In lines, so that the cuts on the picture do not hide the end.
    const float most = 16 * e;
    const ImVec2 at{(*middle)[0] + e * 0.8F, (*middle)[1] - e * 0.5F},
        wide = ImGui::CalcTextSize(preview.text().c_str(), nullptr, false, most);
    draw->AddRectFilled({at.x - e * 0.25F, at.y}, {at.x + wide.x + e * 0.25F, at.y + wide.y}, IM_COL32(0, 0, 0, 190),
                        e / 4);
    draw->AddText(ImGui::GetFont(), ImGui::GetFontSize(), at, im_colour32(palette::kVermillion), preview.text().c_str(),
                  nullptr, most);
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
  if (tools.saw_in_hand()) {
    saw_in_hand_panel(tools, rehearsal);
  } else if (tools.tool() == Tool::saw) {
    saw_panel(tools, rehearsal, view, preview_, plan_name_);
  } else if (tools.tool() == Tool::piece) {
    piece_panel(tools, rehearsal);
  } else if (tools.tool() == Tool::plate) {
    plate_panel(tools, rehearsal);
    report_collision(hand_in_bone_mm_);
    fixed_plates(rehearsal);
  }
  if (const LocalText& note = tools.note(rehearsal); !note.empty()) ImGui::TextWrapped("%s", note.shown.c_str());
}

void SceneTools::fixed_plates(Rehearsal& rehearsal) {
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
    ImGui::TextWrapped("%u: %s", f.id, model.name.c_str());
    if (kit_button(tr("Take off"), ButtonLook::usual, 0, kSmallControl)) rehearsal.act(SceneAction::detach(f.id));
    report_collision(in_bone_mm[static_cast<std::size_t>(&f - fixtures.data())]);
    if (model.most_opening_mm > 0 && f.other != SceneAction::kNobody) {
      double opening = f.opening_mm;
      if (kit_slider(tr("Opening"), shown_number(opening, 1) + " mm", opening, 0, model.most_opening_mm, 0.1))
        rehearsal.act(SceneAction::open(f.id, opening));
    }
    ImGui::PopID();
  }
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
