// playback: a recorded hand leads that of who learns.
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ostream>

#include "commands/playback.h"
#include "commands/replay.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/network/tutor/playback.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/instrument.h"
#include "playback_text.h"
#include "window_program.h"

namespace osteo {
namespace {

std::vector<Lesson> lessons_of(const std::string& list, const std::string& bone_hash) {
  std::vector<Lesson> all;
  for (std::size_t at = 0; at < list.size();) {
    const std::size_t comma = std::min(list.find(',', at), list.size());
    if (const std::string name = list.substr(at, comma - at); !name.empty()) {
      const SessionReader session(open_session_folder(name).stream());
      if (session.header().bone_hash != bone_hash)
        throw Error(ExitCode::usage, "'" + name + "' of --experts was recorded on another bone",
                    "give sessions of the same case");
      all.push_back(read_lesson(session, 0, 0));
    }
    at = comma + 1;
  }
  return all;
}

// In the window: the same flags, as the window takes them.
int open_window(const PlaybackCommand::Params& p, const SessionFolder& lesson, const cli::Invocation& io) {
  PlaybackParams mine = p, usual;
  std::string as = "from_s=" + format_number(p.from_s) + ",to_s=" + format_number(p.to_s);
  const auto given = fields_of<PlaybackParams>(mine), defaults = fields_of<PlaybackParams>(usual);
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].to_text() != defaults[i].to_text())
      as += "," + std::string(given[i].doc.name) + "=" + given[i].to_text();
  }
  std::vector<std::string> args{window_program("osteo-rehearse", "use --headless"), lesson.case_folder.string(),
                                "--playback=" + lesson.folder.string(), "--playback-as=" + as};
  if (!p.out.empty()) args.push_back("--out=" + p.out);
  if (!p.state_file.empty()) args.push_back("--state-file=" + p.state_file);
  args.push_back("--device=" + std::string(EnumNames<Hand>::values[static_cast<std::size_t>(p.device)]));
  become(std::move(args), io);
}

}  // namespace

double simulated_stiffness(const std::string& hand) {
  const std::string kind = "simulated:";
  const std::string advice = "simulated:100, simulated:250 and simulated:500 are soft, usual and firm grips";
  if (hand.rfind(kind, 0) != 0) throw Error(ExitCode::usage, "--hand: there is no hand '" + hand + "'", advice);
  char* end = nullptr;
  const double n_per_m = std::strtod(hand.c_str() + kind.size(), &end);
  if (end == hand.c_str() + kind.size() || *end != '\0' || !(n_per_m >= 1 && n_per_m <= 5000))
    throw Error(ExitCode::usage, "--hand: '" + hand.substr(kind.size()) + "' is no stiffness from 1 to 5000 N/m",
                advice);
  return n_per_m;
}

cli::CommandInfo PlaybackCommand::info() {
  return {
      "playback",
      "a recorded session led along: the expert's movements and forces in your hand",
      "The hand of the session is one more hand of a new session, and leads yours: by a spring and a damper, and "
      "in 'show' with the "
      "forces that it felt. Bone is drilled by the recorded hand, and comes out as recorded to the bit, or "
      "by yours (--drills). "
      "What is recorded says that it was guided; scores never mix it with unaided sessions. docs/guides/tutoring.md.",
      {{"session", "the expert's, a session folder"}},
      "osteo playback SESSION --mode guide --pace way",
      false,
      {},
      {"out", "state_file"}};
}

int PlaybackCommand::run(const Params& p, cli::Invocation& io) {
  for (const char* const name : {"device", "state_file"}) {
    if (p.headless && io.given.contains(name))
      throw Error(ExitCode::usage,
                  "--" + std::string(name == std::string("device") ? "device" : "state-file") +
                      " has no effect with --headless",
                  "leave it out");
  }
  if (!p.headless && io.given.contains("hand"))
    throw Error(ExitCode::usage, "--hand has no effect in the window", "add --headless, or leave it out");
  const SessionFolder lesson_folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader recorded(lesson_folder.stream());
  PlaybackParams params = p;
  auto lesson = std::make_shared<Lesson>(read_lesson(recorded, p.from_s, p.to_s));
  if (!p.experts.empty()) {
    if (io.given.contains("dead_zone_mm"))
      throw Error(ExitCode::usage, "--dead-zone-mm has no effect beside --experts", "leave one of them out");
    params.dead_zone_mm = spread_mm(*lesson, lessons_of(p.experts, recorded.header().bone_hash));
  }
  if (!p.headless) {
    Params shown = p;
    static_cast<PlaybackParams&>(shown) = params;
    return open_window(shown, lesson_folder, io);
  }
  const double stiffness = simulated_stiffness(p.hand);
  if ((!leads(params) && !by_clock(params)) || params.mode == PlaybackMode::amplify)
    throw Error(ExitCode::usage, "a simulated hand has no will, and nothing leads it in this mode",
                "use --mode show, guide or fading, or --pace clock");

  auto playback = std::make_shared<Playback>(lesson, params);
  const DeviceSample& first = lesson->hands.front().front();
  playback->patience_s = 20;
  RehearsalOptions options;
  options.rate_hz = lesson->rate_hz;
  auto devices = playback_devices(std::make_unique<FollowingHand>(stiffness, from_floats(first.position_mm), playback),
                                  playback, options.haptics);
  options.actions = playback_actions(*playback);
  const Case the_case = load_case(lesson_folder.case_folder);
  options.anatomy = anatomy_of(the_case, options.haptics, io.context);
  World world = world_of_lesson(lesson_folder, p.from_s, the_case, options.anatomy, io.context);
  // It begins with the lesson's scene: the case's, that of the session which the lesson goes on from, or that of a time
  // within the lesson.
  const fs::path before = p.from_s > 0 ? lesson_folder.folder : lesson_folder.resumed_from;
  const double at_s = p.from_s > 0 ? p.from_s : lesson_folder.resumed_at_s;
  const SessionFolder session = create_session_folder(p.out, the_case.folder, before, guided_text(params), at_s);
  options.session_file = session.stream();
  Rehearsal rehearsal(std::move(world), std::move(devices), options, io.context);
  io.context.progress(0.1, "led along");
  const RehearsalSummary s = rehearsal.run_to_end(io.context);
  write_summary(session, s, options.rate_hz, instrument_library()[first.tool].name, options.anatomy);
  const SessionReader guided(session.stream());
  const GuidedFacts facts = measure_guided(guided, playback->begun);
  const bool same_bone = recorded.outline().end && recorded.outline().end->bone_hash == s.bone_hash;
  Json j = guided_json(params, facts, *playback);
  j["bone_as_recorded"] = same_bone;
  write_file(session.folder / "playback.json", j.dump(2) + "\n");
  io.end_progress();
  if (io.common.json) io.out << j.dump(2) << '\n';
  if (!io.common.quiet) {
    io.err << guided_text(params) << '\n' << facts_text(facts) << '\n';
    if (expert_drills(params))
      io.err << (same_bone ? "bone at the end is the recorded one, to the bit\n"
                           : "bone at the end is not that of the session's end\n");
    io.err << "session: " << session.folder.string() << '\n';
  }
  // Reported even when quiet: the exit code is about it.
  if (playback->given_up)
    io.err << "NOT LED TO THE END: the hand did not come on after " << format_number(playback->seconds + p.from_s)
           << " s of the session\n";
  return static_cast<int>(playback->given_up ? ExitCode::partial : ExitCode::ok);
}

}  // namespace osteo
