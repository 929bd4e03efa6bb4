#include "pictures.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"
#include "osteo/display/view/pictures.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene_parts.h"

namespace osteo::inline assessment::review {
namespace {

constexpr std::size_t kMaxEvidencePictures = 12;
constexpr double kContextMm = 25, kMaxSeenMm = 75;

std::array<double, 3> shares(std::array<std::uint8_t, 3> rgb) {
  return {rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0};
}
bool at_rest(const World& w) {
  return std::all_of(w.bodies().begin(), w.bodies().end(), [](const PlacedBody& b) {
    return b.world_from_body.rotation == Mat3{} && b.world_from_body.shift_mm == Vec3{};
  });
}

class Drawer {
 public:
  Drawer(Review& r, const World& begin, const World& end, const StructureMap* structures, const ScoreDetail& detail,
         const std::vector<CameraPose>& cameras, const Context& context)
      : r_(r), begin_(begin), end_(end), structures_(structures), context_(context) {
    std::vector<Vec3> gone;
    for (const auto& [name, v] : detail.voxels) {
      gone.push_back(v.own_mm);
      by_[static_cast<std::size_t>(v.seen)].push_back(v);
    }
    if (!gone.empty()) {
      work_ = around(gone);
    } else {
      work_ = whole();
    }
    eye_ = detail.approach;
    if (length(eye_) < 0.5 && !cameras.empty()) eye_ = normalized(cameras.back().eye_mm - cameras.back().target_mm);
    if (length(eye_) < 0.5) eye_ = eye_direction(ViewFrom::left_front);
  }

  void all() {
    meshes();
    context_.progress(0.4, "drawing");
    overviews();
    evidence();
    context_.progress(0.5, "drawing");
    std::vector<Picture> pictures = draw_stills(parts_, stills_);
    for (std::size_t n = 0; n < pictures.size(); ++n)
      r_.pictures.push_back({ids_[n], captions_[n], std::move(pictures[n]), shown_[n]});
    for_page();
  }

 private:
  [[nodiscard]] Ball whole() const {
    std::vector<Vec3> corners;
    if (structures_ != nullptr) {
      for (std::size_t s = 0; s < structures_->values().size(); ++s) {
        const auto& points = structures_->face(s).points_mm;
        for (std::size_t p = 0; p < points.size(); p += 50) corners.push_back(from_floats(points[p]));
      }
    }
    if (corners.empty()) {
      for (const PlacedBody& b : begin_.bodies()) {
        const BrickGrid& bone = b.body->bone;
        for (std::uint32_t k = 0; k < bone.brick_count(); ++k) {
          const Ijk at = bone.brick_coordinate(k);
          corners.push_back(bone.frame().world_from_index({at.i * 8 + 3.5, at.j * 8 + 3.5, at.k * 8 + 3.5}));
        }
      }
    }
    return around(corners);
  }

  std::size_t part(TriMesh mesh, std::array<double, 3> rgb, double opacity = 1, bool cut = false) {
    parts_.push_back({std::make_shared<const TriMesh>(std::move(mesh)), rgb, opacity, cut});
    return parts_.size() - 1;
  }
  // With a caption of the catalogues.
  void still(std::string id, const char* caption, Still s) { still(std::move(id), caption, tr(caption), std::move(s)); }
  void still(std::string id, std::string caption, std::string shown, Still s) {
    ids_.push_back(std::move(id));
    captions_.push_back(std::move(caption));
    shown_.push_back(std::move(shown));
    stills_.push_back(std::move(s));
  }

  void meshes() {
    const double around_mm = std::min(work_.radius_mm + kContextMm, std::max(kMaxSeenMm, work_.radius_mm));
    const std::array<double, 3> bone = shares(kBoneRgb);
    const auto crop = [&](TriMesh mesh) {
      constexpr std::size_t kMany = 900'000;
      if (mesh.triangles.size() <= kMany) return mesh;
      return within(mesh, work_.centre_mm, std::max(2 * work_.radius_mm, around_mm + 15));
    };
    before_ = part(crop(bone_at_rest(begin_, context_)), bone, 1, true);
    context_.progress(0.1);
    after_ = part(crop(bone_at_rest(end_, context_)), bone, 1, true);
    context_.progress(0.25);
    around_mm_ = around_mm;
    if (structures_ != nullptr) {
      for (std::size_t s = 0; s < structures_->values().size(); ++s) {
        const std::uint8_t value = structures_->values()[s];
        const TriMesh smooth = smooth_surface(structures_->face(s), structures_->label_spacing_mm()[1] / 2);
        structure_parts_.push_back(part(smooth, structures_->colour_of(value)));
        // Air cells fill the picture with what is not in danger.
        opened_.push_back(structures_->opened(s));
      }
    }
    seen_ = part(blob_of(by_[0], begin_, context_), shares(kSeenRgb), 0.30);
    seen_solid_ = part(*parts_[seen_].mesh, shares(kSeenRgb));
    hidden_ = part(blob_of(by_[1], begin_, context_), shares(kHiddenRgb));
    unknown_ = part(blob_of(by_[2], begin_, context_), shares(kUnknownRgb), 0.4);
  }
  [[nodiscard]] std::vector<std::size_t> with_structures(std::vector<std::size_t> parts) const {
    for (std::size_t s = 0; s < structure_parts_.size(); ++s) {
      if (!opened_[s]) parts.push_back(structure_parts_[s]);
    }
    return parts;
  }
  [[nodiscard]] Still view(Vec3 centre, double radius, Vec3 eye, std::vector<std::size_t> parts) const {
    Still s;
    s.centre_mm = centre;
    s.radius_mm = radius;
    s.eye = eye;
    s.parts = std::move(parts);
    return s;
  }

