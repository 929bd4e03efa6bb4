#include "osteo/hospital/pacs/orthanc.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "http.h"
#include "node.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline hospital {
namespace {

constexpr std::size_t kMaxAnswerBytes = 64'000'000;  // bytes of an answer: 1 kB for each of 64,000 objects
constexpr int kChangesPerPage = 200;                 // changes
constexpr int kTries = 3;                            // of a series whose objects are wrong
constexpr const char* kState = ".orthanc.json";

// What the server gives is not what it says; another try may or may not help.
struct WrongObject : Error {
  explicit WrongObject(const std::string& what) : Error(ExitCode::corrupt, what) {}
};

struct Fd {
  int fd = -1;
  explicit Fd(int f) : fd(f) {}
  ~Fd() {
    if (fd >= 0) ::close(fd);
  }
  Fd(const Fd&) = delete;
  Fd& operator=(const Fd&) = delete;
};

void sync(const fs::path& path) {
  const Fd f(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (f.fd < 0 || ::fsync(f.fd) != 0)
    throw Error(ExitCode::cannot_write, std::string("the copy of a series: ") + std::strerror(errno));
}

class Rest {
 public:
  Rest(const OrthancServer& server, const Context& context) : url_(web_text(server)), http_(server, context) {}

  /// None: the server has no such thing (any more).
  std::optional<Json> ask(const std::string& path) {
    const pacs::Reply reply = http_.ask({.path = path, .accept = {}, .most = kMaxAnswerBytes});
    if (!good(reply)) return std::nullopt;
    auto said = Json::parse(reply.text);
    if (!said) throw wrong("gives an answer that is no JSON");
    return said;
  }

  /// Exactly so many bytes; false: the server has no such thing.
  bool fetch(const std::string& path, const fs::path& file, std::uint64_t bytes) {
    const Fd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> f(fd.fd < 0 ? nullptr : ::fdopen(::dup(fd.fd), "wb"),
                                                            &std::fclose);
    if (!f) throw lost();
    std::uint64_t got = 0;
    const pacs::Reply reply = http_.ask(
        {.path = path, .accept = {}, .most = kMaxAnswerBytes, .take = [&](const pacs::Reply&, std::string_view piece) {
           if (piece.size() > bytes - got) throw WrongObject("an object is longer than " + url_ + " says");
           got += piece.size();
           if (std::fwrite(piece.data(), 1, piece.size(), f.get()) != piece.size()) throw lost();
         }});
    if (!good(reply)) return false;
    if (std::fflush(f.get()) != 0 || ::fsync(fd.fd) != 0) throw lost();
    if (got != bytes) throw WrongObject("an object is shorter than " + url_ + " says");
    return true;
  }

  [[nodiscard]] Error wrong(const std::string& what) const {
    return http_.wrong(what, "is it the address of an Orthanc?");
  }

 private:
  [[nodiscard]] bool good(const pacs::Reply& reply) const {
    if (reply.status == 404) return false;
    if (reply.status != 200) throw wrong("answers with status " + std::to_string(reply.status));
    return true;
  }
  static Error lost() {
    return {errno == ENOSPC ? ExitCode::resources : ExitCode::cannot_write,
            std::string("the copy of an object: ") + std::strerror(errno)};
  }

  const std::string url_;
  pacs::Http http_;
};

struct State {
  std::string url, id;  // of the server; of what the last change was about
  std::int64_t last = 0;
  int tries = 0;  // of the change after it
};

State read_state(const fs::path& folder) {
  const fs::path path = folder / kState;
  const JsonFile file(read_text(path), path.string(), ExitCode::corrupt);
  file.require_format("osteotome_orthanc");
  const JsonValue& root = file.root();
  State s;
  s.url = file.text(file.need(root, "", "url"), "url");
  s.id = file.text(file.need(root, "", "id"), "id");
  s.last = static_cast<std::int64_t>(file.number(file.need(root, "", "last"), "last", 0, 9e15));
  s.tries = static_cast<int>(file.number(file.need(root, "", "tries"), "tries", 0, kTries));
  return s;
}

void write_state(const fs::path& folder, const State& s) {
  write_file(
      folder / kState,
      Json{{"osteotome_orthanc", 1}, {"url", s.url}, {"last", s.last}, {"id", s.id}, {"tries", s.tries}}.dump() + "\n");
}

std::string string_member(const Json& object, const char* key) {
  const Json* const v = object.find(key);
  return v != nullptr && v->text() != nullptr ? *v->text() : std::string();
}

// Five groups of eight digits of a SHA-1: nothing else may become part of an address.
bool is_id(const std::string& id) {
  if (id.size() != 44) return false;
  for (std::size_t i = 0; i < id.size(); ++i)
    if (i % 9 == 8 ? id[i] != '-' : std::string_view("0123456789abcdef").find(id[i]) == std::string_view::npos)
      return false;
  return true;
}

class Follower {
 public:
  Follower(const fs::path& folder, const OrthancServer& server, const Context& context)
      : folder_(folder), server_(server), context_(context), http_(server, context), state_(read_state(folder)) {}

  void run() {
    check_log();
    while (true) {
      const Json page = changes(state_.last, kChangesPerPage);
      const Json* const list = page.find("Changes");
      const Json* const done = page.find("Done");
      if (done == nullptr || done->flag() == nullptr) throw http_.wrong("gives no list of changes");
      if (list->items().empty() && !*done->flag())
        throw http_.wrong("says that there are more changes, and gives none");
      for (const Json& change : list->items()) {
        const std::int64_t seq = seq_of(change);
        if (seq <= state_.last) throw http_.wrong("gives changes out of their order");
        if (string_member(change, "ChangeType") == "StableSeries") {
          const std::string id = string_member(change, "ID");
          if (!is_id(id)) throw http_.wrong("names a series that cannot be");
          take(id);
          keep(seq, id);
        } else {
          state_.last = seq;  // kept with the page
          state_.id = string_member(change, "ID");
        }
      }
      if (!list->items().empty()) keep(state_.last, state_.id);
      if (*done->flag()) return;
    }
  }

 private:
  void keep(std::int64_t seq, const std::string& id) {
    state_.last = seq;
    state_.id = id;
    state_.tries = 0;
    write_state(folder_, state_);
  }

  Json changes(std::int64_t since, int limit) {
    auto page = http_.ask("/changes?since=" + std::to_string(since) + "&limit=" + std::to_string(limit));
    if (!page || page->find("Changes") == nullptr) throw http_.wrong("gives no list of changes");
    return *page;
  }

  [[nodiscard]] std::int64_t seq_of(const Json& change) const {
    const Json* const v = change.find("Seq");
    const auto seq = v == nullptr ? std::nullopt : v->number();
    if (!seq || *seq < 1 || *seq > 9e15) throw http_.wrong("gives a change without a number");
    return static_cast<std::int64_t>(*seq);
  }

  // A server that was set up again counts from 1 again. Beginning again costs questions only: what is here is not
  // fetched twice.
  void check_log() {
    if (state_.last == 0) return;
    const Json page = changes(state_.last - 1, 1);
    const auto& list = page.find("Changes")->items();
    if (!list.empty() && (seq_of(list[0]) != state_.last || string_member(list[0], "ID") == state_.id)) return;
    context_.warn("the list of changes is not the one that was followed before: it is gone through from its beginning");
    keep(0, "");
  }

  void take(const std::string& id) {
    try {
      fetch(id);
    } catch (const WrongObject& e) {
      if (++state_.tries < kTries) {
        write_state(folder_, state_);
        throw Error(ExitCode::failed, e.what(), "tried again later");
      }
      context_.warn(std::string("a series is left out after ") + std::to_string(kTries) + " tries: " + e.what());
    }
  }

  void fetch(const std::string& id) {
    const auto series = http_.ask("/series/" + id);
    if (!series) return;  // deleted since
    const Json* const tags = series->find("MainDicomTags");
    const std::string modality = tags == nullptr ? "" : string_member(*tags, "Modality");
    if (!modality.empty() && modality != "CT" && modality != "MR") return;
    const auto objects = http_.ask("/series/" + id + "/instances");
    if (!objects) return;
    const std::string name = "series-" + hash_text(id).substr(0, 24);
    const fs::path whole = folder_ / name, half = folder_ / ("." + name);
    fs::create_directories(half);
    ::chmod(half.c_str(), 0700);
    std::vector<std::string> fresh;
    for (const Json& object : objects->items()) {
      const std::string instance = string_member(object, "ID");
      const Json* const size = object.find("FileSize");
      const double bytes = size == nullptr ? 0 : size->number().value_or(0);
      if (!is_id(instance) || bytes < 1 || bytes > 1e15) throw WrongObject("an object without a name or length");
      if (bytes > server_.object_gb * 1e9) throw WrongObject("an object is larger than allowed (--object-gb)");
      const std::string file = hash_text(instance).substr(0, 24) + ".dcm";
      if (fs::exists(whole / file)) continue;
      if (fs::exists(half / file) || one(instance, half / file, static_cast<std::uint64_t>(bytes)))
        fresh.push_back(file);
    }
    if (fresh.empty()) {
      fs::remove_all(half);
      return;
    }
    sync(half);
    if (!fs::exists(whole)) {
      fs::rename(half, whole);
    } else {
      for (const std::string& file : fresh) fs::rename(half / file, whole / file);
      fs::remove_all(half);
      sync(whole);
    }
    sync(folder_);
  }

  // Under its name only when it is good.
  bool one(const std::string& instance, const fs::path& file, std::uint64_t bytes) {
    std::error_code ec;
    const auto space = fs::space(folder_, ec);
    if (!ec && static_cast<double>(space.available) < server_.keep_free_mb * 1e6 + static_cast<double>(bytes))
      throw Error(ExitCode::resources, "the disk of the copies is full", "make room, or lower --keep-free-mb");
    const fs::path part = file.parent_path() / ".part";
    if (!http_.fetch("/instances/" + instance + "/file", part, bytes)) return false;
    pacs::ObjectHead head;
    if (!pacs::read_head(part, head) || !pacs::is_uid(head.series)) throw WrongObject("an object is no DICOM object");
    fs::rename(part, file);
    return true;
  }

  const fs::path& folder_;
  const OrthancServer& server_;
  const Context& context_;
  Rest http_;
  State state_;
};

}  // namespace

void check_orthanc(const OrthancServer& server) {
  pacs::check_address(server);
}

void open_orthanc_folder(const fs::path& folder, const OrthancServer& server) {
  if (output_exists(folder / kState)) {
    const State s = read_state(folder);
    if (s.url != web_text(server))
      throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds the series of " + s.url,
                  "give another folder");
    return;
  }
  std::error_code ec;
  if (fs::exists(folder, ec) && (!fs::is_directory(folder, ec) || !fs::is_empty(folder, ec)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds something else than series of an Orthanc",
                "give another folder, or an empty one");
  make_output_folder(folder);
  ::chmod(folder.c_str(), 0700);
  write_state(folder, {web_text(server), "", 0, 0});
}

void follow_orthanc(const fs::path& folder, const OrthancServer& server, const Context& context) {
  const Fd lock(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock.fd < 0) throw Error(ExitCode::cannot_write, "'" + folder.string() + "': " + std::strerror(errno));
  if (::flock(lock.fd, LOCK_EX | LOCK_NB) != 0)
    throw Error(ExitCode::cannot_write, "another watcher copies into '" + folder.string() + "'", "give another folder");
  pacs::quiet_dcmtk(1);
  try {
    Follower(folder, server, context).run();
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
}

}  // namespace osteo::inline hospital
