#include "http.h"

#include <curl/curl.h>
#include <sys/stat.h>

#include <algorithm>
#include <memory>

#include "osteo/core/base/shell.h"

namespace osteo::inline hospital {
namespace {

constexpr std::size_t kMaxHead = 65'536;  // bytes before an answer's body

}  // namespace

std::string web_text(const WebServer& server) {
  std::string url = server.url;
  while (url.ends_with('/')) url.pop_back();
  return url;
}

std::string read_login(const fs::path& file) {
  require_readable(file);
  struct stat s {};
  if (::stat(file.c_str(), &s) != 0 || (s.st_mode & 077) != 0)
    throw Error(ExitCode::usage, "others can read '" + file.string() + "'", "chmod 600 " + shell_path(file));
  std::string text = read_text(file);
  while (text.ends_with('\n') || text.ends_with('\r')) text.pop_back();
  if (text.find(':') == std::string::npos || text.starts_with(':') || text.find('\n') != std::string::npos)
    throw Error(ExitCode::usage, "'" + file.string() + "' holds no login", "one line: USER:PASSWORD");
  return text;
}

namespace pacs {

bool own_machine(const std::string& url) {
  std::string host = url.substr(url.find("://") + 3);
  host = host.substr(0, host.find('/'));
  const std::size_t end = host.starts_with('[') ? host.find(']') : 0;
  if (end != std::string::npos) host = host.substr(0, host.find(':', end));
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

void check_address(const WebServer& server) {
  const std::string& url = server.url;
  const bool plain = url.starts_with("http://");
  const auto bad = [&](const char* why) {  // without the address: it may hold a password
    return Error(ExitCode::usage, server.flag + ": " + why,
                 "like https://pacs.example:8042; user and password by " + server.flag + "-login");
  };
  if (!plain && !url.starts_with("https://")) throw bad("the address begins with neither https:// nor http://");
  if (url.find('@') != std::string::npos) throw bad("no user and password in the address: others could see them");
  if (web_text(server).size() <= url.find("://") + 3 || std::ranges::any_of(url, [](unsigned char c) {
        return c <= ' ' || c >= 127 || c == '?' || c == '#' || c == '\\';
      }))
    throw bad("that is no address of a server");
  if (plain && !server.login.empty() && !own_machine(url))
    throw Error(ExitCode::usage, "the password would go over the network in the clear",
                "https://, or a tunnel to 127.0.0.1");
  if (!server.ca.empty()) require_readable(server.ca);
}

// An exception may not pass through libcurl: it waits here.
struct Http::Transfer {
  const Question& question;
  CURL* curl;
  const Context& context;
  Reply reply;
  std::size_t head = 0;
  bool begun = false, over = false, endless_head = false;
  std::exception_ptr thrown;

  void look() {
    if (begun) return;
    begun = true;
    ::curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &reply.status);
    const char* type = nullptr;
    if (::curl_easy_getinfo(curl, CURLINFO_CONTENT_TYPE, &type) == CURLE_OK && type != nullptr) reply.type = type;
  }
  std::size_t body(const char* data, std::size_t n) {
    look();
    if (question.take && reply.status == 200) {
      try {
        question.take(reply, {data, n});
        return n;
      } catch (...) {
        thrown = std::current_exception();
        return 0;
      }
    }
    over = n > question.most - reply.text.size();
    if (over) return 0;
    reply.text.append(data, n);
    return n;
  }
  std::size_t send(char* to, std::size_t n) {
    try {
      return question.upload->read(to, n);
    } catch (...) {
      thrown = std::current_exception();
      return CURL_READFUNC_ABORT;
    }
  }
  int again(curl_off_t offset) {
    if (offset != 0) return CURL_SEEKFUNC_CANTSEEK;
    try {
      question.upload->again();
      return CURL_SEEKFUNC_OK;
    } catch (...) {
      thrown = std::current_exception();
      return CURL_SEEKFUNC_FAIL;
    }
  }
};

template <class T>
void Http::set(int option, T value) {
  if (::curl_easy_setopt(curl_, static_cast<CURLoption>(option), value) != CURLE_OK)
    throw Error(ExitCode::failed, "libcurl does not know an option that is needed", "7.85 or later");
}

Http::Http(const WebServer& server, const Context& context)
    : server_(server), url_(web_text(server)), context_(context) {
  if (::curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK || (curl_ = ::curl_easy_init()) == nullptr)
    throw Error(ExitCode::resources, "libcurl cannot be started");
}

Http::~Http() {
  ::curl_easy_cleanup(curl_);
}

Error Http::wrong(const std::string& what, const std::string& advice) const {
  return {ExitCode::failed, url_ + " " + what, advice};
}

Reply Http::ask(const Question& question) {
  context_.check_cancelled();
  Transfer transfer{question, curl_, context_, {}, 0, false, false, false, {}};
  ::curl_easy_reset(curl_);  // connections stay
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_NOPROXY, "*");  // a login goes to the server and nobody else
  set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
  set(CURLOPT_SSL_VERIFYPEER, 1L);
  set(CURLOPT_SSL_VERIFYHOST, 2L);
  if (!server_.ca.empty()) set(CURLOPT_CAINFO, server_.ca.c_str());
  if (!server_.login.empty()) {
    set(CURLOPT_HTTPAUTH, static_cast<long>(CURLAUTH_BASIC));
    set(CURLOPT_USERPWD, server_.login.c_str());
  }
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(server_.timeout_s * 1000));
  set(CURLOPT_LOW_SPEED_LIMIT, 1000L);
  set(CURLOPT_LOW_SPEED_TIME, std::max(1L, static_cast<long>(server_.timeout_s)));
  set(CURLOPT_TIMEOUT, 3600L);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFODATA, &transfer);
  set(
      CURLOPT_XFERINFOFUNCTION, +[](void* t, curl_off_t, curl_off_t, curl_off_t, curl_off_t) -> int {
        return static_cast<const Transfer*>(t)->context.cancelled() ? 1 : 0;
      });
  set(CURLOPT_HEADERDATA, &transfer);
  set(
      CURLOPT_HEADERFUNCTION, +[](char*, std::size_t, std::size_t n, void* t) -> std::size_t {
        auto& to = *static_cast<Transfer*>(t);
        to.head += n;
        to.endless_head = to.head > kMaxHead;
        return to.endless_head ? 0 : n;
      });
  set(CURLOPT_WRITEDATA, &transfer);
  set(
      CURLOPT_WRITEFUNCTION, +[](char* data, std::size_t, std::size_t n, void* t) -> std::size_t {
        return static_cast<Transfer*>(t)->body(data, n);
      });
  std::unique_ptr<curl_slist, decltype(&::curl_slist_free_all)> heads(nullptr, &::curl_slist_free_all);
  const auto head = [&](const std::string& line) {
    curl_slist* const more = ::curl_slist_append(heads.get(), line.c_str());
    if (more == nullptr) throw Error(ExitCode::resources, "there is no memory left");
    static_cast<void>(heads.release());
    heads.reset(more);
  };
  if (!question.accept.empty()) head("Accept: " + question.accept);
  if (question.upload != nullptr) {
    head("Content-Type: " + question.upload->type);
    set(CURLOPT_POST, 1L);
    set(CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(question.upload->bytes));
    set(CURLOPT_READDATA, &transfer);
    set(
        CURLOPT_READFUNCTION, +[](char* to, std::size_t size, std::size_t n, void* t) -> std::size_t {
          return static_cast<Transfer*>(t)->send(to, size * n);
        });
    set(CURLOPT_SEEKDATA, &transfer);
    set(
        CURLOPT_SEEKFUNCTION,
        +[](void* t, curl_off_t offset, int) -> int { return static_cast<Transfer*>(t)->again(offset); });
  }
  if (heads) set(CURLOPT_HTTPHEADER, heads.get());
  set(CURLOPT_URL, (url_ + question.path).c_str());
  const CURLcode done = ::curl_easy_perform(curl_);
  context_.check_cancelled();
  if (transfer.thrown) std::rethrow_exception(transfer.thrown);
  transfer.look();
  const Reply& reply = transfer.reply;
  if (reply.status == 401 || reply.status == 403)
    throw wrong(server_.login.empty() ? "asks for a login" : "rejects the login", server_.flag + "-login FILE");
  if (transfer.endless_head) throw wrong("gives an answer whose head does not end");
  if (reply.status >= 300 && reply.status < 400)
    throw wrong("points elsewhere (status " + std::to_string(reply.status) + "), which is not followed",
                "give the address it is at");
  // An answer of another status may be of any length: the status is what counts.
  if (reply.status >= 400) return reply;
  if (transfer.over) throw wrong("gives an answer of more than " + std::to_string(question.most / 1'000'000) + " MB");
  if (done != CURLE_OK) throw Error(ExitCode::failed, url_ + ": " + ::curl_easy_strerror(done), "tried again later");
  return std::move(transfer.reply);
}

}  // namespace pacs
}  // namespace osteo::inline hospital
