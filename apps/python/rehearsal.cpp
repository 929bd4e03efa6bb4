// A rehearsal that a script of Python steps: goals of hands in, records of ticks out.
#include "osteo/session/scene/rehearsal.h"

#include <atomic>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <mutex>

#include "arrays.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/recording/haptic_settings.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "osteo/simulation/haptics/guide.h"

namespace osteo::python {
namespace {

// HandGoal.
py::dtype goal_dtype() {
  const py::dict spec(py::arg("names") = py::make_tuple("position_mm", "axis", "pedal", "tool"),
                      py::arg("formats") = py::make_tuple("(3,)<f8", "(3,)<f4", "u1", "u1"),
                      py::arg("offsets") = py::make_tuple(offsetof(HandGoal, position_mm), offsetof(HandGoal, axis),
                                                          offsetof(HandGoal, pedal), offsetof(HandGoal, tool)),
                      py::arg("itemsize") = sizeof(HandGoal));
  return py::module_::import("numpy").attr("dtype")(spec);
}

// Goes through goals that lie in memory, one a tick. On a spring, as a script's hand, or exactly there.
class GivenHand final : public Device {
 public:
  explicit GivenHand(bool spring) : spring_(spring) {}
  void follow(const HandGoal* first, std::size_t stride) {
    next_ = first;
    stride_ = stride;
  }
  DeviceSample read(std::uint64_t, double dt_s, Vec3 force_n) noexcept override {
    const HandGoal& goal = *next_;
    next_ += stride_;
    if (spring_) return hand_.step(goal, dt_s, force_n);
    DeviceSample sample;
    sample.position_mm = to_floats(goal.position_mm);
    sample.axis = goal.axis;
    sample.pedal = goal.pedal;
    sample.tool = goal.tool;
    return sample;
  }
  [[nodiscard]] static DeviceTraits traits_of(bool spring) { return spring ? SpringHand::traits() : DeviceTraits{}; }
  [[nodiscard]] DeviceTraits traits() const override { return traits_of(spring_); }

