#include "osteo/assessment/evidence/score.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {

ScoreKeeper::ScoreKeeper(const EvidenceScene& scene)
    : scene_(scene), process_(scene), near_(scene), visibility_(scene), cuts_(scene) {}

void ScoreKeeper::frame(const EvidenceFrame& f) {
  process_.frame(f);
  near_.frame(f);
  visibility_.frame(f);
  cuts_.frame(f);
  for (const auto& changes : {f.changes, f.sawn}) {
    for (const VoxelChange& c : changes) {
      if (c.before < kSolid || c.density >= kSolid) continue;
      if (const PlacedBody* const b = f.world.owner(c.voxel)) {
        const BrickGrid& bone = b->body->bone;
        removed_[c.voxel] = {place_of_voxel_mm(bone, c.voxel - b->body->name_of(0)),
                             static_cast<float>(bone.frame().voxel_volume_mm3())};
      }
    }
  }
  for (const TickRecord& t : f.ticks)
    axes_ += normalized(from_floats(t.device.axis)) * static_cast<double>(t.removed_mm3);
}

void ScoreKeeper::finish(const World& end) {
  // What was put back is not gone.
  std::erase_if(removed_, [&](const auto& v) {
    const PlacedBody* const b = end.owner(v.first);
    return b != nullptr && b->body->bone.value(v.first - b->body->name_of(0)) >= kSolid;
  });
  process_.finish(end, values_, moments_);
  near_.finish(end, values_, moments_);
  cuts_.finish(end, values_, moments_);
  visibility_.finish(end, values_, moments_);
  std::stable_sort(moments_.begin(), moments_.end(), [](const Moment& a, const Moment& b) { return a.t_s < b.t_s; });
}

RemovedSet ScoreKeeper::removed_set() const {
  RemovedSet set;
  for (const auto& [name, voxel] : removed_) set.push_back(name);
  return set;
}

Vec3 ScoreKeeper::approach() const {
  return normalized(axes_);
}

std::size_t Score::judged() const {
  return static_cast<std::size_t>(std::count_if(items.begin(), items.end(), [](const auto& i) { return i.measured; }));
}
std::size_t Score::passed() const {
  return static_cast<std::size_t>(
      std::count_if(items.begin(), items.end(), [](const auto& i) { return i.measured && i.pass; }));
}

namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool no_bone(const World& world) {
  for (const PlacedBody& b : world.bodies()) {
    const BrickGrid& bone = b.body->bone;
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) >= kSolid) return false;
    }
  }
  return true;
}

bool has(const StructureMap* structures, const std::string& name) {
  if (structures == nullptr) return false;
  const auto& values = structures->values();
  return std::any_of(values.begin(), values.end(), [&](std::uint8_t v) { return structures->name_of(v) == name; });
}

void check_procedure(const Procedure& p, const StructureMap* structures, std::vector<std::string>& words) {
  if (p.structures.empty()) return;
  if (structures == nullptr) {
    words.push_back("the case has no structures: what the procedure asks of them is not judged");
    return;
  }
  std::string missing;
  std::size_t found = 0;
  for (const ProcedureStructure& s : p.structures) {
    if (has(structures, s.name)) {
      ++found;
    } else if (!s.optional) {
      missing += (missing.empty() ? "'" : ", '") + s.name + "'";
    }
  }
  if (found == 0) {
    std::string there;
    for (const std::uint8_t v : structures->values())
      there += (there.empty() ? "'" : ", '") + structures->name_of(v) + "'";
    throw Error(ExitCode::usage,
                "'" + p.file + "' is a procedure for another case: it has none of the structures " + missing,
                "this case has " + there + "; structures belong to a procedure by their names");
  }
  if (!missing.empty())
    words.push_back("the case lacks " + missing + ": what the procedure asks of them is not judged");
}

