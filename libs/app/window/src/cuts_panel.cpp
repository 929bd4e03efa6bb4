#include "cuts_panel.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "gl_texture.h"
#include "grey_choice.h"
#include "osteo/core/base/translate.h"
#include "osteo/display/view/instrument_view.h"
#include "slice_overlay.h"
#include "ui_kit.h"
#include "ui_style.h"
#include "view_panels.h"

namespace osteo::inline app {
namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                    ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoScrollbar |
                                    ImGuiWindowFlags_NoScrollWithMouse;
constexpr ImU32 kHead = IM_COL32(255, 170, 60, 240), kShaft = IM_COL32(190, 200, 215, 220),
                kPlanned = IM_COL32(255, 90, 220, 230);

constexpr float kListRow = 30;  // of the design's pixels

float scale_now() {
  return em() / 13;
}

// A blade as a closed body; endless sides are longer than any head.
TriMesh blade_of(const SawCut& cut) {
  constexpr double kEndless = 600;
  const Vec3 n = normalized(cut.normal), along = normalized(cut.along - n * dot(cut.along, n)), deep = cross(n, along);
  const Vec3 half[3] = {n * (cut.kerf_mm / 2), along * ((cut.length_mm > 0 ? cut.length_mm : kEndless) / 2),
                        deep * ((cut.depth_mm > 0 ? cut.depth_mm : kEndless) / 2)};
  TriMesh box;
  for (int c = 0; c < 8; ++c) {
    box.points_mm.push_back(to_floats(cut.at_mm + half[0] * ((c & 1) != 0 ? 1 : -1) +
                                      half[1] * ((c & 2) != 0 ? 1 : -1) + half[2] * ((c & 4) != 0 ? 1 : -1)));
  }
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

// The middle of what the procedure wants removed, the first of it.
std::optional<Vec3> target_of(const RegionsView* regions) {
  if (regions == nullptr) return std::nullopt;
  for (const auto& r : regions->all()) {
    if (r.region.forbidden || r.surface == nullptr || r.surface->points_mm.empty()) continue;
    Vec3 sum{};
    for (const auto& p : r.surface->points_mm) sum += from_floats(p);
    return sum / static_cast<double>(r.surface->points_mm.size());
  }
  return std::nullopt;
}

// Of the middles of blocks of 8 voxels, those in bone.
std::optional<Vec3> bone_nearest(const World& world, Vec3 to) {
  std::optional<Vec3> best;
  double least = 1e30;
  for (const PlacedBody& b : world.bodies()) {
    const BrickGrid& bone = b.body->bone;
    for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
      const Ijk at = bone.brick_coordinate(brick);
      const Vec3 p = b.world_from_body(bone.frame().world_from_index({at.i * 8 + 3.5, at.j * 8 + 3.5, at.k * 8 + 3.5}));
      if (const double d = length(p - to); d < least && is_bone(world, p)) {
        least = d;
        best = p;
      }
    }
  }
  return best;
}

// Kept in the session: what could be seen is part of what was done.
void note_look(Rehearsal& rehearsal, const StructuresView::One& s) {
  rehearsal.note("structure", note_of(s.value, rehearsal.structures()->name_of(s.value), s.look));
}

}  // namespace

void CutsPanel::create() {
  for (unsigned& t : textures_) t = make_texture();
}

void CutsPanel::release() {
  glDeleteTextures(CutsControl::kCuts, textures_.data());
}

void CutsPanel::set_case(const std::optional<Image>& scan, const SparseGrid* hu, const std::vector<SparseGrid>& bone) {
  if (scan) {
    ct_ = ct_under_mouse_ = std::make_shared<const CtValues>(*scan);  // a dense one any thread may ask
  } else if (hu != nullptr) {
    ct_ = std::make_shared<const CtValues>(*hu);
    ct_under_mouse_ = std::make_shared<const CtValues>(*hu);
  }
  before_.clear();
  for (const SparseGrid& b : bone) before_.push_back(std::make_shared<const GridSampler>(b));
}

CutsLook CutsPanel::look() const {
  return {control_.hu.width,
          control_.hu.level,
          control_.preset(),
          control_.planes() == CutsControl::Planes::tool,
          control_.follows(),
          shown_.tint_removed,
          regions_ == nullptr || regions_->shown()};
}

