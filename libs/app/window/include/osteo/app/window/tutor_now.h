// What the window shows of who leads the hand, and of who takes part from elsewhere: plain values, asked for with each
// picture.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace osteo::inline app {

struct TutorNow {
  /// Another program that takes part.
  struct Link {
    std::string who;     ///< as `hands`: in English, and in the language where it is shown
    bool heard = false;  ///< lately
    double rtt_ms = 0, offset_ms = 0, drift_ppm = 0;
    double lost = 0;       ///< share of packets that did not come
    double behind_s = 0;   ///< of the session's ticks
    bool differs = false;  ///< its bone is another
  };
  /// Of the procedure, with its items that pass now; all of them: it is done. None of its own: it cannot be judged.
  struct Step {
    std::string name;
    std::size_t items = 0, passed = 0;
  };
  std::string title;        ///< in the language; empty: nobody teaches, and nothing is shown
  bool teaches = false;     ///< who sits here teaches or watches: people, steps and harm have a column of their own
  std::string procedure;    ///< its name; empty: none
  std::vector<Step> steps;  ///< of it
  std::string
      invitation;       ///< what others need to join: address and code; shown, and written nowhere. Empty: nobody can
  std::string trouble;  ///< for people; empty: all well
  std::vector<Link> links;
  std::vector<std::string> hands;  ///< who moves them, in the order they are shown, the own first; others are drawn in
                                   ///< a colour of their own
  bool ghosts = false;             ///< and these faintly: they are no hands of today
  bool leads = false;              ///< the own hand may be led
  bool guiding = false;            ///< and it is not switched off
  double pull = 0;                 ///< of that, now: 0 to 1
  double apart_mm = -1;            ///< between the own hand and who leads it; negative: not known
  bool begin_again = false;        ///< what is shown is worth nothing any more: another session, or another bone
};

}  // namespace osteo::inline app