void by_reference(const ScoreKeeper& keeper, const StructureMap* structures, const Reference* reference,
                  const std::string& subject, Score& score) {
  if (reference == nullptr) return;
  const RemovedSet mine = keeper.removed_set();
  std::vector<RemovedSet> experts, novices;
  std::vector<const Reference::One*> others;
  for (const Reference::One& o : reference->sessions) {
    if ((!subject.empty() && o.subject == subject) || (!mine.empty() && o.removed == mine)) continue;
    (o.group == ReferenceGroup::expert ? experts : novices).push_back(o.removed);
    if (o.group == ReferenceGroup::expert) others.push_back(&o);
  }
  const std::size_t left_out = reference->sessions.size() - experts.size() - novices.size();
  if (left_out > 0)
    score.words.push_back(std::to_string(left_out) +
                          " sessions of the reference are left out: of the same person, or the same session");
  const auto no = [&](MetricWhen what, const std::string& why, const std::string& of = {}) {
    not_measured_all(score.values, MetricPlace::reference, {what}, why, of);
  };
  if (experts.empty() || novices.empty()) {
    no(MetricWhen::regions, std::string("the reference has no sessions of ") +
                                (experts.empty() ? "experts" : "novices") + (left_out > 0 ? " by others" : ""));
  } else {
    const RegionScore r = score_region(mine, experts, novices);
    score.values.push_back(measured("region_log_ratio", r.log_ratio));
    score.values.push_back(r.effective_voxels > 0
                               ? measured("region_per_voxel", r.per_voxel)
                               : not_measured("region_per_voxel", "experts and novices took the same"));
    score.values.push_back(measured("region_voxels", r.effective_voxels));
    score.values.push_back(measured("region_thesis", r.thesis));
  }
  if (structures == nullptr) {
    no(MetricWhen::bands, "the case has no structures");
    return;
  }
  constexpr std::size_t kMin = 100;  // samples: a second
  for (const auto& [value, samples] : keeper.near().samples()) {
    const std::string name = structures->name_of(value);
    std::vector<IsotonicQuantile::Point> force, speed;
    for (const Reference::One* const o : others) {
      const auto theirs = o->near.find(value);
      if (theirs == o->near.end()) continue;
      for (const NearMetric::Sample& s : theirs->second) {
        force.push_back({static_cast<double>(s.distance_mm), static_cast<double>(s.force_n)});
        if (!std::isnan(s.speed_mm_s))
          speed.push_back({static_cast<double>(s.distance_mm), static_cast<double>(s.speed_mm_s)});
      }
    }
    if (force.size() < kMin) {
      no(MetricWhen::bands, "experts drilled less than a second near it", name);
      continue;
    }
    const IsotonicQuantile most_force(force, 0.9), most_speed(speed, 0.9);
    std::size_t harder = 0, faster = 0, moved = 0;
    double last_reported_s = -1e9;
    for (const NearMetric::Sample& s : samples) {
      const double d = static_cast<double>(s.distance_mm), limit = most_force.at(d);
      if (!std::isnan(s.speed_mm_s)) {
        ++moved;
        if (static_cast<double>(s.speed_mm_s) > most_speed.at(d)) ++faster;
      }
      if (static_cast<double>(s.force_n) <= limit) continue;
      ++harder;
      if (d <= kNearMm && s.t_s - last_reported_s > 1) {
        score.moments.push_back(
            {s.t_s, s.at_mm, "pressed harder than experts do there", name, static_cast<double>(s.force_n), limit});
        last_reported_s = s.t_s;
      }
    }
    score.values.push_back(
        measured("force_above_band_share", static_cast<double>(harder) / static_cast<double>(samples.size()), name));
    score.values.push_back(
        moved > 0 && !speed.empty()
            ? measured("speed_above_band_share", static_cast<double>(faster) / static_cast<double>(moved), name)
            : not_measured("speed_above_band_share", "no drilling near it is long enough for a speed", name));
  }
}

// Directions of a procedure are one side's. Where they look to the one and the hand came from the other, its items are
// of faces that nobody worked on.
std::string side_doubt(const Procedure& procedure, Vec3 approach) {
  constexpr double kSideways = 0.5;
  Vec3 sum;
  for (const ScaleItem& item : procedure.items) {
    const Vec3 towards{item.towards[0], item.towards[1], item.towards[2]};
    if (length(towards) > 0) sum += normalized(towards);
  }
  if (!(length(sum) > 0)) return {};
  const double looks = normalized(sum).x, came = approach.x;
  if (std::abs(looks) < kSideways || std::abs(came) < kSideways || looks * came > 0) return {};
  return std::string("the procedure is for the patient's ") + (looks > 0 ? "left" : "right") +
         " side, and the hand came from the other: score it " +
         (procedure.hash.ends_with("mirrored") ? "without" : "with") + " --mirror";
}