void CutsPanel::take(const CutsLook& look) {
  if (look.preset >= 0 && look.preset < static_cast<int>(grey_presets().size())) control_.take_preset(look.preset);
  control_.hu = {look.window_hu, look.level_hu};
  control_.follow(look.follow);
  control_.take_planes(look.along_tool ? CutsControl::Planes::tool : CutsControl::Planes::body);
  shown_.tint_removed = look.removed;
}

void CutsPanel::begin(Rehearsal& rehearsal, StructuresView* structures, RegionsView* regions) {
  structures_ = structures;
  regions_ = regions;
  notes_.begin();
  std::vector<CutStructure> outlined;
  if (structures != nullptr) {
    for (const StructuresView::One& s : structures->all()) {
      outlined.push_back({s.value, s.surface});
      if (s.look != StructureLook::solid) note_look(rehearsal, s);  // as the session before left it
    }
  }
  for (std::size_t r = 0; regions != nullptr && r < regions->all().size(); ++r)
    outlined.push_back({CutStructure::kRegion + static_cast<int>(r), regions->all()[r].surface});
  double voxel_mm = 0.5;
  rehearsal.look([&](const World& world, SceneReaders&) {
    voxel_mm = world.finest_voxel_mm();
    Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
    for (const PlacedBody& b : world.bodies()) {
      const BrickGrid& bone = b.body->bone;
      for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
        const Ijk at = bone.brick_coordinate(brick);
        const Vec3 p =
            b.world_from_body(bone.frame().world_from_index({at.i * 8 + 3.5, at.j * 8 + 3.5, at.k * 8 + 3.5}));
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], p[a]);
          hi[a] = std::max(hi[a], p[a]);
        }
      }
    }
    if (lo.x > hi.x) lo = hi = {};
    control_.set_bounds(lo, hi, voxel_mm);
    Vec3 wanted = (lo + hi) * 0.5;
    if (const auto target = target_of(regions)) wanted = *target;
    if (const auto at = bone_nearest(world, wanted)) control_.begin_at(*at);
  });
  constexpr double kPixelsToAVoxel = 2.5;  // more would show nothing that a smooth enlargement does not
  drawer_.show(ct_, before_, std::move(outlined), voxel_mm / kPixelsToAVoxel);
  drawn_ = {};
}

void CutsPanel::lay_out(const ViewLayout& layout) {
  middle_ = scene_ = layout.view;
  header_ = footer_ = list_ = room_ = {};
  boxes_ = {};
  // Header above, reading below: at fixed places, whatever they say.
  const ImGuiStyle& style = ImGui::GetStyle();
  const float line = ImGui::GetFontSize() + style.ItemSpacing.y, pad = 2 * style.WindowPadding.y;
  const float top = 2 * (kSmallControl * layout.unit + style.ItemSpacing.y) + line + pad,
              bottom = 2 * line + pad - style.ItemSpacing.y;
  foot_ = {};
  any_ = true;
  one_alone_ = false;
  if (!layout.side.empty()) {
    boxes_ = layout.cuts;
    const ScreenBox& side = layout.side;
    header_ = {side.x, side.y, side.width, std::min(top, side.height)};
    footer_ = {side.x, std::max(header_.bottom(), side.bottom() - bottom), side.width, std::min(bottom, side.height)};
    // The structures have half of what is left, or less where that is enough.
    const float left = footer_.y - header_.bottom();
    const auto rows = static_cast<float>(structures_ == nullptr ? 0 : structures_->all().size());
    list_ = {side.x, header_.bottom(), side.width,
             rows > 0 ? std::min(std::floor(left / 2), line + pad + rows * kListRow * layout.unit) : 0};
    room_ = {side.x, list_.bottom(), side.width, footer_.y - list_.bottom()};
  } else if (layout.shown == Layout::plan) {
    boxes_ = layout.cuts;
    ScreenBox& first = boxes_.front();
    header_ = {first.x, first.y, first.width, std::min(top, first.height)};
    first = {first.x, first.y + header_.height, first.width, first.height - header_.height};
    ScreenBox& last = boxes_.back();
    footer_ = {last.x, std::max(last.y, last.bottom() - bottom), last.width, std::min(bottom, last.height)};
    last.height -= footer_.height;
  } else if (!layout.over[0].empty()) {
    const float u = layout.unit, wide = std::min(344 * u, layout.view.width);
    one_alone_ = layout.over[1].empty();
    if (one_alone_) {
      boxes_[static_cast<std::size_t>(chosen_)] = layout.over[0];
    } else {
      boxes_ = layout.over;
    }
    const ScreenBox& lowest = one_alone_ ? layout.over[0] : layout.over[2];
    foot_ = cuts_foot_box(layout);
    if (settings_open_) header_ = {std::max(layout.view.x, lowest.x - kGap * u - wide), layout.over[0].y, wide, top};
    footer_ = {std::max(layout.view.x, lowest.right() - wide),
               std::min(foot_.bottom() + kGap * u, layout.view.bottom() - bottom), wide, bottom};
  } else {
    any_ = control_.enlarged() >= 0;  // over the whole picture there is room for one in any case
  }
  if (const int big = control_.enlarged(); big >= 0 && any_) {
    ScreenBox& box = boxes_[static_cast<std::size_t>(big)];
    scene_ = box.empty() ? std::exchange(boxes_[static_cast<std::size_t>(chosen_)], {}) : box;
    box = middle_;
  }
  for (std::size_t c = 0; c < boxes_.size(); ++c)
    control_.resize(static_cast<int>(c), static_cast<int>(boxes_[c].width), static_cast<int>(boxes_[c].height));
}