  void overviews() {
    const double radius = std::min(work_.radius_mm * 1.15 + 6, kMaxSeenMm);
    // Who took nothing held no shaft that would tell the side.
    const bool nothing = by_[0].empty() && by_[1].empty() && by_[2].empty();
    still("before",
          nothing ? tr_later("Before: nothing was drilled that would tell from where one worked")
                  : tr_later("Before: as one looked along the burr's mean shaft"),
          view(work_.centre_mm, radius, eye_, with_structures({before_})));
    still("after", tr_later("After: from the same side"),
          view(work_.centre_mm, radius, eye_, with_structures({after_})));
    if (nothing) return;
    // Without the bone: from where one worked, and from the side, where undercutting shows.
    const Vec3 side = normalized(cross(std::abs(eye_.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{0, -1, 0}, eye_));
    const double close = work_.radius_mm * 1.12 + 2;
    const bool known = !by_[0].empty() || !by_[1].empty();
    still("unseen",
          known ? tr_later("What was removed, without the bone: blue-grey seen, orange unseen; from where one worked")
                : tr_later("What was removed, without the bone; nobody knows from where one looked; from where one "
                           "worked"),
          view(work_.centre_mm, close, eye_, with_structures({seen_, hidden_, unknown_})));
    still("unseen-side",
          known ? tr_later("What was removed, without the bone: blue-grey seen, orange unseen; from the side")
                : tr_later("What was removed, without the bone; nobody knows from where one looked; from the side"),
          view(work_.centre_mm, close, side, with_structures({seen_, hidden_, unknown_})));
  }

  void evidence() {
    const bool still_there = at_rest(end_);
    std::size_t drawn = 0, wanted = 0;
    for (const ScoreFinding& f : r_.findings.list) {
      if (f.places_mm.empty() || !f.at_mm || (f.severity == FindingSeverity::good && f.kind != "hidden")) continue;
      ++wanted;
      if (drawn == kMaxEvidencePictures) continue;
      ++drawn;
      const bool hidden = f.id == "hidden";
      Ball ball = close_to(*f.at_mm, f.places_mm);
      ball.radius_mm = std::clamp(ball.radius_mm * 1.3 + 4, 7.0, 28.0);
      std::vector<Vec3> near;
      for (const Vec3 p : f.places_mm) {
        if (length(p - ball.centre_mm) <= ball.radius_mm) near.push_back(p);
      }
      const Lookout from = still_there ? look_at_places(end_, near, eye_) : Lookout{eye_, 0};
      // A moment's place is where the burr was, the angle's where a ball fits: both are shown as large as they are.
      const double ball_mm = ball_radius(f);
      const std::size_t marks =
          hidden ? hidden_
          : ball_mm > 0
              ? part(dots_at(near, ball_mm, 12), shares(kHiddenRgb), 0.6)
              : part(dots_at(near, std::clamp((near.size() < 20 ? 0.03 : 0.012) * ball.radius_mm, 0.12, 0.7), 2500),
                     shares(kHiddenRgb));
      Still s = view(ball.centre_mm, ball.radius_mm, from.eye, with_structures({after_, marks}));
      const ScoreFinding* const other = r_.shown.findings.find(f.id);
      std::string caption = f.text, shown = other == nullptr ? f.text : other->text;
      const auto add = [&](const char* more) {
        caption += std::string(" ") + more;
        shown += std::string(" ") + tr(more);
      };
      if (ball_mm > 0)
        add(f.kind == "item" ? tr_later("(Orange: that ball.)") : tr_later("(Orange: the burr at these moments.)"));
      if (from.seen_share < 0.5) {
        // It lies behind bone: what is in front of it is taken off, and other structures are left out.
        s.eye = eye_;
        s.parts = {after_, marks};
        for (std::size_t n = 0; n < structure_parts_.size(); ++n) {
          if (structures_->name_of(structures_->values()[n]) == f.structure) s.parts.push_back(structure_parts_[n]);
        }
        std::vector<double> nearer;
        for (const Vec3 p : near) nearer.push_back(dot(p - ball.centre_mm, eye_));
        std::sort(nearer.begin(), nearer.end());
        s.cut_mm = nearer[(nearer.size() - 1) * 3 / 4] + 0.6;
        add(tr_later("(Bone in front of it is cut away.)"));
      }
      still(f.id, caption, shown, s);
    }
    if (wanted <= drawn) return;
    constexpr const char* kMore = tr_later("pictures of {more} more findings: the first {n} have one");
    const std::initializer_list<Place> places{{"more", std::to_string(wanted - drawn)}, {"n", std::to_string(drawn)}};
    r_.left_out.push_back(filled(kMore, places));
    r_.shown.left_out.push_back(filled(tr(kMore), places));
  }

  // What a place stands for, where that is a ball: the burr in hand at the first of a finding's moments, or the ball
  // that fits in. Else 0.
  [[nodiscard]] double ball_radius(const ScoreFinding& f) const {
    for (const Product::Result& r : r_.score.items) {
      if (f.kind == "item" && r.item->name == f.metric && r.item->kind == ItemKind::sharp_angle) return r.value;
    }
    if (f.kind != "injury" && f.kind != "touch" && f.kind != "force") return 0;
    const auto n =
        f.times_s.empty() ? r_.timeline.size() : static_cast<std::size_t>(f.times_s.front() * Timeline::kRateHz);
    if (n >= r_.timeline.size() || r_.timeline.tool[n] == Timeline::kPlate) return 0;
    const Instrument& tool = instrument_of(r_.timeline.tool[n]);
    return tool.as_burr() == nullptr ? 0 : tool.as_burr()->diameter_mm / 2;
  }

  // What the page shows in 3D: less of it, and only around where one worked.
  void for_page() {
    context_.progress(0.95, "meshes");
    r_.view_centre_mm = work_.centre_mm;
    r_.view_eye = eye_;
    r_.view_radius_mm = std::min(work_.radius_mm * 1.15 + 6, kMaxSeenMm);
    const double voxel = begin_.finest_voxel_mm();
    const auto add = [&](std::string id, std::string name, std::array<std::uint8_t, 3> rgb, std::size_t part,
                         std::size_t most, double error) {
      const TriMesh cropped = within(*parts_[part].mesh, work_.centre_mm, around_mm_);
      if (cropped.triangles.empty()) return;
      r_.meshes.push_back({std::move(id), std::move(name), rgb, simplified(cropped, most, error)});
    };
    add("after", tr_later("bone, after"), kBoneRgb, after_, 130'000, 0.12 * voxel);
    add("before", tr_later("bone, before"), kBoneRgb, before_, 60'000, 0.25 * voxel);
    for (std::size_t s = 0; s < structure_parts_.size(); ++s) {
      const std::uint8_t value = structures_->values()[s];
      const auto c = structures_->colour_of(value);
      std::array<std::uint8_t, 3> rgb{};
      for (std::size_t a = 0; a < 3; ++a) rgb[a] = static_cast<std::uint8_t>(std::lround(255 * c[a]));
      add((opened_[s] ? "opened-" : "structure-") + std::to_string(value), structures_->name_of(value), rgb,
          structure_parts_[s], 12'000, 0.1);
    }
    add("seen", tr_later("removed, seen"), kSeenRgb, seen_solid_, 40'000, 0.2 * voxel);
    add("hidden", tr_later("removed, unseen"), kHiddenRgb, hidden_, 40'000, 0.1 * voxel);
    add("unknown", tr_later("removed before the first look"), kUnknownRgb, unknown_, 40'000, 0.2 * voxel);
  }

  Review& r_;
  const World &begin_, &end_;
  const StructureMap* structures_;
  const Context& context_;
  std::array<std::vector<VisibilityMetric::Voxel>, 3> by_;  // seen, hidden, unknown
  Ball work_;
  double around_mm_ = 0;
  Vec3 eye_;
  std::vector<StillPart> parts_;
  std::vector<Still> stills_;
  std::vector<std::string> ids_, captions_, shown_;
  std::vector<std::size_t> structure_parts_;
  std::vector<bool> opened_;
  std::size_t before_ = 0, after_ = 0, seen_ = 0, seen_solid_ = 0, hidden_ = 0, unknown_ = 0;
};

}  // namespace

void draw_pictures(Review& r, const World& begin, const World& end, const StructureMap* structures,
                   const ScoreDetail& detail, const std::vector<CameraPose>& cameras, const Context& context) {
  Drawer(r, begin, end, structures, detail, cameras, context).all();
}

}  // namespace osteo::inline assessment::review
