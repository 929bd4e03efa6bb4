// Questions to a web server, by libcurl. What it answers is believed in nothing: no redirect is followed, no proxy is
// asked, nothing is decompressed, and what is read has a bound. Private to libs/hospital/pacs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/hospital/pacs/web.h"

namespace osteo::inline hospital::pacs {

/// Error(usage) for an address that is none, has a user in it, or would send the login over a network in the clear.
void check_address(const WebServer& server);

/// Whether the address is one of this machine (loopback).
[[nodiscard]] bool own_machine(const std::string& url);

struct Reply {
  long status = 0;
  std::string type;  ///< Content-Type as it came; empty: none
  std::string text;  ///< of an answer whose pieces nobody took; with a status of no success it may be cut
};

/// What is sent with a question.
struct Upload {
  std::string type;                                     ///< Content-Type
  std::uint64_t bytes = 0;                              ///< all of it
  std::function<std::size_t(char*, std::size_t)> read;  ///< the next bytes; 0 at the end. May throw
  std::function<void()> again;                          ///< from the first byte
};

struct Question {
  std::string path;                ///< put behind the address
  std::string accept;              ///< media types; empty: any
  std::size_t most = 0;            ///< bytes of text that an answer may have
  const Upload* upload = nullptr;  ///< none: GET, else POST
  /// Takes an answer of status 200, in place of its text, piece by piece. May throw, which ends the transfer.
  std::function<void(const Reply& head, std::string_view piece)> take = {};
};

class Http {
 public:
  /// The server must outlive it. Begins threads (names are looked up in one).
  Http(const WebServer& server, const Context& context);
  ~Http();
  Http(const Http&) = delete;
  Http& operator=(const Http&) = delete;

  /// Errors: failed when there is no connection, it stalls or breaks off, the login is rejected, it points elsewhere or
  /// says more than `most`; cancelled; what `take` and the upload throw.
  Reply ask(const Question& question);

  /// Error(failed): "https://... gives a list that is none".
  [[nodiscard]] Error wrong(const std::string& what, const std::string& advice = {}) const;

 private:
  struct Transfer;
  template <class T>
  void set(int option, T value);

  const WebServer& server_;
  const std::string url_;
  const Context& context_;
  void* curl_ = nullptr;  // CURL
};

}  // namespace osteo::inline hospital::pacs
