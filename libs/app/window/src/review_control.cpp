#include "review_control.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "osteo/core/base/error.h"

namespace osteo::inline app {

std::vector<std::size_t> shown_findings(const std::vector<ReviewFinding>& findings) {
  std::vector<std::size_t> shown;
  for (std::size_t n = 0; n < findings.size() && shown.size() < kShownFindings; ++n) {
    if (findings[n].weight != ReviewFinding::Weight::note) shown.push_back(n);
  }
  return shown;
}

bool serious(const std::vector<ReviewFinding>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const ReviewFinding& f) {
    return f.weight == ReviewFinding::Weight::caution || f.weight == ReviewFinding::Weight::serious;
  });
}

void ReviewControl::present() {
  if (!review_ || chosen_ >= 0 || !serious(review_->findings)) return;
  chosen_ = static_cast<int>(shown_findings(review_->findings)[0]);
  places_new_ = true;
  look_ = review_->findings[static_cast<std::size_t>(chosen_)].at_mm;
}

void ReviewControl::begin(const Make& make) {
  end();
  stop_ = false;
  fraction_ = 0;
  state_ = State::making;
  Context context;
  context.set_cancel_flag(&stop_);
  context.on_progress([this](double f, std::string_view) { fraction_ = f; });
  making_ = std::async(std::launch::async, [make, context] { return make(context); });
}

void ReviewControl::end() {
  stop_ = true;
  if (making_.valid()) {
    try {
      static_cast<void>(making_.get());
    } catch (const std::exception&) {  // nobody wants it any more
    }
  }
  review_.reset();
  failure_.clear();
  state_ = State::none;
  shown_ = playing_ = moved_ = false;
  places_new_ = chosen_ >= 0;
  chosen_ = -1;
  look_.reset();
}

ReviewControl::State ReviewControl::poll() {
  if (state_ != State::making || making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return state_;
  try {
    review_ = making_.get();
    state_ = State::ready;
  } catch (const std::exception& e) {
    failure_ = e.what();
    state_ = State::failed;
  }
  return state_;
}

void ReviewControl::show(bool on) {
  shown_ = on;
  if (!on) playing_ = false;
}

void ReviewControl::go_to(double t_s) {
  if (!review_) return;
  const double before = now_s();
  review_->player->go_to(t_s);
  moved_ = moved_ || now_s() != before;
}

void ReviewControl::play(bool on) {
  if (!review_) return;
  if (on && now_s() >= review_->player->end_s()) go_to(0);
  playing_ = on;
  if (on) shown_ = true;
}

void ReviewControl::change_speed(int steps) {
  speed_ =
      static_cast<std::size_t>(std::clamp(static_cast<int>(speed_) + steps, 0, static_cast<int>(kSpeeds.size()) - 1));
}

void ReviewControl::advance(double seconds) {
  if (!playing_ || !review_) return;
  go_to(now_s() + seconds * speed());
  if (now_s() >= review_->player->end_s()) playing_ = false;
}

bool ReviewControl::key(const Keyboard::Press& press) {
  if (press.command == Command::timeline) {
    show(!shown_);
    return true;
  }
  if (!shown()) return false;
  switch (press.command) {
    case Command::earlier:
    case Command::later:
      playing_ = false;
      go_to(now_s() + (press.command == Command::later ? 1 : -1) * (press.shift ? kLongStepS : kStepS));
      return true;
    case Command::back:
      change_speed(1);
      return true;
    case Command::deeper:
      change_speed(-1);
      return true;
    case Command::drill:
      play(!playing_);
      return true;
    default:
      return false;
  }
}

void ReviewControl::choose(int finding) {
  if (!review_) return;
  const auto& all = review_->findings;
  if (finding < 0 || finding >= static_cast<int>(all.size())) {
    places_new_ = chosen_ >= 0;
    chosen_ = -1;
    return;
  }
  const ReviewFinding& f = all[static_cast<std::size_t>(finding)];
  // Chosen again: its next moment.
  moment_ = finding == chosen_ ? moment_ + 1 : 0;
  places_new_ = places_new_ || finding != chosen_;
  chosen_ = finding;
  playing_ = false;
  if (!f.times_s.empty()) {
    shown_ = true;
    go_to(f.times_s[moment_ % f.times_s.size()]);
  }
  look_ = f.at_mm;
}

std::optional<std::vector<Vec3>> ReviewControl::take_places() {
  if (!std::exchange(places_new_, false)) return std::nullopt;
  return chosen_ < 0 || !review_ ? std::vector<Vec3>{} : review_->findings[static_cast<std::size_t>(chosen_)].places_mm;
}

}  // namespace osteo::inline app
