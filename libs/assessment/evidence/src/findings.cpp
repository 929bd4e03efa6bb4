#include "osteo/assessment/evidence/findings.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"

namespace osteo::inline assessment {
namespace {

std::string in(double v, const std::string& unit) {
  const std::string u = unit_text(unit);
  return reported_number(v) + (u.empty() ? "" : " " + u);
}
std::string percent(double share) {
  const double p = 100 * share;
  // What is not all is not told as all, and what is not nothing not as nothing.
  if (p > 0 && p < 1) return tr("less than 1 %");
  if (p < 100 && p > 99) return tr("over 99 %");
  return format_number(std::round(p)) + " %";
}
std::string times(double n) {
  return n == 1 ? tr("once") : n == 2 ? tr("twice") : filled(tr("{n} times"), {{"n", reported_number(n)}});
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
    for (const std::string& w : score_.words) out_.words.push_back(tr(w));
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
    return procedure_ != nullptr && procedure_->enters(structure);
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
      out_.summary.push_back(
          filled(drilling && *drilling > 0 ? tr("The session lasted {time}; for {drilling} of it a burr was drilling.")
                                           : tr("The session lasted {time}; no burr drilled."),
                 {{"time", reported_seconds(*duration)}, {"drilling", reported_seconds(drilling.value_or(0))}}));
    }
    const bool drilled = removed && *removed > 0, cut = sawn && *sawn > 0;
    out_.summary.push_back(filled(drilled && cut ? tr("Burrs took {bone} of bone and saws {sawn}.")
                                  : drilled      ? tr("Burrs took {bone} of bone.")
                                  : cut          ? tr("Saws took {sawn} of bone, burrs none.")
                                                 : tr("No bone was removed."),
                                  {{"bone", in(removed.value_or(0), "mm3")}, {"sawn", in(sawn.value_or(0), "mm3")}}));
    if (score_.procedure.empty() || score_.items.empty()) return;
    const std::size_t left = score_.items.size() - score_.judged();
    out_.summary.push_back(filled(score_.judged() == 0 ? tr("No item of the scale could be judged.")
                                  : left > 0 ? tr("{n} of {all} items of the scale passed; {left} could not be judged.")
                                             : tr("{n} of {all} items of the scale passed."),
                                  {{"n", std::to_string(score_.passed())},
                                   {"all", std::to_string(score_.judged())},
                                   {"left", std::to_string(left)}}));
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
        by == CutBy::saw
            ? Words{"cut", tr("The saw cut through the {structure}: {mm3} of it."),
                    tr("The saw's cut was in contact with the {structure} and removed nothing of it that can be "
                       "measured."),
                    tr("Cut through: it lay in the path of the blade, as far as that was in bone.")}
        : by == CutBy::shaft
            ? Words{"shaft", tr("A shaft went through the {structure}: {mm3} of it."),
                    tr("A shaft was in contact with the {structure} and removed nothing of it that can be measured."),
                    tr("The part of it that lay inside the shaft, on its way.")}
            : Words{"screws", tr("Screws of a plate went through the {structure}: {mm3} of it."),
                    tr("Screws of a plate were in contact with the {structure} and removed nothing of it that can be "
                       "measured."),
                    tr("The part of it that lay inside the screws, as long as they are drawn.")};
    const double mm3 = taken_by(by, name);
    const bool contact = std::any_of(score_.moments.begin(), score_.moments.end(), [&](const Moment& m) {
      return m.what == CutMetric::moment_of(by, true) && m.structure == name;
    });
    if (mm3 <= 0 && !contact) return false;
    ScoreFinding& f = add(
        words.id, name, mm3 > 0 ? FindingSeverity::serious : FindingSeverity::caution,
        filled(mm3 > 0 ? words.through : words.touched, {{"structure", tr(name)}, {"mm3", in(mm3, "mm3")}}), words.why);
    f.kind = mm3 > 0 ? "injury" : "touch";
    from(f, "cut_mm3", name, mm3, 0);
    moments(f, CutMetric::moment_of(by, mm3 <= 0), name);
    return true;
  }

