#include "osteo/hospital/pacs/watch.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <set>
#include <thread>

#include "node.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/batch/children.h"

namespace osteo::inline hospital {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kHeadsAtOnce = 2000;                   // of files, in one child: some 400 kB of what it says
constexpr std::size_t kHeads = 0;                            // the child that reads them; cases count from 1
constexpr ChildLimits kHeadLimits{1000, 600};                // MB and s: heads are read without pixels
constexpr std::size_t kFeed = static_cast<std::size_t>(-1);  // the child that brings files
constexpr ChildLimits kFeedLimits{1000, 3600};
constexpr double kLongestWait = 300;  // seconds, after a feed that failed
constexpr double kPatience = 12;      // seconds: children of a watcher that was killed have 10 to end
constexpr double kTick = 0.2;         // seconds: how long the wish to stop may go unseen

// Classes that bone is made from.
bool is_scan(const std::string& sop_class) {
  static const std::set<std::string> kScans{
      UID_CTImageStorage, UID_EnhancedCTImageStorage, UID_LegacyConvertedEnhancedCTImageStorage,
      UID_MRImageStorage, UID_EnhancedMRImageStorage, UID_LegacyConvertedEnhancedMRImageStorage};
  return kScans.contains(sop_class);
}

struct Head {
  std::string series, object;  // hashes of their UIDs; empty: no DICOM object
  SeriesFacts facts;
};

// In the child: a line for each file, in their order.
int read_heads(const std::vector<fs::path>& files) {
  pacs::quiet_dcmtk(1);
  for (const fs::path& file : files) {
    Json said = Json::object();
    pacs::ObjectHead ids;
    DcmFileFormat format;
    if (pacs::read_head(file, ids, &format) && pacs::is_uid(ids.series)) {
      DcmDataset& data = *format.getDataset();
      Float64 mm = 0;
      data.findAndGetFloat64(DCM_SliceThickness, mm, 0, OFTrue);
      const std::string description = pacs::text_of(data, DCM_SeriesDescription);
      said["series"] = "series-" + hash_text(ids.series).substr(0, 12);
      said["object"] = hash_text(ids.sop_instance).substr(0, 24);
      said["modality"] = pacs::text_of(data, DCM_Modality);
      said["description"] = description.substr(0, 64);
      said["mm"] = mm;
      said["scan"] = is_scan(ids.sop_class);
      said["own"] = pacs::text_of(data, DCM_Manufacturer) == "Osteotome" || description == "Osteotome volume";
    }
    std::cout << said.dump() << std::endl;
  }
  return 0;
}

Head head_of(const std::string& line) {
  Head head;
  const Json said = Json::parse(line).value_or(Json());
  const auto text = [&](const char* key) {
    const Json* const v = said.find(key);
    return v != nullptr && v->text() != nullptr ? *v->text() : std::string();
  };
  const auto flag = [&](const char* key) {
    const Json* const v = said.find(key);
    return v != nullptr && v->flag() != nullptr && *v->flag();
  };
  head.series = text("series");
  head.object = text("object");
  head.facts.modality = text("modality");
  head.facts.description = text("description");
  if (const Json* mm = said.find("mm")) head.facts.slice_mm = mm->number().value_or(0);
  head.facts.scan = flag("scan");
  head.facts.own = flag("own");
  return head;
}

struct WatchedFile {
  std::uintmax_t bytes = 0;
  std::int64_t time = 0;
  Clock::time_point changed;
  bool read = false;
  Head head;
};

struct Group {
  std::vector<fs::path> files;
  std::set<std::string> objects;
  SeriesFacts facts;
  Clock::time_point changed{};
};

// What was done with a series; also as a file.
struct Entry {
  std::string state;  // "begun", or as state_name()
  std::string rule, why;
  int run = 1, tries = 1;
  std::set<std::string> objects;
  Json how;  // the batch's record of it
};

Json to_json(const std::string& code, const Entry& e) {
  Json j{{"osteotome_watch_series", 1},
         {"series", code},
         {"state", e.state},
         {"rule", e.rule},
         {"run", e.run},
         {"tries", e.tries}};
  j["objects"] = Json(e.objects);
  j["how"] = e.how;
  return j;
}

Entry entry_of(const fs::path& path) {
  const JsonFile file(read_text(path), path.string(), ExitCode::corrupt);
  file.require_format("osteotome_watch_series");
  const JsonValue& root = file.root();
  Entry e;
  e.state = file.text(file.need(root, "", "state"), "state");
  e.rule = file.text(file.need(root, "", "rule"), "rule");
  e.run = static_cast<int>(file.number(file.need(root, "", "run"), "run", 1, 1e6));
  for (const JsonValue& o : file.list(file.need(root, "", "objects"), "objects"))
    e.objects.insert(file.text(o, "an object"));
  // What ended for memory or time is worth another try at the next start.
  if (e.state == state_name(CaseState::resources)) e.state = "begun";
  return e;
}

// OUT, for one watcher at a time.
class Out {
 public:
  explicit Out(const fs::path& out) {
    const fs::path mark = out / "watch.json";
    if (!output_exists(mark)) {
      std::error_code ec;
      if (fs::exists(out, ec) && (!fs::is_directory(out, ec) || !fs::is_empty(out, ec)))
        throw Error(ExitCode::cannot_write, "'" + out.string() + "' holds something that no watcher made",
                    "give another folder, or an empty one");
      make_output_folder(out);
      write_file(mark, Json{{"osteotome_watch", 1}}.dump() + "\n");
    }
    for (const char* part : {"cases", "records", "sources"}) make_output_folder(out / part);
    fd_ = ::open(mark.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd_ < 0) throw Error(ExitCode::cannot_write, "'" + mark.string() + "': " + std::strerror(errno));
    // Children that outlive a killed watcher hold the lock with it until they have ended, so that nothing is begun
    // beside them.
    const auto until = Clock::now() + std::chrono::duration<double>(kPatience);
    while (::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      if (Clock::now() < until) {
        std::this_thread::sleep_for(std::chrono::duration<double>(kTick));
        continue;
      }
      ::close(fd_);
      throw Error(ExitCode::cannot_write, "another watcher is at work in '" + out.string() + "'",
                  "stop it, or give another folder");
    }
  }
  ~Out() { ::close(fd_); }
  Out(const Out&) = delete;
  Out& operator=(const Out&) = delete;

