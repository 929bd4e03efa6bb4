#include "edit_control.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cut_picture.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

// The way that slices are counted.
Vec3 count_along(Plane plane) {
  return plane == Plane::axial ? Vec3{0, 0, 1} : plane == Plane::coronal ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
}

// The index axis that runs along the normal.
std::size_t axis_of(const Frame& frame, Plane plane) {
  const Vec3 n = count_along(plane);
  std::size_t best = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(dot(frame.direction.column[a], n)) > std::abs(dot(frame.direction.column[best], n))) best = a;
  }
  return best;
}

std::string rounded(double v) {
  char text[32];
  std::snprintf(text, sizeof text, std::abs(v) < 10 ? "%.1f" : "%.0f", v);
  return shown_figures(text);
}

constexpr std::array<std::array<int, 3>, 8> kColours{{{255, 220, 60},
                                                      {90, 170, 255},
                                                      {90, 220, 130},
                                                      {240, 120, 200},
                                                      {255, 140, 80},
                                                      {120, 230, 230},
                                                      {190, 150, 255},
                                                      {200, 220, 110}}};

}  // namespace

std::string volume_text(double mm3) {
  return mm3 >= 1000 ? rounded(mm3 / 1000) + " cm³" : rounded(mm3) + " mm³";
}

EditControl::EditControl(EditDocument& document)
    : document_(document), saved_version_(document.version()), drawn_version_(document.version()) {
  for (std::size_t v = 0; v < 3; ++v) views_[v].plane = static_cast<Plane>(v);
  cross_mm_ = document_.ct().frame.centre_mm();
  // Where the threshold stands: the lowest value in bone, or what was set last.
  const Image& ct = document_.ct();
  int lowest = 32767;
  for (const Run& r : document_.bone().runs(true)) {
    const std::int16_t* const row =
        ct.voxels.get() + static_cast<std::size_t>(r.row) * static_cast<std::size_t>(ct.frame.dims[0]);
    lowest = std::min(lowest, static_cast<int>(*std::min_element(row + r.begin, row + r.end)));
  }
  if (lowest < 32767) lower_hu = lowest;
  for (const EditOperation& o : document_.operations()) {
    if (const auto* const t = std::get_if<ThresholdEdit>(&o)) {
      lower_hu = t->lower_hu;
      upper_hu = t->upper_hu;
    }
  }
  const Frame& f = document_.ct().frame;
  const Vec3 c = f.centre_mm();
  for (std::size_t a = 0; a < 3; ++a) {
    box_lo_mm[a] = c[a] - 20;
    box_hi_mm[a] = c[a] + 20;
  }
  go_to(cross_mm_);
  fit();
}

// --- views
// ----------------------------------------------------------------------------------------------------------------------------

void EditControl::resize(int view, int width, int height) {
  SliceView& v = views_[static_cast<std::size_t>(view)];
  if (v.width == width && v.height == height) return;
  v.resize(width, height);
  redraw_ = true;
}

