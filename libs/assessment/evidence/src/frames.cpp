#include "osteo/assessment/evidence/frames.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/data/json_vec.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline assessment {
std::vector<CameraPose> camera_poses(std::span<const Note> notes, std::size_t& unreadable) {
  std::vector<CameraPose> poses;
  for (const Note& n : notes) {
    if (n.kind != "camera") continue;
    const auto j = Json::parse(n.json);
    const auto eye = j ? vec_of(j->find("eye_mm")) : std::nullopt,
               target = j ? vec_of(j->find("target_mm")) : std::nullopt;
    if (eye && target) {
      poses.push_back({n.tick, *eye, *target});
    } else {
      ++unreadable;
    }
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const CameraPose& a, const CameraPose& b) { return a.tick < b.tick; });
  return poses;
}

FrameMaker::FrameMaker(World begin, double rate_hz, const std::vector<CameraPose>& cameras, Sink sink)
    : world_(std::move(begin)),
      rate_hz_(rate_hz),
      frame_ticks_(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(Recorder::kFrameS * rate_hz)))),
      cameras_(cameras),
      sink_(std::move(sink)) {}

void FrameMaker::flush() {
  if (actions_.empty() && ticks_.empty() && changes_.empty() && sawn_.empty()) return;
  std::sort(changes_.begin(), changes_.end(),
            [](const VoxelChange& a, const VoxelChange& b) { return a.voxel < b.voxel; });
  const auto behind = std::upper_bound(cameras_.begin(), cameras_.end(), next_tick_,
                                       [](std::uint64_t t, const CameraPose& c) { return t <= c.tick; });
  sink_({rate_hz_, actions_, ticks_, changes_, sawn_, world_, behind == cameras_.begin() ? nullptr : &*(behind - 1),
         lost_});
  actions_.clear();
  ticks_.clear();
  changes_.clear();
  sawn_.clear();
  in_frame_.clear();
  lost_ = 0;
}

// A frame that holds an earlier tenth of a second is whole.
void FrameMaker::begin_frame_at(std::uint64_t tick) {
  if (tick > next_tick_) {
    flush();
    lost_ += tick - next_tick_;
  } else if (tick / frame_ticks_ != (next_tick_ == 0 ? 0 : next_tick_ - 1) / frame_ticks_) {
    flush();
  }
}

void FrameMaker::action(const SceneAction& action) {
  // Of several frames of a file within a tenth of a second the ticks belong together only up to here.
  if (parts_changes(row_of(action)) && !changes_.empty()) flush();
  actions_.push_back(action);
  std::vector<std::shared_ptr<Body>> before;
  if (action.is(ActionKind::saw)) {
    for (const PlacedBody& b : world_.bodies()) before.push_back(b.body);
  }
  const World::Effect effect = apply_action(action, world_);
  if (!action.is(ActionKind::saw)) return;
  for (const World::Effect::Changed& c : effect.changed) {
    const PlacedBody* const now = world_.find(c.body);
    const auto old = std::find_if(before.begin(), before.end(), [&](const auto& b) { return b->id == c.body; });
    if (now == nullptr || old == before.end()) continue;
    for (const std::uint32_t brick : c.bricks) {
      for (std::uint32_t o = 0; o < BrickGrid::kVoxels; ++o) {
        const VoxelKey own = brick * BrickGrid::kVoxels + o;
        const float was = (*old)->bone.value(own), is = now->body->bone.value(own);
        if (is < was) sawn_.push_back({now->body->name_of(own), is, was});
      }
    }
  }
}

void FrameMaker::take(const TickRecord& record) {
  if (record.tick + 1 != next_tick_) begin_frame_at(record.tick);
  next_tick_ = record.tick + 1;
  ticks_.push_back(record);
}

bool FrameMaker::take(const VoxelChange& change) {
  const std::optional<VoxelChange> reported = apply_change(change, world_);
  if (!reported) return false;
  if (const auto [at, is_new] = in_frame_.try_emplace(reported->voxel, changes_.size()); is_new) {
    changes_.push_back(*reported);
  } else {
    changes_[at->second].density = reported->density;
  }
  return true;
}

void FrameMaker::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  take(record);
  // What belongs to a body that was just exchanged comes no more.
  for (const VoxelChange& c : changes) static_cast<void>(take(c));
}

void FrameMaker::part(const SessionPart& part) {
  if (part.gap != nullptr) flush();
  for (const SceneAction& a : part.actions) action(a);
  for (const TickRecord& t : part.ticks) take(t);
  for (const VoxelChange& c : part.changes) {
    if (!take(c)) throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
  }
}

void FrameMaker::end() {
  flush();
}

std::vector<CameraPose> cameras_of(const SessionReader& session, std::size_t& unreadable) {
  std::vector<Note> notes;
  auto parts = session.parts();
  while (const SessionPart* const p = parts.next()) {
    for (const Note& n : p->notes) {
      if (n.kind == "camera") notes.push_back(n);
    }
  }
  return camera_poses(notes, unreadable);
}

World report_frames(const SessionReader& session, World begin, const FrameMaker::Sink& sink, const Context& context) {
  if (begin.hash() != session.header().bone_hash)
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  std::size_t unreadable = 0;
  const std::vector<CameraPose> cameras = cameras_of(session, unreadable);
  if (unreadable > 0) context.warn(std::to_string(unreadable) + " camera notes cannot be read: left out");
  const Gap* const known_until = session.outline().bone_known_until();
  const double all = static_cast<double>(std::max<std::uint64_t>(1, session.outline().tick_records));
  FrameMaker maker(std::move(begin), session.header().rate_hz, cameras, sink);
  auto parts = session.parts();
  double reported = 0;
  while (const SessionPart* const p = parts.next()) {
    if (p->gap != nullptr && p->gap == known_until) break;
    maker.part(*p);
    reported += static_cast<double>(p->ticks.size());
    context.progress(std::min(1.0, reported / all), "reading the session");
  }
  maker.end();
  return maker.world().copy();
}

}  // namespace osteo::inline assessment
