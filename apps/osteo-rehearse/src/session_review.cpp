#include "session_review.h"

#include "osteo/assessment/evidence/findings.h"
#include "osteo/assessment/evidence/timeline.h"

namespace osteo {
namespace {

ReviewFinding::Weight weight_of(FindingSeverity severity) {
  switch (severity) {
    case FindingSeverity::good:
      return ReviewFinding::Weight::good;
    case FindingSeverity::note:
      return ReviewFinding::Weight::note;
    case FindingSeverity::caution:
      return ReviewFinding::Weight::caution;
    case FindingSeverity::serious:
      return ReviewFinding::Weight::serious;
  }
  return ReviewFinding::Weight::note;
}

}  // namespace

SessionReview review_of(const SessionFolder& folder, const Case& the_case, const Anatomy& anatomy,
                        const Procedure* procedure, const Context& context) {
  const SessionReader session(folder.stream(), Damage::keep);
  World begin = world_at_begin(folder, the_case, anatomy, context);
  SessionReview review;
  review.structures = anatomy.structures;
  TimelineKeeper keeper({session.header().rate_hz, anatomy.structures.get(), procedure});
  ScoreDetail detail;
  detail.frame = [&](const EvidenceFrame& f) { keeper.frame(f); };
  const Score score = score_session(session, begin.copy(), anatomy.structures.get(), procedure, nullptr, {},
                                    context.sub(0, 0.6), &detail);
  report_notes(session, keeper);
  const Findings findings = findings_of(score, anatomy.structures.get(), procedure);
  review.summary = findings.summary;
  review.words = findings.words;
  for (const ScoreFinding& f : findings.list)
    review.findings.push_back({weight_of(f.severity), f.text, f.why, f.times_s, f.at_mm, f.places_mm});
  Timeline line = keeper.timeline(detail.voxels);
  review.course.force_n = std::move(line.force_n);
  review.course.distance_mm = std::move(line.distance_mm);
  review.course.seen_mm3 = std::move(line.seen_mm3);
  review.course.hidden_mm3 = std::move(line.hidden_mm3);
  for (const TimelineEvent& e : line.events)
    review.course.events.push_back({e.t_s, e.shown(), e.kind == EventKind::injury || e.kind == EventKind::touch});
  review.player = std::make_unique<SessionPlayer>(session, std::move(begin), context.sub(0.6, 1));
  return review;
}

}  // namespace osteo