void CutsPanel::upload(DrawnCut cut) {
  const auto n = static_cast<std::size_t>(cut.cut);
  ++uploads_;
  put_pixels(textures_[n], cut.view.width, cut.view.height, 4, cut.rgba.data());
  cut.rgba = {};
  drawn_[n] = std::move(cut);
}

// What the cuts are to show now, and what of it has been drawn.
void CutsPanel::take(Rehearsal& rehearsal) {
  if (!drawer_.busy()) {
    shown_.parts.clear();
    shown_.removed_mm3 = rehearsal.removed_mm3();
    rehearsal.look([&](const World& world, SceneReaders&) {
      for (const PlacedBody& b : world.bodies()) shown_.parts.push_back({b.body, b.world_from_body.inverse()});
    });
    shown_.hu = control_.hu;
  }
  std::array<std::optional<SliceView>, 3> views;
  for (std::size_t c = 0; c < views.size(); ++c) {
    if (boxes_[c].width > 8 && boxes_[c].height > 8) views[c] = control_.view(static_cast<int>(c));
  }
  for (DrawnCut& cut : drawer_.next(views, shown_)) upload(std::move(cut));
}

void CutsPanel::draw(Rehearsal& rehearsal, const SawCut* planned) {
  const TickRecord tick = rehearsal.latest();
  constexpr double kContactN = 0.05;  // less is the weight of nothing
  control_.tool_is(from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                   normalized(from_floats(tick.device.axis)), length(from_floats(tick.force_n)) > kContactN);
  if (const auto note = notes_.next(look(), ImGui::GetTime())) rehearsal.note("cuts", *note);
  if (!any_) return;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  if (!header_.empty()) header(rehearsal);
  if (!foot_.empty()) foot(rehearsal);
  if (!list_.empty() && structures_ != nullptr) list_in_side(rehearsal);
  mouse_in_ = false;
  for (int c = 0; c < CutsControl::kCuts; ++c) one_cut(c, rehearsal, planned);
  if (!mouse_in_) control_.move({});
  if (foot_.empty() || mouse_in_) readout(rehearsal);
  ImGui::PopStyleVar();
  if (list_open_ && list_.empty() && structures_ != nullptr) list_structures(rehearsal);
  take(rehearsal);
}