void EditControl::fit() {
  const Frame& f = document_.ct().frame;
  Vec3 lo = f.centre_mm(), hi = lo;
  for (int c = 0; c < 8; ++c) {
    const Vec3 p = f.world_from_index({(c & 1) != 0 ? f.dims[0] - 0.5 : -0.5, (c & 2) != 0 ? f.dims[1] - 0.5 : -0.5,
                                       (c & 4) != 0 ? f.dims[2] - 0.5 : -0.5});
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  const Vec3 size = hi - lo;
  for (SliceView& v : views_) {
    const double across = v.plane == Plane::sagittal ? size.y : size.x,
                 down = v.plane == Plane::axial ? size.y : size.z;
    v.centre_mm = f.centre_mm();
    v.mm_per_pixel = 1.04 * std::max(across / v.width, down / v.height);
  }
  redraw_ = true;
}

void EditControl::go_to(Vec3 world_mm) {
  const Frame& f = document_.ct().frame;
  Vec3 x = f.index_from_world(world_mm);
  for (std::size_t a = 0; a < 3; ++a) x[a] = std::clamp(x[a], 0.0, f.dims[a] - 1.0);
  cross_mm_ = f.world_from_index(x);
  follow_cross();
}

void EditControl::follow_cross() {
  for (SliceView& v : views_) v.through_mm = cross_mm_;
  if (last_.view >= 0 && last_.view < kView3D) under_mouse_ = world(last_);  // another slice is under it
}

void EditControl::scroll(int view, int slices) {
  if (view < 0 || view >= kView3D) return;
  const Frame& f = document_.ct().frame;
  const Plane plane = views_[static_cast<std::size_t>(view)].plane;
  const std::size_t a = axis_of(f, plane);
  const double sign = dot(f.direction.column[a], count_along(plane)) >= 0 ? 1 : -1;
  Vec3 x = f.index_from_world(cross_mm_);
  x[a] = std::clamp(std::round(x[a]) + sign * slices, 0.0, f.dims[a] - 1.0);
  cross_mm_ = f.world_from_index(x);
  follow_cross();
}

std::pair<int, int> EditControl::slice(int view) const {
  const Frame& f = document_.ct().frame;
  const Plane plane = views_[static_cast<std::size_t>(view)].plane;
  const std::size_t a = axis_of(f, plane);
  const int at = static_cast<int>(std::lround(f.index_from_world(cross_mm_)[a]));
  return {dot(f.direction.column[a], count_along(plane)) >= 0 ? at + 1 : f.dims[a] - at, f.dims[a]};
}

// --- mouse
// ----------------------------------------------------------------------------------------------------------------------------

bool EditControl::refuse_when_busy() {
  if (busy()) message_ = tr("wait until it is worked out (Esc stops it)");
  return busy();
}

void EditControl::press(SlicePointer at, SliceButton button) {
  last_ = at;
  if (at.view < 0 || at.view >= kView3D || held_) return;
  held_ = button;
  held_view_ = at.view;
  if (button != SliceButton::left) return;
  const Vec3 p = world(at);
  switch (tool_) {
    case EditTool::ruler:
      ruler_mm = {p, p};
      break;
    case EditTool::box:
      box_from_mm_ = p;
      break;
    case EditTool::piece:
      if (!refuse_when_busy())
        start({IslandEdit{{p.x, p.y, p.z}, at.shift ? IslandChoice::keep : IslandChoice::remove}});
      break;
    case EditTool::brush:
    case EditTool::eraser:
      if (refuse_when_busy()) break;
      if (structure != 0 && document_.structure(structure) == nullptr) structure = 0;
      document_.begin_stroke(BrushEdit{structure, tool_ == EditTool::eraser, brush_radius_mm, {}});
      document_.add_point(p);
      redraw_ = true;
      break;
    default:
      break;
  }
}

void EditControl::move(SlicePointer at) {
  const double dx = at.x - last_.x, dy = at.y - last_.y;
  last_ = at;
  under_mouse_ = at.view >= 0 && at.view < kView3D ? std::optional(world(at)) : std::nullopt;
  if (held_ && (tool_ == EditTool::brush || tool_ == EditTool::eraser)) redraw_ = true;
  if (!held_) {
    if (at.shift && under_mouse_) go_to(*under_mouse_);
    return;
  }
  // A drag belongs to the view where it began.
  SliceView& v = views_[static_cast<std::size_t>(held_view_)];
  if (*held_ == SliceButton::middle) {
    v.drag(dx, dy);
    return;
  }
  if (*held_ == SliceButton::right) {
    v.zoom_about(v.width / 2.0 - 0.5, v.height / 2.0 - 0.5, std::exp(dy * 0.01));
    return;
  }
  const Vec3 p = v.world(at.x, at.y);
  switch (tool_) {
    case EditTool::look:
      hu.drag(dx, dy);
      redraw_ = redraw_ || dx != 0 || dy != 0;
      break;
    case EditTool::ruler:
      if (ruler_mm) (*ruler_mm)[1] = p;
      break;
    case EditTool::box: {
      const Vec3 n = v.normal();
      for (std::size_t a = 0; a < 3; ++a) {
        if (n[a] != 0) continue;  // along the normal it stays as it is
        box_lo_mm[a] = std::round(std::min(box_from_mm_[a], p[a]) * 100) / 100;
        box_hi_mm[a] = std::round(std::max(box_from_mm_[a], p[a]) * 100) / 100;
      }
      break;
    }
    case EditTool::brush:
    case EditTool::eraser:
      if (document_.in_stroke() && (dx != 0 || dy != 0)) document_.add_point(p);
      break;
    default:
      break;
  }
}

void EditControl::release(SlicePointer at, SliceButton button) {
  if (held_ != button) return;
  move(at);
  held_.reset();
  if (document_.in_stroke()) reported(document_.end_stroke());
}

void EditControl::wheel(SlicePointer at, double notches) {
  if (at.view < 0 || at.view >= kView3D || notches == 0) return;
  last_ = at;
  const bool brushes = tool_ == EditTool::brush || tool_ == EditTool::eraser;
  if (at.shift && brushes) {
    brush_radius_mm = std::clamp(brush_radius_mm * std::pow(1.15, notches), 0.2, 30.0);
  } else if (at.control) {
    // What is under the mouse stays there.
    SliceView& v = views_[static_cast<std::size_t>(at.view)];
    v.zoom_about(at.x, at.y, std::pow(1.15, notches));
  } else {
    scroll(at.view, notches > 0 ? std::max(1, static_cast<int>(notches)) : std::min(-1, static_cast<int>(notches)));
  }
}

void EditControl::double_click(SlicePointer at) {
  if (at.view < 0) return;
  if (at.control) {
    hu = grey_presets()[0].hu;
  } else if (tool_ != EditTool::piece && tool_ != EditTool::brush && tool_ != EditTool::eraser) {
    enlarged_ = enlarged_ < 0 ? at.view : -1;
  }
  redraw_ = true;
}

std::string EditControl::readout() const {
  if (!under_mouse_) return {};
  const Image& ct = document_.ct();
  std::string text = shown_figures(place_text(*under_mouse_)) + " mm";
  const auto here = hu_at(ct, *under_mouse_);
  if (!here) return text + "   " + tr("outside the scan");
  text += "   " + std::to_string(std::lround(*here)) + " HU";
  const Vec3 x = ct.frame.index_from_world(*under_mouse_);
  std::array<int, 3> at{};
  for (std::size_t a = 0; a < 3; ++a)
    at[a] = std::clamp(static_cast<int>(std::floor(x[a] + 0.5)), 0, ct.frame.dims[a] - 1);
  if (document_.bone().at(at[0], at[1], at[2])) text += std::string("   ") + tr("bone");
  if (const EditStructure* const s = document_.structure(document_.labels()[ct.offset(at[0], at[1], at[2])]))
    text += "   " + s->is.name;
  return text;
}

// --- tools
// ----------------------------------------------------------------------------------------------------------------------------

void EditControl::take(EditTool tool) {
  if (document_.in_stroke()) reported(document_.end_stroke());
  held_.reset();
  tool_ = tool;
  redraw_ = true;
}

std::optional<ThresholdEdit> EditControl::live() const {
  if (tool_ != EditTool::threshold) return std::nullopt;
  return ThresholdEdit{std::min(lower_hu, upper_hu), std::max(lower_hu, upper_hu)};
}

void EditControl::set_threshold(double lower, double upper) {
  lower_hu = std::clamp(std::round(lower), -32768.0, 32767.0);
  upper_hu = std::clamp(std::round(upper), -32768.0, 32767.0);
  redraw_ = true;
}

void EditControl::start(std::vector<EditOperation> operations) {
  if (refuse_when_busy()) return;
  if (document_.in_stroke()) reported(document_.end_stroke());
  message_ = operation_text(operations.front()) + " ...";
  worker_.plan(document_, std::move(operations));
}

void EditControl::apply(BoxChoice choice) {
  switch (tool_) {
    case EditTool::threshold: {
      const ThresholdEdit t = *live();
      start(later_steps_again ? document_.with_later_steps(t) : std::vector<EditOperation>{t});
      break;
    }
    case EditTool::pieces:
      start({IslandSizeEdit{pieces_mm3, pieces_largest}});
      break;
    case EditTool::box:
      start({BoxEdit{box_lo_mm, box_hi_mm, choice}});
      break;
    case EditTool::fill:
      start({FillEdit{fill_mm3}});
      break;
    case EditTool::smooth:
      start({SmoothEdit{smooth_mm}});
      break;
    default:
      break;
  }
}

bool EditControl::at_once(const EditOperation& operation) {
  if (refuse_when_busy()) return false;
  try {
    reported(document_.apply(operation));
    redraw_ = true;
    return true;
  } catch (const Error& e) {
    message_ = e.what();
    return false;
  }
}

bool EditControl::add_structure(const std::string& name) {
  const int value = document_.free_value();
  if (value == 0) {
    message_ = tr("255 structures are all there can be");
    return false;
  }
  const auto& c = kColours[static_cast<std::size_t>(value - 1) % kColours.size()];
  if (!at_once(AddStructureEdit{value, name, {c[0], c[1], c[2]}, StructureRole::at_risk})) return false;
  structure = value;
  return true;
}

void EditControl::find_structures(const std::string& what, std::function<EditFound(const Context&)> work) {
  if (refuse_when_busy()) return;
  if (document_.in_stroke()) reported(document_.end_stroke());
  finding_ = what;
  message_ = what + " ...";
  worker_.find(std::move(work));
}

// The values of what was found are the network's; the document has its own.
void EditControl::take_found(EditFound found) {
  const EditOutcome done = document_.apply_together(structures_of(found.structures, document_), finding_);
  places = std::move(found.places);
  for (EditPlace& p : places) {
    for (const EditStructure& s : document_.structures())
      if (s.is.name == p.name) p.structure = s.is.value;
  }
  if (!done.changed && found.note.empty()) found.note = tr("nothing changes");
  message_ = finding_ + (found.note.empty() ? "" : ": " + found.note);
}

void EditControl::show_structure(int value, bool shown) {
  document_.show(value, shown);
  hidden_changed_ = redraw_ = true;
  preview_version_ = ~0ULL;
}

void EditControl::undo() {
  if (refuse_when_busy()) return;
  const std::string what = document_.undo_text();
  message_ = document_.undo() ? filled(tr("taken back: {what}"), {{"what", what}}) : tr("nothing to undo");
  redraw_ = true;
}

void EditControl::redo() {
  if (refuse_when_busy()) return;
  const std::string what = document_.redo_text();
  message_ = document_.redo() ? filled(tr("done again: {what}"), {{"what", what}}) : tr("nothing to do again");
  redraw_ = true;
}

void EditControl::cancel() {
  if (busy()) {
    worker_.cancel_plan();
  } else if (show_help) {
    show_help = false;
  } else {
    take(EditTool::look);
  }
}

bool EditControl::key(const EditKeyRow& k) {
  const int view = last_.view >= 0 && last_.view < kView3D ? last_.view : enlarged_ >= 0 ? enlarged_ : 0;
  switch (k.does) {
    case EditKey::tool:
      take(static_cast<EditTool>(k.value));
      return true;
    case EditKey::next_slice:
      scroll(view, 1);
      return true;
    case EditKey::previous_slice:
      scroll(view, -1);
      return true;
    case EditKey::larger:
      brush_radius_mm = std::min(30.0, brush_radius_mm * 1.15);
      return true;
    case EditKey::smaller:
      brush_radius_mm = std::max(0.2, brush_radius_mm / 1.15);
      return true;
    case EditKey::fit:
      fit();
      return true;
    case EditKey::apply:
      apply();
      return true;
    case EditKey::cancel:
      cancel();
      return true;
    case EditKey::undo:
      undo();
      return true;
    case EditKey::redo:
      redo();
      return true;
    case EditKey::cross:
      show_cross = !show_cross;
      return true;
    case EditKey::outline:
      show_outlines = !show_outlines;
      redraw_ = true;
      return true;
    case EditKey::preset: {
      const GreyPreset& p = grey_presets()[static_cast<std::size_t>(k.value)];
      hu = p.hu;
      redraw_ = true;
      return true;
    }
    default:
      return false;
  }
}

std::string EditControl::hint() const {
  if (busy()) return tr("Being worked out; look around meanwhile. Esc stops it.");
  const EditStructure* const s = document_.structure(structure);
  const std::string what = s != nullptr ? "'" + s->is.name + "'" : std::string(tr("bone"));
  const std::string size = shown_number(2 * brush_radius_mm, 1);
  switch (tool_) {
    case EditTool::look:
      return tr("Drag: window and level. Wheel: slices. Shift-move: crosshair.");
    case EditTool::ruler:
      return tr("Drag: measures a length.");
    case EditTool::threshold:
      return tr("Blue is what would be bone. Enter applies it.");
    case EditTool::piece:
      return tr("Click: that piece of bone goes. Shift-click: it alone stays.");
    case EditTool::pieces:
      return tr("Enter: removes small fragments.");
    case EditTool::box:
      return tr("Drag: sets the box in this view. Enter clears the bone inside.");
    case EditTool::fill:
      return tr("Enter: enclosed cavities become bone.");
    case EditTool::smooth:
      return tr("Enter: smooths the whole surface.");
    case EditTool::brush:
      return filled(tr("Drag: adds to {structure}, ball of {mm} mm."), {{"structure", what}, {"mm", size}});
    case EditTool::eraser:
      return filled(tr("Drag: takes from {structure}, ball of {mm} mm."), {{"structure", what}, {"mm", size}});
  }
  return {};
}

void EditControl::reported(const EditOutcome& o) {
  const std::initializer_list<Place> words{
      {"what", o.text}, {"added", volume_text(o.added_mm3)}, {"removed", volume_text(o.removed_mm3)}, {"note", o.note}};
  const char* text = tr("{what}: nothing changes");
  if (!o.changed) {
    if (!o.note.empty()) text = "{what}: {note}";
  } else if (o.added_mm3 > 0) {
    text = o.removed_mm3 > 0 ? tr("{what}: {added} added, {removed} removed") : tr("{what}: {added} added");
  } else {
    text = o.removed_mm3 > 0 ? tr("{what}: {removed} removed") : "{what}";
  }
  message_ = filled(text, words);
  if (o.changed && !o.note.empty()) message_ += " (" + o.note + ")";
}

void EditControl::tick() {
  if (auto done = worker_.take_plan()) {
    if (done->error) {
      message_ = done->error->code() == ExitCode::cancelled ? tr("stopped; nothing was changed")
                                                            : std::string(done->error->what());
    } else if (done->found) {
      try {
        take_found(std::move(*done->found));
      } catch (const Error& e) {
        message_ = e.what();
      }
    } else {
      reported(document_.commit(std::move(*done->plan)));
    }
    redraw_ = true;
  }
  if (document_.version() != drawn_version_) {
    drawn_version_ = document_.version();
    redraw_ = true;
  }
  ask_preview();
}

void EditControl::ask_preview() {
  const auto wanted = live();
  const bool same_live =
      wanted.has_value() == preview_live_.has_value() &&
      (!wanted || (wanted->lower_hu == preview_live_->lower_hu && wanted->upper_hu == preview_live_->upper_hu));
  if (busy() || document_.in_stroke() || (same_live && preview_version_ == document_.version())) return;
  preview_live_ = wanted;
  preview_version_ = document_.version();
  PreviewRequest request{document_.ct(), wanted, nullptr, {}, preview_voxels};
  if (!wanted) request.bone = std::make_shared<const BitMask>(document_.bone());
  for (const EditStructure& s : document_.structures()) {
    const EditDocument::Bounds b = document_.bounds(s.is.value);
    if (!s.shown || b.hi[0] <= b.lo[0]) continue;
    PreviewRequest::Part part{s.is.rgb, document_.ct().frame, {}};
    for (std::size_t a = 0; a < 3; ++a) part.frame.dims[a] = b.hi[a] - b.lo[a];
    part.frame.origin_mm = document_.ct().frame.world_from_index({double(b.lo[0]), double(b.lo[1]), double(b.lo[2])});
    part.voxels = BitMask(part.frame.dims);
    std::size_t row = 0;
    for (int k = b.lo[2]; k < b.hi[2]; ++k) {
      for (int j = b.lo[1]; j < b.hi[1]; ++j, ++row) {
        const std::uint8_t* const from = document_.labels().data() + document_.ct().offset(b.lo[0], j, k);
        for (int i = 0; i < part.frame.dims[0]; ++i) {
          if (from[i] == s.is.value) part.voxels.set(row, i, i + 1, true);
        }
      }
    }
    request.structures.push_back(std::move(part));
  }
  worker_.preview(std::move(request));
}

}  // namespace osteo::inline app
