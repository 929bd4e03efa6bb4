#include "osteo/assessment/trainee/simulate.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "osteo/assessment/trainee/trainee_hand.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {
namespace {

constexpr double kClearMm = 6;  // above the bone, where burrs are changed
constexpr double kHopMm = 1.3, kMinStrokeMm = 12, kShortMm = 1.2;
// What lies within a burr's rim, or is less, is not worth a stroke; in a layer with others below it that is more than
// in the last.
constexpr double kRimMm = 0.45, kSeenMm3 = 2, kWorthMm3 = 6;
// Of a layer: what is left then is met again in the next, but for the last ones.
constexpr int kMaxRepeats = 5, kMaxLastRepeats = 25;
// How it learns by how much its hand goes below the burr that it sees: from ticks with so much force, so much of each,
// at most mm/N.
constexpr double kFeltN = 0.3, kNoticed = 0.02, kMaxYields = 0.5;
constexpr double kEyeMm = 180, kViewDeg = 30;

Json triple(Vec3 v) {
  const auto micrometres = [](double x) { return std::round(x * 1000) / 1000; };
  return Json{micrometres(v.x), micrometres(v.y), micrometres(v.z)};
}

// What goes on behind the hand: it looks at what bone is left, and says what comes next. Reported by the stream like
// any reader, in the thread that steps the servo.
class TraineeMind final : public Reader {
 public:
  using Note = std::function<void(const std::string& kind, const std::string& json)>;
  TraineeMind(const WorkPlan& plan, const TraineeOptions& options, double rate_hz, TraineeHand& hand)
      : plan_(plan), options_(options), rate_hz_(rate_hz), hand_(hand) {
    for (std::size_t s = 0; s < plan.strokes.size(); ++s)
      if (s == 0 || plan.strokes[s].layer != plan.strokes[s - 1].layer) layers_.push_back(s);
    layers_.push_back(plan.strokes.size());
  }
  /// Whom it tells what it looks at.
  void notify(Note note) { note_ = std::move(note); }

  void resync(const World& world) override { world_ = &world; }

  void tick(const TickRecord& record, std::span<const VoxelChange>) override {
    now_ = record;
    const Instrument& tool = instrument_of(record.device.tool);
    if (record.device.pedal == 0 || record.speed_rpm < 1000 || tool.as_burr() == nullptr || record.normal_force_n <= 0)
      return;
    const double pushed_n = dot(from_floats(record.force_n), plan_.toward);
    if (pushed_n > kFeltN) {
      yields_ += (dot(from_floats(record.shown_offset_mm), plan_.toward) / pushed_n - yields_) * kNoticed;
      hand_.sees(std::clamp(yields_, 0.0, kMaxYields));
    }
    // Where it is shown: at the bone's surface, not in bone that it has not taken yet.
    const Vec3 at = from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm);
    if (!swept_.empty() && length(swept_.back().centre_mm - at) < 0.1 &&
        swept_.back().radius_mm == tool.head.largest_radius_mm())
      return;
    swept_.push_back({at, tool.head.largest_radius_mm()});
  }

  void update() override {
    const double t_s = static_cast<double>(now_.tick) / rate_hz_;
    if (t_s > options_.most_s && !leaving_) leave();
    while (hand_.done() && !gone_) {
      if (leaving_) {
        gone_ = true;
        hand_.end();
        return;
      }
      next();
    }
    look(t_s);
  }

  [[nodiscard]] const std::vector<SweptBall>& swept() const { return swept_; }
  [[nodiscard]] bool finished() const { return finished_; }