void judge(const World& begin, const World& end, const ScoreKeeper& keeper, const StructureMap* structures,
           const Procedure& procedure, Score& score, const Context& context) {
  if (structures == nullptr) {
    for (const ScaleItem& item : procedure.items) {
      if (item.kind == ItemKind::pieces || item.kind == ItemKind::fixed) {
        score.items.push_back(Product::count(item, end));
        continue;
      }
      Product::Result r;
      r.item = &item;
      r.threshold = item.threshold;
      r.word = "the case has no structures";
      score.items.push_back(std::move(r));
    }
    return;
  }
  std::vector<RemovedVoxel> removed;
  for (const auto& [name, voxel] : keeper.removed()) removed.push_back(voxel);
  std::vector<std::string> injured;
  for (const Measured& m : keeper.values()) {
    if ((m.is("injured_s") || m.is("cut_mm3")) && m.value && *m.value > 0) injured.push_back(m.of);
  }
  const Product product(begin, end, *structures, procedure, std::move(removed), context);
  if (!product.word().empty()) score.words.push_back(product.word());
  score.items.resize(procedure.items.size());
  const Vec3 approach = keeper.approach();
  if (std::string doubt = side_doubt(procedure, approach); !doubt.empty()) score.words.push_back(std::move(doubt));
  parallel_for(procedure.items.size(), 1, context.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t n = from; n < to; ++n) score.items[n] = product.evaluate(procedure.items[n], approach, injured);
  });
  for (const Product::RegionResult& r : product.regions()) {
    if (r.region->kind == RegionKind::forbidden) {
      score.values.push_back(measured("forbidden_mm3", r.removed_mm3, r.region->name));
    } else if (r.bone_mm3 > 0) {
      score.values.push_back(measured("target_share", r.removed_mm3 / r.bone_mm3, r.region->name));
    } else {
      score.values.push_back(not_measured("target_share", "there is no bone in it", r.region->name));
    }
  }
  if (std::any_of(procedure.regions.begin(), procedure.regions.end(),
                  [](const auto& r) { return r.kind == RegionKind::target; }))
    score.values.push_back(measured("outside_target_mm3", product.outside_targets_mm3()));
  score.values.push_back(measured("cavity_mm3", product.cavity_mm3()));
}

}  // namespace

