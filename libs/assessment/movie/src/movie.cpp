#include "osteo/assessment/movie/movie.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <span>

#include "movie_stage.h"
#include "osteo/assessment/movie/movie_file.h"
#include "osteo/core/base/error.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_scene.h"

namespace osteo::inline assessment {
namespace {

// A movie that ends before its session does needs the rest of it no more.
struct Enough {};

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string clock(double s) {
  const auto tenths = static_cast<long long>(std::floor(s * 10 + 1e-6));
  char text[48];
  std::snprintf(text, sizeof text, "%lld:%02lld.%lld", tenths / 600, tenths / 10 % 60, tenths % 10);
  return text;
}

// All of what was drilled, from where the hand came; nothing drilled: all of the bone from the left.
ScopeView fixed_view(const SessionSurvey& survey, const World& begin) {
  if (survey.drilled_mm) {
    const auto& [lo, hi] = *survey.drilled_mm;
    constexpr double kAroundMm = 12, kMinMm = 20;
    const Vec3 eye = length(survey.handle) > 0 ? survey.handle : Vec3{1, 0, 0};
    // From a little aside, so that the shaft does not hide what its burr does.
    const Vec3 aside = std::abs(eye.z) < 0.8 ? Vec3{0, 0, 1} : Vec3{0, -1, 0};
    return overview((lo + hi) * 0.5, std::max(kMinMm, 0.5 * length(hi - lo) + kAroundMm),
                    normalized(eye + aside * 0.7));
  }
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  for (const PlacedBody& b : begin.bodies()) {
    const Frame& f = b.body->bone.frame();
    for (int c = 0; c < 8; ++c) {
      const Vec3 at = b.world_from_body(
          f.world_from_index({(c & 1) != 0 ? f.dims[0] - 1.0 : 0.0, (c & 2) != 0 ? f.dims[1] - 1.0 : 0.0,
                              (c & 4) != 0 ? f.dims[2] - 1.0 : 0.0}));
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], at[a]);
        hi[a] = std::max(hi[a], at[a]);
      }
    }
  }
  return overview((lo + hi) * 0.5, 0.5 * length(hi - lo), {1, 0, 0});
}

class MovieReader final : public Reader {
 public:
  MovieReader(const SessionSurvey& survey, const MovieTimes& times, const MovieOptions& options, const ScopeView& fixed,
              const StructureMap* structures, std::size_t hands, bool dust, MovieFile& file, const Context& context)
      : survey_(survey),
        times_(times),
        options_(options),
        fixed_(fixed),
        structures_(structures),
        hands_(hands),
        scene_({.dust = dust, .dust_by_action = true}, survey.rate_hz, {}),
        stage_(options.width, options.height, structures, options.deep),
        file_(file),
        context_(context) {}

  void resync(const World& world) override { scene_.resync(world); }
  void action(const SceneAction& action) override {
    if (ended_) return;
    draw_until(action.tick);
    scene_.action(action);
  }
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override {
    draw_until(record.tick);
    scene_.tick(record, changes);
    if (record.tick % 512 == 0) context_.check_cancelled();
    if (record.tick >= first_reported_) hardest_n_ = std::max(hardest_n_, static_cast<double>(record.normal_force_n));
    reported_tick_ = std::max(reported_tick_, record.tick + 1);
  }
  /// The rest of the frames show the scene as it was left.
  void end() { draw_until(~std::uint64_t{0}); }

 private:
  void draw_until(std::uint64_t tick) {
    for (; next_ < times_.ticks.size() && times_.ticks[next_] <= tick; ++next_) draw(times_.ticks[next_]);
    if (next_ < times_.ticks.size()) return;
    ended_ = true;
    if (tick != ~std::uint64_t{0} && times_.ticks.back() < survey_.end_tick) throw Enough();
  }

  [[nodiscard]] const ScopeView& view_at(std::uint64_t tick) const {
    if (options_.camera == MovieCamera::fixed || survey_.views.empty()) return fixed_;
    const auto behind = std::upper_bound(survey_.views.begin(), survey_.views.end(), tick,
                                         [](std::uint64_t t, const auto& v) { return t < v.first; });
    return behind == survey_.views.begin() ? behind->second : (behind - 1)->second;
  }

  void draw(std::uint64_t tick) {
    context_.check_cancelled();
    Picture picture = stage_.draw(scene_, view_at(tick), hands_, survey_.rate_hz);
    if (options_.overlay) write_strip(picture, words_at(tick));
    file_.add(picture);
    hardest_n_ = 0;
    const double done = static_cast<double>(next_ + 1), all = static_cast<double>(times_.ticks.size());
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    context_.progress(done / all, "frame " + std::to_string(next_ + 1) + " of " + std::to_string(times_.ticks.size()) +
                                      ", " + clock(took_s * (all - done) / done) + " left");
  }

