#include "osteo/session/scene/soft_tissue.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/tet_io.h"

namespace osteo::inline session {
namespace {

constexpr std::string_view kPlain = "tissue";  // the body whose files lie in the case's own folder

// Of a body in a folder: null where no file of it is there.
std::unique_ptr<SoftBody> body_in(const fs::path& folder, const std::string& name, bool listed) {
  const fs::path mesh = folder / "tissue.vtu", problem = folder / "tissue.json",
                 constants = folder / "tissue-constants.json", skin = folder / "tissue.ply";
  const std::array files{mesh, problem, constants, skin};
  const auto there = std::find_if(files.begin(), files.end(), [](const fs::path& f) { return output_exists(f); });
  if (there == files.end() && !listed) return nullptr;
  for (const fs::path& needed : {mesh, problem}) {
    if (output_exists(needed)) continue;
    throw Error(ExitCode::no_input,
                "the case lists its soft tissue '" + name + "' by halves: '" + needed.string() + "' is missing" +
                    (there != files.end() ? ", '" + there->filename().string() + "' is there" : ""),
                "'osteo tetrahedralize --method grid' makes tissue.vtu, docs/validation/tissue.md describes tissue.json; or "
                "remove what is there");
  }
  try {
    const Surface finer = output_exists(skin) ? load_surface(skin) : nullptr;
    return std::make_unique<SoftBody>(*load_tets(mesh), read_text(problem),
                                      output_exists(constants) ? std::optional(read_text(constants)) : std::nullopt,
                                      finer.get());
  } catch (const Error& e) {
    throw Error(e.code(), "soft tissue '" + name + "': " + e.what(), e.advice());
  }
}

}  // namespace

void SoftTissue::add(const std::string& name, std::unique_ptr<SoftBody> body) {
  // It is told in lines and drawn on the screen.
  const bool odd =
      name.empty() || std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (odd) throw Error(ExitCode::usage, "a body of soft tissue needs a name of one line", "rename its folder");
  for (const Facts& f : facts_) {
    if (f.name == name)
      throw Error(ExitCode::usage, "there are two bodies of soft tissue named '" + name + "'", "rename one's folder");
  }
  bodies_.push_back(std::move(body));
  facts_.push_back({name});
  keep_facts();
}

void SoftTissue::meet(const World* world) {
  for (const auto& b : bodies_) b->meet(world);
}

std::vector<SceneAction> SoftTissue::update(std::span<const SoftTool> tools) {
  // Who needs least comes first, so that what it leaves is there for the others.
  std::vector<std::size_t> awake(bodies_.size());
  std::iota(awake.begin(), awake.end(), std::size_t{0});
  std::erase_if(awake, [&](std::size_t b) { return bodies_[b]->sleeps_with(tools); });
  std::stable_sort(awake.begin(), awake.end(),
                   [&](std::size_t a, std::size_t b) { return bodies_[a]->work() < bodies_[b]->work(); });
  std::vector<std::vector<SoftPush>> pushes(bodies_.size(), std::vector<SoftPush>(tools.size()));
  double left = SoftBody::kMaxWork;
  for (std::size_t n = 0; n < awake.size(); ++n) {
    const double share = left / static_cast<double>(awake.size() - n);
    pushes[awake[n]] = bodies_[awake[n]]->update(tools, share);
    left -= std::min(bodies_[awake[n]]->work(), share);
  }
  keep_facts();
  std::vector<SceneAction> planes;
  for (std::size_t hand = 0; hand < tools.size() && hand < pushed_.size(); ++hand) {
    Vec3 force{};
    for (const auto& of_body : pushes) force += of_body[hand].force_n;
    const double size = length(force);
    if (!(size > 0) && !pushed_[hand]) continue;
    pushed_[hand] = size > 0;
    SceneAction plane = SceneAction::soft_push(tools[hand].at_mm, {}, 0, 0);
    if (size > 0) {
      // Each body's plane rises along its own direction: of that, what lies along the sum's.
      const Vec3 along = force / size;
      double stiffness = 0;
      for (const auto& of_body : pushes) {
        const SoftPush& p = of_body[hand];
        if (!(p.stiffness_n_per_mm > 0)) continue;
        const Vec3 own = p.force_n / length(p.force_n);
        const double share = own == along ? 1 : dot(own, along);
        stiffness += p.stiffness_n_per_mm * share * share;
      }
      plane = SceneAction::soft_push(tools[hand].at_mm, along, size, stiffness);
    }
    plane.hand = static_cast<std::uint32_t>(hand);
    planes.push_back(plane);
  }
  return planes;
}

double SoftTissue::cut_off_mm3() const {
  double sum = 0;
  for (const auto& b : bodies_) sum += b->cut_off_mm3();
  return sum;
}
std::size_t SoftTissue::memory_bytes() const {
  std::size_t sum = 0;
  for (const auto& b : bodies_) sum += b->memory_bytes();
  return sum;
}

void SoftTissue::keep_facts() {
  const std::lock_guard lock(mutex_);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    facts_[b].cut_off_mm3 = bodies_[b]->cut_off_mm3();
    facts_[b].of_real_time = bodies_[b]->slow_motion();
    facts_[b].asleep = bodies_[b]->asleep();
  }
}
std::vector<SoftTissue::Facts> SoftTissue::facts() const {
  const std::lock_guard lock(mutex_);
  return facts_;
}

void SoftTissue::resync(const World&) {
  for (const auto& b : bodies_) b->wake();
}
void SoftTissue::scene_changed(const World&, const World::Effect&) {
  for (const auto& b : bodies_) b->wake();
}
void SoftTissue::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  if (changes.empty()) return;
  for (const auto& b : bodies_) {
    if (b->asleep()) b->wake_near(from_floats(record.device.position_mm), record.device.tool);
  }
}

std::shared_ptr<SoftTissue> soft_tissue_of(const fs::path& folder) {
  auto tissue = std::make_shared<SoftTissue>();
  const std::string plain(kPlain);
  if (auto body = body_in(folder, plain, false)) tissue->add(plain, std::move(body));
  if (const fs::path more = folder / "tissue"; output_exists(more)) {
    std::set<fs::path> listed;
    try {
      if (!fs::is_directory(more))
        throw Error(ExitCode::usage, "'" + more.string() + "' is no folder of soft tissue", "remove or rename it");
      for (const auto& e : fs::directory_iterator(more)) {
        if (e.path().filename().string().starts_with('.')) continue;  // what file managers leave
        if (!e.is_directory())
          throw Error(ExitCode::usage,
                      "'" + e.path().string() + "' is no folder: in 'tissue' each body of soft tissue has its own",
                      "put it into tissue/NAME/, as tissue.vtu, tissue.json, tissue-constants.json or tissue.ply");
        listed.insert(e.path());
      }
    } catch (const fs::filesystem_error& e) {
      throw error_of(e);
    }
    for (const fs::path& p : listed) tissue->add(p.filename().string(), body_in(p, p.filename().string(), true));
  }
  return tissue->size() > 0 ? tissue : nullptr;
}

}  // namespace osteo::inline session
