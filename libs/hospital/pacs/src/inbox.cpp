#include "inbox.h"

#include <sys/stat.h>

#include <utility>

#include "osteo/core/base/error.h"

namespace osteo::inline hospital::pacs {
namespace {

constexpr const char* kClosed = "CLOSED";
// Two changes of a folder within one tick of the disk's clock leave the same time: until then it is looked at again.
constexpr std::chrono::seconds kSettles{2};

bool is_gone(const std::error_code& why) {
  return why == std::errc::no_such_file_or_directory || why == std::errc::not_a_directory;
}

// Entries of a folder, as far as it is there; what went wrong otherwise.
template <class Use>
std::error_code each_entry(const fs::path& folder, const Use& use) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) use(*at);
  return is_gone(error) ? std::error_code() : error;
}

ClosedSeries look(const fs::path& series) {
  ClosedSeries c{series, 0, 0, {}};
  each_entry(series, [&](const fs::directory_entry& file) {
    std::error_code error;
    const auto size = file.file_size(error);
    if (error || file.path().extension() != ".dcm") return;
    ++c.objects;
    c.bytes += size;
  });
  return c;
}

std::string name_of(const fs::path& series) {
  return (series.parent_path().filename() / series.filename()).string();
}

}  // namespace

void Inbox::complain(const fs::path& path, const std::error_code& why) {
  if (!std::exchange(complained_, true))
    warn_("'" + path.string() + "' cannot be looked at (" + why.message() + "): what is in it does not count");
}

void Inbox::each_series(const std::function<void(const fs::path&)>& use) {
  const std::error_code failed = each_entry(folder_, [&](const fs::directory_entry& study) {
    std::error_code error;
    if (!study.path().filename().string().starts_with("study-") || !study.is_directory(error)) return;
    error = each_entry(study.path(), [&](const fs::directory_entry& series) {
      std::error_code ignored;
      if (series.is_directory(ignored)) use(series.path());
    });
    if (error) complain(study.path(), error);
  });
  if (failed) complain(folder_, failed);
}

std::uint64_t Inbox::measure(Time now) {
  std::uint64_t total = 0;
  ++round_;
  each_series([&](const fs::path& series) {
    struct stat of {};
    if (::stat(series.c_str(), &of) != 0) return;  // gone
    const std::int64_t changed_ns = std::int64_t{of.st_mtim.tv_sec} * 1'000'000'000 + of.st_mtim.tv_nsec;
    Measured& m = measured_[series];
    if (m.round == 0 || m.changed_ns != changed_ns) m = {changed_ns, now, false, 0, 0};
    m.round = round_;
    if (!m.settled) {
      m.settled = now - m.first_seen > kSettles;
      m.bytes = 0;
      const std::error_code failed = each_entry(series, [&](const fs::directory_entry& file) {
        std::error_code error;
        const auto size = file.file_size(error);
        if (!error) m.bytes += size;
      });
      if (failed) complain(series, failed);
    }
    total += m.bytes;
  });
  std::erase_if(measured_, [&](const auto& m) { return m.second.round != round_; });
  return total;
}

void Inbox::open_unclosed(Time now) {
  each_series([&](const fs::path& series) {
    std::error_code error;
    if (look(series).objects > 0 && !fs::exists(series / kClosed, error)) open_[series] = {now};
  });
}

void Inbox::came(const fs::path& series, Time now) {
  open_[folder_ / series] = {now};
  std::error_code error;
  fs::remove(folder_ / series / kClosed, error);
}

std::vector<ClosedSeries> Inbox::close_quiet(Time now) {
  std::vector<ClosedSeries> closed;
  for (auto at = open_.begin(); at != open_.end();) {
    Open& open = at->second;
    if (std::chrono::duration<double>(now - open.came).count() < quiet_s_) {
      ++at;
      continue;
    }
    std::string why;
    ClosedSeries series = look(at->first);
    if (series.objects > 0) {
      try {
        write_file(series.folder / kClosed, std::to_string(series.objects) + " objects\n");
        closed.push_back(std::move(series));
        at = open_.erase(at);
        continue;
      } catch (const Error& e) {
        why = e.what();
        series = look(at->first);  // perhaps it went just now
      }
    }
    if (series.objects == 0) {
      ++gone_;
      warn_("the series " + name_of(at->first) + " was moved or deleted before it was closed: it is not reported");
      at = open_.erase(at);
      continue;
    }
    if (!std::exchange(open.warned, true)) warn_("the series " + name_of(at->first) + " cannot be closed yet: " + why);
    open.came = now;
    ++at;
  }
  return closed;
}

}  // namespace osteo::inline hospital::pacs