Score score_session(const SessionReader& session, World begin, const StructureMap* structures,
                    const Procedure* procedure, const Reference* reference, const std::string& subject,
                    const Context& context, ScoreDetail* detail) {
  Score score;
  if (procedure != nullptr) {
    score.procedure = procedure->name;
    check_procedure(*procedure, structures, score.words);
  }
  const SessionOutline& o = session.outline();
  score.source.bone = session.header().bone_hash.substr(0, 16);
  score.source.procedure = procedure != nullptr ? procedure->hash : "none";
  score.source.recorded_by = session.header().program_version;
  score.source.simulated = !simulated_text(session).empty();
  score.source.cut_short = !o.end || o.damaged() || !losses(o).empty();
  if (!o.end) score.words.push_back("the session was cut short: it is scored as far as it goes");
  for (const std::string& line : losses(o)) score.words.push_back(line);
  if (o.bone_known_until() != nullptr) score.words.push_back("behind the first gap that lost bone nothing is scored");
  double t = now_s();
  ScoreKeeper keeper({session.header().rate_hz, structures, procedure});
  const World first = begin.copy();
  std::ptrdiff_t undone = 0;
  World end = report_frames(
      session, std::move(begin),
      [&](const EvidenceFrame& f) {
        keeper.frame(f);
        undone += std::count_if(f.actions.begin(), f.actions.end(),
                                [](const SceneAction& a) { return a.is(ActionKind::undo); });
        if (detail != nullptr && detail->frame) detail->frame(f);
      },
      context.sub(0, 0.8));
  keeper.finish(end);
  score.seconds_frames = now_s() - t;
  score.values = keeper.values();
  score.moments = keeper.moments();
  // The final product goes by voxels that lost half of their bone; the work by all that was taken, however little.
  if (keeper.removed().empty()) {
    const bool worked = std::any_of(score.values.begin(), score.values.end(), [](const Measured& m) {
      return (m.name() == "removed_mm3" || m.name() == "sawn_mm3") && m.value.value_or(0) > 0;
    });
    if (!worked)
      score.words.push_back("nothing was removed");
    else if (undone > 0 && first.volume_mm3() - end.volume_mm3() < 1e-6)
      score.words.push_back("all that was removed was taken back");
    else
      score.words.push_back("less was removed than half of any voxel");
  }
  if (undone > 0)
    score.words.push_back(
        (undone == 1 ? "a step was taken back" : std::to_string(undone) + " steps were taken back") +
        std::string(
            ": what was seen and the final product go by what is gone at the end; all else counts the work done"));
  const auto count = [](const World& w, bool of_region) {
    return std::count_if(w.bodies().begin(), w.bodies().end(),
                         [&](const PlacedBody& b) { return b.of_region == of_region; });
  };
  if (count(first, false) > 1 || count(end, false) > 1)
    score.words.push_back("bone in fragments: the final product is measured with each where it lay at the beginning");
  if (count(first, true) > 0)
    score.words.push_back("the case has a finer region: volumes and what was seen go by each voxel's own size");
  if (!keeper.removed().empty() && no_bone(end)) score.words.push_back("no bone is left");
  if (structures == nullptr && procedure == nullptr)
    score.words.push_back("the case has no structures: nothing is known of what was near");
  for (const Moment& m : score.moments) {
    if (m.what == "touched from the first tick on")
      score.words.push_back("'" + m.structure + "' was touched from the first tick on: the tool began inside it");
  }
  t = now_s();
  if (procedure != nullptr) {
    judge(first, end, keeper, structures, *procedure, score, context);
    if (score.judged() > 0) {
      score.values.push_back(measured("items_passed", static_cast<double>(score.passed())));
    } else {
      score.values.push_back(not_measured("items_passed", "no item could be judged"));
    }
    for (const ProcedureStep& step : procedure->steps) {
      bool done = true, judged = !step.items.empty();
      for (const Product::Result& r : score.items) {
        if (std::find(step.items.begin(), step.items.end(), r.item->name) == step.items.end()) continue;
        judged = judged && r.measured;
        done = done && r.pass;
      }
      score.steps.emplace_back(step.name, !judged ? "not judged" : done ? "done" : "not done");
    }
  }
  score.seconds_product = now_s() - t;
  by_reference(keeper, structures, reference, subject, score);
  std::stable_sort(score.moments.begin(), score.moments.end(),
                   [](const Moment& a, const Moment& b) { return a.t_s < b.t_s; });
  for (const auto& v : keeper.visibility().voxels()) {
    if (v.second.seen == VisibilityMetric::Seen::hidden) score.hidden.emplace_back(v.first, v.second);
  }
  if (detail != nullptr) {
    detail->voxels = keeper.visibility().voxels();
    detail->removed = keeper.removed_set();
    detail->near = keeper.near().samples();
    detail->approach = keeper.approach();
    detail->end = std::move(end);
  }
  context.progress(1);
  return score;
}

Reference::One read_reference(const SessionReader& session, World begin, const StructureMap* structures,
                              const ReferenceSession& which, const Context& context) {
  Reference::One one{which.subject, which.group, {}, {}};
  ScoreKeeper keeper({session.header().rate_hz, structures, nullptr});
  const World end = report_frames(
      session, std::move(begin), [&](const EvidenceFrame& f) { keeper.frame(f); }, context);
  keeper.finish(end);
  one.removed = keeper.removed_set();
  one.near = keeper.near().samples();
  return one;
}

}  // namespace osteo::inline assessment