 private:
  int fd_ = -1;
};

class Watcher {
 public:
  Watcher(const std::vector<SeriesRule>& rules, const WatchOptions& options, const WatchWork& work,
          const std::function<void(const WatchEvent&, const WatchCounters&)>& notify, const Context& context)
      : rules_(rules), o_(options), work_(work), report_to_(notify), context_(context), lock_(options.out) {
    for (const auto& file : fs::directory_iterator(o_.out / "records")) {
      if (file.path().extension() != ".json") continue;
      try {
        journal_[file.path().stem().string()] = entry_of(file.path());
      } catch (const Error& e) {
        context_.warn(std::string(e.what()) + "; its series is taken as new");
      }
    }
  }

  WatchCounters run() {
    Clock::time_point looked{};
    bool waiting = true, due = true;
    while (!context_.cancelled()) {
      if (Clock::now() - looked >= std::chrono::duration<double>(o_.poll_s)) {
        look();
        looked = Clock::now();
        due = true;
      }
      feed();
      read_new_heads();
      if (due) waiting = begin_ready();
      due = false;
      if (o_.once && !waiting && !due && children_.running() == 0 && unread_ == 0 && looked != Clock::time_point{} &&
          (!o_.feed || fed_))
        break;
      if (children_.running() == 0) {
        std::this_thread::sleep_for(std::chrono::duration<double>(kTick));
      } else if (const auto end = children_.wait(kTick)) {
        if (end->id == kFeed && end->exit_code == 0) looked = {};  // what it has brought
        finish(*end);
        due = true;
      }
    }
    children_.stop();
    while (children_.running() > 0) {
      if (const auto end = children_.wait(kTick)) finish(*end);
    }
    if (o_.once && feed_failed_)
      throw Error(ExitCode::failed, "not all series could be fetched", "start it again: it goes on where it was");
    return counters_;
  }

 private:
  void feed() {
    if (!o_.feed || feeding_ || (o_.once && fed_) || Clock::now() < feed_at_) return;
    feeding_ = true;
    children_.start(kFeed, o_.feed, kFeedLimits);
  }