 private:
  // Bone is left where the burr would be, were it as deep as it wants to come.
  [[nodiscard]] bool sees_bone(Vec3 centre, double radius, double least_mm3) const {
    const BrickGrid& bone = world_->bodies().front().body->bone;
    const Vec3 middle = bone.frame().index_from_world(centre), spacing = bone.frame().spacing_mm;
    std::array<int, 3> lo{}, hi{};
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = static_cast<int>(std::ceil(middle[a] - radius / spacing[a]));
      hi[a] = static_cast<int>(std::floor(middle[a] + radius / spacing[a]));
    }
    double left = 0;
    for (int k = lo[2]; k <= hi[2]; ++k)
      for (int j = lo[1]; j <= hi[1]; ++j)
        for (int i = lo[0]; i <= hi[0]; ++i) {
          const Vec3 d{(i - middle.x) * spacing.x, (j - middle.y) * spacing.y, (k - middle.z) * spacing.z};
          if (dot(d, d) < radius * radius) left += static_cast<double>(bone.at(i, j, k));
        }
    return left * bone.frame().voxel_volume_mm3() > least_mm3;
  }

  // Of a row the parts where bone is left, with a place more on either side; each to and fro where it is short.
  [[nodiscard]] TraineeStroke left_of(const TraineeStroke& planned, double radius, double least_mm3) const {
    TraineeStroke s = planned;
    s.points.clear();
    const std::vector<TraineeStroke::Point>& row = planned.points;
    std::vector<bool> near(row.size(), false);
    for (std::size_t p = 0; p < row.size(); ++p) {
      if (!sees_bone(row[p].at_mm, radius - kRimMm, least_mm3)) continue;
      for (std::size_t n = p > 0 ? p - 1 : 0; n < std::min(row.size(), p + 2); ++n) near[n] = true;
    }
    for (std::size_t first = 0; first < row.size(); ++first) {
      if (!near[first]) continue;
      std::size_t last = first;
      while (last + 1 < row.size() && near[last + 1]) ++last;
      to_and_fro(row, first, last, s.points);
      first = last;
    }
    return s;
  }
  void to_and_fro(const std::vector<TraineeStroke::Point>& row, std::size_t first, std::size_t last,
                  std::vector<TraineeStroke::Point>& points) const {
    double way = 0;
    if (length(row[last].at_mm - row[first].at_mm) < kShortMm) {
      // Around a single place it goes in small crosses.
      const Vec3 u = any_perpendicular(plan_.toward) * (kShortMm / 2), v = cross(plan_.toward, u);
      for (; way < kMinStrokeMm; way += 4 * kShortMm)
        for (std::size_t n = first; n <= last; ++n)
          for (const Vec3 off : {u, -u, v, -v}) points.push_back({row[n].at_mm + off, row[n].axis, row[n].press_mm});
      return;
    }
    for (bool back = false; way < kMinStrokeMm; back = !back) {
      for (std::size_t n = 0; n <= last - first; ++n) points.push_back(row[back ? last - n : first + n]);
      way += std::max(1.0, length(row[last].at_mm - row[first].at_mm));
    }
  }

  [[nodiscard]] bool last_layers() const { return layer_ + 3 >= layers_.size(); }

  void next() {
    if (!queue_.empty()) {
      hand_.begin(std::move(queue_.front()));
      queue_.pop_front();
      return;
    }
    while (stroke_ < plan_.strokes.size()) {
      const TraineeStroke& planned = plan_.strokes[stroke_];
      const double radius = instrument_of(planned.tool).head.largest_radius_mm();
      TraineeStroke s = left_of(planned, radius, last_layers() ? kSeenMm3 : kWorthMm3);
      ++stroke_;
      const bool ends_layer = stroke_ == layers_[layer_ + 1];
      if (!s.points.empty()) left_in_layer_ = true;
      if (ends_layer) {
        // Again, as long as bone is seen in it.
        if (left_in_layer_ && ++repeats_ < (last_layers() ? kMaxLastRepeats : kMaxRepeats)) {
          stroke_ = layers_[layer_];
        } else {
          ++layer_;
          repeats_ = 0;
        }
        left_in_layer_ = false;
      }
      if (s.points.empty()) continue;
      start(std::move(s));
      return;
    }
    finished_ = true;
    leave();
  }

  // From above the first place, where it is not there already; another burr is taken outside.
  void start(TraineeStroke s) {
    const Vec3 first = s.points.front().at_mm, axis = s.points.front().axis, here = hand_.position_mm();
    const double above = dot(here - first, plan_.toward);
    const double sideways = length(here - first - plan_.toward * above);
    const bool change = s.tool != hand_.tool(), far = layer_at_ != s.layer || !in_hole_;
    layer_at_ = s.layer;
    const bool in_hole_before = std::exchange(in_hole_, true);
    if (change || far || sideways > (plan_.steep ? 0.3 : 2.5)) {
      TraineeStroke out, over;
      out.drilling = over.drilling = false;
      out.tool = hand_.tool();
      over.tool = s.tool;
      const bool outside = change || plan_.steep || above < -0.5 || sideways > 9 || !in_hole_before;
      const auto beside = [&](Vec3 p) {
        return p - plan_.centre_mm - plan_.toward * dot(p - plan_.centre_mm, plan_.toward);
      };
      if (outside) {
        // In and out by the middle of the opening, where what lies under its edge is gone to.
        if (length(beside(here)) > plan_.open_mm) out.points.push_back({here - beside(here), axis});
        out.points.push_back(
            {plan_.centre_mm + plan_.toward * kClearMm + beside(out.points.empty() ? here : plan_.centre_mm), axis});
        const bool under = length(beside(first)) > plan_.open_mm;
        const Vec3 above_first = first + plan_.toward * (std::max(0.0, dot(plan_.centre_mm - first, plan_.toward)) + 2);
        over.points.push_back({under ? above_first - beside(first) : above_first, axis});
        if (under) s.points.insert(s.points.begin(), {first - beside(first), axis});
      } else {
        out.points.push_back({here + plan_.toward * kHopMm, axis});
        over.points.push_back({first + plan_.toward * kHopMm, axis});
      }
      queue_.push_back(std::move(out));
      queue_.push_back(std::move(over));
    }
    queue_.push_back(std::move(s));
    next();
  }

  void leave() {
    leaving_ = true;
    queue_.clear();
    TraineeStroke way;
    way.drilling = false;
    way.tool = hand_.tool();
    way.points.push_back({hand_.position_mm() + plan_.toward * 25, plan_.toward});
    hand_.begin(std::move(way));
  }

  void look(double t_s) {
    const double every_s = 40 - 36 * options_.skill.camera;
    if (!note_ || (looked_ && t_s - looked_s_ < every_s)) return;
    const Vec3 work = looked_ ? hand_.position_mm() : plan_.centre_mm;
    // The view goes where the work is, and looks down the middle of the window.
    const Vec3 off = work - plan_.centre_mm,
               target = plan_.centre_mm + (off - plan_.toward * dot(off, plan_.toward)) * 0.5;
    if (looked_ && length(target - looked_at_) < 0.05) return;
    looked_ = true;
    looked_s_ = t_s;
    looked_at_ = target;
    note_("camera", Json{{"eye_mm", triple(target + plan_.toward * kEyeMm)},
                         {"target_mm", triple(target)},
                         {"up", triple(any_perpendicular(plan_.toward))},
                         {"view_angle_deg", kViewDeg}}
                        .dump());
  }

  const WorkPlan& plan_;
  const TraineeOptions& options_;
  double rate_hz_;
  TraineeHand& hand_;
  const World* world_ = nullptr;
  Note note_;
  TickRecord now_;
  std::vector<std::size_t> layers_;  // first stroke of each, and one behind the last
  std::size_t stroke_ = 0, layer_ = 0;
  int repeats_ = 0, layer_at_ = -1;
  bool left_in_layer_ = false, leaving_ = false, gone_ = false, finished_ = false, looked_ = false, in_hole_ = false;
  std::deque<TraineeStroke> queue_;
  double looked_s_ = 0, yields_ = 0;
  Vec3 looked_at_;
  std::vector<SweptBall> swept_;
};

}  // namespace