void CutsPanel::header(const Rehearsal& rehearsal) {
  begin_fixed("Cuts", header_, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  std::string help = tr("Drag with the right button in a cut to change it; right click: back to this.");
  if (ct_ && !ct_->soft_tissue()) {
    help += "\n";
    help += tr("The case keeps CT values of bone only: soft tissue stays black without --scan.");
  }
  if (const int p = grey_choice(control_.preset(), kSmallControl, 0, help); p >= 0) control_.take_preset(p);
  const float side = kSmallControl * unit(), gap = 4 * unit();
  bool first = true;
  const auto is_pressed = [&](const char* icon, bool on, const std::string& words) {
    if (!std::exchange(first, false)) ImGui::SameLine(0, gap);
    return tile(icon, icon, {false, on, true, words}, side);
  };
  if (is_pressed("crosshair", control_.follows(), tr("the cuts follow the tool"))) control_.follow(!control_.follows());
  const bool along = control_.planes() == CutsControl::Planes::tool;
  if (is_pressed("drill", along, tr("along the drill (F4)")))
    control_.take_planes(along ? CutsControl::Planes::body : CutsControl::Planes::tool);
  if (before_.empty()) shown_.tint_removed = false;
  if (!before_.empty() && is_pressed("scissors", shown_.tint_removed, tr("what was removed is tinted")))
    shown_.tint_removed = !shown_.tint_removed;
  if (regions_ != nullptr &&
      is_pressed("target", regions_->shown(), tr("what the procedure wants removed (green) or left (orange); Ctrl-L")))
    regions_->show(!regions_->shown());
  if (rehearsal.structures() != nullptr && list_.empty() &&
      is_pressed("list-check", list_open_,
                 filled(tr("structures ({n})"), {{"n", std::to_string(rehearsal.structures()->values().size())}})))
    list_open_ = !list_open_;
  kit_text(filled("{window} / {level} HU   ",
                  {{"window", shown_number(control_.hu.width, 0)}, {"level", shown_number(control_.hu.level, 0)}}) +
               (control_.enlarged() >= 0 ? tr("F3: back") : tr("F3: in the middle")),
           theme().quiet);
  ImGui::End();
}

void CutsPanel::foot(const Rehearsal& rehearsal) {
  const bool along = control_.planes() == CutsControl::Planes::tool;
  const CutsFoot pressed = draw_cuts_foot(
      foot_, one_alone_,
      one_alone_ ? chosen_
      : along    ? 1
                 : 0,
      settings_open_,
      rehearsal.structures() != nullptr ? tr("Window, level, structures, plan") : tr("Window, level, structures"));
  if (pressed.chosen >= 0 && one_alone_) chosen_ = pressed.chosen;
  if (pressed.chosen >= 0 && !one_alone_)
    control_.take_planes(pressed.chosen == 1 ? CutsControl::Planes::tool : CutsControl::Planes::body);
  if (pressed.settings) settings_open_ = !settings_open_;
}

void CutsPanel::mouse_over(int cut, float corner_x, float corner_y) {
  const bool hovered = ImGui::IsItemHovered(), active = ImGui::IsItemActive();
  if (!hovered && !active) return;
  mouse_in_ = true;
  const ImGuiIO& io = ImGui::GetIO();
  const SlicePointer at{cut, static_cast<double>(io.MousePos.x - corner_x) - 0.5,
                        static_cast<double>(io.MousePos.y - corner_y) - 0.5, io.KeyShift, io.KeyCtrl};
  control_.move(at);
  constexpr std::pair<ImGuiMouseButton, SliceButton> kButtons[] = {{ImGuiMouseButton_Left, SliceButton::left},
                                                                   {ImGuiMouseButton_Right, SliceButton::right},
                                                                   {ImGuiMouseButton_Middle, SliceButton::middle}};
  for (const auto& [button, is] : kButtons) {
    if (hovered && button == ImGuiMouseButton_Left && ImGui::IsMouseDoubleClicked(button)) {
      control_.double_click(at);
    } else if (hovered && ImGui::IsMouseClicked(button)) {
      control_.press(at, is);
    }
    if (ImGui::IsMouseReleased(button)) control_.release(at, is);
  }
  if (hovered && io.MouseWheel != 0) control_.wheel(at, static_cast<double>(io.MouseWheel));
}

void CutsPanel::one_cut(int cut, const Rehearsal& rehearsal, const SawCut* planned) {
  const auto n = static_cast<std::size_t>(cut);
  const ScreenBox box = boxes_[n];
  if (box.width < 8 || box.height < 8) return;
  // Letters and lines grow with the cuts, also where the panels' text does not.
  const float scale = scale_now();
  ImGui::SetNextWindowPos({box.x, box.y});
  ImGui::SetNextWindowSize({box.width, box.height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, {0, 0, 0, 1});
  ImGui::Begin(("cut " + std::to_string(cut)).c_str(), nullptr, kFixed | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const ImVec2 lo = ImGui::GetCursorScreenPos();
  if (!foot_.empty() && control_.enlarged() < 0) {
    // Its left edge moves, and all of them with it.
    ImGui::InvisibleButton("edge", {6 * unit(), box.height});
    if (ImGui::IsItemHovered() || ImGui::IsItemActive()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    if (ImGui::IsItemActive()) wished_width_ = box.width - ImGui::GetIO().MouseDelta.x;
    ImGui::SetCursorScreenPos(lo);
  }
  ImGui::InvisibleButton(
      "picture", {box.width, box.height},
      ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight | ImGuiButtonFlags_MouseButtonMiddle);
  mouse_over(cut, lo.x, lo.y);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const SliceView& view = control_.view(cut);
  const SliceOnScreen on{draw, view, lo, scale};
  draw->PushClipRect(lo, {lo.x + box.width, lo.y + box.height}, true);
  if (const auto& drawn = drawn_[n]) {
    // It may be of a moment ago: moved and zoomed as the cut is now. Of another plane it says nothing.
    const SliceView& of = drawn->view;
    if (dot(of.axes().right, view.axes().right) > 0.99 && dot(of.axes().down, view.axes().down) > 0.99) {
      const auto place = [&](double x, double y) {
        const auto p = view.pixel(of.world(x, y));
        return ImVec2{lo.x + static_cast<float>(p[0]) + 0.5F, lo.y + static_cast<float>(p[1]) + 0.5F};
      };
      draw->AddImage(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(textures_[n])), place(-0.5, -0.5),
                     place(of.width - 0.5, of.height - 0.5));
      for (const DrawnCut::Outline& o : drawn->outlines) {
        if (o.value >= CutStructure::kRegion) {
          if (!regions_->shown()) continue;
          const auto c = region_colour(
              regions_->all()[static_cast<std::size_t>(o.value - CutStructure::kRegion)].region.forbidden);
          const ImU32 ink = ImGui::ColorConvertFloat4ToU32(
              {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]), 0.9F});
          for (const CutLine& line : o.lines) on.line(line, ink, 1.2F * scale);
          continue;
        }
        const auto& all = structures_->all();
        const auto s = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.value == o.value; });
        if (s == all.end() || s->look == StructureLook::hidden) continue;
        const auto c = rehearsal.structures()->colour_of(s->value);
        const ImU32 colour =
            ImGui::ColorConvertFloat4ToU32({static_cast<float>(c[0]), static_cast<float>(c[1]),
                                            static_cast<float>(c[2]), s->look == StructureLook::clear ? 0.55F : 1.0F});
        for (const CutLine& line : o.lines) on.line(line, colour, 1.6F * scale);
      }
    }
  }
  if (planned != nullptr) {
    for (const CutLine& line : section_of(blade_of(*planned), view.through_mm, view.normal()))
      on.line(line, kPlanned, 1.5F * scale);
  }
  for (std::size_t hand = 0; hand < rehearsal.hands(); ++hand) {
    const TickRecord tick = rehearsal.latest(hand);
    if ((hand > 0 && tick.tick == 0) || (tick.flags & kPlateInHand) != 0) continue;
    const Instrument& held = instrument_of(tick.device.tool);
    const Vec3 at = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
               axis = normalized(from_floats(tick.device.axis));
    on.line(section_of(held.shaft, at, axis, view.through_mm, view.normal()), kShaft, 1.5F * scale);
    on.line(section_of(held.head, at, axis, view.through_mm, view.normal()), kHead, 1.5F * scale);
  }
  on.cross(control_.cross_mm());
  on.letters();
  // In a very small one they would lie on the letters; its foot says which it is.
  if (foot_.empty() || box.width >= 128 * unit()) {
    on.scale_bar();
    on.title(control_.name(cut));
  }
  if (!foot_.empty())
    draw->AddRect(lo, {lo.x + box.width, lo.y + box.height}, im_colour32(theme().line), kRound * unit(), 0,
                  std::max(1.0F, unit()));
  if (const auto& r = control_.ruler()) on.ruler({r->from_mm, r->to_mm});
  draw->PopClipRect();
  ImGui::End();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
}

