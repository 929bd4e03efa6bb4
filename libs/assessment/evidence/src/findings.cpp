#include "osteo/assessment/evidence/findings.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline assessment {
namespace {

std::string in(double v, const std::string& unit) {
  const std::string u = unit_text(unit);
  return reported_number(v) + (u.empty() ? "" : " " + u);
}
std::string percent(double share) {
  const double p = 100 * share;
  // What is not all is not told as all, and what is not nothing not as nothing.
  if (p > 0 && p < 1) return "less than 1 %";
  if (p < 100 && p > 99) return "over 99 %";
  return format_number(std::round(p)) + " %";
}
std::string times(double n) {
  return n == 1 ? "once" : n == 2 ? "twice" : reported_number(n) + " times";
}
std::string slug(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    const char low = u < 128 ? static_cast<char>(std::tolower(u)) : '-';
    if ((low >= 'a' && low <= 'z') || (low >= '0' && low <= '9')) {
      out += low;
    } else if (!out.empty() && out.back() != '-') {
      out += '-';
    }
  }
  while (!out.empty() && out.back() == '-') out.pop_back();
  return out;
}
// "whole of the nerve" as a sentence begins.
std::string capital(std::string s) {
  if (!s.empty()) s[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(s[0])));
  return s;
}

class Finder {
 public:
  Finder(const Score& score, const StructureMap* structures, const Procedure* procedure, const FindingLimits& limits,
         Findings& out)
      : score_(score), structures_(structures), procedure_(procedure), limits_(limits), out_(out) {}

  void all() {
    out_.words = score_.words;
    summary();
    structures();
    hidden();
    force();
    instruments();
    regions();
    items();
    time();
    unmeasured();
    std::stable_sort(out_.list.begin(), out_.list.end(),
                     [](const ScoreFinding& a, const ScoreFinding& b) { return a.severity > b.severity; });
  }

