#include "osteo/pacs/orthanc.h"

#include <curl/curl.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "node.h"
#include "osteo/base/json.h"
#include "osteo/base/json_document.h"

namespace osteo {
namespace {

constexpr std::size_t kMostText = 64'000'000;  // bytes of an answer: 1 kB for each of 64,000 objects
constexpr int kPage = 200;                     // changes
constexpr int kTries = 3;                      // of a series whose objects are wrong
constexpr const char* kState = ".orthanc.json";

// What the server gives is not what it says; another try may or may not help.
struct WrongObject : Error {
  explicit WrongObject(const std::string& what) : Error(ExitCode::corrupt, what) {}
};

std::string bare(std::string url) {
  while (url.ends_with('/')) url.pop_back();
  return url;
}

bool own_machine(const std::string& url) {
  std::string host = url.substr(url.find("://") + 3);
  host = host.substr(0, host.find('/'));
  if (!host.starts_with('[')) host = host.substr(0, host.find(':'));
  return host == "localhost" || host == "127.0.0.1" || host.starts_with("[::1]");
}

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
  if (f.fd < 0 || ::fsync(f.fd) != 0) throw Error(ExitCode::cannot_write, std::string("the copy of a series: ") + std::strerror(errno));
}

class Http {
 public:
  Http(const OrthancServer& server, const Context& context) : server_(server), url_(bare(server.url)), context_(context) {
    if (::curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK || (curl_ = ::curl_easy_init()) == nullptr)
      throw Error(ExitCode::resources, "libcurl cannot be started");
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_PROTOCOLS_STR, "http,https");
    set(CURLOPT_NOPROXY, "*");  // a login goes to the server and nobody else
    set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
    set(CURLOPT_SSL_VERIFYPEER, 1L);
    set(CURLOPT_SSL_VERIFYHOST, 2L);
    if (!server.ca.empty()) set(CURLOPT_CAINFO, server.ca.c_str());
    if (!server.login.empty()) {
      set(CURLOPT_HTTPAUTH, static_cast<long>(CURLAUTH_BASIC));
      set(CURLOPT_USERPWD, server.login.c_str());
    }
    set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(server.timeout_s * 1000));
    set(CURLOPT_LOW_SPEED_LIMIT, 1000L);
    set(CURLOPT_LOW_SPEED_TIME, std::max(1L, static_cast<long>(server.timeout_s)));
    set(CURLOPT_TIMEOUT, 3600L);
    set(CURLOPT_NOPROGRESS, 0L);
    set(CURLOPT_XFERINFODATA, &context_);
    set(
        CURLOPT_XFERINFOFUNCTION, +[](void* context, curl_off_t, curl_off_t, curl_off_t, curl_off_t) -> int {
          return static_cast<const Context*>(context)->cancelled() ? 1 : 0;
        });
    set(CURLOPT_WRITEDATA, &to_);
    set(
        CURLOPT_WRITEFUNCTION, +[](char* data, std::size_t, std::size_t n, void* to) -> std::size_t {
          Sink& s = *static_cast<Sink*>(to);
          if (n > s.most - s.got) {
            s.over = true;
            return 0;
          }
          s.got += n;
          if (s.file == nullptr) {
            s.text.append(data, n);
          } else if (std::fwrite(data, 1, n, s.file) != n) {
            s.reason = errno;
            return 0;
          }
          return n;
        });
  }
  ~Http() { ::curl_easy_cleanup(curl_); }
  Http(const Http&) = delete;
  Http& operator=(const Http&) = delete;

  /// None: the server has no such thing (any more).
  std::optional<Json> ask(const std::string& path) {
    if (!get(path, kMostText, nullptr)) return std::nullopt;
    auto said = Json::parse(to_.text);
    if (!said) throw wrong("gives an answer that is no JSON");
    return said;
  }

  /// Exactly so many bytes; false: the server has no such thing.
  bool fetch(const std::string& path, const fs::path& file, std::uint64_t bytes) {
    const Fd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> f(fd.fd < 0 ? nullptr : ::fdopen(::dup(fd.fd), "wb"), &std::fclose);
    if (!f) throw Error(ExitCode::cannot_write, std::string("the copy of an object: ") + std::strerror(errno));
    if (!get(path, bytes, f.get())) return false;
    if (std::fflush(f.get()) != 0 || ::fsync(fd.fd) != 0)
      throw Error(errno == ENOSPC ? ExitCode::resources : ExitCode::cannot_write,
                  std::string("the copy of an object: ") + std::strerror(errno));
    if (to_.got != bytes) throw WrongObject("an object is shorter than " + url_ + " says");
    return true;
  }

  [[nodiscard]] Error wrong(const std::string& what) const {
    return {ExitCode::failed, url_ + " " + what, "is it the address of an Orthanc?"};
  }

 private:
  struct Sink {
    std::string text;
    std::FILE* file = nullptr;
    std::size_t most = 0, got = 0;
    bool over = false;
    int reason = 0;
  };

  template <class T>
  void set(CURLoption option, T value) {
    if (::curl_easy_setopt(curl_, option, value) != CURLE_OK)
      throw Error(ExitCode::failed, "libcurl does not know an option that is needed", "7.85 or later");
  }

  bool get(const std::string& path, std::size_t most, std::FILE* file) {
    context_.check_cancelled();
    to_ = {};
    to_.most = most;
    to_.file = file;
    set(CURLOPT_URL, (url_ + path).c_str());
    const CURLcode done = ::curl_easy_perform(curl_);
    context_.check_cancelled();
    long status = 0;
    ::curl_easy_getinfo(curl_, CURLINFO_RESPONSE_CODE, &status);
    // An answer of another status may be of any length: the status is what counts.
    if (status == 404 && (done == CURLE_OK || to_.over)) return false;
    if (status == 401 || status == 403)
      throw Error(ExitCode::failed, url_ + (server_.login.empty() ? " asks for a login" : " refuses the login"), "--orthanc-login FILE");
    if (to_.reason != 0)
      throw Error(to_.reason == ENOSPC ? ExitCode::resources : ExitCode::cannot_write,
                  std::string("the copy of an object: ") + std::strerror(to_.reason));
    if (to_.over && status == 200) {
      if (file != nullptr) throw WrongObject("an object is longer than " + url_ + " says");
      throw wrong("gives an answer of more than " + std::to_string(kMostText / 1'000'000) + " MB");
    }
    if (done != CURLE_OK) throw Error(ExitCode::failed, url_ + ": " + ::curl_easy_strerror(done), "tried again later");
    if (status != 200) throw wrong("answers with status " + std::to_string(status));
    return true;
  }

  const OrthancServer& server_;
  const std::string url_;
  const Context& context_;
  CURL* curl_ = nullptr;
  Sink to_;
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
  write_file(folder / kState,
             Json{{"osteotome_orthanc", 1}, {"url", s.url}, {"last", s.last}, {"id", s.id}, {"tries", s.tries}}.dump() + "\n");
}

