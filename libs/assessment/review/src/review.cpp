#include "osteo/assessment/review/review.h"

#include <algorithm>
#include <cmath>

#include "osteo/assessment/evidence/frames.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/recording/session_reader.h"
#include "pictures.h"

namespace osteo::inline assessment {
namespace {

struct Reported {
  Score score;
  ScoreDetail detail;
};

// The scene that a session was recorded on, opened.
struct Opened {
  SessionFolder folder;
  Case the_case;
  SessionReader session;
  Anatomy anatomy;

  Opened(const fs::path& path, const fs::path& case_folder, const Procedure* procedure, const Context& context)
      : folder(open_session_folder(path, case_folder)),
        the_case(load_case(folder.case_folder)),
        session(folder.stream(), Damage::keep),
        anatomy(anatomy_without_hu(procedure, context)) {}
  [[nodiscard]] World begin(const Context& context) const { return world_at_begin(folder, the_case, anatomy, context); }

 private:
  [[nodiscard]] Anatomy anatomy_without_hu(const Procedure* procedure, const Context& context) const {
    HapticSetup setup;
    setup.hardness = false;
    setup.opened = procedure != nullptr ? procedure->opened() : session.header().haptics.opened;
    return anatomy_of(the_case, setup, context);
  }
};

Reported reported_of(const Opened& o, World begin, const Procedure* procedure, const Reference* reference,
                     const std::string& subject, const Context& context) {
  Reported t;
  t.score = score_session(o.session, std::move(begin), o.anatomy.structures.get(), procedure, reference, subject,
                          context, &t.detail);
  return t;
}

// What is shown beside others' sessions, in this order.
constexpr MetricName kCompared[] = {"items_passed", "seen_share",   "hidden_mm3",     "hidden_near_mm3", "touches",
                                    "injured_s",    "clearance_mm", "force_p95_n",    "force_peak_n",    "duration_s",
                                    "drilling_s",   "removed_mm3",  "rate_mm3_per_s", "path_mm"};

// Values of a metric as one: those of several structures are added up, of the least distance the least is taken.
std::optional<double> one_value(const Score& score, const MetricRow& row) {
  std::optional<double> v;
  for (const Measured& m : score.values) {
    if (m.row->name != row.name || !m.value) continue;
    if (!v) {
      v = m.value;
    } else if (m.is("clearance_mm")) {
      v = std::min(*v, *m.value);
    } else if (row.name.ends_with("_share")) {
      v = std::max(*v, *m.value);
    } else {
      *v += *m.value;
    }
  }
  return v;
}

std::vector<IsotonicQuantile::Point> quantile(const std::vector<IsotonicQuantile::Point>& points, double q) {
  constexpr std::size_t kMin = 100;  // a second of drilling, as for bands of the score
  if (points.size() < kMin) return {};
  return IsotonicQuantile(points, q).steps();
}

std::vector<ForceProfile> profiles_of(const ScoreDetail& detail, const Reference* reference, const std::string& subject,
                                      const StructureMap* structures, const Procedure* procedure) {
  std::vector<ForceProfile> all;
  if (structures == nullptr) return all;
  for (const auto& [value, samples] : detail.near) {
    ForceProfile p;
    p.structure = structures->name_of(value);
    if (procedure != nullptr && procedure->enters(p.structure)) continue;
    p.drilled_s = static_cast<double>(samples.size()) / 100;
    std::vector<IsotonicQuantile::Point> mine, theirs;
    for (const NearMetric::Sample& v : samples)
      mine.push_back({static_cast<double>(v.distance_mm), static_cast<double>(v.force_n)});
    for (std::size_t n = 0; reference != nullptr && n < reference->sessions.size(); ++n) {
      const Reference::One& o = reference->sessions[n];
      if (o.group != ReferenceGroup::expert || (!subject.empty() && o.subject == subject)) continue;
      const auto near = o.near.find(value);
      if (near == o.near.end()) continue;
      for (const NearMetric::Sample& v : near->second)
        theirs.push_back({static_cast<double>(v.distance_mm), static_cast<double>(v.force_n)});
    }
    p.middle = quantile(mine, 0.5);
    p.most = quantile(mine, 0.9);
    p.experts_middle = quantile(theirs, 0.5);
    p.experts_most = quantile(theirs, 0.9);
    const std::size_t keep = std::min(ForceProfile::kMaxSamples, samples.size());
    for (std::size_t n = 0; n < keep; ++n) {
      const NearMetric::Sample& v = samples[n * samples.size() / keep];
      p.samples.push_back({v.distance_mm, v.force_n});
    }
    if (!p.most.empty()) all.push_back(std::move(p));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const ForceProfile& a, const ForceProfile& b) { return a.drilled_s > b.drilled_s; });
  return all;
}

// Whether forces led the hand.
struct HandWasLed {
  bool curve = false, guide = false;
  void frame(const EvidenceFrame& f) {
    for (const TickRecord& t : f.ticks) curve = curve || (t.flags & kCurveHeld) != 0;
    for (const SceneAction& a : f.actions) guide = guide || name_of(a) == "guide";
  }
};

std::vector<std::string> labels_of(const Opened& o, const HandWasLed& seen) {
  std::vector<std::string> all;
  if (std::string words = simulated_text(o.session); !words.empty()) {
    all.push_back(std::move(words));
  } else if (output_exists(o.folder.folder / "strokes.json")) {
    all.emplace_back(tr("Scripted: a file of strokes moved the hand, no person did."));
  }
  if (!o.folder.guided.empty() || seen.curve || seen.guide)
    all.push_back(
        filled(tr("Guided: {how}. What was done then is not the hand's alone."),
               {{"how", o.folder.guided.empty() ? tr("forces that led the hand were on at times") : o.folder.guided}}));
  if (!o.session.outline().end)
    all.emplace_back(tr("Cut short: the program was stopped before the session was closed."));
  return all;
}

}  // namespace

