// What 'osteo playback' and the window say of a playback, and the bone that it begins with.
#pragma once
#include <cmath>
#include <string>

#include "osteo/core/base/json_document.h"
#include "osteo/network/tutor/playback.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

/// Words for session.json: mode, who drills, pace.
inline std::string guided_text(const PlaybackParams& p) {
  return "led by a recorded session: " +
         std::string(EnumNames<PlaybackMode>::values[static_cast<std::size_t>(p.mode)]) + ", " +
         (expert_drills(p) ? "the recorded burr drills" : "the learner's burr drills") + ", time goes " +
         (by_clock(p) ? "in real time" : "along the way");
}

/// The scene when the lesson begins.
inline World world_of_lesson(const SessionFolder& lesson, double from_s, const Case& the_case, const Anatomy& anatomy,
                             const Context& context) {
  return from_s > 0 ? world_at(lesson, from_s, the_case, anatomy, context)
                    : world_at_begin(lesson, the_case, anatomy, context);
}

inline std::string facts_text(const GuidedFacts& f) {
  const auto n = [](double x) { return format_number(std::round(x * 1000) / 1000); };
  return "hand beside the recorded one: RMS " + n(f.rms_mm) + " mm, 95 % within " + n(f.p95_mm) + " mm, at most " +
         n(f.most_mm) + " mm; led with at most " + n(f.most_pull_n) + " N; work of the guide on the hand " +
         n(f.work_mj) + " mJ, at most " + n(f.most_work_mj) + " mJ";
}

inline Json guided_json(const PlaybackParams& params, const GuidedFacts& f, const Playback& playback) {
  PlaybackParams copy = params;
  Json j{{"osteotome_playback", 1}, {"words", guided_text(params)}};
  j["params"] = Json::object();
  for (const FieldRef& field : fields_of<PlaybackParams>(copy))
    j["params"][std::string(field.doc.name)] = field.to_text();
  j["expert_drills"] = expert_drills(params);
  j["by_clock"] = by_clock(params);
  j["led_to_the_end"] = !playback.given_up;
  j["lesson_s"] = playback.lesson->seconds();
  j["begun_tick"] = playback.begun;
  j["ticks"] = f.ticks;
  j["rms_mm"] = f.rms_mm;
  j["p95_mm"] = f.p95_mm;
  j["most_mm"] = f.most_mm;
  j["most_pull_n"] = f.most_pull_n;
  j["work_mj"] = f.work_mj;
  j["most_work_mj"] = f.most_work_mj;
  j["guided_s"] = f.guided_s;
  j["force_capped_s"] = f.capped_s;
  if (params.mode == PlaybackMode::fading)
    j["fading"] = {{"strength", playback.fading.strength()},
                   {"trials", playback.fading.trials()},
                   {"last_error_mm", playback.fading.last_error_mm()}};
  return j;
}

}  // namespace osteo
