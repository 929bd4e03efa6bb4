#include "multipart.h"

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo::inline hospital::pacs {
namespace {

constexpr std::size_t kMaxHead = 16'384;  // bytes of a part's head, and before the first part

Error bad(const std::string& what) {
  return {ExitCode::failed, "an answer in several parts is damaged: " + what};
}

std::string small(std::string_view text) {
  std::string s(text);
  for (char& c : s)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return s;
}

}  // namespace

MediaType parse_media_type(std::string_view text) {
  const auto wrong = [] {
    return Error(ExitCode::failed, "an answer says of itself what cannot be understood (Content-Type)");
  };
  MediaType type;
  std::size_t at = std::min(text.find(';'), text.size());
  type.name = small(trimmed(text.substr(0, at)));
  while (at < text.size()) {
    ++at;  // the semicolon
    const std::size_t equals = text.find('=', at), next = text.find(';', at);
    if (equals == std::string_view::npos || next < equals) {
      if (!trimmed(text.substr(at, next == std::string_view::npos ? next : next - at)).empty()) throw wrong();
      at = std::min(next, text.size());
      continue;
    }
    const std::string name = small(trimmed(text.substr(at, equals - at)));
    std::string value;
    at = std::min(text.find_first_not_of(" \t", equals + 1), text.size());
    if (at < text.size() && text[at] == '"') {
      for (++at; at < text.size() && text[at] != '"'; ++at) {
        if (text[at] == '\\' && ++at == text.size()) break;
        value += text[at];
      }
      if (at >= text.size()) throw wrong();
      at = std::min(text.find(';', at), text.size());
    } else {
      const std::size_t end = std::min(text.find(';', at), text.size());
      value = trimmed(text.substr(at, end - at));
      at = end;
    }
    if (!type.parameters.emplace(name, value).second) throw wrong();
  }
  return type;
}

MultipartReader::MultipartReader(std::string boundary, PartEvents events)
    : delimiter_("\r\n--" + boundary), events_(std::move(events)) {
  constexpr std::string_view kAllowed = "'()+_,-./:=? ";
  const bool good = !boundary.empty() && boundary.size() <= 70 && boundary.back() != ' ' &&
                    std::ranges::all_of(boundary, [&](char c) {
                      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                             kAllowed.find(c) != std::string_view::npos;
                    });
  if (!good) throw bad("its boundary is not valid");
}

void MultipartReader::feed(std::string_view piece) {
  if (whole()) return;
  buffer_ += piece;
  while (step()) {
  }
}

// Whether there may be more to do with what is in the buffer.
bool MultipartReader::step() {
  switch (state_) {
    case State::preamble:
    case State::body: {
      const std::size_t found = buffer_.find(delimiter_);
      // The end of the buffer may be the beginning of a boundary.
      const std::size_t keep = delimiter_.size() - 1,
                        sure = found != std::string::npos ? found : buffer_.size() - std::min(buffer_.size(), keep);
      if (state_ == State::body) {
        if (sure > 0) events_.data(std::string_view(buffer_).substr(0, sure));
        buffer_.erase(0, sure);
        if (found != std::string::npos) events_.end();
      } else if (sure > kMaxHead) {
        throw bad("it does not begin with its boundary");
      }
      if (found == std::string::npos) return false;
      buffer_.erase(0, delimiter_.size() + (state_ == State::body ? 0 : found));
      state_ = State::boundary;
      return true;
    }
    case State::boundary: {
      if (buffer_.size() < 2) return false;
      if (buffer_.starts_with("--")) {
        state_ = State::done;
        buffer_.clear();
        return false;
      }
      const std::size_t end = buffer_.find("\r\n");
      const std::size_t blanks = std::min(buffer_.find_first_not_of(" \t"), buffer_.size());
      if (blanks > kMaxHead || (end != blanks && blanks < buffer_.size() && buffer_.substr(blanks) != "\r"))
        throw bad("something stands behind a boundary");
      if (end == std::string::npos) return false;
      buffer_.erase(0, end);  // the line's end may also be that of an empty head
      state_ = State::head;
      return true;
    }
    case State::head: {
      const std::size_t end = buffer_.find("\r\n\r\n");
      if (std::min(end, buffer_.size()) > kMaxHead) throw bad("the head of a part does not end");
      if (end == std::string::npos) return false;
      std::map<std::string, std::string> head;
      std::string_view rest = std::string_view(buffer_).substr(0, end);
      while (!rest.empty()) {
        rest.remove_prefix(2);  // the end of the line before
        const std::size_t line = std::min(rest.find("\r\n"), rest.size()), colon = rest.find(':');
        if (colon == std::string_view::npos || colon > line ||
            !head.emplace(small(trimmed(rest.substr(0, colon))), trimmed(rest.substr(colon + 1, line - colon - 1)))
                 .second)
          throw bad("the head of a part cannot be understood");
        rest.remove_prefix(line);
      }
      buffer_.erase(0, end + 4);
      state_ = State::body;
      events_.begin(head);
      return true;
    }
    case State::done:
      return false;
  }
  return false;
}

}  // namespace osteo::inline hospital::pacs