  void take_feed(const ChildEnd& end) {
    feeding_ = false;
    fed_ = true;
    if (context_.cancelled()) return;
    for (std::size_t at = 0, to = 0; (to = end.err.find('\n', at)) != std::string::npos; at = to + 1)
      context_.warn(end.err.substr(at, to - at));
    feed_failed_ = end.exit_code != 0;
    if (end.exit_code < 0)
      context_.warn(end.over_time || end.over_memory ? "fetching took more time or memory than it may"
                                                     : "fetching ended by force");
    feed_wait_ = feed_failed_ ? std::min(kLongestWait, 2 * feed_wait_) : o_.poll_s;
    feed_at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(feed_wait_));
  }

  void notify(const WatchEvent& event) const { report_to_(event, counters_); }

  // What is there now; what is new or has changed is to be read.
  void look() {
    std::set<fs::path> seen;
    std::error_code ec;
    const auto skip = fs::directory_options::skip_permission_denied;
    if (!fs::is_directory(o_.folder, ec))
      throw Error(ExitCode::no_input, "the folder that is watched is not there", "mount it again");
    for (auto it = fs::recursive_directory_iterator(o_.folder, skip, ec);
         !ec && it != fs::recursive_directory_iterator(); it.increment(ec)) {
      if (it->path().filename().string().starts_with('.')) {  // half of something, by custom
        if (it->is_directory(ec)) it.disable_recursion_pending();
        continue;
      }
      struct stat s {};
      if (::lstat(it->path().c_str(), &s) != 0 || !S_ISREG(s.st_mode) || it->path().filename() == "CLOSED") continue;
      seen.insert(it->path());
      WatchedFile& file = files_[it->path()];
      const std::int64_t time = static_cast<std::int64_t>(s.st_mtim.tv_sec) * 1'000'000'000 + s.st_mtim.tv_nsec;
      const auto bytes = static_cast<std::uintmax_t>(s.st_size);
      if (file.changed != Clock::time_point{} && file.bytes == bytes && file.time == time) continue;
      file = {bytes, time, Clock::now(), false, {}};
    }
    // A folder that could not be read to its end tells nothing of what is gone.
    if (ec && o_.once)
      throw Error(ExitCode::cannot_read, "the folder that is watched could not be read whole: " + ec.message(),
                  "try again");
    if (ec) context_.warn("the folder that is watched could not be read whole: " + ec.message());
    if (!ec) std::erase_if(files_, [&](const auto& f) { return !seen.contains(f.first); });
    count_unread();
  }

  void count_unread() {
    unread_ = static_cast<std::size_t>(std::ranges::count_if(files_, [](const auto& f) { return !f.second.read; }));
  }

  void read_new_heads() {
    if (!reading_.empty() || unread_ == 0) return;
    for (const auto& [path, file] : files_) {
      if (file.read) continue;
      reading_.push_back(path);
      reading_time_.push_back(file.time);
      if (reading_.size() == kHeadsAtOnce) break;
    }
    children_.start(
        kHeads, [this] { return read_heads(reading_); }, kHeadLimits);
  }

  void take_heads(const ChildEnd& end) {
    std::size_t n = 0;
    for (std::size_t at = 0, to = 0; n < reading_.size() && (to = end.out.find('\n', at)) != std::string::npos;
         ++n, at = to + 1)
      take(n, head_of(end.out.substr(at, to - at)));
    // It ended before its time: at the first file that it has not told of. The others are read by the next.
    if (n < reading_.size() && !context_.cancelled()) {
      take(n, {});
      ++counters_.unreadable;
      notify({"", "unreadable", "", "reading the head of a file ended its process: it is left out", {}, 1});
    }
    reading_.clear();
    reading_time_.clear();
    count_unread();
  }

  void take(std::size_t n, Head head) {
    const auto file = files_.find(reading_[n]);
    if (file == files_.end() || file->second.time != reading_time_[n]) return;  // gone, or changed meanwhile
    file->second.read = true;
    file->second.head = std::move(head);
  }

  [[nodiscard]] std::map<std::string, Group> groups() const {
    std::map<std::string, Group> all;
    for (const auto& [path, file] : files_) {
      if (file.head.series.empty()) continue;
      Group& g = all[file.head.series];
      if (g.files.empty()) g.facts = file.head.facts;
      g.facts.own = g.facts.own || file.head.facts.own;
      g.facts.slice_mm = std::max(g.facts.slice_mm, file.head.facts.slice_mm);
      g.files.push_back(path);
      g.objects.insert(file.head.object);
      g.changed = std::max(g.changed, file.changed);
    }
    for (auto& [code, g] : all) g.facts.objects = g.objects.size();
    return all;
  }

