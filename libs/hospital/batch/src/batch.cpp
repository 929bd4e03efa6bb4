#include "osteo/hospital/batch/batch.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "record.h"

namespace osteo::inline hospital {
namespace {

constexpr double kWait = 0.5;  // seconds: how long the wish to stop may go unseen

// Held for the life of a run: alone in OUT, or beside others that each do cases of their own.
class OutLock {
 public:
  OutLock(const fs::path& out, bool shared) {
    const fs::path file = out / "batch.json";
    fd_ = ::open(file.c_str(), O_RDONLY);
    if (fd_ < 0) throw Error(ExitCode::cannot_write, "'" + file.string() + "': " + std::strerror(errno));
    // A file system without locks (some of a network's) is taken as it is: the cases themselves reject two writers.
    if (::flock(fd_, (shared ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(fd_);
      throw Error(ExitCode::cannot_write, "another batch is at work in '" + out.string() + "'",
                  "wait for it, or give another folder");
    }
  }
  ~OutLock() { ::close(fd_); }
  OutLock(const OutLock&) = delete;
  OutLock& operator=(const OutLock&) = delete;

 private:
  int fd_ = -1;
};

void prepare_folder(const fs::path& out) {
  const fs::path mark = out / "batch.json";
  if (!output_exists(mark)) {
    std::error_code ec;
    if (fs::exists(out, ec) && (!fs::is_directory(out, ec) || !fs::is_empty(out, ec)))
      throw Error(ExitCode::cannot_write, "'" + out.string() + "' holds something that is no batch",
                  "give another folder, or an empty one");
    make_output_folder(out);
    write_file(mark, Json{{"osteotome_batch", 1}}.dump() + "\n");
  }
  make_output_folder(out / "cases");
  make_output_folder(out / "records");
}

// Sizes and times of what the source is, without reading it; of a folder, of all that is in it.
std::string looks_of(const fs::path& source) {
  std::error_code ec;
  const auto one = [](const fs::path& p) {
    std::error_code e;
    const auto size = fs::is_regular_file(p, e) ? fs::file_size(p, e) : 0;
    const auto time = fs::last_write_time(p, e).time_since_epoch().count();
    return std::to_string(size) + "@" + std::to_string(time) + ";";
  };
  if (!fs::exists(source, ec)) return "nothing";
  if (!fs::is_directory(source, ec)) return one(source);
  std::vector<std::string> all;
  for (auto it = fs::recursive_directory_iterator(source, fs::directory_options::skip_permission_denied, ec);
       !ec && it != fs::recursive_directory_iterator(); it.increment(ec))
    all.push_back(it->path().lexically_relative(source).string() + "=" + one(it->path()));
  std::sort(all.begin(), all.end());
  std::string text;
  for (const std::string& a : all) text += a;
  return text;
}

std::string key_of(const BatchCase& row, const std::string& common) {
  std::string text = common + "\n" + row.source.string() + "\n" + looks_of(row.source) + "\n";
  for (const auto& [name, value] : row.settings) text += name + "=" + value + "\n";
  return hash_text(text);
}

double free_mb(const fs::path& out) {
  std::error_code ec;
  const auto space = fs::space(out, ec);
  return ec ? std::numeric_limits<double>::infinity() : static_cast<double>(space.available) / 1e6;
}

std::string duration(double seconds) {
  if (seconds < 90) return std::to_string(static_cast<int>(std::ceil(seconds))) + " s";
  if (seconds < 5400) return std::to_string(static_cast<int>(std::round(seconds / 60))) + " min";
  return format_number(std::round(seconds / 360) / 10) + " h";
}

class Batch {
 public:
  Batch(const std::vector<BatchCase>& table, const BatchOptions& options, const CaseWork& work, const Context& context)
      : table_(table), options_(options), work_(work), context_(context), limits_{options.memory_mb, options.seconds} {}

  BatchResult run() {
    for (const std::string& code : options_.only) {
      if (std::none_of(table_.begin(), table_.end(), [&](const BatchCase& c) { return c.code == code; }))
        throw Error(ExitCode::usage, "the table has no case '" + code + "'");
    }
    prepare_folder(options_.out);
    const OutLock lock(options_.out, !options_.only.empty());
    std::size_t untouched = 0;
    for (std::size_t i = 0; i < table_.size(); ++i) {
      if (!options_.only.empty() && !options_.only.contains(table_[i].code)) continue;
      context_.check_cancelled();
      if (is_settled(table_[i]))
        ++untouched;
      else
        queue_.push_back({i, 1});
    }
    to_do_ = queue_.size();
    start_ = std::chrono::steady_clock::now();
    std::string stopped = work_off();
    const bool cancelled = context_.cancelled();
    BatchResult result;
    for (const BatchCase& c : table_) {
      if (options_.only.empty() || options_.only.contains(c.code)) count(known_record(options_.out, c.code), result);
    }
    try {
      if (options_.only.empty()) static_cast<void>(write_batch_report(table_, options_.out));
    } catch (const Error& e) {
      if (stopped.empty()) throw;  // else the disk is known to be full
      context_.warn(e.what());
    }
    result.untouched = untouched;
    result.stopped = std::move(stopped);
    if (cancelled)
      throw Error(ExitCode::cancelled, "stopped: " + progress_text(), "the same line again goes on from here");
    return result;
  }

 private:
  struct Try {
    std::size_t index;
    int number;
  };

  // Done as its row has it now, or ended before for a reason that would come again.
  [[nodiscard]] bool is_settled(const BatchCase& row) const {
    const auto record = known_record(options_.out, row.code);
    if (!record || record->key != key_of(row, options_.key)) return false;
    if (record->state == CaseState::done) {
      std::error_code ec;
      return fs::is_directory(case_folder(options_.out, row.code), ec);
    }
    return !options_.retry_failed && (record->state == CaseState::refused || record->state == CaseState::failed);
  }

  // Why it stopped before the end, or nothing.
  std::string work_off() {
    std::string stopped;
    while (!queue_.empty() || children_.running() > 0) {
      if (context_.cancelled() && stopped.empty()) {
        stopped = "it was asked to";
        queue_.clear();
        children_.stop();
      }
      while (!queue_.empty() && children_.running() < static_cast<std::size_t>(std::max(1, options_.jobs)) &&
             !context_.cancelled()) {
        if (const double mb = free_mb(options_.out); mb < options_.keep_free_mb) {
          stopped = "only " + format_number(std::round(mb)) + " MB are free where the cases go";
          queue_.clear();
          break;
        }
        begin(queue_.front());
        queue_.pop_front();
      }
      try {
        if (const auto end = children_.wait(kWait)) finish(*end);
      } catch (const Error& e) {
        stopped = e.what();  // what cannot be recorded need not be begun
        queue_.clear();
        children_.stop();
      }
      show_progress();
    }
    return stopped;
  }

  void begin(const Try& t) {
    const BatchCase& row = table_[t.index];
    std::error_code ec;
    fs::remove(record_file(options_.out, row.code), ec);
    running_[t.index] = {t.number, key_of(row, options_.key)};
    const fs::path folder = case_folder(options_.out, row.code);
    children_.start(
        t.index, [&] { return work_(row, folder); }, limits_);
  }

  void finish(const ChildEnd& end) {
    const BatchCase& row = table_[end.id];
    const auto [number, key] = running_.at(end.id);
    running_.erase(end.id);
    const fs::path folder = case_folder(options_.out, row.code);
    CaseRecord record = record_of(row, key, end, number, limits_, folder);
    record.program = options_.program;
    if (record.state == CaseState::waiting || (context_.cancelled() && record.state != CaseState::done))
      return;  // interrupted
    if (record.state == CaseState::resources && number <= options_.retries) {
      context_.info(row.code + ": " + record.why + "; tried again");
      queue_.push_back({end.id, number + 1});
      return;
    }
    write_file(record_file(options_.out, row.code), record.to_json().dump(2) + "\n");
    ++ended_;
    if (record.state == CaseState::done) return;
    ++bad_;
    context_.warn(row.code + ": " + std::string(state_name(record.state)) + ": " + record.why);
  }

  [[nodiscard]] std::string progress_text() const {
    return std::to_string(ended_) + " of " + std::to_string(to_do_) + " cases" +
           (bad_ > 0 ? ", " + std::to_string(bad_) + " not done" : "");
  }
  void show_progress() const {
    const double ran = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    std::string left;
    if (ended_ > 0 && ended_ < to_do_)
      left = ", about " + duration(ran / static_cast<double>(ended_) * static_cast<double>(to_do_ - ended_)) + " left";
    // Cancelling is this class' own business: a running case is to be asked first.
    if (!context_.cancelled()) {
      try {
        context_.progress(to_do_ == 0 ? 1.0 : static_cast<double>(ended_) / static_cast<double>(to_do_),
                          progress_text() + left);
      } catch (const Error&) {
      }
    }
  }

  const std::vector<BatchCase>& table_;
  const BatchOptions& options_;
  const CaseWork& work_;
  const Context& context_;
  ChildLimits limits_;
  std::deque<Try> queue_;
  std::map<std::size_t, std::pair<int, std::string>> running_;  // index -> number of the try, key
  Children children_;
  std::size_t to_do_ = 0, ended_ = 0, bad_ = 0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

BatchResult run_batch(const std::vector<BatchCase>& table, const BatchOptions& options, const CaseWork& work,
                      const Context& context) {
  return Batch(table, options, work, context).run();
}

}  // namespace osteo::inline hospital
