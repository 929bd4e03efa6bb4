#include "osteo/scene/rehearsal.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numbers>

#include "osteo/base/error.h"
#include "osteo/pipeline/pipeline.h"

namespace osteo {

Rehearsal::Rehearsal(BrickGrid bone, std::unique_ptr<Device> device, const RehearsalOptions& options, const Context& context)
    : bone_(std::move(bone)),
      device_(std::move(device)),
      options_(options),
      renderer_(options.haptics, bone_, options.anatomy, 1 / options.rate_hz),
      servo_(bone_, renderer_, *device_, stream_, options.rate_hz),
      tick_buffer_(1024),
      change_buffer_(1 << 20) {
  if (!options_.session_file.empty()) {
    SessionHeader header;
    header.program_version = program_version();
    header.bone_hash = bone_.hash();
    header.rate_hz = options_.rate_hz;
    header.haptics = options_.haptics;
    recorder_ = std::make_unique<Recorder>(stream_.add_reader(), options_.session_file, header);
  }
  if (options_.follow_pieces) {
    components_ = std::make_unique<LiveComponents>(bone_);
    pieces_ = static_cast<int>(large_pieces().size());
  }
  if (options_.dust) {
    dust_bone_ = BrickGrid(bone_);
    dust_ = std::make_unique<Dust>(dust_bone_);
  }
  if (options_.follow_surface || options_.follow_pieces || options_.dust) surface_reader_ = &stream_.add_reader();
  if (options_.follow_surface) {
    surface_ = std::make_unique<LiveSurface>(bone_, context);
  }
}

Rehearsal::~Rehearsal() {
  if (loop_) loop_->request_stop();
  if (loop_) loop_->join();
  stop_ = true;
  if (follower_.joinable()) follower_.join();
}

double Rehearsal::removed_mm3() const {
  return removed_mm3_;
}
bool Rehearsal::running() const {
  return loop_ && loop_->running();
}

void Rehearsal::dust_tick(const TickRecord& tick, std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    const double gone = static_cast<double>(dust_bone_.value(c.voxel) - c.density) * dust_bone_.frame().voxel_volume_mm3();
    dust_bone_.set(c.voxel, c.density);
    dust_->add(c.voxel, gone);
  }
  // A hundred steps a second: 50 mm/s at half-millimetre voxels.
  const auto every = static_cast<std::uint64_t>(std::max(1.0, std::round(options_.rate_hz / 100)));
  if (tick.tick % every != 0) return;
  if (tick.device.tool < burr_library().size())
    dust_->push(burr_library()[tick.device.tool].head(), from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                normalized(from_floats(tick.device.axis)));
  dust_->step();
}

void Rehearsal::with_dust(const std::function<void(Dust&)>& f) {
  const std::lock_guard lock(surface_mutex_);
  if (dust_) f(*dust_);
}

std::vector<LiveComponents::Component> Rehearsal::large_pieces() {
  std::vector<LiveComponents::Component> large;
  const double voxel_mm3 = bone_.frame().voxel_volume_mm3();
  for (const auto& c : components_->update()) {
    if (c.mass * voxel_mm3 >= kLeastPieceMm3) large.push_back(c);
  }
  std::stable_sort(large.begin(), large.end(), [](const auto& a, const auto& b) { return a.mass > b.mass; });
  return large;
}

std::size_t Rehearsal::drain_surface() {
  if (surface_reader_ == nullptr) return 0;
  std::size_t total = 0;
  const std::lock_guard lock(surface_mutex_);
  while (const std::size_t n = surface_reader_->ticks.pop(tick_buffer_)) {
    std::size_t wanted = 0;
    double removed = 0;
    for (std::size_t t = 0; t < n; ++t) {
      wanted += tick_buffer_[t].voxels_changed;
      const TickRecord& r = tick_buffer_[t];
      removed += static_cast<double>(r.removed_mm3);
      if (r.structure == 0) continue;
      const auto clearance = static_cast<double>(r.clearance_mm);
      auto& e = structure_events_.try_emplace(r.structure, RehearsalSummary::StructureEvents{clearance, 0, 0}).first->second;
      e.least_clearance_mm = std::min(e.least_clearance_mm, clearance);
      e.ticks_touched += (r.flags & kStructureTouched) != 0 ? 1 : 0;
      e.ticks_injured += (r.flags & kStructureInjured) != 0 ? 1 : 0;
    }
    if (wanted > change_buffer_.size()) change_buffer_.resize(wanted);
    const std::size_t got = surface_reader_->changes.pop({change_buffer_.data(), wanted});
    std::size_t used = 0;
    for (std::size_t t = 0; t < n && dust_; ++t) {
      const std::size_t changed = std::min<std::size_t>(tick_buffer_[t].voxels_changed, got - used);
      dust_tick(tick_buffer_[t], {change_buffer_.data() + used, changed});
      used += changed;
    }
    for (std::size_t c = 0; c < got; ++c) {
      if (surface_) surface_->mark(change_buffer_[c].voxel);
      if (components_) components_->mark(change_buffer_[c].voxel);
    }
    removed_mm3_ = removed_mm3_ + removed;
    latest_.store(tick_buffer_[n - 1]);
    total += n;
  }
  if (surface_) {
    for (const std::uint32_t b : surface_->update()) changed_bricks_.insert(b);
  }
  if (components_ && total > 0) pieces_ = static_cast<int>(large_pieces().size());
  return total;
}

