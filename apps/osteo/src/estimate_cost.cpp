// osteo estimate-cost: what a rehearsal will build, and what each part costs.
#include <cmath>
#include <ostream>

#include "commands/estimate_cost.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/session/recording/haptic_settings.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/live_components.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo {

cli::CommandInfo EstimateCostCommand::info() {
  return {"estimate-cost",
          "what a rehearsal of a case will build, and what each part costs",
          "Memory and time to make of every part that the case and the settings list, and the time of a tick while "
          "drilling. What is not "
          "listed is not "
          "built and costs nothing.",
          {{"case", "a folder made by prepare"}},
          "osteo estimate-cost CASE"};
}

namespace {

// Of real time: below it forces lag by a tenth and more behind a hand at 40 mm/s (docs/validation/tissue.md).
constexpr double kSluggish = 0.05;

std::string percent(double share) {
  return format_number(std::round(100 * share)) + " %";
}
double rounded(double value, double steps_per_unit) {
  return std::round(value * steps_per_unit) / steps_per_unit;
}

// Builds the parts of a scene one after the other, and notes what each costs.
class SceneCosts {
 public:
  SceneCosts(const Case& the_case, const EstimateCostCommand::Params& params, const Context& context)
      : case_(the_case), params_(params), context_(context) {
    j_["parts"] = Json::list();
  }

  void build() {
    build_bone();
    setup_.device = SpringHand::traits();
    setup_.params.contact.method = params_.contact;
    apply_haptic_settings(case_.folder, params_.settings, setup_);
    build_anatomy();
    build_what_follows();
    build_tissue();
    build_renderer();
    find_burrs_too_small();
    drill();
    j_["threads"] = {"servo (real time)", "recorder", "follower (surface, fragments)", "window"};
    j_["memory_mb"] = rounded(megabytes_, 10);
  }

  [[nodiscard]] const Json& json() const { return j_; }

  void print(std::ostream& out) const {
    for (const Part& part : parts_) {
      char line[160];
      std::snprintf(line, sizeof line, "%-50s %8.2f MB  made in %5.2f s  %s\n", part.name.c_str(), part.memory_mb,
                    part.made_in_s, part.thread.c_str());
      out << line;
    }
    for (const std::string& line : tissue_lines_) out << line << '\n';
    out << "together " << format_number(rounded(megabytes_, 10)) << " MB; a tick while drilling takes "
        << format_number(ticks_.quantile_us(0.5)) << " us, p99 " << format_number(ticks_.quantile_us(0.99))
        << " us, p99.9 " << format_number(ticks_.quantile_us(0.999)) << " us\n"
        << reported_hardness(anatomy_) << '\n'
        << "threads: servo (real time), recorder, follower (surface, fragments), window\n";
  }

 private:
  struct Part {
    std::string name, thread;
    double memory_mb = 0, made_in_s = 0;
  };

  // `make` returns bytes.
  void timed(const std::string& name, const std::string& thread, const auto& make) {
    const std::int64_t begin = monotonic_ns();
    const std::size_t bytes = make();
    add_part(name, thread, bytes, static_cast<double>(monotonic_ns() - begin) / 1e9);
  }
  void add_part(const std::string& name, const std::string& thread, std::size_t bytes, double made_in_s) {
    parts_.push_back({name, thread, rounded(static_cast<double>(bytes) / 1e6, 100), rounded(made_in_s, 100)});
    const Part& p = parts_.back();
    megabytes_ += p.memory_mb;
    j_["parts"].push_back(
        {{"part", p.name}, {"memory_mb", p.memory_mb}, {"made_in_s", p.made_in_s}, {"kept_up_to_date_by", p.thread}});
  }
  // Of all bodies together: a case with a finer region has two.
  [[nodiscard]] std::size_t over_bodies(const auto& bytes) const {
    std::size_t sum = 0;
    for (const PlacedBody& b : world_->bodies()) sum += bytes(b.body->bone);
    return sum;
  }

