// osteo sound: what a session sounded like, as a file.
#include <cmath>
#include <ostream>
#include <set>

#include "commands/sound.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/session/scene/sound.h"

namespace osteo {

cli::CommandInfo SoundCommand::info() {
  return {
      "sound",
      "what a session sounded like, as a WAV file",
      "Burrs by their rotation, teeth, size, force and the bone under them; suction tubes, water, plates on bone. A "
      "model by published levels "
      "and "
      "spectra, designed by ear where there are none (docs/validation/sound.md), not a recording. 48 kHz, 16 bits, one "
      "channel. The bone over sinus, "
      "dura and vessels sounds duller where the case names its structures. Of a damaged session what is missing is "
      "silent, and the exit "
      "code is 4.",
      {{"session", "a session folder"}, {"output", "file that ends in .wav"}},
      "osteo sound SESSION out.wav"};
}

int SoundCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path out = io.arguments[1];
  if (out.extension() != ".wav")
    throw Error(ExitCode::usage, "'" + out.string() + "' does not end in .wav", "name the output NAME.wav");
  if (fs::exists(out) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + out.string() + "' exists already", "--force replaces it");
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  std::set<std::uint32_t> soft;
  if (!session.header().haptics.structures.empty()) {
    HapticSetup setup;
    setup.hardness = false;
    const Anatomy anatomy = anatomy_of(load_case(folder.case_folder), setup, io.context);
    if (setup.structures == session.header().haptics.structures) {
      soft = soft_structures(anatomy.structures->structures());
    } else {
      io.context.warn(
          "the case's structures are not those that the session watched: bone over them does not sound duller");
    }
  }
  const SoundFileFacts facts = write_session_sound(session, soft, p.volume, p.alarms, out, io.context);
  io.end_progress();
  const auto rounded = [](double x) { return format_number(std::round(x * 10) / 10); };
  if (io.common.json) {
    Json j{{"seconds", facts.seconds},
           {"loudest_db", facts.loudest_db},
           {"most_held_down_db", facts.most_held_down_db},
           {"gaps", facts.gaps}};
    io.out << j.dump(2) << '\n';
  }
  for (const std::string& line : losses(session.outline())) io.err << "session: " << line << '\n';
  if (!io.common.quiet) {
    io.err << rounded(facts.seconds) << " s of sound: " << out.string() << ", loudest sample "
           << rounded(facts.loudest_db) << " dB of full scale";
    if (facts.most_held_down_db < -0.05)
      io.err << ", held down by up to " << rounded(-facts.most_held_down_db) << " dB where it was loud for long";
    io.err << '\n';
  }
  return session.outline().damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

}  // namespace osteo
