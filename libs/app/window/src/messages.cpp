#include "messages.h"

#include <algorithm>
#include <utility>

namespace osteo::inline app {

void Messages::say(Message message, Clock::time_point now) {
  last_ = message.text;
  std::erase_if(said_, [&](const Said& s) { return s.message.rank == message.rank; });
  if (!message.text.empty()) said_.push_back({std::move(message), kShownS, now});
}

std::optional<Message> Messages::shown(Clock::time_point now) {
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  for (Said& s : said_) {
    // Shown since it was last asked for; what was said after that has all its time.
    if (now_ == s.message) s.left_s -= seconds(now - std::max(asked_, s.since));
  }
  std::erase_if(said_, [&](const Said& s) { return s.left_s <= 0 || seconds(now - s.since) >= kStaleS; });
  asked_ = now;
  now_.reset();
  for (const Said& s : said_) {
    if (!now_ || s.message.rank > now_->rank) now_ = s.message;
  }
  for (const Message& c : causes_) {
    if (!c.text.empty() && (!now_ || c.rank > now_->rank)) now_ = c;
  }
  return now_;
}

}  // namespace osteo::inline app