  // Whether there is something to wait for besides running children.
  bool begin_ready() {
    if (unread_ > 0) return true;
    bool waiting = false;
    const auto all = groups();
    counters_.series = all.size();
    for (const auto& [code, g] : all) {
      if (std::ranges::any_of(running_, [&](const auto& r) { return r.second.first == code; })) continue;
      const auto known = journal_.find(code);
      const bool is_new = known == journal_.end() || !std::ranges::includes(known->second.objects, g.objects);
      const bool half = known != journal_.end() && known->second.state == "begun";
      if ((!is_new && !half) || settled_[code] == g.objects.size()) continue;
      if (Clock::now() - g.changed < std::chrono::duration<double>(o_.quiet_s)) {
        waiting = true;
        continue;
      }
      const RuleChoice choice = choose_rule(rules_, g.facts);
      if (choice.rule == nullptr || choice.rule->ignore) {
        settled_[code] = g.objects.size();
        if (choice.rule == nullptr) ++counters_.unmatched;
        notify({code,
                choice.rule != nullptr ? "ignored" : "unmatched",
                choice.rule != nullptr ? choice.rule->name : "",
                choice.why,
                {},
                g.objects.size()});
        continue;
      }
      if (running_.size() >= static_cast<std::size_t>(std::max(1, o_.jobs)) || !has_room()) {
        waiting = true;
        continue;
      }
      try {
        begin(code, g, *choice.rule);
      } catch (const fs::filesystem_error& e) {  // moved away meanwhile, say: the cases that run go on
        context_.warn("series " + code + " could not be begun: " + e.code().message());
        waiting = true;
      }
    }
    return waiting;
  }

  bool has_room() {
    std::error_code ec;
    const auto space = fs::space(o_.out, ec);
    const bool room = ec || static_cast<double>(space.available) / 1e6 >= o_.keep_free_mb;
    if (!room && o_.once)
      throw Error(ExitCode::resources, "the disk of the cases is full", "make room, or lower --keep-free-mb");
    if (!room && !reported_full_) context_.warn("the disk of the cases is full: nothing is begun until there is room");
    reported_full_ = !room;
    return room;
  }

  static std::string name_of(const std::string& code, int run) {
    return run == 1 ? code : code + "-" + std::to_string(run);
  }
  [[nodiscard]] fs::path case_of(const std::string& code, int run) const {
    return o_.out / "cases" / name_of(code, run);
  }
  [[nodiscard]] fs::path record_of_series(const std::string& code) const {
    return o_.out / "records" / (code + ".json");
  }

  // A folder with the files of this series and of no other.
  [[nodiscard]] fs::path source_of(const std::string& name, const std::string& code, const Group& g) const {
    const fs::path parent = g.files.front().parent_path();
    const std::string below = parent.string() + "/";
    const bool alone =
        std::ranges::all_of(g.files, [&](const fs::path& f) { return f.parent_path() == parent; }) &&
        std::ranges::all_of(files_, [&](const auto& f) {
          return f.second.head.series.empty() || f.second.head.series == code || !f.first.string().starts_with(below);
        });
    if (alone) return parent;
    const fs::path folder = o_.out / "sources" / name;
    fs::remove_all(folder);
    fs::create_directories(folder);
    int n = 0;
    for (const fs::path& file : g.files) {
      const fs::path to = folder / (std::to_string(++n) + ".dcm");
      std::error_code ec;
      fs::create_hard_link(file, to, ec);
      if (ec) fs::copy_file(file, to);  // another disk
    }
    return folder;
  }

  void begin(const std::string& code, const Group& g, const SeriesRule& rule) {
    const auto known = journal_.find(code);
    Entry e = known == journal_.end() ? Entry{} : known->second;
    if (e.state == "begun") {
      if (e.objects != g.objects) e.tries = 1;
    } else {
      e = {};
      while (output_exists(case_of(code, e.run))) ++e.run;
    }
    e.state = "begun";
    e.rule = rule.name;
    e.objects = g.objects;
    const fs::path folder = case_of(code, e.run), source = source_of(name_of(code, e.run), code, g);
    journal_[code] = e;
    write_file(record_of_series(code),
               to_json(code, e).dump(2) + "\n");  // before the child: whoever comes next must know
    const std::size_t id = ++last_id_;
    running_[id] = {code, source};
    children_.start(
        id, [this, &rule, source, folder] { return work_(rule, source, folder); },
        ChildLimits{o_.memory_mb, o_.seconds});
    notify({code, "begun", rule.name, "", folder, g.objects.size()});
  }