TraineeScene trainee_scene(const std::filesystem::path& case_folder, Procedure procedure, const Context& context) {
  TraineeScene scene{load_case(case_folder), {}, {}, std::move(procedure)};
  scene.haptics.device = SpringHand::traits();
  apply_haptic_settings(scene.the_case.folder, {}, scene.haptics);
  scene.haptics.opened = scene.procedure.opened();
  scene.anatomy = anatomy_of(scene.the_case, scene.haptics, context);
  if (!scene.anatomy.structures)
    throw Error(ExitCode::usage, "the case has no structures, and a trainee's plan begins with them",
                "prepare it with --structures and --names");
  return scene;
}

SimulatedSession simulate_trainee(const TraineeScene& scene, World begin, const TraineeOptions& options,
                                  const SessionFolder& folder, const Context& context) {
  const Procedure& procedure = scene.procedure;
  RehearsalOptions o;
  o.haptics = scene.haptics;
  o.anatomy = scene.anatomy;
  o.session_file = folder.stream();
  SimulatedSession result;
  result.plan = plan_work(begin, *o.anatomy.structures, procedure, options.skill, options.seed, options.plan);
  const WorkPlan& plan = result.plan;
  const Vec3 start = plan.centre_mm + plan.toward * (kClearMm + 6);
  std::vector<bool> guarded;
  for (const std::uint8_t value : o.anatomy.structures->values())
    guarded.push_back(!procedure.enters(o.anatomy.structures->name_of(value)));
  auto device = std::make_unique<TraineeHand>(options.skill, options.seed, o.anatomy.structures.get(), guarded, start,
                                              plan.toward, plan.toward);
  TraineeHand& hand = *device;
  // The burr that it begins with is in its hand.
  TraineeStroke wait;
  wait.drilling = false;
  wait.tool = plan.coarse_tool;
  wait.points.push_back({start, plan.toward});
  hand.begin(wait);
  TraineeMind mind(plan, options, o.rate_hz, hand);
  Rehearsal rehearsal(std::move(begin), std::move(device), o, context);
  Json simulated{{"by", "simulated trainee"},
                 {"skill", skill_json(options.skill)},
                 {"seed", options.seed},
                 {"procedure", procedure.name}};
  rehearsal.note(std::string(kSimulatedNote), simulated.dump());
  mind.notify([&](const std::string& kind, const std::string& json) { rehearsal.note(kind, json); });
  rehearsal.add_reader(mind);
  result.summary = rehearsal.run_to_end(context);
  rehearsal.remove_reader(mind);
  result.finished = mind.finished();
  result.seconds = static_cast<double>(result.summary.ticks) / o.rate_hz;
  result.truth = own_truth(procedure, *o.anatomy.structures, mind.swept());
  const std::string text =
      write_summary(folder, result.summary, o.rate_hz, instrument_library()[plan.coarse_tool].name, o.anatomy);
  Json summary = Json::parse(text).value_or(Json::object());
  summary["simulated"] = simulated;
  write_file(folder.summary(), summary.dump(2) + "\n");
  Json truth = Json::list();
  for (const OwnTruth& t : result.truth)
    truth.push_back({{"item", t.item->name}, {"value", t.value}, {"pass", t.pass}});
  write_file(folder.folder / "trainee.json", Json{{"osteotome_trainee", 1},
                                                  {"simulated", true},
                                                  {"skill", skill_json(options.skill)},
                                                  {"seed", options.seed},
                                                  {"procedure", procedure.name},
                                                  {"finished", result.finished},
                                                  {"plan", Json{{"centre_mm", triple(plan.centre_mm)},
                                                                {"toward", triple(plan.toward)},
                                                                {"radius_mm", plan.radius_mm},
                                                                {"beside_the_best_mm", length(plan.shifted_mm)}}},
                                                  {"truth", truth}}
                                                     .dump(2) +
                                                 "\n");
  return result;
}

}  // namespace osteo::inline assessment