 private:
  bool spring_;
  SpringHand hand_;
  const HandGoal* next_ = nullptr;
  std::size_t stride_ = 1;
};

[[noreturn]] void refuse(const std::string& what, const std::string& advice = {}) {
  throw Error(ExitCode::usage, what, advice);
}

void require_goals(const HandGoal* goals, std::size_t n, std::size_t hands) {
  const std::size_t tools = instrument_library().size();
  for (std::size_t i = 0; i < n * hands; ++i) {
    const HandGoal& g = goals[i];
    const auto wrong = [&](const std::string& what, const std::string& advice) {
      refuse("goal " + std::to_string(i / hands) + (hands > 1 ? " of hand " + std::to_string(i % hands) : "") + ": " +
                 what,
             advice);
    };
    if (!std::isfinite(g.position_mm.x) || !std::isfinite(g.position_mm.y) || !std::isfinite(g.position_mm.z))
      wrong("its position is not finite", "give LPS millimetres");
    const double length = std::hypot(g.axis[0], g.axis[1], g.axis[2]);
    if (!(std::abs(length - 1) < 1e-3))
      wrong("its axis is not of length 1", "the axis points from the tip to the handle");
    if (g.tool >= tools)
      wrong("there is no tool " + std::to_string(g.tool), "osteo.tools names them all, by their numbers");
  }
}

class Stepped {
 public:
  Stepped(const py::object& from, bool spring, std::size_t hands, const std::string& contact,
          const py::object& settings, const py::object& procedure, const std::string& out, const std::string& resume,
          double rate_hz, bool surface, int threads)
      : hands_(hands), rate_hz_(rate_hz) {
    if (hands < 1 || hands > kMaxHands)
      refuse("hands must be 1 to " + std::to_string(kMaxHands) + ", not " + std::to_string(hands));
    if (!(rate_hz >= 100 && rate_hz <= 5000)) refuse("rate_hz must be 100 to 5000 Hz");
    context_.threads = threads;
    context_.on_log([this](LogLevel level, std::string_view text) {
      if (level != LogLevel::warning) return;
      const std::lock_guard lock(warnings_mutex_);
      warnings_.emplace_back(text);
    });
    RehearsalOptions options;
    options.rate_hz = rate_hz;
    options.follow = {.surface = surface};
    HapticSetup& haptics = options.haptics;
    FieldRef{{"contact", ""},
             FieldRef::Choice{reinterpret_cast<int*>(&haptics.params.contact.method), EnumNames<ContactMethod>::values}}
        .from_text(contact, "contact");
    haptics.device = GivenHand::traits_of(spring);
    haptics.more_devices.assign(hands - 1, haptics.device);
    const bool by_name = py::isinstance<py::dict>(settings);
    const std::string file =
        settings.is_none() || by_name ? "" : std::string(py::str(py::module_::import("os").attr("fspath")(settings)));
    const bool of_grid = py::isinstance<SparseGrid>(from);
    const std::string folder = of_grid ? "" : std::string(py::str(py::module_::import("os").attr("fspath")(from)));
    if (of_grid && (!out.empty() || !resume.empty()))
      refuse("a grid by itself is no case: its session could not be replayed",
             "make a case with 'osteo prepare', or leave out= and resume= out");
    const std::string operation =
        procedure.is_none() ? "" : std::string(py::str(py::module_::import("os").attr("fspath")(procedure)));
    if (of_grid && !operation.empty())
      refuse("a grid by itself has no structures that a procedure could open", "give a case, or leave procedure= out");
    const auto change = [&] {
      if (!by_name) return;
      auto fields = fields_of<HapticsParams>(haptics.params);
      for (const auto& [key, value] : settings.cast<py::dict>()) {
        const std::string name = py::str(key);
        const FieldRef* const f = find_field(fields, name);
        if (f == nullptr)
          refuse("there is no setting '" + name + "'", "'osteo rehearse CASE --show-settings' lists them");
        set_value(*f, value);
      }
    };
    if (of_grid) {
      const SparseGrid grid = from.cast<SparseGrid>();
      if (grid.background != 0) refuse("bone is a grid whose background is 0, not " + std::to_string(grid.background));
      if (!file.empty()) load_haptic_settings(file, haptics);
      change();
      haptics.hardness = false;
      const py::gil_scoped_release free;
      start(World(to_bricks(grid)), spring, options);
      return;
    }
    std::optional<Case> the_case;
    {
      const py::gil_scoped_release free;
      the_case = load_case(folder);
      apply_haptic_settings(the_case->folder, file, haptics);
    }
    change();
    const py::gil_scoped_release free;
    if (!operation.empty()) haptics.opened = load_procedure(operation).opened();
    options.anatomy = anatomy_of(*the_case, haptics, context_);
    anatomy_ = options.anatomy;
    World world = resume.empty() ? world_of(*the_case, options.anatomy)
                                 : world_at_end(open_session_folder(resume, the_case->folder), *the_case,
                                                options.anatomy, context_);
    if (std::filesystem::exists(the_case->folder / "tissue.vtu") ||
        std::filesystem::exists(the_case->folder / "tissue"))
      context_.warn("the case's soft tissue is left out: only 'osteo rehearse' moves it");
    if (!out.empty()) {
      session_ = create_session_folder(out, the_case->folder, resume);
      options.session_file = session_->stream();
    }
    start(std::move(world), spring, options);
  }

  py::array run(const py::array& goals, const py::object& actions) {
    const std::unique_lock alone = sole();
    require_open();
    const py::dtype type = goal_dtype();
    if (!goals.dtype().equal(type) || !(goals.flags() & py::array::c_style) || goals.ndim() != (hands_ == 1 ? 1 : 2) ||
        (hands_ > 1 && static_cast<std::size_t>(goals.shape(1)) != hands_))
      refuse("goals must be a C-contiguous array of osteo.goal_dtype, " +
                 (hands_ == 1 ? std::string("one for each tick") : "(ticks, " + std::to_string(hands_) + ")"),
             "osteo.goals() makes one");
    const auto n = static_cast<std::size_t>(goals.shape(0));
    const auto* const first = static_cast<const HandGoal*>(goals.data());
    require_goals(first, n, hands_);
    const std::vector<SceneAction> timed = actions_from(actions, n);
    std::vector<TickRecord> ticks(n * hands_);
    bool interrupted = false;
    {
      const py::gil_scoped_release free;
      for (std::size_t h = 0; h < hands_; ++h) devices_[h]->follow(first + h, hands_);
      std::size_t next = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t begin = next;
        while (next < timed.size() && timed[next].tick == done_) ++next;
        rehearsal_->step_elsewhere({timed.data() + begin, next - begin});
        ++done_;
        if (reader_->ticks.pop({ticks.data() + i * hands_, hands_}) != hands_)
          throw Error(ExitCode::resources,
                      "tick " + std::to_string(done_.load() - 1) + " changed more voxels than are kept",
                      "use larger voxels");
        while (reader_->changes.pop(scratch_) > 0) {
        }
        SceneAction reported;
        while (reader_->actions.pop({&reported, 1}) > 0) {
        }
        if (i % 256 == 255) {
          const py::gil_scoped_acquire gil;
          if ((interrupted = PyErr_CheckSignals() != 0)) break;
        }
      }
      // What they pointed to is the caller's.
      rehearsal_->catch_up();
    }
    if (interrupted) throw py::error_already_set();
    if (const auto failure = rehearsal_->recording().failure) throw Error(*failure);
    for (std::string r = rehearsal_->take_refusal(); !r.empty(); r = rehearsal_->take_refusal()) context_.warn(r);
    auto owner = std::make_shared<const std::vector<TickRecord>>(std::move(ticks));
    const TickRecord* const data = owner->data();
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(n)};
    if (hands_ > 1) shape.push_back(static_cast<py::ssize_t>(hands_));
    return view_as(tick_dtype(), std::move(owner), data, std::move(shape));
  }