  void finish(const ChildEnd& end) {
    if (end.id == kFeed) {
      take_feed(end);
      return;
    }
    if (end.id == kHeads) {
      take_heads(end);
      return;
    }
    const auto [code, source] = running_.at(end.id);
    running_.erase(end.id);
    Entry& e = journal_[code];
    const fs::path folder = case_of(code, e.run);
    BatchCase row;
    row.code = code;
    row.source = source;
    CaseRecord record = record_of(row, "", end, e.tries, {o_.memory_mb, o_.seconds}, folder);
    record.program = o_.program;
    // Interrupted: it stays begun, for the next start.
    if (record.state == CaseState::waiting || (context_.cancelled() && record.state != CaseState::done)) return;
    if (record.state == CaseState::resources && e.tries <= o_.retries) {
      ++e.tries;
      notify({code, "again", e.rule, record.why, folder, e.objects.size()});
      return;
    }
    e.state = state_name(record.state);
    e.how = record.to_json();
    write_file(record_of_series(code), to_json(code, e).dump(2) + "\n");
    ++(record.state == CaseState::done ? counters_.done : counters_.bad);
    notify({code, e.state, e.rule, record.why, folder, e.objects.size()});
  }

  const std::vector<SeriesRule>& rules_;
  const WatchOptions& o_;
  const WatchWork& work_;
  const std::function<void(const WatchEvent&, const WatchCounters&)>& report_to_;
  const Context& context_;
  Out lock_;
  Children children_;
  std::map<fs::path, WatchedFile> files_;
  std::vector<fs::path> reading_;  // by the child of heads
  std::vector<std::int64_t> reading_time_;
  std::map<std::string, Entry> journal_;
  std::map<std::string, std::size_t> settled_;  // without a case: objects when that was decided
  std::map<std::size_t, std::pair<std::string, fs::path>> running_;
  std::size_t unread_ = 0, last_id_ = 0;
  bool reported_full_ = false, feeding_ = false, fed_ = false, feed_failed_ = false;
  double feed_wait_ = 1;  // seconds
  Clock::time_point feed_at_{};
  WatchCounters counters_;
};

}  // namespace

void check_watch_folders(const fs::path& folder, const fs::path& out) {
  const std::string a = fs::weakly_canonical(folder).string() + "/", b = fs::weakly_canonical(out).string() + "/";
  if (b.starts_with(a) || a.starts_with(b))
    throw Error(ExitCode::usage, "cases may not lie in the folder that is watched, nor it among them",
                "give --out another folder");
}

WatchCounters watch_folder(const std::vector<SeriesRule>& rules, const WatchOptions& options, const WatchWork& work,
                           const std::function<void(const WatchEvent&, const WatchCounters&)>& notify,
                           const Context& context) {
  if (!fs::is_directory(options.folder))
    throw Error(ExitCode::no_input, "'" + options.folder.string() + "' is no folder to watch");
  check_watch_folders(options.folder, options.out);
  try {
    return Watcher(rules, options, work, notify, context).run();
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
}

std::string metrics_text(const WatchCounters& c) {
  std::string text;
  const auto row = [&](const char* name, const char* kind, const char* help, std::size_t value) {
    const std::string full = std::string("osteotome_watch_") + name;
    text += "# HELP " + full + " " + help + "\n# TYPE " + full + " " + kind + "\n" + full + " " +
            std::to_string(value) + "\n";
  };
  row("series", "gauge", "series in the folder", c.series);
  row("done_total", "counter", "cases made", c.done);
  row("bad_total", "counter", "series rejected, failed or out of resources", c.bad);
  row("unmatched_total", "counter", "series that no rule matched", c.unmatched);
  row("unreadable_total", "counter", "files whose heads ended their process", c.unreadable);
  return text;
}

}  // namespace osteo::inline hospital