  void build_bone() {
    timed(case_.files.contains("region") ? "bone, with its finer region" : "bone", "servo", [&] {
      world_ = world_of(case_, {});
      return over_bodies([](const BrickGrid& b) { return b.memory_bytes(); });
    });
  }

  void build_anatomy() {
    timed("hardness and critical structures", "nobody: they do not change", [&] {
      anatomy_ = anatomy_of(case_, setup_, context_);
      return (anatomy_.hardness ? anatomy_.hardness->memory_bytes() : 0) +
             (anatomy_.structures ? anatomy_.structures->memory_bytes() : 0);
    });
    j_["hardness"] = Json::parse(hardness_json(anatomy_)).value();
  }

  // What is kept true to the bone while it is drilled.
  void build_what_follows() {
    if (setup_.params.effects.fail_safe)
      timed("distance map", "servo",
            [&] { return over_bodies([](const BrickGrid& b) { return DepthMap(b).memory_bytes(); }); });
    timed("surface", "follower", [&] {
      return over_bodies([&](const BrickGrid& bone) {
        const LiveSurface surface(bone, context_);
        std::size_t bytes = 0;
        for (std::uint32_t b = 0; b < bone.brick_count(); ++b)
          bytes += sizeof(SurfacePatch) + surface.patch(b).memory_bytes();
        return bytes;
      });
    });
    timed("fragments (window, or --fragments)", "follower",
          [&] { return over_bodies([](const BrickGrid& b) { return LiveComponents(b).memory_bytes(); }); });
    if (params_.dust) {
      timed("bone dust (a copy of the bone; more where it lies)", "follower",
            [&] { return over_bodies([](const BrickGrid& b) { return BrickGrid(b).memory_bytes(); }); });
    }
    if (params_.heat) {
      timed("heat (a copy of the bone; more where it is warm)", "follower",
            [&] { return over_bodies([](const BrickGrid& b) { return BrickGrid(b).memory_bytes(); }); });
    }
  }

  // Each body by itself, and what is left to it while all of them move.
  void build_tissue() {
    std::shared_ptr<SoftTissue> soft;
    const std::int64_t made_from = monotonic_ns();
    soft = soft_tissue_of(case_.folder);
    if (!soft) return;
    const double made_in_s = static_cast<double>(monotonic_ns() - made_from) / 1e9 / static_cast<double>(soft->size());
    soft->meet(&*world_);
    constexpr int kUpdates = 20;
    const auto update_ms = [](const auto& update) {
      const std::int64_t from = monotonic_ns();
      for (int n = 0; n < kUpdates; ++n) update();
      return static_cast<double>(monotonic_ns() - from) / 1e6 / kUpdates;
    };
    const auto at_rest = [&](std::size_t n) {
      return SoftTool{soft->body(n).points_mm().front(), {0, 0, 1}, 0, false};
    };
    Json bodies = Json::list();
    std::vector<double> alone(soft->size());
    for (std::size_t n = 0; n < soft->size(); ++n) {
      SoftBody& body = soft->body(n);
      add_part("soft tissue '" + soft->name(n) + "'", "follower, while it moves", body.memory_bytes(), made_in_s);
      const SoftTool tool = at_rest(n);
      const double ms = update_ms([&] { static_cast<void>(body.update({&tool, 1})); });
      alone[n] = body.slow_motion();
      bodies.push_back({{"name", soft->name(n)}, {"update_ms", ms}, {"of_real_time", alone[n]}});
      if (alone[n] < kSluggish)
        context_.warn("soft tissue '" + soft->name(n) + "' runs at " + percent(alone[n]) +
                      " of real time: it will lag behind a quick hand; larger voxels make it quicker");
    }
    soft->meet(&*world_);  // all of it awake
    const SoftTool tool = at_rest(0);
    const double ms = update_ms([&] { static_cast<void>(soft->update({&tool, 1})); });
    const std::vector<SoftTissue::Facts> facts = soft->facts();
    soft->meet(nullptr);
    double least = 1;
    for (std::size_t n = 0; n < facts.size(); ++n) {
      least = std::min(least, facts[n].of_real_time);
      tissue_lines_.push_back(
          "soft tissue '" + facts[n].name + "': " + percent(alone[n]) + " of real time" +
          (facts.size() > 1 ? ", " + percent(facts[n].of_real_time) + " while all of it moves" : std::string()));
    }
    j_["soft_tissue"] = {
        {"update_ms", ms}, {"updates_per_s", SoftBody::kUpdatesPerS}, {"of_real_time", least}, {"bodies", bodies}};
    if (ms > 1000 / SoftBody::kUpdatesPerS)
      context_.warn("an update of soft tissue takes " + format_number(rounded(ms, 10)) + " ms of the " +
                    format_number(1000 / SoftBody::kUpdatesPerS) + " it has");
  }

