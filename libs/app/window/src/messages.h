// What there is to tell while one works, one at a time: harm, then what stops the work, then information. Private to
// libs/app/window; no ImGui, no screen.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace osteo::inline app {

struct Message {
  enum class Rank { information, hindrance, harm } rank = Rank::information;
  std::string text;
  friend bool operator==(const Message&, const Message&) = default;
};

/// A message that is said is shown for kShownS. One of a higher rank goes before it; it returns for the rest of its
/// time, unless it has waited for kStaleS. Of the same rank the last said takes the place of the one before. What has a
/// cause is shown as long as that lasts, and lets pass what is said in its own rank.
class Messages {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr double kShownS = 4, kStaleS = 10;

  void say(Message message, Clock::time_point now = Clock::now());
  /// What is so now, the most important first: all of it, in each picture.
  void causes(std::vector<Message> so) { causes_ = std::move(so); }
  /// What to show. The time since it was last asked counts for what was shown then.
  [[nodiscard]] std::optional<Message> shown(Clock::time_point now = Clock::now());
  /// The last that was said.
  [[nodiscard]] const std::string& last() const { return last_; }

 private:
  struct Said {
    Message message;
    double left_s = kShownS;
    Clock::time_point since;
  };
  std::vector<Said> said_;  // one of a rank
  std::vector<Message> causes_;
  std::optional<Message> now_;
  Clock::time_point asked_{};
  std::string last_;
};

}  // namespace osteo::inline app
