#include "past_session.h"

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo {

PastSession::PastSession(const std::filesystem::path& folder, const std::filesystem::path& case_folder)
    : folder_(open_session_folder(folder, case_folder)) {
  static_cast<void>(SessionReader(folder_.stream(), Damage::keep));
}

std::unique_ptr<Rehearsal> PastSession::stage(const Case& the_case, RehearsalOptions options, const HandView& view,
                                              const Context& context) const {
  World world = world_at_begin(folder_, the_case, options.anatomy, context);
  if (world.hash() != SessionReader(folder_.stream(), Damage::keep).header().bone_hash)
    throw Error(ExitCode::corrupt,
                "the session '" + folder_.folder.string() + "' was recorded on another bone than its case holds now",
                "give the case it was recorded on, unchanged");
  options.session_file.clear();
  options.soft = nullptr;
  options.follow = {true, true, false, false};
  const HandGoal rest{from_floats(to_floats(view.eye * 300)), to_floats(view.axis), 0,
                      static_cast<std::uint8_t>(view.tool)};
  auto hand = std::make_unique<MouseDevice>(rest);
  options.haptics.device = hand->traits();
  options.haptics.more_devices.clear();
  std::vector<std::unique_ptr<Device>> hands;
  hands.push_back(std::move(hand));
  return std::make_unique<Rehearsal>(std::move(world), std::move(hands), options, context);
}

SessionFacts PastSession::facts(const Anatomy& anatomy) const {
  const SessionReader session(folder_.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  SessionFacts f;
  f.past = true;
  f.folder = folder_.folder;
  f.rate_hz = session.header().rate_hz;
  f.seconds = static_cast<double>(outline.tick_records) /
              static_cast<double>(1 + session.header().haptics.more_devices.size()) / f.rate_hz;
  f.has_structures = anatomy.structures != nullptr;
  if (!outline.end) f.warnings.push_back("the session was cut short: it is shown as far as it goes");
  for (const std::string& line : losses(outline)) f.warnings.push_back(line);
  if (!folder_.guided.empty()) f.warnings.push_back("guided: " + folder_.guided);
  if (const std::string words = simulated_text(session); !words.empty()) f.warnings.push_back(words);
  const auto summary =
      std::filesystem::exists(folder_.summary()) ? Json::parse(read_text(folder_.summary())) : std::nullopt;
  if (!summary) {
    f.warnings.push_back("it was left without a summary: what was removed stands among the findings");
    return f;
  }
  const auto number = [](const Json& j, const char* key) {
    const Json* const n = j.find(key);
    return n == nullptr ? 0.0 : n->number().value_or(0);
  };
  f.removed_mm3 = number(*summary, "removed_mm3");
  f.sawn_mm3 = number(*summary, "sawn_mm3");
  f.tissue_mm3 = number(*summary, "tissue_cut_off_mm3");
  f.bodies = std::max<std::size_t>(1, static_cast<std::size_t>(number(*summary, "bodies")));
  if (const Json* const plates = summary->find("plates")) {
    for (const Json& p : plates->items()) {
      const Json* const name = p.find("plate");
      if (name != nullptr && name->text() != nullptr)
        f.plates.push_back(format_number(number(p, "number")) + ": " + *name->text());
    }
  }
  if (const Json* const structures = summary->find("structures")) {
    for (const Json& s : structures->items()) {
      const Json* const name = s.find("name");
      if (name != nullptr && name->text() != nullptr)
        f.structures.push_back(
            {*name->text(), number(s, "least_clearance_mm"), number(s, "touched_s"), number(s, "injured_s")});
    }
  }
  if (const Json* const cuts = summary->find("structures_cut")) {
    for (const Json& c : cuts->items()) {
      const Json* const by = c.find("by");
      if (const Json* const name = c.find("name"); name != nullptr && name->text() != nullptr)
        f.add_cut(*name->text(), by != nullptr && by->text() != nullptr ? *by->text() : "saw", number(c, "mm3"));
    }
  }
  return f;
}

}  // namespace osteo