Review make_review(const ReviewRequest& q, const Context& context) {
  Review r;
  if (q.procedure) r.of_procedure = std::make_shared<const Procedure>(*q.procedure);
  const Procedure* const procedure = r.of_procedure.get();
  const Opened o(q.session, q.case_folder, procedure, context);
  const StructureMap* const structures = o.anatomy.structures.get();
  World begin = o.begin(context);
  r.damaged = o.session.outline().damaged();

  // Others first: the reference is what this one is held against.
  std::optional<Reference> reference;
  struct Other {
    Score score;
    enum class Of { earlier, expert, novice } of;
  };
  std::vector<Other> others;
  if (!q.reference.empty()) {
    reference.emplace();
    const std::vector<ReferenceSession> list = load_reference(q.reference);
    for (std::size_t n = 0; n < list.size(); ++n) {
      context.progress(0.3 * static_cast<double>(n) / static_cast<double>(list.size()), "reading the reference");
      const Opened one(q.reference / list[n].session, o.folder.case_folder, procedure, context);
      World its = one.begin(context);
      if (its.hash() != o.session.header().bone_hash || one.session.header().bone_hash != o.session.header().bone_hash)
        throw Error(ExitCode::usage,
                    "session '" + list[n].session + "' of the reference was recorded on another bone than this one",
                    "a reference is of one case: leave it out of reference.json");
      Reported t = reported_of(one, std::move(its), procedure, nullptr, {}, Context());
      reference->sessions.push_back(
          {list[n].subject, list[n].group, std::move(t.detail.removed), std::move(t.detail.near)});
      if (q.subject.empty() || list[n].subject != q.subject)
        others.push_back(
            {std::move(t.score), list[n].group == ReferenceGroup::expert ? Other::Of::expert : Other::Of::novice});
    }
  }
  for (const fs::path& path : q.earlier) {
    context.progress(0.3, "reading earlier sessions");
    const Opened one(path, {}, procedure, context);
    others.push_back(
        {reported_of(one, one.begin(context), procedure, nullptr, {}, Context()).score, Other::Of::earlier});
  }

  TimelineKeeper keeper({o.session.header().rate_hz, structures, procedure});
  report_notes(o.session, keeper);
  HandWasLed led;
  ScoreDetail detail;
  detail.frame = [&](const EvidenceFrame& f) {
    keeper.frame(f);
    led.frame(f);
  };
  const World first = begin.copy();
  r.score = score_session(o.session, std::move(begin), structures, procedure, reference ? &*reference : nullptr,
                          q.subject, context.sub(0.35, 0.7), &detail);
  if (!o.session.header().haptics.structures.empty() && structures != nullptr &&
      o.session.header().haptics.structures != structures->hash())
    r.score.words.emplace_back(
        "the case's structures are not those that the session watched: they are measured as the case has them now");
  r.procedure = r.score.procedure;
  r.shown.labels = labels_of(o, led);
  r.shown.findings = findings_of(r.score, structures, procedure);
  {
    const EnglishHere files;
    r.labels = labels_of(o, led);
    r.findings = findings_of(r.score, structures, procedure);
  }
  r.timeline = keeper.timeline(detail.voxels);
  for (const auto& [name, v] : detail.voxels) {
    (v.seen == VisibilityMetric::Seen::seen     ? r.seen_mm3
     : v.seen == VisibilityMetric::Seen::hidden ? r.hidden_mm3
                                                : r.unknown_mm3) += static_cast<double>(v.mm3);
  }
  r.profiles = profiles_of(detail, reference ? &*reference : nullptr, q.subject, structures, procedure);
  for (const Other& other : others)
    ++(other.of == Other::Of::earlier ? r.earlier : other.of == Other::Of::expert ? r.experts : r.novices);
  if (!others.empty()) {
    for (const MetricName name : kCompared) {
      Comparison c{&name.row(), std::nullopt, {}, {}, {}};
      c.value = one_value(r.score, *c.row);
      bool any = false;
      for (const Other& other : others) {
        const auto v = one_value(other.score, *c.row);
        any = any || v;
        if (other.of == Other::Of::earlier) {
          c.earlier.push_back(v);
        } else if (v) {
          (other.of == Other::Of::expert ? c.experts : c.novices).push_back(*v);
        }
      }
      if (any || c.value) r.comparison.push_back(std::move(c));
    }
  }
  if (!q.pictures) {
    constexpr const char* kNone = tr_later("pictures and the view in 3D were not asked for");
    r.left_out.emplace_back(kNone);
    r.shown.left_out.emplace_back(tr(kNone));
  } else {
    context.progress(0.72, "drawing");
    std::size_t unreadable = 0;
    const std::vector<CameraPose> cameras = cameras_of(o.session, unreadable);
    review::draw_pictures(r, first, *detail.end, structures, detail, cameras, context.sub(0.72, 1));
  }
  context.progress(1);
  return r;
}

}  // namespace osteo::inline assessment
