#include "osteo/assessment/evidence/hints.h"

#include <algorithm>
#include <set>

#include "hints_json.h"
#include "osteo/assessment/evidence/detail/process.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {
namespace {

constexpr std::string_view kStructure = "{structure}";

bool is_near(HintKind kind) {
  return kind == HintKind::force || kind == HintKind::large_burr || kind == HintKind::cutting_burr;
}
bool has_limit(HintKind kind) {
  return kind == HintKind::force || kind == HintKind::large_burr;
}

}  // namespace

std::vector<HintRule> parse_hints(std::string_view json, const std::string& name) {
  const JsonFile file(json, name);
  file.require_format("osteotome_hints");
  const std::string known[] = {"osteotome_hints", "hints"};
  file.allow(file.root(), "", known);
  std::vector<HintRule> rules;
  std::set<std::string> ids;
  for (const JsonValue& item : file.list(file.need(file.root(), "", "hints"), "hints")) {
    HintRule rule;
    const std::string where = "hint " + std::to_string(rules.size() + 1);
    const auto fields = fields_of<HintRule>(rule);
    file.read(item, where, fields);
    if (rule.id.empty() || rule.words.empty()) throw file.wrong(item, where + ": 'id' and 'words' may not be empty");
    if (!ids.insert(rule.id).second) throw file.wrong(item, where + ": there is another hint '" + rule.id + "'");
    const std::string kind(EnumNames<HintKind>::values[static_cast<std::size_t>(rule.kind)]);
    for (const char* const key : {"structure", "within_mm"}) {
      if (!is_near(rule.kind) && item.find(key) != nullptr)
        throw file.wrong(*item.find(key), where + ": '" + key + "' says nothing for " + kind);
    }
    if (!has_limit(rule.kind) && item.find("limit") != nullptr)
      throw file.wrong(*item.find("limit"), where + ": 'limit' says nothing for " + kind);
    if (has_limit(rule.kind) && item.find("limit") == nullptr)
      throw file.wrong(item, where + ": " + kind + " needs a 'limit'");
    if (!is_near(rule.kind) && rule.words.find(kStructure) != std::string::npos)
      throw file.wrong(item, where + ": " + kind + " knows no {structure}");
    rules.push_back(std::move(rule));
  }
  return rules;
}

std::vector<HintRule> load_hints(const std::filesystem::path& file) {
  return parse_hints(read_text(file), file.string());
}

const std::vector<HintRule>& usual_hints() {
  static const std::vector<HintRule> rules = parse_hints(kHintsJson, "pipelines/hints.json");
  return rules;
}

HintWatch::HintWatch(std::vector<HintRule> rules, double rate_hz, const StructureMap* structures, bool water)
    : rate_hz_(rate_hz), structures_(structures), water_(water) {
  for (HintRule& r : rules) {
    std::uint8_t value = 0;
    if (!r.structure.empty()) {
      bool found = false;
      for (const std::uint8_t v : structures != nullptr ? structures->values() : std::vector<std::uint8_t>()) {
        if (structures->name_of(v) != r.structure) continue;
        value = v;
        found = true;
      }
      if (!found) continue;  // of another case
    }
    wanted_.push_back(value);
    rules_.push_back({std::move(r), 0, 0, std::nullopt});
  }
}

void HintWatch::action(const SceneAction& action) {
  if (action.is(ActionKind::irrigate)) water_flows_ = action.values[4] > 0;
  if (action.is(ActionKind::simulate) && action.item == static_cast<std::uint32_t>(Simulated::dust))
    water_ = action.values[0] > 0;
}

bool HintWatch::holds(const HintRule& rule, const TickRecord& t) const {
  const Burr* const burr = instrument_of(t.device.tool).cutter();
  if (is_near(rule.kind) && (t.structure == 0 || static_cast<double>(t.clearance_mm) > rule.within_mm)) return false;
  switch (rule.kind) {
    case HintKind::unseen:
      return seen_ == false;
    case HintKind::force:
      return static_cast<double>(t.normal_force_n) > rule.limit;
    case HintKind::large_burr:
      return burr->diameter_mm > rule.limit;
    case HintKind::cutting_burr:
      return !row_of(burr->kind).near_structures;
    case HintKind::dry:
      return water_ && !water_flows_ && !poured_;
  }
  return false;
}

void HintWatch::tick(const TickRecord& t) {
  if (t.hand > 0) {
    poured_ = poured_ || (instrument_of(t.device.tool).kind == InstrumentKind::irrigator && t.device.pedal > 0);
    return;
  }
  last_ = t;
  drilling_ = instrument_of(t.device.tool).cutter() != nullptr && static_cast<double>(t.speed_rpm) > kTurnsRpm &&
              t.normal_force_n > 0;
  const auto pause = static_cast<std::uint64_t>(kPauseS * rate_hz_);
  for (std::size_t n = 0; n < rules_.size(); ++n) {
    Watched& w = rules_[n];
    if (w.rule.kind == HintKind::dry) {
      // Water at any time; a pause dries nothing.
      if (water_flows_ || poured_) w.held = 0;
      if (drilling_ && holds(w.rule, t)) ++w.held;
      continue;
    }
    if (drilling_ && (wanted_[n] == 0 || t.structure == wanted_[n]) && holds(w.rule, t)) {
      ++w.held;
      w.missed = 0;
    } else if (w.held > 0 && ++w.missed > pause) {
      w.held = w.missed = 0;
    }
  }
  poured_ = false;  // hands after the first are told behind it: for the next tick
}

std::optional<Hint> HintWatch::take() {
  const double t_s = static_cast<double>(last_.tick) / rate_hz_;
  if (!drilling_ || (last_s_ && t_s - *last_s_ < kApartS)) return std::nullopt;
  for (Watched& w : rules_) {
    if (w.held == 0 || w.missed > 0 || static_cast<double>(w.held) < w.rule.for_s * rate_hz_) continue;
    if (w.said_s && t_s - *w.said_s < w.rule.quiet_s) continue;
    Hint hint{w.rule.id, w.rule.words, {}, t_s};
    if (is_near(w.rule.kind) && structures_ != nullptr)
      hint.structure = structures_->name_of(static_cast<std::uint8_t>(last_.structure));
    if (const auto at = hint.words.find(kStructure); at != std::string::npos)
      hint.words.replace(at, kStructure.size(), hint.structure);
    w.said_s = last_s_ = t_s;
    w.held = 0;
    return hint;
  }
  return std::nullopt;
}

}  // namespace osteo::inline assessment
