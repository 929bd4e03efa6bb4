// osteo movie: a session as a movie, for its surgeon or, blinded, for raters. Only where OSTEO_MOVIE is on.
#ifdef OSTEO_WITH_MOVIE
#include "osteo/assessment/movie/movie.h"

#include <cmath>
#include <cstdio>
#include <ostream>
#include <random>

#include "commands/movie.h"
#include "osteo/assessment/movie/movie_file.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

cli::CommandInfo MovieCommand::info() {
  return {"movie",
          "a session as a movie that browsers play",
          "As the window drew it: bone, tools, dust, critical structures, from where the surgeon looked or from one "
          "place. .mp4 (H.264) or "
          ".webm "
          "(VP9), no sound. With --blind for raters: nothing is written into the picture or the file that says who, "
          "when, which case or how "
          "good, and where the output is a folder the file gets a random name. What the picture itself shows stays. Of "
          "a damaged session what "
          "is there is shown, and the exit code is 4.",
          {{"session", "a session folder"}, {"output", "file that ends in .mp4 or .webm; with --blind also a folder"}},
          "osteo movie SESSION out.mp4 --speed 4 --skip-idle"};
}

namespace {

void parse_size(const std::string& text, int& width, int& height) {
  int used = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%n", &width, &height, &used) != 2 ||
      static_cast<std::size_t>(used) != text.size())
    throw Error(ExitCode::usage, "--size: '" + text + "' is no size", "write it as 1280x720");
}

// Reported by nothing but chance, so that it does not follow from the session.
std::string random_code() {
  static constexpr char kLetters[] = "abcdefghjkmnpqrstuvwxyz23456789";
  std::random_device chance;
  std::uniform_int_distribution<std::size_t> pick(0, sizeof kLetters - 2);
  std::string code;
  for (int n = 0; n < 8; ++n) code += kLetters[pick(chance)];
  return code;
}

std::string seconds(double s) {
  return format_number(std::round(s * 10) / 10) + " s";
}

}  // namespace

int MovieCommand::run(const Params& p, cli::Invocation& io) {
  MovieOptions o;
  parse_size(p.size, o.width, o.height);
  o.camera = p.camera;
  o.fps = p.fps;
  o.speed = p.speed;
  o.from_s = p.from_s;
  o.to_s = p.to_s;
  o.skip_idle = p.skip_idle;
  o.overlay = !p.no_overlay && !p.blind;
  o.deep = p.deep;
  fs::path out = io.arguments[1];
  std::string code;
  if (p.blind && fs::is_directory(out)) {
    do {
      code = random_code();
    } while (fs::exists(out / (code + ".mp4")));
    out /= code + ".mp4";
  }
  if (out.extension() != ".mp4" && out.extension() != ".webm")
    throw Error(
        ExitCode::usage, "'" + io.arguments[1] + "' is no movie that can be written",
        p.blind ? "name a file .mp4 or .webm, or a folder that is there" : "name the output NAME.mp4 or NAME.webm");
  if (output_exists(out) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + out.string() + "' exists already", "--force replaces it");
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const Case the_case = load_case(folder.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  HapticSetup setup = session.header().haptics;
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  const World begin = world_at_begin(folder, the_case, anatomy, io.context);
  MovieFacts facts;
  write_atomically(
      out, [&](const fs::path& temporary) { facts = make_movie(session, begin, anatomy, o, temporary, io.context); });
  io.end_progress();
  if (p.blind && code.empty())
    facts.words.emplace_back("the file's name is yours: see that it does not tell who or how good");
  if (io.common.json) {
    Json j{{"frames", facts.frames},
           {"seconds", facts.seconds},
           {"shown_s", facts.shown_s},
           {"left_out_s", facts.left_out_s},
           {"camera", EnumNames<MovieCamera>::values[static_cast<std::size_t>(facts.camera)]},
           {"encoder", facts.encoder},
           {"repeated", facts.repeated},
           {"words", facts.words}};
    if (!code.empty()) j["code"] = code;
    io.out << j.dump(2) << '\n';
  }
  for (const std::string& line : losses(session.outline())) io.err << "session: " << line << '\n';
  for (const std::string& word : facts.words) io.err << "movie: " << word << '\n';
  if (!io.common.quiet) {
    io.err << out.string() << ": " << facts.frames << " frames, " << seconds(facts.seconds) << " for "
           << seconds(facts.shown_s) << " of the session";
    if (o.skip_idle) io.err << ", " << seconds(facts.left_out_s) << " idle left out";
    io.err << ", by " << facts.encoder << '\n';
  }
  return session.outline().damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
#endif
