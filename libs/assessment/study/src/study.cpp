#include "osteo/assessment/study/study.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/basics.h"
#include "outcomes.h"
#include "study_folder.h"

namespace osteo::inline assessment::study {
namespace {

constexpr std::array<std::string_view, 4> kAcceptable{"cut-short", "other-bone", "procedure", "program"};

std::uint64_t seed_of(std::uint64_t seed, const std::string& what) {
  return std::stoull(hash_text(std::to_string(seed) + "\n" + what).substr(0, 16), nullptr, 16);
}

// Letters that are not read as one another, and make no words.
std::string blind_code(std::uint64_t seed) {
  statistics::Random random(seed);
  constexpr std::string_view kLetters = "BCDFGHJKMNPQRTVWXZ";
  std::string code;
  for (int i = 0; i < 5; ++i) code += kLetters[random.below(kLetters.size())];
  return code;
}

// Where a row differs from the others: what it may be called to be accepted, and in words.
std::vector<std::pair<std::string, std::string>> differences(const Study& s, const fs::path& folder,
                                                             const Session& added) {
  std::vector<std::pair<std::string, std::string>> found;
  const auto differs = [&](const char* as, const std::string& words) {
    if (std::none_of(found.begin(), found.end(), [&](const auto& f) { return f.first == as; }))
      found.emplace_back(as, words);
  };
  const auto base = [](const std::string& procedure) { return procedure.substr(0, procedure.find(' ')); };
  const Source& mine = added.source;
  if (mine.cut_short) differs("cut-short", "it was cut short, or a part of it is lost");
  // The study's own procedure binds the first row too, which has no other to be compared with.
  if (const fs::path own = folder / "procedure.json"; mine.known() && fs::exists(own)) {
    if (base(mine.procedure) != hash_text(read_text(own)).substr(0, 16))
      differs("procedure", "it was scored by another procedure than the study's own, '" + own.string() + "'");
  }
  for (const Session& other : s.sessions) {
    const Source& o = other.source;
    if (!o.known() || !mine.known()) continue;
    const std::string of = other.participant + "'s attempt " + std::to_string(other.attempt) + " of " + other.case_name;
    const bool same_case = other.case_name == added.case_name;
    if (same_case && o.bone != mine.bone && !o.other_bone)
      differs("other-bone", "it was recorded on another bone than " + of);
    if (!same_case && o.bone == mine.bone && !o.other_bone)
      differs("other-bone", "it was recorded on the bone of another case: that of " + of);
    if (base(o.procedure) != base(mine.procedure) || (same_case && o.procedure != mine.procedure))
      differs("procedure", "it was scored by another procedure than " + of);
    if (o.recorded_by != mine.recorded_by)
      differs("program", "it was recorded by version " + mine.recorded_by + ", " + of + " by " + o.recorded_by);
    if (o.scored_by != mine.scored_by)
      differs("program", "it was scored by version " + mine.scored_by + ", " + of + " by " + o.scored_by);
  }
  return found;
}

// Of a session that a study cannot hold at all.
void need_own_work(const Study& s, const Session& added) {
  const Source& mine = added.source;
  const std::string it = mine.known() ? "this session" : "what these numbers are of";
  if (mine.guided)
    throw Error(ExitCode::usage, it + " is a guided session", "a study compares sessions that nobody guided");
  if (mine.simulated && !s.plan.simulated)
    throw Error(ExitCode::usage, it + " was drilled by a program, and this is a study of people",
                "simulated trainees have studies of their own: osteo study demo");
  if (mine.known() && !mine.simulated && s.plan.simulated)
    throw Error(ExitCode::usage, it + " was drilled by a person, and this study is of simulated trainees");
  for (const Session& other : s.sessions) {
    if (mine.known() && other.source.stream == mine.stream)
      throw Error(ExitCode::usage, "this session is in the study already: as " + other.participant + "'s attempt " +
                                       std::to_string(other.attempt) + " of " + other.case_name);
  }
}

}  // namespace

void new_study(const fs::path& folder, const Plan& plan) {
  if (const std::string what = wrong_with(plan); !what.empty())
    throw Error(ExitCode::usage, "the study cannot be made: " + what);
  if (output_exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' is there already",
                "choose another folder; a study is never replaced");
  make_output_folder(folder);
  write_plan(folder, plan);
  write_file(folder / "participants.csv", "participant,group\n");
}

std::string add_participant(const fs::path& folder, std::string code, const std::string& group) {
  Study s = read_study(folder);
  // A list on paper may not tell p01 from P01.
  const auto there = [&](const std::string& name) {
    const auto same = std::find_if(s.participants.begin(), s.participants.end(),
                                   [&](const Participant& p) { return lower_case(p.code) == lower_case(name); });
    return same == s.participants.end() ? std::string() : same->code;
  };
  for (int i = 1; code.empty(); ++i) {
    const std::string next = (i < 10 ? "P0" : "P") + std::to_string(i);
    if (there(next).empty()) code = next;
  }
  need_code(code, "a participant");
  if (const std::string same = there(code); !same.empty())
    throw Error(ExitCode::usage, "participant '" + same + "' is there already");
  if (!among(s.plan.groups, group))
    throw Error(ExitCode::usage, "'" + group + "' is not one of the groups " + listed(s.plan.groups),
                "give it with --group");
  s.participants.push_back({code, group});
  write_participants(folder, s);
  return code;
}

std::span<const std::string_view> acceptable_differences() {
  return kAcceptable;
}

std::string add_session(const fs::path& folder, const std::string& participant, const std::string& case_name,
                        int attempt, const Measurements& measured, const std::vector<std::string>& accepted,
                        std::vector<std::string>& notes) {
  Study s = read_study(folder);
  if (find_participant(s, participant) == nullptr)
    throw Error(ExitCode::usage, "there is no participant '" + participant + "'", "add the participant first");
  if (!among(s.plan.cases, case_name))
    throw Error(ExitCode::usage, "'" + case_name + "' is not one of the cases " + listed(s.plan.cases));
  if (attempt < 1 || attempt > s.plan.attempts)
    throw Error(ExitCode::usage, "--attempt is from 1 to " + std::to_string(s.plan.attempts));
  for (const std::string& a : accepted) {
    if (std::find(kAcceptable.begin(), kAcceptable.end(), a) == kAcceptable.end())
      throw Error(ExitCode::usage, "'" + a + "' is nothing that can be accepted",
                  listed({kAcceptable.begin(), kAcceptable.end()}));
  }
  std::set<std::string> taken;
  for (const Session& one : s.sessions) {
    taken.insert(one.blind);
    if (one.participant == participant && one.case_name == case_name && one.attempt == attempt)
      throw Error(ExitCode::usage, "this attempt of '" + participant + "' is there already",
                  "'osteo study remove' takes it out");
  }
  Session added{"", participant, case_name, attempt, {}, measured.source};
  need_own_work(s, added);
  std::string asks, names;
  for (const auto& [as, words] : differences(s, folder, added)) {
    if (as == "other-bone") added.source.other_bone = true;
    if (among(accepted, as)) continue;
    asks += (asks.empty() ? "" : "; ") + words;
    names += (names.empty() ? "" : ", ") + as;
  }
  if (!asks.empty())
    throw Error(ExitCode::usage, "this session differs from what the study holds: " + asks,
                "where that is meant to be, --accept '" + names + "' takes it, and the report says so");
  if (!added.source.known())
    notes.push_back(
        "numbers of an unknown session: neither bone, nor procedure, nor whether a person drilled can be "
        "checked; 'osteo study add' takes the session itself, or what 'osteo score' writes");
  for (const auto& [metric, value] : measured.metrics) {
    if (!among(s.metrics, metric)) s.metrics.push_back(metric);
    added.metrics[metric] = value;
  }
  for (int i = 0; added.blind.empty() || taken.contains(added.blind); ++i)
    added.blind = blind_code(seed_of(
        s.plan.seed, participant + "\n" + case_name + "\n" + std::to_string(attempt) + "\n" + std::to_string(i)));
  s.sessions.push_back(added);
  write_sessions(folder, s);
  return added.blind;
}

Removed remove(const fs::path& folder, const std::string& participant, const std::string& case_name, int attempt) {
  Study s = read_without_ratings(folder);
  if (find_participant(s, participant) == nullptr)
    throw Error(ExitCode::usage, "there is no participant '" + participant + "'");
  Removed r;
  std::vector<std::string> blinds;
  std::erase_if(s.sessions, [&](const Session& one) {
    if (one.participant != participant) return false;
    if (!case_name.empty() && (one.case_name != case_name || one.attempt != attempt)) return false;
    blinds.push_back(one.blind);
    return true;
  });
  r.sessions = blinds.size();
  if (!case_name.empty() && blinds.empty())
    throw Error(ExitCode::usage,
                "'" + participant + "' has no attempt " + std::to_string(attempt) + " of '" + case_name + "'");
  // Ratings first: a study that was stopped here lacks ratings, and holds none of sessions that are gone.
  const auto there = [&](const std::string& blind) {
    return std::any_of(s.sessions.begin(), s.sessions.end(), [&](const Session& one) { return one.blind == blind; });
  };
  for (const fs::path& file : rating_files(folder)) {
    auto ratings = Json::parse(read_text(file));
    const Json* const rows = ratings ? ratings->find("ratings") : nullptr;
    if (rows == nullptr) throw Error(ExitCode::usage, "'" + file.string() + "' holds no ratings");
    Json kept = Json::list();
    for (const Json& row : rows->items()) {
      const Json* const of = row.find("session");
      if (of != nullptr && of->text() != nullptr && !there(*of->text())) {
        ++r.ratings;
      } else {
        kept.push_back(row);
      }
    }
    if (kept.items().size() == rows->items().size()) continue;
    (*ratings)["ratings"] = std::move(kept);
    write_file(file, ratings->dump(1) + "\n");
  }
  for (const std::string& blind : blinds) r.movies += fs::remove(folder / "movies" / (blind + ".mp4")) ? 1 : 0;
  if (fs::is_directory(folder / "forms")) {
    std::vector<fs::path> forms;
    for (const auto& entry : fs::directory_iterator(folder / "forms"))
      if (entry.path().extension() == ".html") forms.push_back(entry.path());
    std::sort(forms.begin(), forms.end());
    for (const fs::path& form : forms) {
      if (blinds.empty()) break;
      r.forms.push_back(form.stem().string());
      if (s.sessions.empty()) {
        fs::remove(form);
      } else {
        write_file(form, form_html(s, form.stem().string()));
      }
    }
  }
  // A column that nobody has any more would stay as a name.
  std::erase_if(s.metrics, [&](const std::string& m) {
    return std::none_of(s.sessions.begin(), s.sessions.end(), [&](const Session& x) { return x.metrics.contains(m); });
  });
  if (!blinds.empty()) write_sessions(folder, s);
  if (!case_name.empty()) return r;
  std::erase_if(s.order, [&](const OrderRow& o) { return o.participant == participant; });
  if (output_exists(folder / "order.csv")) write_order(folder, s);
  std::erase_if(s.participants, [&](const Participant& p) { return p.code == participant; });
  write_participants(folder, s);
  return r;
}

void set_primary(const fs::path& folder, const std::vector<std::string>& outcomes) {
  Study s = read_study(folder);
  if (outcomes.empty()) throw Error(ExitCode::usage, "no outcome was named");
  std::vector<std::string> known;
  for (const Outcome& o : outcomes_of(s)) known.push_back(o.name);
  for (const std::string& item : s.plan.items) known.push_back("rating: " + item);
  if (s.plan.items.size() > 1) known.push_back("rating: mean of items");
  for (const std::string& o : outcomes) {
    if (s.sessions.empty() || among(known, o)) continue;
    const std::string near = nearest_name(o, known);
    throw Error(ExitCode::usage, "'" + o + "' is no outcome of this study",
                near.empty() ? "sessions.csv has a metric a column; ratings are 'rating: ITEM'"
                             : "did you mean '" + near + "'?");
  }
  s.plan.primary = outcomes;
  s.plan.primary_after = static_cast<int>(s.sessions.size());
  if (const std::string what = wrong_with(s.plan); !what.empty()) throw Error(ExitCode::usage, what);
  write_plan(folder, s.plan);
}

std::vector<std::vector<int>> williams(int n) {
  std::vector<std::vector<int>> rows;
  for (int turned = 0; turned < (n % 2 == 0 ? 1 : 2); ++turned) {
    for (int r = 0; r < n; ++r) {
      std::vector<int> row;
      for (int c = 0; c < n; ++c) row.push_back((r + (c % 2 == 0 ? c / 2 : n - (c + 1) / 2)) % n);
      if (turned == 1) std::reverse(row.begin(), row.end());
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::size_t make_order(const fs::path& folder) {
  Study s = read_study(folder);
  const auto square = williams(static_cast<int>(s.plan.cases.size()));
  std::set<std::string> have;
  for (const OrderRow& row : s.order) have.insert(row.participant);
  std::map<std::string, std::size_t> in_group;
  std::size_t added = 0;
  for (const Participant& p : s.participants) {
    // Dealt block by block: whoever comes later changes nothing for those before.
    const std::size_t place = in_group[p.group]++, block = place / square.size();
    std::vector<std::size_t> rows(square.size());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i;
    statistics::Random random(seed_of(s.plan.seed, "order\n" + p.group + "\n" + std::to_string(block)));
    random.shuffle(rows);
    if (have.contains(p.code)) continue;
    int position = 1;
    for (const int c : square[rows[place % square.size()]])
      s.order.push_back({p.code, position++, s.plan.cases[static_cast<std::size_t>(c)]});
    ++added;
  }
  if (added > 0) write_order(folder, s);
  return added;
}

}  // namespace osteo::inline assessment::study