  void build_renderer() {
    const std::string_view method =
        EnumNames<ContactMethod>::values[static_cast<std::size_t>(setup_.params.contact.method)];
    timed("haptic renderer: " + std::string(method), "servo", [&] {
      renderer_ = std::make_unique<HapticRenderer>(setup_, anatomy_, 1e-3);
      touched_ = HapticScene::of(*world_, renderer_->setup());
      renderer_->show(&touched_);
      std::size_t bytes = touched_.changes.size() * sizeof(VoxelChange);
      for (const HapticScene::Item& i : touched_.items) bytes += i.bone->grains().memory_bytes();
      return bytes;
    });
  }

  // Those of the library that these voxels do not bear, and what is to be said of them.
  void find_burrs_too_small() {
    const double voxel_mm = world_->finest_voxel_mm();
    Json small = Json::list();
    for (const Burr& burr : burr_library()) {
      if (!too_small_for_voxels(burr, voxel_mm).empty()) small.push_back(burr.name());
    }
    if (small.empty()) return;
    j_["burrs_too_small"] = small;
    const double least_mm = 2 * kMinRadiusVoxels * voxel_mm;
    context_.warn(
        "balls and cylinders of less than " + format_number(std::ceil(least_mm * 10 - 1e-6) / 10) +
        " mm, tapers of less than " + format_number(std::ceil(2 * least_mm * 10 - 1e-6) / 10) +
        " mm, are small for voxels of " + format_number(rounded(voxel_mm, 1000)) +
        " mm: force and its direction are coarse; prepare with a smaller --spacing-mm, or a finer region of interest");
  }

  // A few seconds of drilling, without a clock.
  void drill() {
    ScriptedDevice device(make_default_script(*world_, true, burr_index(BurrKind::cutting, 4), 5), 1000);
    Vec3 force{};
    for (std::uint64_t t = 0; device.active(t); ++t) {
      const DeviceSample sample = device.read(t, 1e-3, force);
      const std::int64_t begin = monotonic_ns();
      const auto [record, changes] = renderer_->step(sample);
      ticks_.add(monotonic_ns() - begin);
      force = from_floats(record.force_n);
    }
    j_["tick_us"] = {{"p50_us", ticks_.quantile_us(0.5)},
                     {"p99_us", ticks_.quantile_us(0.99)},
                     {"p99_9_us", ticks_.quantile_us(0.999)}};
  }

  const Case& case_;
  const EstimateCostCommand::Params& params_;
  const Context& context_;
  Json j_;
  std::vector<Part> parts_;
  std::vector<std::string> tissue_lines_;
  double megabytes_ = 0;
  std::optional<World> world_;
  HapticSetup setup_;
  Anatomy anatomy_;
  std::unique_ptr<HapticRenderer> renderer_;
  HapticScene touched_;
  Histogram ticks_;
};

}  // namespace

int EstimateCostCommand::run(const Params& p, cli::Invocation& io) {
  const Case the_case = load_case(io.arguments[0]);
  SceneCosts costs(the_case, p, io.context);
  costs.build();
  io.end_progress();
  if (io.common.json) {
    io.out << costs.json().dump(2) << '\n';
  } else {
    costs.print(io.out);
  }
  return 0;
}

}  // namespace osteo