void CutsPanel::readout(const Rehearsal& rehearsal) {
  ImGui::SetNextWindowPos({footer_.x, footer_.y});
  ImGui::SetNextWindowSize({footer_.width, footer_.height});
  ImGui::Begin("Under the mouse", nullptr, kFixed);
  if (const auto p = control_.under_mouse()) {
    std::string words = shown_figures(place_text(*p)) + " mm";
    if (const auto hu = ct_under_mouse_ ? ct_under_mouse_->at_world(*p) : std::nullopt)
      words += "   " + std::to_string(std::lround(*hu)) + " HU";
    ImGui::Text("%s", words.c_str());
    std::string below = ct_under_mouse_ && !ct_under_mouse_->at_world(*p) ? tr("no CT value is kept here") : "";
    if (const StructureMap* const map = rehearsal.structures()) {
      if (const auto near = map->at(*p); near.structure != 0) {
        below += (below.empty() ? "" : ";  ") +
                 filled(near.distance_mm < 0 ? tr("in {structure}") : tr("{structure}, {mm} mm away"),
                        {{"structure", tr(map->name_of(near.structure))}, {"mm", shown_number(near.distance_mm, 1)}});
      }
    }
    ImGui::Text("%s", below.c_str());
  } else {
    ImGui::TextDisabled("%s mm", shown_figures(place_text(control_.cross_mm())).c_str());
  }
  ImGui::End();
}

