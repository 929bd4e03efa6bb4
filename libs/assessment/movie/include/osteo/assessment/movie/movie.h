// A session as a movie.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/assessment/movie/movie_options.h"
#include "osteo/core/base/context.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/operation.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline assessment {

/// What a movie has to know of a session before its first frame.
struct SessionSurvey {
  double rate_hz = 1000;
  std::uint64_t end_tick = 0;  ///< behind the last one known
  std::vector<bool>
      idle;  ///< by tenths of a second: no pedal down, nothing done, neither hand nor camera moved (2 mm/s)
  std::vector<std::pair<std::uint64_t, ScopeView>> views;  ///< of "camera" notes, each from its tick on
  std::size_t unreadable_views = 0;
  bool dust = false;                                ///< some of it has any
  std::optional<std::pair<Vec3, Vec3>> drilled_mm;  ///< box of the burrs' places while they removed bone
  Vec3 handle;  ///< unit, from there to the hand, on the average; zero where nothing was drilled
  [[nodiscard]] double seconds() const { return static_cast<double>(end_tick) / rate_hz; }
};
/// One pass through the file.
[[nodiscard]] SessionSurvey survey_of(const SessionReader& session);

/// Which moments of a session a movie shows.
struct MovieTimes {
  std::vector<std::uint64_t> ticks;    ///< of each frame: all before it has happened
  double shown_s = 0, left_out_s = 0;  ///< of the session
};
/// round(shown * fps / speed) frames, at least one; each shows the end of its share, so that the last one shows the
/// end. `to_s` below 0: to the session's end. With `skip_idle` what is idle for more than kIdleS is left out but for
/// kRestS at either end. Error(usage) for a range that holds nothing of the session, or more than kMaxFrames.
[[nodiscard]] MovieTimes movie_times(const SessionSurvey& survey, double from_s, double to_s, double speed, int fps,
                                     bool skip_idle);
inline constexpr double kIdleS = 2, kRestS = 0.4;
inline constexpr std::uint64_t kMaxFrames = 10'000'000;

struct MovieFacts {
  std::uint64_t frames = 0;
  double seconds = 0;                  ///< it plays
  double shown_s = 0, left_out_s = 0;  ///< of the session
  MovieCamera camera = MovieCamera::surgeon;
  std::string encoder;
  bool repeated = false;           ///< the session was run again, tick by tick; else told in tenths of a second
  std::vector<std::string> words;  ///< what is otherwise than asked, or than it was, each a sentence
};

/// Draws and writes it; `path` as MovieFile takes it, written over. The session is run again where it can be (replay),
/// so that bone and dust are those of each frame's tick; where it cannot (a gap, another version, other structures), as
/// report_recorded() tells it, which `words` says. `begin`: the scene it began with. Progress says how long it will
/// take. Errors: as MovieFile, movie_times, replay; Error(failed) when there is no OpenGL.
MovieFacts make_movie(const SessionReader& session, const World& begin, const Anatomy& anatomy,
                      const MovieOptions& options, const std::filesystem::path& path, const Context& context = {});

}  // namespace osteo::inline assessment
