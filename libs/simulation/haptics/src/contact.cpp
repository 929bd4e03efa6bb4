#include "osteo/simulation/haptics/contact.h"

#include <algorithm>
#include <cmath>

#include "contact_models.h"

namespace osteo::inline simulation {

std::size_t most_hits(double spacing_mm) {
  double most = 0;
  for (const Instrument& i : instrument_library()) {
    const RoundCone& head = i.head;
    // One voxel thicker all around, since covered voxels count however little they are covered.
    const double r = head.largest_radius_mm() + spacing_mm;
    most = std::max(most, RoundCone{0, head.length_mm, r, r}.volume_mm3());
  }
  return static_cast<std::size_t>(std::min(most / (spacing_mm * spacing_mm * spacing_mm), 4.0 * kMaxCutPerTick)) + 1024;
}

std::unique_ptr<ContactModel> make_contact_model(const ContactParams& params, double spacing_mm,
                                                 std::span<const std::size_t> tools) {
  switch (params.method) {
    case ContactMethod::rays:
      return std::make_unique<RaySampling>(params, spacing_mm);
    case ContactMethod::volume:
      return std::make_unique<VolumeSampling>(params, spacing_mm);
    case ContactMethod::proxy:
      return std::make_unique<BurrProxy>(params, spacing_mm, tools);
    default:
      return std::make_unique<ExactOverlap>(params, spacing_mm);
  }
}

std::string too_small_for_voxels(const Burr& burr, double spacing_mm) {
  const RoundCone head = burr.head();
  const double voxels = std::min(head.start_radius_mm, head.end_radius_mm) / spacing_mm;
  if (voxels >= kMinRadiusVoxels) return {};
  return "the " + burr.name() + (burr.length_mm > 0 ? " is small for" : " burr is small for") + " voxels of " +
         format_number(std::round(spacing_mm * 1000) / 1000) + " mm (radius " +
         format_number(std::round(voxels * 10) / 10) + " voxels): force and its direction are coarse; from " +
         format_number(std::floor(spacing_mm * voxels / kMinRadiusVoxels * 100 + 1e-6) / 100) +
         " mm they are true: prepare with a smaller --spacing-mm, or a finer region of interest where it drills";
}

Removal::Removal(const BrickGrid& bone)
    : grains_(bone),
      reached_(most_hits(bone.frame().spacing_mm.x) + 512),
      weights_(reached_.size()),
      changes_(most_hits(bone.frame().spacing_mm.x)) {}

std::span<const VoxelChange> Removal::remove(BrickGrid& bone, const Cut& cut, const Burr& burr, double force_n,
                                             double speed_rpm, double dt_s, const Hardness* hardness,
                                             double& removed_mm3, std::size_t hand) noexcept {
  removed_mm3 = 0;
  if (cut.hits.empty()) return {};
  grains_.place(bone, burr.head(), cut.at_mm, cut.axis, cut.in_turns, hand);
  double may_go = 0, listed = 0, resisted = 0;
  for (std::size_t i = 0; i < cut.hits.size(); ++i) {
    const Hit& h = cut.hits[i];
    const float density = bone.value(h.voxel);
    reached_[i] = density - grains_.reach(bone, h.voxel, h.share);
    if (!(reached_[i] > 0)) continue;
    const double here = static_cast<double>(std::min(density * h.share, reached_[i])),
                 w = here * static_cast<double>(h.efficiency);
    may_go += here;
    listed += w;
    weights_[i] = hardness != nullptr ? w / static_cast<double>(hardness->at(h.voxel)) : w;
    resisted += weights_[i];
  }
  if (!(resisted > 0) || !(force_n > 0)) return {};
  const double efficiency = listed / may_go, ease = resisted / listed;
  const double full = burr.rate_mm3_per_s_per_n * speed_rpm / Burr::kNominalRpm * dt_s;
  const double wanted = full * efficiency * force_n * ease + carry_mm3_[hand];
  const double voxel_mm3 = bone.frame().voxel_volume_mm3();
  std::size_t changed = 0;
  for (std::size_t i = 0; i < cut.hits.size() && changed < changes_.size(); ++i) {
    if (!(reached_[i] > 0)) continue;
    const Hit& h = cut.hits[i];
    const double share = wanted * weights_[i] / resisted / voxel_mm3;
    const float before = bone.value(h.voxel);
    const float after = std::max(0.0F, before - std::min(reached_[i], static_cast<float>(share)));
    if (after == before) continue;
    bone.set(h.voxel, after);
    changes_[changed++] = {h.voxel, after, before};
    removed_mm3 += static_cast<double>(before - after) * voxel_mm3;
  }
  // What emptied voxels could not give, or rounding kept back, waits; but no more than a tick's worth at 10 N.
  carry_mm3_[hand] = std::clamp(wanted - removed_mm3, 0.0, full * 10);
  return {changes_.data(), changed};
}

}  // namespace osteo::inline simulation