  SparseGrid bone(std::size_t body) {
    const std::unique_lock alone = sole();
    const py::gil_scoped_release free;
    SparseGrid grid;
    rehearsal_->look([&](const World& w, SceneReaders&) {
      if (body >= w.bodies().size())
        refuse("there is no piece " + std::to_string(body) + " among " + std::to_string(w.bodies().size()));
      grid = to_sparse(w.bodies()[body].body->bone, "density");
    });
    return grid;
  }

  std::shared_ptr<TriMesh> surface() {
    const std::unique_lock alone = sole();
    const py::gil_scoped_release free;
    auto mesh = std::make_shared<TriMesh>();
    rehearsal_->look([&](const World& w, SceneReaders&) { *mesh = surface_of(w, context_); });
    return mesh;
  }

  void note(const std::string& kind, const std::string& json) {
    const std::unique_lock alone = sole();
    require_open();
    rehearsal_->note(kind, json);
  }

  py::dict close() {
    const std::unique_lock alone = sole();
    {
      const py::gil_scoped_release free;
      if (!summary_) {
        closed_ = true;
        rehearsal_->end_elsewhere({});
        summary_ = rehearsal_->stop();
        for (const std::string& w : summary_->warnings) context_.warn(w);
        const auto used = rehearsal_->latest().device.tool;
        if (session_) write_summary(*session_, *summary_, rate_hz_, instrument_of(used).name, anatomy_);
      }
    }
    const RehearsalSummary& s = *summary_;
    py::list notes;
    for (const ActionNote& a : s.notes)
      notes.append(py::dict(py::arg("tick") = a.tick, py::arg("action") = std::string(name_of(a.kind)),
                            py::arg("done") = a.done, py::arg("why") = a.why, py::arg("times") = a.times));
    return py::dict(py::arg("ticks") = s.ticks, py::arg("removed_mm3") = s.removed_mm3,
                    py::arg("sawn_mm3") = s.sawn_mm3, py::arg("crumbs_mm3") = s.crumbs_mm3,
                    py::arg("bone_hash") = s.bone_hash, py::arg("surface_hash") = s.surface_hash,
                    py::arg("actions") = notes, py::arg("ticks_not_recorded") = s.ticks_not_recorded,
                    py::arg("unusable_poses") = s.unusable_poses);
  }

