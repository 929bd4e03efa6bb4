#include "osteo/core/base/context.h"

#include "osteo/core/base/error.h"

namespace osteo {

struct Context::Shared {
  std::mutex mutex;
  ProgressSink progress;
  LogSink log;
  const std::atomic<bool>* cancel = nullptr;
  Report report;
};

Context::Context() : shared_(std::make_shared<Shared>()) {}

void Context::on_progress(ProgressSink sink) {
  shared_->progress = std::move(sink);
}
void Context::on_log(LogSink sink) {
  shared_->log = std::move(sink);
}
void Context::set_cancel_flag(const std::atomic<bool>* flag) {
  shared_->cancel = flag;
}

bool Context::cancelled() const noexcept {
  return shared_->cancel != nullptr && shared_->cancel->load(std::memory_order_relaxed);
}

void Context::check_cancelled() const {
  if (cancelled()) throw Error(ExitCode::cancelled, "cancelled");
}

void Context::progress(double fraction, std::string_view activity) const {
  check_cancelled();
  if (!shared_->progress) return;
  const std::lock_guard lock(shared_->mutex);
  shared_->progress(begin_ + fraction * (end_ - begin_), activity);
}

void Context::info(std::string_view message) const {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->log) shared_->log(LogLevel::info, message);
}

void Context::warn(std::string_view message) const {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->log) shared_->log(LogLevel::warning, message);
}

void Context::report(std::string_view key, ReportValue value) const {
  const std::lock_guard lock(shared_->mutex);
  shared_->report.emplace_back(std::string(key), std::move(value));
}

Report Context::take_report() const {
  const std::lock_guard lock(shared_->mutex);
  return std::exchange(shared_->report, {});
}

Context Context::sub(double begin, double end) const {
  Context child = *this;
  child.begin_ = begin_ + begin * (end_ - begin_);
  child.end_ = begin_ + end * (end_ - begin_);
  return child;
}

}  // namespace osteo
