#include "osteo/assessment/experiment/protocol.h"

#include <algorithm>
#include <array>
#include <set>

#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::experiment {
namespace {

constexpr std::array<std::array<Training, 3>, 6> kOrders{{
    {Training::haptic, Training::visual, Training::visuohaptic},
    {Training::visual, Training::visuohaptic, Training::haptic},
    {Training::visuohaptic, Training::haptic, Training::visual},
    {Training::haptic, Training::visuohaptic, Training::visual},
    {Training::visuohaptic, Training::visual, Training::haptic},
    {Training::visual, Training::haptic, Training::visuohaptic},
}};

std::string wrong_with(const Protocol& p) {
  if (p.participants.empty()) return "participants must name one at least";
  std::set<std::string> seen;
  for (const std::string& code : p.participants) {
    const bool plain = !code.empty() && code.size() <= 40 && std::all_of(code.begin(), code.end(), [](char c) {
      return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
    });
    if (!plain) return "participant '" + code + "' is no code of letters, digits and '-'";
    if (!seen.insert(code).second) return "participant '" + code + "' is there twice";
  }
  if (p.peak_n < p.device_n) return "peak_n is below device_n: no device holds more than it can give";
  const int whole = p.repetitions * static_cast<int>(kTrainings);
  if (p.trials % whole != 0)
    return "trials is " + std::to_string(p.trials) + ": no multiple of " + std::to_string(whole) +
           ", a block for each training";
  return {};
}

std::uint64_t stimulus_seed(const Protocol& p, int block) {
  statistics::Random random(static_cast<std::uint64_t>(p.seed) * 1000003 + static_cast<std::uint64_t>(block));
  return random.bits() >> 11;  // so that JSON's numbers hold it
}

}  // namespace

const char* short_name(Training t) {
  return t == Training::haptic ? "H" : t == Training::visual ? "V" : "V+H";
}

void check(const Protocol& p) {
  if (const std::string what = wrong_with(p); !what.empty()) throw Error(ExitCode::usage, "protocol: " + what);
}

Protocol read_protocol(const fs::path& folder) {
  const fs::path file = folder / "protocol.json";
  const JsonFile json(read_text(file), file.string());
  json.require_format("osteotome_force_skill");
  Protocol p;
  const std::vector<std::string> besides{"osteotome_force_skill", "participants"};
  json.read(json.root(), "", fields_of<Protocol>(p), besides);
  const JsonValue& list = json.need(json.root(), "", "participants");
  for (const JsonValue& v : json.list(list, "participants")) p.participants.push_back(json.text(v, "participants"));
  if (const std::string what = wrong_with(p); !what.empty()) throw json.wrong(json.root(), what);
  return p;
}

void write_protocol(const fs::path& folder, const Protocol& given) {
  check(given);
  const fs::path file = folder / "protocol.json";
  if (output_exists(file))
    throw Error(ExitCode::cannot_write, "'" + file.string() + "' is there already", "give another folder");
  make_output_folder(folder);
  Protocol p = given;
  Json j{{"osteotome_force_skill", 1}, {"participants", p.participants}};
  for (const FieldRef& f : fields_of<Protocol>(p)) {
    if (const auto* const flag = std::get_if<bool*>(&f.target)) {
      j[f.doc.name] = **flag;
    } else if (const auto* const whole = std::get_if<int*>(&f.target)) {
      j[f.doc.name] = **whole;
    } else if (const auto* const number = std::get_if<double*>(&f.target)) {
      j[f.doc.name] = **number;
    } else {
      j[f.doc.name] = f.to_text();
    }
  }
  write_file(file, j.dump(2) + "\n");
}

std::vector<Trial> trials_of(const Protocol& p, std::size_t participant) {
  check(p);
  // At each place of three blocks the six orders go round the participants, begun anywhere, in an order of their own.
  statistics::Random random(static_cast<std::uint64_t>(p.seed) * 7919 + 17);
  std::vector<std::size_t> round{0, 1, 2, 3, 4, 5};
  random.shuffle(round);
  std::vector<Trial> trials;
  const int blocks = p.trials / p.repetitions;
  std::size_t begun = 0;
  for (int b = 0; b < blocks; ++b) {
    if (b % 3 == 0) begun = random.below(6);
    const Training training = kOrders[round[(participant + begun) % 6]][static_cast<std::size_t>(b % 3)];
    for (int r = 1; r <= p.repetitions; ++r) {
      Trial t;
      t.number = b * p.repetitions + r;
      t.block = b + 1;
      t.repetition = r;
      t.training = training;
      t.stimulus = stimulus_seed(p, b + 1);
      t.pause = p.break_after > 0 && t.number > 1 && (t.number - 1) % p.break_after == 0;
      t.aid = p.fading && p.repetitions > 1 ? 1 - static_cast<double>(r - 1) / static_cast<double>(p.repetitions) : 1;
      trials.push_back(t);
    }
  }
  return trials;
}

std::vector<Trial> retention_of(const Protocol& p, std::size_t participant) {
  std::vector<Trial> all = trials_of(p, participant), kept;
  for (Trial t : all) {
    if (t.repetition != 1) continue;
    t.number = static_cast<int>(kept.size()) + 1;
    t.pause = false;
    t.aid = 0;
    kept.push_back(t);
  }
  return kept;
}

Stimulus stimulus_of(const Protocol& p, const Trial& t) {
  StimulusParams params;
  params.device_n = p.device_n;
  params.scale = p.scale;
  return make_stimulus(t.stimulus, params, p.rate_hz);
}

std::size_t participant_number(const Protocol& p, const std::string& code) {
  for (std::size_t i = 0; i < p.participants.size(); ++i) {
    if (p.participants[i] == code) return i;
  }
  const std::string near = nearest_name(code, p.participants);
  throw Error(ExitCode::usage, "the protocol has no participant '" + code + "'",
              near.empty() ? "protocol.json lists them" : "did you mean '" + near + "'?");
}

}  // namespace osteo::inline assessment::experiment
