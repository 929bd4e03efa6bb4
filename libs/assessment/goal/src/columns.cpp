#include "osteo/assessment/goal/columns.h"

#include <algorithm>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment {

double kept_mm(ProcedureRole role) {
  switch (role) {
    case ProcedureRole::expose:
      return 0.4;
    case ProcedureRole::thin:
      return 1.2;
    case ProcedureRole::enter:
      return -1e9;
    case ProcedureRole::keep:
    case ProcedureRole::never_touch:
      break;
  }
  return 1;
}

namespace {

constexpr double kStep = 0.25;  // mm along a column

}  // namespace

Columns::Columns(const World& world, const StructureMap& structures, const Procedure& procedure, Vec3 toward,
                 double most_depth, bool by_tip)
    : bone_(world.bodies().front().body->bone),
      structures_(structures),
      toward_(toward),
      across_(any_perpendicular(toward)),
      along_(cross(toward, across_)),
      most_depth_(most_depth),
      by_tip_(by_tip),
      each_(structures.values().size()) {
  for (const std::uint8_t value : structures.values()) {
    const ProcedureStructure* const s = procedure.find(structures.name_of(value));
    role_.push_back(s != nullptr ? s->role : ProcedureRole::keep);
    double within = -1;
    for (const ProcedureRegion& r : procedure.regions)
      if (r.kind == RegionKind::target && r.structure == structures.name_of(value))
        within = std::max(within, r.within_mm);
    within_.push_back(within);
    double ruled = 0;
    for (const InstrumentRule& r : procedure.instruments)
      if (r.structure == structures.name_of(value)) ruled = std::max(ruled, r.within_mm);
    ruled_.push_back(ruled);
  }
  // Above all bone near the targets.
  BoxMm box;
  for (std::size_t n = 0; n < within_.size(); ++n) {
    if (within_[n] < 0) continue;
    for (const auto& p : structures.face(n).points_mm) box.include(from_floats(p));
  }
  if (box.lo.x > box.hi.x) {
    std::string names;
    for (const ProcedureRegion& r : procedure.regions)
      if (r.kind == RegionKind::target) names += (names.empty() ? "'" : ", '") + r.structure + "'";
    throw Error(ExitCode::usage,
                names.empty() ? "the procedure has no target region, so there is nothing to drill towards"
                              : "the case has none of the structures that the target regions lie around: " + names,
                names.empty() ? "add one of kind \"target\" to its \"regions\""
                              : "prepare the case with --structures and --names");
  }
  for (int c = 0; c < 8; ++c) {
    const Vec3 p{(c & 1) != 0 ? box.hi.x : box.lo.x, (c & 2) != 0 ? box.hi.y : box.lo.y,
                 (c & 4) != 0 ? box.hi.z : box.lo.z};
    flat_.include({dot(p, across_), dot(p, along_), dot(p, toward_)});
  }
  above_ = flat_.hi.z + 25;
}

Column Columns::column(double u, double v, double radius, double belief, bool ruled) const {
  Column c;
  const RoundCone ball{0, 0, radius, radius};
  double t = above_;
  for (; t > flat_.lo.z && bone_.nearest(place(u, v, t)) < 0.5F; t -= kStep) {
    // A hollow that is deeper than the burr is no surface to begin at.
    if (t < flat_.hi.z - 30) return c;
  }
  if (t <= flat_.lo.z) return c;
  c.top = t;
  c.bone = true;
  c.safe = t;
  for (; t > c.top - most_depth_ - belief; t -= kStep) {
    structures_.clearance(ball, place(u, v, t + radius), toward_, each_);
    bool reaches = false;
    for (std::size_t n = 0; n < each_.size(); ++n) {
      const double kept =
          std::max(kept_mm(role_[n]), ruled && role_[n] != ProcedureRole::enter ? ruled_[n] : -1e9) - belief;
      if (each_[n] < kept) return c;
      if (within_[n] < 0) continue;
      const double to = by_tip_ ? structures_.distance_mm(n, place(u, v, t)) : each_[n];
      reaches = reaches || to <= within_[n];
    }
    c.safe = t;
    if (!reaches) continue;
    c.target = t;
    c.in_target_mm += kStep;
  }
  return c;
}

Vec3 toward_of(const Procedure& procedure) {
  Vec3 view, shown;
  for (const ScaleItem& i : procedure.items) {
    const Vec3 towards = normalized({i.towards[0], i.towards[1], i.towards[2]});
    if (i.kind == ItemKind::no_overhang) view += towards;
    if (i.kind == ItemKind::exposed) shown += towards;
  }
  const Vec3 toward = normalized(length(view) > 0 ? view : shown);
  if (length(toward) == 0)
    throw Error(ExitCode::usage, "no item of the procedure says from where its structures are come to",
                "give --approach, or \"towards\" of an item of kind no_overhang or exposed");
  return toward;
}

}  // namespace osteo::inline assessment