void Rehearsal::follow() {
  while (!stop_) {
    drain_surface();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void Rehearsal::start() {
  loop_ = std::make_unique<FixedRateLoop>(options_.rate_hz, [this](std::int64_t lateness_ns) { return servo_.step(lateness_ns); });
  if (recorder_) recorder_->start();
  if (surface_reader_ != nullptr) follower_ = std::thread([this] { follow(); });
  loop_->start();
}

RehearsalSummary Rehearsal::stop() {
  if (loop_) {
    loop_->request_stop();
    loop_->join();
  }
  stop_ = true;
  if (follower_.joinable()) follower_.join();
  return finish();
}

RehearsalSummary Rehearsal::run_to_end(const Context& context) {
  while (servo_.step(0)) {
    if (servo_.ticks() % 64 != 0) continue;
    context.check_cancelled();
    if (recorder_) recorder_->drain();
    drain_surface();
  }
  return finish();
}

RehearsalSummary Rehearsal::finish() {
  drain_surface();
  if (recorder_) recorder_->stop();
  RehearsalSummary s;
  s.ticks = servo_.ticks();
  s.removed_mm3 = recorder_ ? recorder_->removed_mm3() : removed_mm3_.load();
  s.bone_hash = bone_.hash();
  if (surface_) {
    s.surface_hash = surface_hash(surface_->joined().mesh);
  }
  if (surface_reader_ != nullptr) s.dropped = surface_reader_->dropped;
  s.voxel_mm3 = bone_.frame().voxel_volume_mm3();
  if (components_) s.pieces = large_pieces();
  if (dust_) s.dust = dust_->totals();
  if (recorder_) {
    if (recorder_->failure()) throw Error(*recorder_->failure());
    recorder_->finish({s.ticks, s.bone_hash, s.surface_hash, s.removed_mm3});
    s.session_bytes = recorder_->bytes();
  }
  s.structures = structure_events_;
  if (loop_) s.loop = loop_->stats();
  return s;
}

void Rehearsal::with_surface(const std::function<void(const LiveSurface&, std::span<const std::uint32_t>)>& f) {
  const std::lock_guard lock(surface_mutex_);
  const std::vector<std::uint32_t> changed(changed_bricks_.begin(), changed_bricks_.end());
  changed_bricks_.clear();
  f(*surface_, changed);
}

ReplayResult replay(const Session& session, BrickGrid& bone, const Anatomy& anatomy, const Context& context) {
  const auto begin = std::chrono::steady_clock::now();
  ReplayResult result;
  if (bone.hash() != session.header.bone_hash) {
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  }
  std::vector<DeviceSample> samples;
  samples.reserve(session.ticks.size());
  for (const TickRecord& t : session.ticks) samples.push_back(t.device);
  BrickGrid from_changes = bone;  // the second way: apply the recorded changes
  ReplayDevice device(std::move(samples));
  if (session.header.haptics.hardness != (anatomy.hardness != nullptr)) {
    throw Error(ExitCode::usage, "the session went by the hardness of the bone, which this case does not tell",
                "the case needs its hu.vdb");
  }
  if (session.header.haptics.structures != (anatomy.structures ? anatomy.structures->hash() : "")) {
    throw Error(ExitCode::corrupt, "the session watched other structures at risk than this case has",
                "give the case it was recorded on, unchanged");
  }
  HapticRenderer renderer(session.header.haptics, bone, anatomy, 1 / session.header.rate_hz);
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Servo servo(bone, renderer, device, stream, session.header.rate_hz);
  std::vector<VoxelChange> changes(1 << 16);
  const auto differ = [&](const std::string& what) {
    if (result.difference.empty()) result.difference = what;
  };
  for (const TickRecord& recorded : session.ticks) {
    if (recorded.tick % 256 == 0)
      context.progress(0.9 * static_cast<double>(recorded.tick) / static_cast<double>(session.ticks.size()), "replay");
    servo.step(0);
    TickRecord now;
    reader.ticks.pop({&now, 1});
    while (reader.changes.pop(changes) > 0) {
    }
    // Bytes, not numbers: the same bits or not.
    constexpr std::size_t kRepeated = offsetof(TickRecord, work_us);
    const bool same = std::memcmp(&now, &recorded, kRepeated) == 0;
    if (!same) differ("tick " + std::to_string(recorded.tick) + " came out differently");
    result.removed_mm3 += static_cast<double>(now.removed_mm3);
  }
  result.ticks = session.ticks.size();
  for (const VoxelChange& c : session.changes) {
    if (c.voxel / BrickGrid::kVoxels >= from_changes.brick_count())
      throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
    from_changes.set(c.voxel, c.density);
  }
  result.bone_hash = bone.hash();
  if (from_changes.hash() != result.bone_hash) differ("the recorded voxel changes give another bone than the recorded poses");
  result.surface_hash = surface_hash(surface_nets(bone, 0.5F, context).mesh);
  result.complete = session.end.has_value();
  if (session.end) {
    if (session.end->ticks != result.ticks) differ("the session says it had " + std::to_string(session.end->ticks) + " ticks");
    if (session.end->bone_hash != result.bone_hash) differ("the bone came out differently");
    if (!session.end->surface_hash.empty() && session.end->surface_hash != result.surface_hash) differ("the surface came out differently");
  }
  result.identical = result.difference.empty();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

Script make_default_script(const BrickGrid& bone, bool left, int tool, double seconds) {
  // Centre of the bone, from a brick's middle each: near enough for a starting point.
  Vec3 sum{};
  double weight = 0;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Ijk o = bone.brick_coordinate(b);
    sum += bone.frame().world_from_index({o.i * 8 + 3.5, o.j * 8 + 3.5, o.k * 8 + 3.5});
    weight += 1;
  }
  if (weight == 0) throw Error(ExitCode::failed, "the case holds no bone");
  // The mastoid of most heads lies behind and below the middle of their bone.
  const Vec3 centre = sum / weight + Vec3{0, 20, -22};
  const Vec3 out{left ? 1.0 : -1.0, 0, 0};
  // The outside of the first bone met that is followed by 20 mm of nothing (air cells, the ear canal and a gap to a head holder are
  // narrower and wider); try rays around the centre until one meets bone.
  std::optional<Vec3> entry;
  const auto& f = bone.frame();
  const double longest = length({f.dims[0] * f.spacing_mm.x, f.dims[1] * f.spacing_mm.y, f.dims[2] * f.spacing_mm.z});
  for (int ring = 0; ring < 40 && !entry; ++ring) {
    for (int a = 0; a < (ring == 0 ? 1 : 8) && !entry; ++a) {
      const double angle = a * std::numbers::pi / 4;
      const Vec3 from = centre + Vec3{0, 2.0 * ring * std::cos(angle), 2.0 * ring * std::sin(angle)};
      double bone_end = -1;
      for (double s = 0; s < longest; s += 0.25) {
        if (bone.nearest(from + out * s) >= 0.5F) {
          bone_end = s;
        } else if (bone_end >= 0 && s - bone_end > 20) {
          break;
        }
      }
      if (bone_end >= 0) entry = from + out * bone_end;
    }
  }
  if (!entry)
    throw Error(ExitCode::failed, "no bone was found on the patient's " + std::string(left ? "left" : "right") + " side",
                "write a script of strokes for this case");

  const double radius = burr_library()[static_cast<std::size_t>(tool)].diameter_mm / 2;
  Script script;
  script.tool = tool;
  script.axis = normalized(out + Vec3{0, 0.8, 0.6});
  const Vec3 u{0, 1, 0}, v{0, 0, 1};
  script.waypoints.push_back({0, *entry + out * (radius + 6), false});
  script.waypoints.push_back({0.04 * seconds, *entry + out * (radius + 1), true});
  const double first = 0.06 * seconds, last = 0.94 * seconds, step = 0.05;
  for (double t = first; t < last; t += step) {
    const double share = (t - first) / (last - first);
    // Turns that open and close between the middle and the rim, a little deeper each time.
    const double rim = std::min(7.0, 3 + seconds / 15), sway = std::abs(std::fmod(0.25 * (t - first), 2.0) - 1);
    const double circle = rim * (1 - sway), angle = 2 * std::numbers::pi * 1.2 * (t - first);
    const double depth = 3 + std::min(9.0, 0.12 * seconds + 1) * share;
    script.waypoints.push_back(
        {t, *entry + out * (radius - depth) + u * (circle * std::cos(angle)) + v * (circle * std::sin(angle)), true});
  }
  script.waypoints.push_back({last + step, *entry + out * (radius + 2), false});
  script.waypoints.push_back({seconds, *entry + out * (radius + 8), false});
  return script;
}

}  // namespace osteo