std::string text_in(const Json& object, const char* key) {
  const Json* const v = object.find(key);
  return v != nullptr && v->text() != nullptr ? *v->text() : std::string();
}

// Five groups of eight digits of a SHA-1: nothing else may become part of an address.
bool is_id(const std::string& id) {
  if (id.size() != 44) return false;
  for (std::size_t i = 0; i < id.size(); ++i)
    if (i % 9 == 8 ? id[i] != '-' : std::string_view("0123456789abcdef").find(id[i]) == std::string_view::npos) return false;
  return true;
}

class Follower {
 public:
  Follower(const fs::path& folder, const OrthancServer& server, const Context& context)
      : folder_(folder), server_(server), context_(context), http_(server, context), state_(read_state(folder)) {}

  void run() {
    check_log();
    while (true) {
      const Json page = changes(state_.last, kPage);
      const Json* const list = page.find("Changes");
      const Json* const done = page.find("Done");
      if (done == nullptr || done->flag() == nullptr) throw http_.wrong("gives no list of changes");
      if (list->items().empty() && !*done->flag()) throw http_.wrong("says that there are more changes, and gives none");
      for (const Json& change : list->items()) {
        const std::int64_t seq = seq_of(change);
        if (seq <= state_.last) throw http_.wrong("gives changes out of their order");
        if (text_in(change, "ChangeType") == "StableSeries") {
          const std::string id = text_in(change, "ID");
          if (!is_id(id)) throw http_.wrong("names a series that cannot be");
          take(id);
          keep(seq, id);
        } else {
          state_.last = seq;  // kept with the page
          state_.id = text_in(change, "ID");
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

  // A server that was set up anew counts from 1 again. Beginning again costs questions only: what is here is not fetched twice.
  void check_log() {
    if (state_.last == 0) return;
    const Json page = changes(state_.last - 1, 1);
    const auto& list = page.find("Changes")->items();
    if (!list.empty() && (seq_of(list[0]) != state_.last || text_in(list[0], "ID") == state_.id)) return;
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
    const std::string modality = tags == nullptr ? "" : text_in(*tags, "Modality");
    if (!modality.empty() && modality != "CT" && modality != "MR") return;
    const auto objects = http_.ask("/series/" + id + "/instances");
    if (!objects) return;
    const std::string name = "series-" + hash_text(id).substr(0, 24);
    const fs::path whole = folder_ / name, half = folder_ / ("." + name);
    fs::create_directories(half);
    ::chmod(half.c_str(), 0700);
    std::vector<std::string> fresh;
    for (const Json& object : objects->items()) {
      const std::string instance = text_in(object, "ID");
      const Json* const size = object.find("FileSize");
      const double bytes = size == nullptr ? 0 : size->number().value_or(0);
      if (!is_id(instance) || bytes < 1 || bytes > 1e15) throw WrongObject("an object without a name or length");
      if (bytes > server_.object_gb * 1e9) throw WrongObject("an object is larger than allowed (--object-gb)");
      const std::string file = hash_text(instance).substr(0, 24) + ".dcm";
      if (fs::exists(whole / file)) continue;
      if (fs::exists(half / file) || one(instance, half / file, static_cast<std::uint64_t>(bytes))) fresh.push_back(file);
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
  Http http_;
  State state_;
};

}  // namespace

void check_orthanc(const OrthancServer& server) {
  const std::string& url = server.url;
  const bool plain = url.starts_with("http://");
  const auto bad = [](const char* why) {  // without the address: it may hold a password
    return Error(ExitCode::usage, std::string("--orthanc: ") + why,
                 "like https://orthanc.example:8042; user and password by --orthanc-login");
  };
  if (!plain && !url.starts_with("https://")) throw bad("the address begins with neither https:// nor http://");
  if (url.find('@') != std::string::npos) throw bad("no user and password in the address: others could see them");
  if (bare(url).size() <= url.find("://") + 3 ||
      std::ranges::any_of(url, [](unsigned char c) { return c <= ' ' || c >= 127 || c == '?' || c == '#' || c == '\\'; }))
    throw bad("that is no address of a server");
  if (plain && !server.login.empty() && !own_machine(url))
    throw Error(ExitCode::usage, "the password would go over the network in the clear", "https://, or a tunnel to 127.0.0.1");
  if (!server.ca.empty()) require_readable(server.ca);
}

std::string read_login(const fs::path& file) {
  require_readable(file);
  struct stat s {};
  if (::stat(file.c_str(), &s) != 0 || (s.st_mode & 077) != 0)
    throw Error(ExitCode::usage, "others can read '" + file.string() + "'", "chmod 600 " + file.string());
  std::string text = read_text(file);
  while (text.ends_with('\n') || text.ends_with('\r')) text.pop_back();
  if (text.find(':') == std::string::npos || text.starts_with(':') || text.find('\n') != std::string::npos)
    throw Error(ExitCode::usage, "'" + file.string() + "' holds no login", "one line: USER:PASSWORD");
  return text;
}

void open_orthanc_folder(const fs::path& folder, const OrthancServer& server) {
  if (output_exists(folder / kState)) {
    const State s = read_state(folder);
    if (s.url != bare(server.url))
      throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds the series of " + s.url, "give another folder");
    return;
  }
  std::error_code ec;
  if (fs::exists(folder, ec) && (!fs::is_directory(folder, ec) || !fs::is_empty(folder, ec)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds something else than series of an Orthanc",
                "give another folder, or an empty one");
  make_output_folder(folder);
  ::chmod(folder.c_str(), 0700);
  write_state(folder, {bare(server.url), "", 0, 0});
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

}  // namespace osteo
