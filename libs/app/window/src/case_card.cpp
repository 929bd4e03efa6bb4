#include "case_card.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/scene/approval.h"
#include "osteo/session/scene/case.h"
#include "start_list.h"

namespace osteo::inline app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNamesShown = 3;

double number_at(const Json& j, const char* key) {
  const Json* const v = j.find(key);
  return v == nullptr ? 0 : v->number().value_or(0);
}

// "5=ossicles, 6=facial nerve" without its values.
std::string names_of(const Json& manifest) {
  const Json* const recipe = manifest.find("recipe");
  const Json* const settings = recipe == nullptr ? nullptr : recipe->find("settings");
  const Json* const given = settings == nullptr ? nullptr : settings->find("names");
  if (given == nullptr || given->text() == nullptr) return {};
  std::vector<std::string> names;
  const std::string& text = *given->text();
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size()), is = text.find('=', at);
    if (is < end) names.emplace_back(tr(text.substr(is + 1, end - is - 1)));
    at = text.find_first_not_of(' ', end + 1);
    if (at == std::string::npos) break;
  }
  std::string shown;
  for (std::size_t n = 0; n < std::min(names.size(), kNamesShown); ++n) shown += (n > 0 ? ", " : "") + names[n];
  if (names.size() > kNamesShown)
    shown = filled(tr("{names}, {n} more"), {{"names", shown}, {"n", std::to_string(names.size() - kNamesShown)}});
  return shown;
}

std::string facts_of(const Json& manifest, const fs::path& folder) {
  std::string all;
  const auto add = [&](const std::string& text) { all += (all.empty() ? "" : " · ") + text; };
  const Json* const frame = manifest.find("frame");
  const Json* const spacing = frame == nullptr ? nullptr : frame->find("spacing_mm");
  if (spacing != nullptr && spacing->items().size() == 3) {
    double least = 1e9;
    for (const Json& v : spacing->items()) least = std::min(least, v.number().value_or(1e9));
    if (least < 1e9) add(filled(tr("{mm} mm"), {{"mm", shown_figures(format_number(std::round(100 * least) / 100))}}));
  }
  const std::vector<fs::path> sessions = sessions_of(folder);
  if (sessions.size() == 1) add(tr("1 session"));
  if (sessions.size() > 1) add(filled(tr("{n} sessions"), {{"n", std::to_string(sessions.size())}}));
  std::error_code unknown;
  const auto when =
      fs::last_write_time(sessions.empty() ? folder / "manifest.json" : sessions.front() / "session.json", unknown);
  if (!unknown) add(day_text(when));
  return all;
}

}  // namespace

std::string day_text(fs::file_time_type time) {
  const auto seconds = [](auto t) {
    return std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::system_clock::duration>(t));
  };
  const std::time_t then = seconds(std::chrono::file_clock::to_sys(time)),
                    now = seconds(std::chrono::system_clock::now());
  std::tm at{}, today{};
  ::localtime_r(&then, &at);
  ::localtime_r(&now, &today);
  char text[32];
  if (at.tm_year == today.tm_year && at.tm_yday == today.tm_yday) {
    std::strftime(text, sizeof text, "%H:%M", &at);
    return filled(tr("today {time}"), {{"time", text}});
  }
  std::strftime(text, sizeof text, "%Y-%m-%d", &at);
  return text;
}

CaseCard card_of(const fs::path& folder) {
  CaseCard card;
  card.name = folder.filename().string();
  const auto broken = [&](std::string why) {
    card.state = CaseCard::State::broken;
    card.words = tr("cannot be opened");
    card.why = std::move(why);
    card.facts = folder.parent_path().string();
    return card;
  };
  try {
    const fs::path file = folder / "manifest.json";
    if (!fs::exists(file)) return broken(tr("it is no longer there"));
    const std::string text = read_text(file);
    const auto files = parse_manifest(text);
    for (const auto& [role, kept] : files) {
      if (!fs::exists(folder / kept.name))
        return broken(filled(tr("{file} is missing: prepare it again"), {{"file", kept.name}}));
      if (role == "picture") card.preview = folder / kept.name;
      if (role == "verdict") card.scan = read_verdict(read_text(folder / kept.name));
    }
    const Json manifest = Json::parse(text).value_or(Json());
    card.structures = names_of(manifest);
    card.facts = facts_of(manifest, folder);
    const ApprovalNow approval = approval_of(folder);
    card.words = tr("not approved");
    if (approval.state == ApprovalState::valid && approval.approval) {
      card.state = CaseCard::State::approved;
      card.words = filled(tr("approved by {name}, {date}"),
                          {{"name", approval.approval->by}, {"date", approval.approval->date}});
    } else if (approval.state == ApprovalState::outdated) {
      card.state = CaseCard::State::doubtful;
      card.words = tr("changed since it was approved");
    }
  } catch (const Error& e) {
    return broken(e.advice().empty() ? e.what() : std::string(e.what()) + "; " + e.advice());
  } catch (const fs::filesystem_error& e) {
    return broken(e.code().message());
  }
  return card;
}

std::string session_figures(const fs::path& session) {
  std::string all;
  try {
    const auto j = Json::parse(read_text(session / "summary.json"));
    if (!j) return {};
    const double rate = number_at(*j, "rate_hz"), seconds = rate > 0 ? number_at(*j, "ticks") / rate : 0;
    const double mm3 = number_at(*j, "removed_mm3") + number_at(*j, "sawn_mm3");
    all = filled(tr("{min} min, {mm3} mm³"), {{"min", shown_number(std::max(0.1, seconds / 60), seconds < 600 ? 1 : 0)},
                                              {"mm3", shown_number(mm3, mm3 < 10 ? 1 : 0)}});
    const Json* const structures = j->find("structures");
    std::string nearest;
    double least = 1e9;
    for (const Json& s : structures == nullptr ? Json::List() : structures->items()) {
      const Json* const name = s.find("name");
      if (number_at(s, "least_clearance_mm") >= least || name == nullptr || name->text() == nullptr) continue;
      least = number_at(s, "least_clearance_mm");
      nearest = *name->text();
    }
    if (!nearest.empty() && least <= 0) all += "; " + filled(tr("touched: {structure}"), {{"structure", tr(nearest)}});
    if (!nearest.empty() && least > 0)
      all += "; " + filled(tr("nearest: the {structure}, {mm} mm"),
                           {{"structure", tr(nearest)}, {"mm", shown_number(least, 1)}});
  } catch (const Error&) {
    return {};
  }
  return all;
}

}  // namespace osteo::inline app