  [[nodiscard]] std::vector<std::string> take_warnings() {
    const std::lock_guard lock(warnings_mutex_);
    return std::exchange(warnings_, {});
  }
  [[nodiscard]] double removed_mm3() const { return rehearsal_->removed_mm3(); }
  [[nodiscard]] std::uint64_t ticks() const { return done_; }
  [[nodiscard]] std::size_t hands() const { return hands_; }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] std::string folder() const { return session_ ? session_->folder.string() : std::string(); }

 private:
  void start(World world, bool spring, const RehearsalOptions& options) {
    std::vector<std::unique_ptr<Device>> devices;
    for (std::size_t h = 0; h < hands_; ++h) {
      auto hand = std::make_unique<GivenHand>(spring);
      devices_.push_back(hand.get());
      devices.push_back(std::move(hand));
    }
    rehearsal_ = std::make_unique<Rehearsal>(std::move(world), std::move(devices), options, context_);
    reader_ = &rehearsal_->stream().add_reader(64, std::size_t{1} << 20);
    scratch_.resize(4096);
  }

  // The servo has one caller at a time; a script's other threads are told, not made to wait for seconds.
  std::unique_lock<std::mutex> sole() {
    std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock()) refuse("another thread is at work on this rehearsal", "one thread at a time");
    return lock;
  }
  void require_open() const {
    if (closed_) refuse("the rehearsal is closed", "make another, with resume= of its session to go on");
  }

  std::vector<SceneAction> actions_from(const py::object& given, std::size_t n) const {
    if (given.is_none()) return {};
    const py::array array = given.cast<py::array>();
    if (!array.dtype().equal(action_dtype()) || array.ndim() != 1 || !(array.flags() & py::array::c_style))
      refuse("actions must be a C-contiguous array of osteo.action_dtype with one axis",
             "those of osteo.load_script() are");
    const auto* const first = static_cast<const SceneAction*>(array.data());
    std::vector<SceneAction> all(first, first + array.shape(0));
    std::uint64_t before = done_;
    for (std::size_t i = 0; i < all.size(); ++i) {
      SceneAction& a = all[i];
      const std::string which = "action " + std::to_string(i);
      a.unused = 0;
      const ActionRow* const row = find_row(a.kind);
      if (row == nullptr || row->by_servo)
        refuse(which + " is of kind " + std::to_string(a.kind) + ", which cannot be asked for",
               "see docs/reference/actions.md");
      if (a.tick < before || a.tick >= done_ + n)
        refuse(which + " is at tick " + std::to_string(a.tick) + ", not among ticks " + std::to_string(done_.load()) +
                   " to " + std::to_string(done_ + n) + " of this call, or before the one before it",
               "ticks count from the beginning of the rehearsal, and rise");
      if (!std::all_of(a.values.begin(), a.values.end(), [](double v) { return std::isfinite(v); }))
        refuse(which + " has a value that is not finite");
      before = a.tick;
    }
    return all;
  }

  Context context_;
  std::mutex warnings_mutex_, mutex_;
  std::vector<std::string> warnings_;
  std::size_t hands_;
  double rate_hz_;
  std::atomic<std::uint64_t> done_{0};  // who runs writes it, others may ask
  bool closed_ = false;
  Anatomy anatomy_;
  std::optional<SessionFolder> session_;
  std::optional<RehearsalSummary> summary_;
  std::vector<VoxelChange> scratch_;
  std::vector<GivenHand*> devices_;  // the rehearsal's
  StreamReader* reader_ = nullptr;   // of its stream
  std::unique_ptr<Rehearsal> rehearsal_;
};

// Goals of each tick of a script, and its actions.
py::tuple script(const std::string& path, double rate_hz) {
  if (!(rate_hz >= 100 && rate_hz <= 5000)) refuse("rate_hz must be 100 to 5000 Hz");
  const Script s = load_script(path);
  const auto devices = devices_of(s, rate_hz);
  std::size_t n = 0;
  while (std::any_of(devices.begin(), devices.end(), [&](const auto& d) { return d->active(n); })) ++n;
  const std::size_t hands = devices.size();
  std::vector<HandGoal> goals(n * hands);
  for (std::size_t h = 0; h < hands; ++h) {
    const Strokes& strokes = h == 0 ? s : s.more_hands[h - 1];
    std::size_t leg = 0;
    for (std::size_t i = 0; i < n; ++i) goals[i * hands + h] = goal_at(strokes, static_cast<double>(i) / rate_hz, leg);
  }
  auto owner = std::make_shared<const std::vector<HandGoal>>(std::move(goals));
  const HandGoal* const data = owner->data();
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(n)};
  if (hands > 1) shape.push_back(static_cast<py::ssize_t>(hands));
  return py::make_tuple(view_as(goal_dtype(), std::move(owner), data, std::move(shape)),
                        records(action_dtype(), actions_of(s, rate_hz)));
}

}  // namespace

void add_rehearsal(py::module_& m) {
  py::class_<Stepped>(m, "Stepped")
      .def(py::init<const py::object&, bool, std::size_t, const std::string&, const py::object&, const py::object&,
                    const std::string&, const std::string&, double, bool, int>())
      .def("run", &Stepped::run)
      .def("bone", &Stepped::bone)
      .def("surface", &Stepped::surface)
      .def("note", &Stepped::note)
      .def("close", &Stepped::close)
      .def("take_warnings", &Stepped::take_warnings)
      .def_property_readonly("removed_mm3", &Stepped::removed_mm3)
      .def_property_readonly("ticks", &Stepped::ticks)
      .def_property_readonly("hands", &Stepped::hands)
      .def_property_readonly("rate_hz", &Stepped::rate_hz)
      .def_property_readonly("folder", &Stepped::folder);
  m.def("goal_dtype", &goal_dtype);
  m.def("script", &script);
  m.def("tools", [] {
    std::vector<std::string> names;
    for (const Instrument& i : instrument_library()) names.push_back(i.name);
    return names;
  });
}

}  // namespace osteo::python
