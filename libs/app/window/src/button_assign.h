// Giving a button something to do by pressing it. Private to libs/app/window; no screen.
#pragma once
#include <optional>
#include <string>

#include "keys.h"

namespace osteo::inline app {

class ButtonAssign {
 public:
  /// The next key, pedal or button that goes down is to do it.
  void listen(HandFunction function) { for_ = function; }
  [[nodiscard]] std::optional<HandFunction> listens() const { return for_; }
  void cancel() { for_.reset(); }
  /// A button went down while it listens: Esc gives up, Delete takes all buttons from it. Returns what there is to say:
  /// what the button did before and no longer does, or why it was rejected (then it goes on listening).
  std::string take(int button, HandButtons& buttons);

 private:
  std::optional<HandFunction> for_;
};

/// "drill", "wrist rest": as people read it.
[[nodiscard]] std::string words_of(HandFunction function);

}  // namespace osteo::inline app