  // What a burr and a saw reached so many times, and took of it or not.
  static const char* reached_text(double burr, double saw, bool took) {
    if (burr > 0 && saw > 0)
      return took
                 ? tr("A rotating burr reached the {structure} {times} and the running saw {sawn}, for {time} in all, "
                      "and took {mm3} of it.")
                 : tr("A rotating burr reached the {structure} {times} and the running saw {sawn}, for {time} in all.");
    if (saw > 0)
      return took ? tr("The running saw reached the {structure} {sawn}, for {time} in all, and took {mm3} of it.")
                  : tr("The running saw reached the {structure} {sawn}, for {time} in all.");
    if (burr > 0)
      return took ? tr("A rotating burr reached the {structure} {times}, for {time} in all, and took {mm3} of it.")
                  : tr("A rotating burr reached the {structure} {times}, for {time} in all.");
    return took ? tr("A rotating burr reached the {structure}, for {time} in all, and took {mm3} of it.")
                : tr("A rotating burr reached the {structure}, for {time} in all.");
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
        const double taken = taken_by(CutBy::burr, name) + taken_by(CutBy::hand_saw, name);
        ScoreFinding& f = add("injury", name, FindingSeverity::serious,
                              filled(reached_text(burr, saw, taken > 0), {{"structure", tr(name)},
                                                                          {"times", times(burr)},
                                                                          {"sawn", times(saw)},
                                                                          {"time", reported_seconds(injured)},
                                                                          {"mm3", in(taken, "mm3")}}),
                              tr("Reached: the tool's surface lay inside the structure's face."));
        from(f, "injured_s", name, injured, 0);
        moments(f, "reached by a rotating burr", name);
        moments(f, "reached by the running saw", name);
        std::sort(f.times_s.begin(), f.times_s.end());
      } else if (n > 0) {
        ScoreFinding& f =
            add("touch", name, FindingSeverity::caution,
                filled(tr("The burr touched the {structure} {times}, for {time}, without turning."),
                       {{"structure", tr(name)}, {"times", times(n)}, {"time", reported_seconds(touched)}}));
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
      ScoreFinding& f = add(
          "saw-clearance", name, FindingSeverity::note,
          filled(tr("The saw's cut passed the {structure} at {mm}."), {{"structure", tr(name)}, {"mm", in(mm, "mm")}}),
          below_text());
      f.kind = "clearance";
      from(f, "saw_clearance_mm", name, mm, limits_.near_miss_mm);
    }
    for (const auto& [name, c] : values("clearance_mm")) {
      if (c <= 0 || c >= limits_.near_miss_mm || value("touches", name).value_or(0) > 0) continue;
      ScoreFinding& f = add(
          "clearance", name, FindingSeverity::note,
          filled(tr("The burr came within {mm} of the {structure}."), {{"structure", tr(name)}, {"mm", in(c, "mm")}}),
          below_text());
      from(f, "clearance_mm", name, c, limits_.near_miss_mm);
    }
    if (any && nearest.second > 0 && !cut) {
      std::string text = filled(nearest.second < 1e8
                                    ? tr("No structure was touched; the burr came nearest to the {structure}, at {mm}.")
                                    : tr("No structure was touched, and no burr came near one."),
                                {{"structure", tr(nearest.first)}, {"mm", in(nearest.second, "mm")}});
      if (by_saw.second < 1e8)
        text += " " + filled(tr("The saw's cuts passed the {structure} at {mm}."),
                             {{"structure", tr(by_saw.first)}, {"mm", in(by_saw.second, "mm")}});
      ScoreFinding& f = add("untouched", {}, FindingSeverity::good, text);
      f.kind = "touch";
      if (nearest.second < 1e8) from(f, "clearance_mm", nearest.first, nearest.second, std::nullopt);
    }
  }

  [[nodiscard]] std::string below_text() const {
    return filled(tr("Reported below {mm} mm."), {{"mm", reported_number(limits_.near_miss_mm)}});
  }

  // Of `near` the first three, the most first.
  static std::string hidden_text(const std::string& mm3, const std::string& share,
                                 const std::vector<std::pair<std::string, double>>& near) {
    const auto part = [&](std::size_t n) { return n < near.size() ? in(near[n].second, "mm3") : std::string(); };
    const auto name = [&](std::size_t n) { return n < near.size() ? tr(near[n].first) : std::string(); };
    const char* const text =
        near.empty()       ? tr("{mm3} of bone ({share}) was removed unseen.")
        : near.size() == 1 ? tr("{mm3} of bone ({share}) was removed unseen, {a} of it within {near} mm of the {one}.")
        : near.size() == 2
            ? tr("{mm3} of bone ({share}) was removed unseen, {a} of it within {near} mm of the {one} and {b} of the "
                 "{two}.")
            : tr("{mm3} of bone ({share}) was removed unseen, {a} of it within {near} mm of the {one}, {b} of the "
                 "{two} and {c} of the {three}.");
    return filled(text, {{"mm3", mm3},
                         {"share", share},
                         {"near", reported_number(kNearMm)},
                         {"a", part(0)},
                         {"one", name(0)},
                         {"b", part(1)},
                         {"two", name(1)},
                         {"c", part(2)},
                         {"three", name(2)}});
  }

  void hidden() {
    const auto mm3 = value("hidden_mm3"), share = value("seen_share");
    if (!mm3 || !share) return;
    if (*mm3 <= 0) {
      from(add("hidden", {}, FindingSeverity::good, tr("All bone that was removed was seen as it went."),
               tr("Seen: a straight line from it to the eye met no bone.")),
           "hidden_mm3", {}, 0, std::nullopt);
      return;
    }
    std::vector<std::pair<std::string, double>> near;
    for (const auto& v : values("hidden_near_mm3")) {
      if (v.second > 0 && !to_be_opened(v.first)) near.push_back(v);
    }
    const bool danger = !near.empty() && near.front().second >= limits_.hidden_near_mm3;
    ScoreFinding& f =
        add("hidden", {}, danger || *share < limits_.seen_well ? FindingSeverity::caution : FindingSeverity::good,
            hidden_text(in(*mm3, "mm3"), percent(1 - *share), near),
            tr("Unseen: bone lay between it and the eye as it went; voxels in touch with the burr are left out."));
    from(f, "hidden_mm3", {}, *mm3, std::nullopt);
    std::vector<Vec3> all, close;
    for (const auto& [name, v] : score_.hidden) {
      all.push_back(v.own_mm);
      if (structures_ == nullptr) continue;
      const StructureMap::Answer a = structures_->at_risk(v.own_mm);
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
              filled(most > 0 ? tr("Near the {structure} the burr pressed harder than the {limit} that the procedure "
                                   "allows there: {most} was seen.")
                              : tr("Near the {structure} the burr pressed harder than the {limit} that the procedure "
                                   "allows there."),
                     {{"structure", tr(name)}, {"limit", in(limit, "N")}, {"most", in(most, "N")}}),
              filled(tr("Impulse above the limit: {impulse}."), {{"impulse", in(ns, "N s")}}));
      from(f, "excess_force_ns", name, ns, 0);
      moments(f, "pressed too hard near it", name);
    }
    const auto band = [&](MetricName metric, const char* kind, const char* text, const char* what) {
      for (const auto& [name, share] : values(metric)) {
        if (share <= limits_.above_band_share || to_be_opened(name)) continue;
        ScoreFinding& f = add(kind, name, FindingSeverity::caution,
                              filled(text, {{"share", percent(share)}, {"structure", tr(name)}}),
                              tr("At the same distance; by chance it would be 10 %."));
        f.id = std::string(kind) + "-band-" + slug(name);
        from(f, metric, name, share, limits_.above_band_share);
        if (what[0] != 0) moments(f, what, name);
      }
    };
    band("force_above_band_share", "force",
         tr("{share} of the drilling near the {structure} was pressed harder than nine in ten moments of the "
            "reference's "
            "experts."),
         "pressed harder than experts do there");
    band("speed_above_band_share", "speed",
         tr("{share} of the drilling near the {structure} was faster than nine in ten moments of the reference's "
            "experts."),
         "");
    if (const auto peak = value("force_peak_n")) {
      const auto p95 = value("force_p95_n"), middle = value("force_median_n");
      ScoreFinding& f = add(
          "force-peak", {}, FindingSeverity::note,
          filled(
              middle && p95 ? tr("The hardest press was {peak}; the middle of all was {middle}, and "
                                 "5 % were above {p95}.")
              : middle      ? tr("The hardest press was {peak}; the middle of all was {middle}.")
              : p95         ? tr("The hardest press was {peak}, and 5 % were above {p95}.")
                            : tr("The hardest press was {peak}."),
              {{"peak", in(*peak, "N")}, {"middle", in(middle.value_or(0), "N")}, {"p95", in(p95.value_or(0), "N")}}));
      f.kind = "force";
      from(f, "force_peak_n", {}, *peak, std::nullopt);
      moments(f, "hardest press", {});
    }
  }

  void instruments() {
    if (const auto share = value("burr_choice_share")) {
      if (*share < 1) {
        from(add("instrument", {}, FindingSeverity::caution,
                 filled(tr("For {share} of the drilling where the procedure restricts burrs, another was in the hand."),
                        {{"share", percent(1 - *share)}})),
             "burr_choice_share", {}, *share, 1);
      } else {
        from(add("instrument", {}, FindingSeverity::good,
                 tr("Where the procedure restricts burrs, only allowed ones were used.")),
             "burr_choice_share", {}, *share, 1);
      }
    }
    if (const auto wet = value("irrigation_share"); wet && *wet < 1 - limits_.dry_share) {
      from(add("water", {}, FindingSeverity::note,
               *wet > 0 ? filled(tr("{share} of the drilling was without water."), {{"share", percent(1 - *wet)}})
                        : tr("No water was used while drilling."),
               tr("Water cools bone; burrs heat it.")),
           "irrigation_share", {}, *wet, 1 - limits_.dry_share);
    }
  }

  void regions() {
    for (const auto& [name, mm3] : values("forbidden_mm3")) {
      if (mm3 <= 0) continue;
      from(add("region", name, FindingSeverity::caution,
               filled(tr("{mm3} of bone is gone that should have stayed: {region}."),
                      {{"mm3", in(mm3, "mm3")}, {"region", name}})),
           "forbidden_mm3", name, mm3, 0);
      out_.list.back().structure.clear();
    }
    for (const auto& [name, share] : values("target_share")) {
      from(add("region", name, FindingSeverity::note,
               filled(tr("{share} of the bone that was to be removed is gone: {region}."),
                      {{"share", percent(share)}, {"region", name}})),
           "target_share", name, share, std::nullopt);
      out_.list.back().structure.clear();
    }
    if (const auto r = value("region_per_voxel")) {
      from(add("region-reference", {}, *r >= 0 ? FindingSeverity::good : FindingSeverity::note,
               *r >= 0
                   ? tr("What was removed is more like what the reference's experts took than what its novices took.")
                   : tr("What was removed is more like what the reference's novices took than what its experts took.")),
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
                            filled(r.pass ? tr("{item}: passed, {how}.") : tr("{item}: not passed, {how}."),
                                   {{"item", capital(r.item->name)}, {"how", reported_item(r)}}),
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
    const std::initializer_list<Place> places{{"value", notify(r.value)}, {"threshold", notify(r.threshold)}};
    switch (r.item->kind) {
      case ItemKind::exposed:
        return filled(tr("{value} of it is laid open, at least {threshold} is asked"), places);
      case ItemKind::not_violated:
        if (r.value > 0) return filled(tr("{value} of bone within it is gone"), places);
        return r.pass ? tr("no bone within it is gone")
                      : tr("no bone within it is gone, but a running burr or saw reached into it");
      case ItemKind::no_hole:
        return filled(tr("the largest bare part has {value}, below {threshold} is asked"), places);
      case ItemKind::no_cells_left:
        return filled(tr("{value} of the cells near it are left, at most {threshold} is asked"), places);
      case ItemKind::no_overhang:
        return filled(tr("{value} of the wall can be seen, at least {threshold} is asked"), places);
      case ItemKind::thinned:
        return filled(tr("{value} of bone is left over it, at most {threshold} is asked"), places);
      case ItemKind::sharp_angle:
        return filled(tr("a ball of {value} fits into what is left, at most {threshold} is asked"), places);
      case ItemKind::followed:
        return filled(tr("{value} of its length is shown, at least {threshold} is asked"), places);
      case ItemKind::margin:
        return filled(tr("it ends {value} off, at most {threshold} is asked"), places);
      case ItemKind::pieces:
      case ItemKind::fixed:
        break;
    }
    return filled(
        tr_n("{value}, at least {threshold} is asked", "{value}, at least {threshold} are asked", r.threshold),
        {{"value", reported_number(r.value)}, {"threshold", reported_number(r.threshold)}});
  }

  void time() {
    const double duration = value("duration_s").value_or(0);
    if (const auto lost = value("lost_s"); lost && *lost > 0)
      from(add("lost", {}, FindingSeverity::caution,
               filled(tr("{time} of the session were not recorded."), {{"time", reported_seconds(*lost)}}),
               tr("What is said here is of the rest.")),
           "lost_s", {}, *lost, 0);
    if (procedure_ != nullptr && procedure_->usual_s > 0 && duration > procedure_->usual_s) {
      ScoreFinding& f =
          add("time", {}, FindingSeverity::note,
              filled(tr("It took {time}; {usual} are usual for this procedure."),
                     {{"time", reported_seconds(duration)}, {"usual", reported_seconds(procedure_->usual_s)}}));
      from(f, "duration_s", {}, duration, procedure_->usual_s);
    }
    if (const auto idle = value("idle_s"); idle && duration > 0 && *idle > limits_.idle_share * duration)
      from(add("idle", {}, FindingSeverity::note,
               filled(tr("For {time} ({share}) neither hand moved."),
                      {{"time", reported_seconds(*idle)}, {"share", percent(*idle / duration)}})),
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
      put(tr(m.word), m.of.empty() ? std::string(m.row->name)
                                   : filled(tr("{metric} of {structure}"),
                                            {{"metric", std::string(m.row->name)}, {"structure", tr(m.of)}}));
    }
    for (const Product::Result& r : score_.items) {
      if (!r.measured) put(tr(r.word), filled(tr("item '{name}'"), {{"name", r.item->name}}));
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
  return shown_figures(format_number(std::round(rounded * 1e6) / 1e6));
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