 private:
  [[nodiscard]] std::optional<double> value(MetricName name, const std::string& of = {}) const {
    for (const Measured& m : score_.values) {
      if (m.is(name) && m.of == of) return m.value;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::vector<std::pair<std::string, double>> values(MetricName name) const {
    std::vector<std::pair<std::string, double>> all;
    for (const Measured& m : score_.values) {
      if (m.is(name) && m.value) all.emplace_back(m.of, *m.value);
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    return all;
  }
  [[nodiscard]] bool to_be_opened(const std::string& structure) const {
    const ProcedureStructure* const p = procedure_ == nullptr ? nullptr : procedure_->find(structure);
    return p != nullptr && p->role == ProcedureRole::enter;
  }
  ScoreFinding& add(std::string kind, const std::string& of, FindingSeverity severity, std::string text,
                    std::string why = {}) {
    ScoreFinding f;
    f.id = of.empty() ? kind : kind + "-" + slug(of);
    f.kind = std::move(kind);
    f.severity = severity;
    f.text = std::move(text);
    f.why = std::move(why);
    out_.list.push_back(std::move(f));
    return out_.list.back();
  }
  static void from(ScoreFinding& f, MetricName name, const std::string& structure, std::optional<double> v,
                   std::optional<double> limit) {
    f.metric = structure.empty() ? std::string(name.row().name) : std::string(name.row().name) + "[" + structure + "]";
    f.structure = structure;
    f.value = v;
    f.limit = limit;
    f.unit = name.row().unit;
  }
  void moments(ScoreFinding& f, std::string_view what, const std::string& structure) const {
    for (const Moment& m : score_.moments) {
      if (m.what != what || m.structure != structure) continue;
      if (f.times_s.size() < ScoreFinding::kMaxTimes) f.times_s.push_back(m.t_s);
      if (f.places_mm.size() < ScoreFinding::kMaxPlaces) f.places_mm.push_back(m.at_mm);
      ++f.places_count;
      if (!f.at_mm) f.at_mm = m.at_mm;
    }
  }
  // Evenly chosen, and a place to look at: the one nearest to the middle of them, so that it is one of them.
  static void places(ScoreFinding& f, const std::vector<Vec3>& all, std::size_t count, double each) {
    f.places_count = count;
    f.places_each = each;
    if (all.empty()) return;
    const std::size_t keep = std::min(all.size(), ScoreFinding::kMaxPlaces);
    Vec3 middle;
    for (std::size_t n = 0; n < keep; ++n) f.places_mm.push_back(all[n * all.size() / keep]);
    for (const Vec3 p : f.places_mm) middle += p / static_cast<double>(keep);
    f.at_mm = *std::min_element(f.places_mm.begin(), f.places_mm.end(),
                                [&](Vec3 a, Vec3 b) { return length(a - middle) < length(b - middle); });
  }

  void summary() {
    const auto duration = value("duration_s"), drilling = value("drilling_s"), removed = value("removed_mm3"),
               sawn = value("sawn_mm3");
    if (duration) {
      std::string s = "The session lasted " + reported_seconds(*duration);
      s += drilling && *drilling > 0 ? "; for " + reported_seconds(*drilling) + " of it a burr was drilling."
                                     : "; no burr drilled.";
      out_.summary.push_back(s);
    }
    if (removed && *removed > 0) {
      std::string s = "Burrs took " + in(*removed, "mm3") + " of bone";
      if (sawn && *sawn > 0) s += " and saws " + in(*sawn, "mm3");
      out_.summary.push_back(s + ".");
    } else if (sawn && *sawn > 0) {
      out_.summary.push_back("Saws took " + in(*sawn, "mm3") + " of bone, burrs none.");
    } else {
      out_.summary.push_back("No bone was removed.");
    }
    if (!score_.procedure.empty() && !score_.items.empty()) {
      std::string s = score_.judged() == 0 ? "No item of the scale could be judged."
                                           : std::to_string(score_.passed()) + " of " +
                                                 std::to_string(score_.judged()) + " items of the scale passed";
      if (score_.judged() > 0) {
        if (score_.judged() < score_.items.size())
          s += "; " + std::to_string(score_.items.size() - score_.judged()) + " could not be judged";
        s += ".";
      }
      out_.summary.push_back(s);
    }
  }

  [[nodiscard]] double taken_by(CutBy by, const std::string& structure) const {
    double mm3 = 0;
    for (const Moment& m : score_.moments) {
      if (m.what == CutMetric::moment_of(by, false) && m.structure == structure) mm3 += m.value;
    }
    return mm3;
  }
  // What no burr did: a finding of its own. False where nothing of the kind happened.
  bool cut_by(CutBy by, const std::string& name) {
    struct Words {
      const char *id, *through, *touched, *why;
    };
    const Words words =
        by == CutBy::saw ? Words{"cut", "The saw cut through the ", "The saw's cut was in contact with the ",
                                 "Cut through: it lay in the path of the blade, as far as that was in bone."}
        : by == CutBy::shaft
            ? Words{"shaft", "A shaft went through the ", "A shaft was in contact with the ",
                    "The part of it that lay inside the shaft, on its way."}
            : Words{"screws", "Screws of a plate went through the ", "Screws of a plate were in contact with the ",
                    "The part of it that lay inside the screws, as long as they are drawn."};
    const double mm3 = taken_by(by, name);
    const bool contact = std::any_of(score_.moments.begin(), score_.moments.end(), [&](const Moment& m) {
      return m.what == CutMetric::moment_of(by, true) && m.structure == name;
    });
    if (mm3 <= 0 && !contact) return false;
    ScoreFinding& f = add(words.id, name, mm3 > 0 ? FindingSeverity::serious : FindingSeverity::caution,
                          mm3 > 0 ? words.through + name + ": " + in(mm3, "mm3") + " of it."
                                  : words.touched + name + " and removed nothing of it that can be measured.",
                          words.why);
    f.kind = mm3 > 0 ? "injury" : "touch";
    from(f, "cut_mm3", name, mm3, 0);
    moments(f, CutMetric::moment_of(by, mm3 <= 0), name);
    return true;
  }

  void structures() {
    std::pair<std::string, double> nearest{"", 1e9};
    bool any = false;
    for (const auto& [name, n] : values("touches")) {
      any = true;
      const double injured = value("injured_s", name).value_or(0), touched = value("touched_s", name).value_or(0);
      if (const auto c = value("clearance_mm", name); c && *c < nearest.second) nearest = {name, *c};
      if (injured > 0) {
        const auto count = [&, &of = name](std::string_view what) {
          return static_cast<double>(std::count_if(score_.moments.begin(), score_.moments.end(), [&](const Moment& m) {
            return m.what == what && m.structure == of;
          }));
        };
        const double burr = count("reached by a rotating burr"), saw = count("reached by the running saw");
        std::string text = burr == 0 && saw > 0 ? "The running saw reached the " : "A rotating burr reached the ";
        text += name;
        if (burr > 0 || saw > 0) text += " " + times(burr > 0 ? burr : saw);
        if (burr > 0 && saw > 0) text += " and the running saw " + times(saw);
        const double taken = taken_by(CutBy::burr, name) + taken_by(CutBy::hand_saw, name);
        ScoreFinding& f = add("injury", name, FindingSeverity::serious,
                              text + ", for " + reported_seconds(injured) + " in all" +
                                  (taken > 0 ? ", and took " + in(taken, "mm3") + " of it." : "."),
                              "Reached: the tool's surface lay inside the structure's face.");
        from(f, "injured_s", name, injured, 0);
        moments(f, "reached by a rotating burr", name);
        moments(f, "reached by the running saw", name);
        std::sort(f.times_s.begin(), f.times_s.end());
      } else if (n > 0) {
        ScoreFinding& f = add("touch", name, FindingSeverity::caution,
                              "The burr touched the " + name + " " + times(n) + ", for " + reported_seconds(touched) +
                                  ", without turning.");
        from(f, "touches", name, n, 0);
        moments(f, "touched from the first tick on", name);
      }
    }
    bool cut = false;
    for (const auto& [name, mm3] : values("cut_mm3")) {
      any = true;
      for (const CutBy by : {CutBy::saw, CutBy::shaft, CutBy::plate_screws}) cut = cut_by(by, name) || cut;
      cut = cut || mm3 > 0;
    }
    std::pair<std::string, double> by_saw{"", 1e9};
    for (const auto& [name, mm] : values("saw_clearance_mm")) {
      if (mm < by_saw.second) by_saw = {name, mm};
      if (mm >= limits_.near_miss_mm) continue;
      ScoreFinding& f = add("saw-clearance", name, FindingSeverity::note,
                            "The saw's cut passed the " + name + " at " + in(mm, "mm") + ".",
                            "Told below " + reported_number(limits_.near_miss_mm) + " mm.");
      f.kind = "clearance";
      from(f, "saw_clearance_mm", name, mm, limits_.near_miss_mm);
    }
    for (const auto& [name, c] : values("clearance_mm")) {
      if (c <= 0 || c >= limits_.near_miss_mm || value("touches", name).value_or(0) > 0) continue;
      ScoreFinding& f =
          add("clearance", name, FindingSeverity::note, "The burr came within " + in(c, "mm") + " of the " + name + ".",
              "Told below " + reported_number(limits_.near_miss_mm) + " mm.");
      from(f, "clearance_mm", name, c, limits_.near_miss_mm);
    }
    if (any && nearest.second > 0 && !cut) {
      const std::string saw =
          by_saw.second < 1e8 ? " The saw's cuts passed the " + by_saw.first + " at " + in(by_saw.second, "mm") + "."
                              : "";
      ScoreFinding& f = add("untouched", {}, FindingSeverity::good,
                            (nearest.second < 1e8 ? "No structure was touched; the burr came nearest to the " +
                                                        nearest.first + ", at " + in(nearest.second, "mm") + "."
                                                  : "No structure was touched, and no burr came near one.") +
                                saw);
      f.kind = "touch";
      if (nearest.second < 1e8) from(f, "clearance_mm", nearest.first, nearest.second, std::nullopt);
    }
  }

  void hidden() {
    const auto mm3 = value("hidden_mm3"), share = value("seen_share");
    if (!mm3 || !share) return;
    if (*mm3 <= 0) {
      from(add("hidden", {}, FindingSeverity::good, "All bone that was removed was seen as it went.",
               "Seen: a straight line from it to the eye met no bone."),
           "hidden_mm3", {}, 0, std::nullopt);
      return;
    }
    std::vector<std::pair<std::string, double>> near;
    for (const auto& v : values("hidden_near_mm3")) {
      if (v.second > 0 && !to_be_opened(v.first)) near.push_back(v);
    }
    const bool danger = !near.empty() && near.front().second >= limits_.hidden_near_mm3;
    std::string text = in(*mm3, "mm3") + " of bone (" + percent(1 - *share) + ") was removed unseen";
    for (std::size_t n = 0; n < std::min<std::size_t>(near.size(), 3); ++n) {
      text += n == 0 ? ", " : n + 1 == std::min<std::size_t>(near.size(), 3) ? " and " : ", ";
      text += in(near[n].second, "mm3") +
              (n == 0 ? " of it within " + reported_number(kNearMm) + " mm of the " : " of the ") + near[n].first;
    }
    ScoreFinding& f = add(
        "hidden", {}, danger || *share < limits_.seen_well ? FindingSeverity::caution : FindingSeverity::good,
        text + ".", "Unseen: bone lay between it and the eye as it went; voxels in touch with the burr are left out.");
    from(f, "hidden_mm3", {}, *mm3, std::nullopt);
    std::vector<Vec3> all, close;
    for (const auto& [name, v] : score_.hidden) {
      all.push_back(v.own_mm);
      if (structures_ == nullptr) continue;
      const StructureMap::Answer a = structures_->at(v.own_mm);
      if (a.structure != 0 && a.distance_mm <= kNearMm && !to_be_opened(structures_->name_of(a.structure)))
        close.push_back(v.own_mm);
    }
    const double each = score_.hidden.empty() ? 0 : static_cast<double>(score_.hidden.front().second.mm3);
    places(f, all, all.size(), each);
    // One looks where it matters.
    if (!close.empty()) {
      Vec3 middle;
      for (const Vec3 p : close) middle += p / static_cast<double>(close.size());
      f.at_mm = *std::min_element(close.begin(), close.end(),
                                  [&](Vec3 a, Vec3 b) { return length(a - middle) < length(b - middle); });
    }
    for (const Moment& m : score_.moments) {
      if (m.what == "removed unseen" && !to_be_opened(m.structure) && f.times_s.size() < ScoreFinding::kMaxTimes)
        f.times_s.push_back(m.t_s);
    }
  }

  void force() {
    for (const auto& [name, ns] : values("excess_force_ns")) {
      if (ns <= 0) continue;
      double most = 0, limit = 0;
      for (const Moment& m : score_.moments) {
        if (m.what != "pressed too hard near it" || m.structure != name) continue;
        most = std::max(most, m.value);
        limit = m.limit;
      }
      ScoreFinding& f =
          add("force", name, FindingSeverity::caution,
              "Near the " + name + " the burr pressed harder than the " + in(limit, "N") +
                  " that the procedure allows there" + (most > 0 ? ": " + in(most, "N") + " was seen." : "."),
              "Impulse above the limit: " + in(ns, "N s") + ".");
      from(f, "excess_force_ns", name, ns, 0);
      moments(f, "pressed too hard near it", name);
    }
    const auto band = [&](MetricName metric, const char* kind, const char* how, const char* what) {
      for (const auto& [name, share] : values(metric)) {
        if (share <= limits_.above_band_share || to_be_opened(name)) continue;
        ScoreFinding& f = add(kind, name, FindingSeverity::caution,
                              percent(share) + " of the drilling near the " + name + " was " + how +
                                  " than nine in ten moments of the reference's experts.",
                              "At the same distance; by chance it would be 10 %.");
        f.id = std::string(kind) + "-band-" + slug(name);
        from(f, metric, name, share, limits_.above_band_share);
        if (what[0] != 0) moments(f, what, name);
      }
    };
    band("force_above_band_share", "force", "pressed harder", "pressed harder than experts do there");
    band("speed_above_band_share", "speed", "faster", "");
    if (const auto peak = value("force_peak_n")) {
      const auto p95 = value("force_p95_n"), middle = value("force_median_n");
      ScoreFinding& f = add("force-peak", {}, FindingSeverity::note,
                            "The hardest press was " + in(*peak, "N") +
                                (middle ? "; the middle of all was " + in(*middle, "N") : "") +
                                (p95 ? ", and 5 % were above " + in(*p95, "N") : "") + ".");
      f.kind = "force";
      from(f, "force_peak_n", {}, *peak, std::nullopt);
      moments(f, "hardest press", {});
    }
  }

  void instruments() {
    if (const auto share = value("burr_choice_share")) {
      if (*share < 1) {
        from(add("instrument", {}, FindingSeverity::caution,
                 "For " + percent(1 - *share) +
                     " of the drilling where the procedure restricts burrs, another was in the hand."),
             "burr_choice_share", {}, *share, 1);
      } else {
        from(add("instrument", {}, FindingSeverity::good,
                 "Where the procedure restricts burrs, only allowed ones were used."),
             "burr_choice_share", {}, *share, 1);
      }
    }
    if (const auto wet = value("irrigation_share"); wet && *wet < 1 - limits_.dry_share) {
      from(add("water", {}, FindingSeverity::note,
               *wet > 0 ? percent(1 - *wet) + " of the drilling was without water."
                        : "No water was used while drilling.",
               "Water cools bone; burrs heat it."),
           "irrigation_share", {}, *wet, 1 - limits_.dry_share);
    }
  }

  void regions() {
    for (const auto& [name, mm3] : values("forbidden_mm3")) {
      if (mm3 <= 0) continue;
      from(add("region", name, FindingSeverity::caution,
               in(mm3, "mm3") + " of bone is gone that should have stayed: " + name + "."),
           "forbidden_mm3", name, mm3, 0);
      out_.list.back().structure.clear();
    }
    for (const auto& [name, share] : values("target_share")) {
      from(add("region", name, FindingSeverity::note,
               percent(share) + " of the bone that was to be removed is gone: " + name + "."),
           "target_share", name, share, std::nullopt);
      out_.list.back().structure.clear();
    }
    if (const auto r = value("region_per_voxel")) {
      from(add("region-reference", {}, *r >= 0 ? FindingSeverity::good : FindingSeverity::note,
               *r >= 0 ? "What was removed is more like what the reference's experts took than what its novices took."
                       : "What was removed is more like what the reference's novices took than what its experts took."),
           "region_per_voxel", {}, *r, 0);
      out_.list.back().kind = "region";
    }
  }

  void items() {
    for (const Product::Result& r : score_.items) {
      if (!r.measured) continue;
      const ProcedureStructure* const s = procedure_ == nullptr ? nullptr : procedure_->find(r.item->structure);
      const bool violated =
          r.item->kind == ItemKind::not_violated && !r.pass && s != nullptr && s->role == ProcedureRole::never_touch;
      ScoreFinding& f = add("item", r.item->name,
                            r.pass     ? FindingSeverity::good
                            : violated ? FindingSeverity::serious
                                       : FindingSeverity::caution,
                            capital(r.item->name) + (r.pass ? ": passed, " : ": not passed, ") + reported_item(r) + ".",
                            reported_item(r).ends_with(r.word) ? std::string() : r.word);
      f.metric = r.item->name;
      f.structure = r.item->structure;
      f.value = r.value;
      f.limit = r.threshold;
      f.unit = r.unit;
      places(f, r.evidence_mm, r.evidence_count, r.evidence_each);
    }
  }
  static std::string reported_item(const Product::Result& r) {
    const bool share = r.unit == "1" && r.item->kind != ItemKind::pieces && r.item->kind != ItemKind::fixed;
    const auto notify = [&](double v) { return share ? percent(v) : in(v, r.unit); };
    switch (r.item->kind) {
      case ItemKind::exposed:
        return notify(r.value) + " of it is laid open, at least " + notify(r.threshold) + " is asked";
      case ItemKind::not_violated:
        if (r.value > 0) return notify(r.value) + " of it is gone";
        return r.pass ? "none of it is gone" : "none of it is gone, but a running burr or saw reached into it";
      case ItemKind::no_hole:
        return "the largest bare part has " + notify(r.value) + ", below " + notify(r.threshold) + " is asked";
      case ItemKind::no_cells_left:
        return notify(r.value) + " of the cells near it are left, at most " + notify(r.threshold) + " is asked";
      case ItemKind::no_overhang:
        return notify(r.value) + " of the wall can be seen, at least " + notify(r.threshold) + " is asked";
      case ItemKind::thinned:
        return notify(r.value) + " of bone is left over it, at most " + notify(r.threshold) + " is asked";
      case ItemKind::sharp_angle:
        return "a ball of " + notify(r.value) + " fits into what is left, at most " + notify(r.threshold) + " is asked";
      case ItemKind::followed:
        return notify(r.value) + " of its length is shown, at least " + notify(r.threshold) + " is asked";
      case ItemKind::margin:
        return "it ends " + notify(r.value) + " off, at most " + notify(r.threshold) + " is asked";
      case ItemKind::pieces:
      case ItemKind::fixed:
        break;
    }
    return reported_number(r.value) + ", at least " + reported_number(r.threshold) +
           (r.threshold == 1 ? " is asked" : " are asked");
  }

  void time() {
    const double duration = value("duration_s").value_or(0);
    if (const auto lost = value("lost_s"); lost && *lost > 0)
      from(add("lost", {}, FindingSeverity::caution, reported_seconds(*lost) + " of the session were not recorded.",
               "What is said here is of the rest."),
           "lost_s", {}, *lost, 0);
    if (procedure_ != nullptr && procedure_->usual_s > 0 && duration > procedure_->usual_s) {
      ScoreFinding& f = add("time", {}, FindingSeverity::note,
                            "It took " + reported_seconds(duration) + "; " + reported_seconds(procedure_->usual_s) +
                                " are usual for this procedure.");
      from(f, "duration_s", {}, duration, procedure_->usual_s);
    }
    if (const auto idle = value("idle_s"); idle && duration > 0 && *idle > limits_.idle_share * duration)
      from(add("idle", {}, FindingSeverity::note,
               "For " + reported_seconds(*idle) + " (" + percent(*idle / duration) + ") neither hand moved."),
           "idle_s", {}, *idle, limits_.idle_share * duration);
    for (ScoreFinding& f : out_.list) {
      if (f.id == "idle") f.kind = "time";
    }
  }

  void unmeasured() {
    const auto put = [&](const std::string& why, const std::string& what) {
      for (auto& [w, list] : out_.not_measured) {
        if (w != why) continue;
        if (std::find(list.begin(), list.end(), what) == list.end()) list.push_back(what);
        return;
      }
      out_.not_measured.push_back({why, {what}});
    };
    for (const Measured& m : score_.values) {
      // A structure that no burr came near has no clearance to tell: that is as it should be.
      if (m.value || (m.is("clearance_mm") && !m.of.empty())) continue;
      put(m.word, std::string(m.row->name) + (m.of.empty() ? "" : " of " + m.of));
    }
    for (const Product::Result& r : score_.items) {
      if (!r.measured) put(r.word, "item '" + r.item->name + "'");
    }
  }

  const Score& score_;
  const StructureMap* structures_;
  const Procedure* procedure_;
  const FindingLimits& limits_;
  Findings& out_;
};

}  // namespace

std::string_view name_of(FindingSeverity severity) {
  static constexpr std::array<std::string_view, 4> kNames{"good", "note", "caution", "serious"};
  return kNames[static_cast<std::size_t>(severity)];
}

std::string unit_text(std::string_view unit) {
  if (unit == "1") return {};
  std::string text(unit);
  for (const auto& [code, shown] : {std::pair{"mm2", "mm²"}, std::pair{"mm3", "mm³"}}) {
    if (unit.starts_with(code)) text.replace(0, 3, shown);
  }
  return text;
}

std::string reported_number(double v) {
  if (!std::isfinite(v) || v == 0) return format_number(v);
  const double size = std::abs(v);
  const double step = size >= 10 ? 1 : size >= 1 ? 0.1 : std::pow(10, std::floor(std::log10(size)) - 1);
  const double rounded = std::round(v / step) * step;
  return format_number(std::round(rounded * 1e6) / 1e6);
}

std::string reported_seconds(double s) {
  if (s < 59.5) return (s < 10 ? reported_number(std::round(s * 1000) / 1000) : format_number(std::round(s))) + " s";
  const auto whole = static_cast<long>(std::llround(s));
  const long h = whole / 3600, min = whole / 60 % 60, rest = whole % 60;
  if (h > 0) return std::to_string(h) + " h " + std::to_string(min) + " min";
  return std::to_string(min) + " min" + (rest > 0 ? " " + std::to_string(rest) + " s" : "");
}

const ScoreFinding* Findings::find(std::string_view id) const {
  const auto at = std::find_if(list.begin(), list.end(), [&](const ScoreFinding& f) { return f.id == id; });
  return at == list.end() ? nullptr : &*at;
}

Findings findings_of(const Score& score, const StructureMap* structures, const Procedure* procedure,
                     const FindingLimits& limits) {
  Findings out;
  Finder(score, structures, procedure, limits, out).all();
  return out;
}

Json findings_json(const Findings& findings, bool with_places) {
  const auto place = [](Vec3 p) {
    Json j = Json::list();
    for (std::size_t a = 0; a < 3; ++a) j.push_back(std::round(p[a] * 1000) / 1000);
    return j;
  };
  Json j{{"osteotome_findings", 1}};
  j["summary"] = findings.summary;
  j["words"] = findings.words;
  j["findings"] = Json::list();
  for (const ScoreFinding& f : findings.list) {
    Json v{{"id", f.id}, {"kind", f.kind}, {"severity", name_of(f.severity)}, {"text", f.text}};
    if (!f.why.empty()) v["why"] = f.why;
    v["metric"] = f.metric;
    if (!f.structure.empty()) v["structure"] = f.structure;
    v["value"] = f.value ? Json(*f.value) : Json();
    v["limit"] = f.limit ? Json(*f.limit) : Json();
    v["unit"] = f.unit;
    v["times_s"] = f.times_s;
    v["at_mm"] = f.at_mm ? place(*f.at_mm) : Json();
    v["places"] = f.places_count;
    v["place_stands_for"] = f.places_each;
    if (with_places) {
      v["places_mm"] = Json::list();
      for (const Vec3 p : f.places_mm) v["places_mm"].push_back(place(p));
    }
    j["findings"].push_back(std::move(v));
  }
  j["not_measured"] = Json::list();
  for (const auto& [why, what] : findings.not_measured) {
    Json v{{"why", why}};
    v["what"] = what;
    j["not_measured"].push_back(std::move(v));
  }
  return j;
}

}  // namespace osteo::inline assessment
