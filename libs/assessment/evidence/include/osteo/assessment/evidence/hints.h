// Hints while one drills, by rules in a file. A hint is words for the surgeon; nothing follows from it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline assessment {

/// What a rule watches, always of the first hand, and only while its burr turns and presses on bone.
enum class HintKind : int {
  unseen,        ///< the burr's place cannot be seen from the camera
  force,         ///< it presses with more than `limit` N within `within_mm` of a structure
  large_burr,    ///< its diameter is over `limit` mm there
  cutting_burr,  ///< it is no diamond there
  dry,           ///< no water; the time begins again when there was some
};
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(HintKind) {
  return {"unseen", "force", "large_burr", "cutting_burr", "dry"};
}

struct HintRule {
  using Params = HintRule;
  std::string id, name, words, structure;
  HintKind kind = HintKind::unseen;
  double within_mm = 2, limit = 1, for_s = 0.5, quiet_s = 15;
  static void describe(Params& p, auto& visit) {
    visit({"id", "name by which a person turns the hint off; also in the session's note", "", 0, 0, true}, p.id);
    visit({"name", "what the settings call it (empty: its id)"}, p.name);
    visit({"kind", "what is watched", "", 0, 0, true}, p.kind);
    visit({"words", "what is said; {structure} stands for its name", "", 0, 0, true}, p.words);
    visit({"structure", "which alone counts (empty: any)"}, p.structure);
    visit({"within_mm", "how near: from the burr's surface", "mm", 0, 8}, p.within_mm);
    visit({"limit", "force in N, or diameter in mm", "", 0, 100}, p.limit);
    visit({"for_s", "time for which the condition must hold, but for pauses of up to 0.3 s", "s", 0, 600}, p.for_s);
    visit({"quiet_s", "time before the hint is given again", "s", 1, 3600}, p.quiet_s);
  }
};

/// Strict: Error(usage) with file and line for a key that is not known or says nothing for its kind, two of one id,
/// what is out of range, {structure} where none is known.
[[nodiscard]] std::vector<HintRule> parse_hints(std::string_view json, const std::string& name);
/// Errors as above; no_input.
[[nodiscard]] std::vector<HintRule> load_hints(const std::filesystem::path& file);
/// Those of pipelines/hints.json, compiled in. Proposals, fitted to nothing.
[[nodiscard]] const std::vector<HintRule>& usual_hints();

struct Hint {
  std::string id, words, structure;
  double t_s = 0;
};

/// Takes in ticks and says a hint now and then. Some 20 ns a tick. One thread.
class HintWatch {
 public:
  /// No two hints come closer than this.
  static constexpr double kApartS = 4, kPauseS = 0.3;
  /// `structures`: may be null; must outlive this. `water`: the scene has dust and water; without it nothing is dry.
  HintWatch(std::vector<HintRule> rules, double rate_hz, const StructureMap* structures, bool water);

  void tick(const TickRecord& record);
  void action(const SceneAction& action);
  /// Whether the burr's place can be seen, as of the last tick; nothing: not known. Until it is told otherwise.
  void seen(std::optional<bool> seen) { seen_ = seen; }
  /// A hint that is due; at most once each.
  [[nodiscard]] std::optional<Hint> take();
  /// The burr turns and presses on bone, as of the last tick.
  [[nodiscard]] bool drilling() const { return drilling_; }

 private:
  struct Watched {
    HintRule rule;
    std::uint64_t held = 0, missed = 0;  // ticks
    std::optional<double> said_s;
  };
  [[nodiscard]] bool holds(const HintRule& rule, const TickRecord& t) const;

  std::vector<Watched> rules_;
  double rate_hz_;
  const StructureMap* structures_;
  std::vector<std::uint8_t> wanted_;  // by rule: the value of its structure, 0 any
  bool water_, water_flows_ = false, poured_ = false, drilling_ = false;
  std::optional<bool> seen_;
  std::optional<double> last_s_;
  TickRecord last_;
};

}  // namespace osteo::inline assessment