  [[nodiscard]] std::vector<std::string> words_at(std::uint64_t tick) const {
    std::vector<std::string> words{clock(static_cast<double>(tick) / survey_.rate_hz)};
    const TickRecord& t = scene_.latest();
    if (static_cast<double>(tick) > static_cast<double>(reported_tick_) + 0.2 * survey_.rate_hz) {
      words.push_back("not recorded");
    } else {
      words.push_back(fixed(hardest_n_, 2) + " N");
    }
    words.push_back(fixed(scene_.removed_mm3(), 1) + " mm3 removed");
    if (structures_ != nullptr && t.structure != 0)
      words.push_back(structures_->name_of(static_cast<std::uint8_t>(t.structure)) + " " +
                      fixed(static_cast<double>(t.clearance_mm), 1) + " mm");
    if (options_.speed != 1) words.push_back("x" + format_number(options_.speed));
    return words;
  }

  const SessionSurvey& survey_;
  const MovieTimes& times_;
  const MovieOptions& options_;
  const ScopeView& fixed_;
  const StructureMap* structures_;
  const std::size_t hands_;
  SessionScene scene_;
  MovieStage stage_;
  MovieFile& file_;
  const Context& context_;
  std::size_t next_ = 0;
  std::uint64_t reported_tick_ = 0;
  // What lies before the movie is stepped through, but the first frame tells of its own time alone.
  const std::uint64_t first_reported_ =
      times_.ticks.size() < 2
          ? times_.ticks.front()
          : times_.ticks.front() - std::min(times_.ticks.front(), times_.ticks[1] - times_.ticks[0]);
  double hardest_n_ = 0;  // since the frame before
  bool ended_ = false;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

// Why the session cannot be run again here; empty: it can.
std::string why_not_repeated(const SessionOutline& outline, const Anatomy& anatomy) {
  if (!outline.not_replayable.empty()) return "this version cannot repeat it (" + outline.not_replayable + ")";
  if (!outline.gaps.empty()) return "something of it is missing";
  if (outline.header.haptics.hardness.value_or(false) != (anatomy.hardness != nullptr))
    return "the case does not tell the hardness it went by";
  if (outline.header.haptics.structures != (anatomy.structures ? anatomy.structures->hash() : ""))
    return "it watched other critical structures than the case has now";
  return {};
}

}  // namespace

MovieFacts make_movie(const SessionReader& session, const World& begin, const Anatomy& anatomy,
                      const MovieOptions& options, const std::filesystem::path& path, const Context& context) {
  const SessionSurvey survey = survey_of(session);
  const MovieTimes times =
      movie_times(survey, options.from_s, options.to_s, options.speed, options.fps, options.skip_idle);
  MovieOptions o = options;
  MovieFacts facts;
  if (survey.unreadable_views > 0)
    facts.words.push_back(std::to_string(survey.unreadable_views) + " camera notes cannot be read: left out");
  if (o.camera == MovieCamera::surgeon && survey.views.empty()) {
    o.camera = MovieCamera::fixed;
    facts.words.emplace_back("the session holds no camera notes: a fixed camera was chosen");
  }
  if (session.outline().bone_known_until() != nullptr)
    facts.words.emplace_back("behind its gap the bone is not known: from there on the movie stands still");
  MovieFile file(path, o.width, o.height, o.fps);
  const ScopeView fixed = fixed_view(survey, begin);
  MovieReader reader(survey, times, o, fixed, anatomy.structures.get(), session.header().haptics.hands(),
                     session.header().dust, file, context);
  const std::string why = why_not_repeated(session.outline(), anatomy);
  try {
    if (why.empty()) {
      Reader* const readers[] = {&reader};
      const ReplayResult r = replay(session, begin.copy(), anatomy, {}, readers);
      if (!r.identical)
        facts.words.push_back("the replay differs from what was recorded (" + r.difference +
                              "): neither may the movie");
    } else {
      report_recorded(session, begin, reader);
      facts.words.push_back(why + ": bone changes in steps of a tenth of a second" +
                            (survey.dust ? ", and dust lies a little elsewhere than it did" : ""));
    }
    reader.end();
  } catch (const Enough&) {  // the part that is shown is over
  }
  file.finish();
  facts.frames = file.frames();
  facts.seconds = static_cast<double>(facts.frames) / o.fps;
  facts.shown_s = times.shown_s;
  facts.left_out_s = times.left_out_s;
  facts.camera = o.camera;
  facts.encoder = file.encoder();
  facts.repeated = why.empty();
  return facts;
}

}  // namespace osteo::inline assessment