void CutsPanel::look_as(std::size_t number, StructureLook look, Rehearsal& rehearsal) {
  const StructuresView::One& s = structures_->all()[number];
  if (s.look == look) return;
  structures_->show(number, look);
  note_look(rehearsal, s);
}

// From where all cuts meet; empty where it is out of the map's reach.
std::string CutsPanel::far_text(const StructureMap& map, std::uint8_t value) const {
  const auto& values = map.values();
  const auto number = static_cast<std::size_t>(std::find(values.begin(), values.end(), value) - values.begin());
  const double mm = number < values.size() ? map.distance_mm(number, control_.cross_mm()) : map.reach_mm();
  return mm >= map.reach_mm() ? std::string() : shown_number(mm, 1);
}

void CutsPanel::list_in_side(Rehearsal& rehearsal) {
  begin_fixed("Structures in the side", list_);
  ImGui::TextDisabled("%s", tr("Structures, mm from the cross"));
  list_rows(rehearsal);
  ImGui::End();
}

// A row for each: a click shows it solid, clear, hidden in turns.
void CutsPanel::list_rows(Rehearsal& rehearsal) {
  const StructureMap& map = *rehearsal.structures();
  const float u = unit();
  const char* const looks[] = {tr_of("look", "solid"), tr_of("look", "clear"), tr_of("look", "hidden")};
  static constexpr std::string_view kEyes[] = {"eye", "adjustments-horizontal", "eye-off"};
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 0});
  for (std::size_t s = 0; s < structures_->all().size(); ++s) {
    const StructuresView::One& one = structures_->all()[s];
    const auto look = static_cast<int>(one.look);
    ImGui::Dummy({24 * u, kListRow * u});
    ImGui::SameLine();
    if (list_row(tr(map.name_of(one.value)) + "##" + std::to_string(one.value), far_text(map, one.value), false,
                 kListRow, kEyes[look]))
      look_as(s, static_cast<StructureLook>((look + 1) % 3), rehearsal);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", looks[look]);
    const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
    const auto c = map.colour_of(one.value);
    const float y = (lo.y + hi.y) / 2;
    ImGui::GetWindowDrawList()->AddRectFilled(
        {lo.x - 20 * u, y - 8 * u}, {lo.x - 4 * u, y + 8 * u},
        ImGui::ColorConvertFloat4ToU32({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                                        one.look == StructureLook::hidden ? 0.35F : 1}),
        3 * u);
  }
  ImGui::PopStyleVar();
}

// The same rows over the picture, with all of them at once above.
void CutsPanel::list_structures(Rehearsal& rehearsal) {
  const float u = unit(), width = std::min(344 * u, middle_.width - 16 * u);
  const ScreenBox box{
      std::max(middle_.x + 8 * u, header_.x - width), middle_.y + 8 * u, width,
      std::min(middle_.height - 16 * u, 112 * u + kListRow * u * static_cast<float>(structures_->all().size()))};
  begin_card("Structures", box, {12 * u, 12 * u});
  kit_text(tr("Structures, mm from the cross"), theme().quiet);
  ImGui::SameLine(box.width - 48 * u);
  if (tile("close", "x", {false, false, true, tr("Close")}, 36 * u)) list_open_ = false;
  const std::string looks[] = {tr_of("look", "solid"), tr_of("look", "clear"), tr_of("look", "hidden")};
  if (const int look = choice("all", looks, -1, kSmallControl); look >= 0) {
    for (std::size_t s = 0; s < structures_->all().size(); ++s) look_as(s, static_cast<StructureLook>(look), rehearsal);
  }
  list_rows(rehearsal);
  ImGui::End();
}

}  // namespace osteo::inline app
