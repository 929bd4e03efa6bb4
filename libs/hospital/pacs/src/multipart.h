// multipart/related (RFC 2387, RFC 2046 5.1) as it comes in pieces. Private to libs/hospital/pacs.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace osteo::inline hospital::pacs {

/// "multipart/related; type=\"application/dicom\"; boundary=x": what stands before the first semicolon in small
/// letters, and parameters by name in small letters.
struct MediaType {
  std::string name;
  std::map<std::string, std::string> parameters;
};
/// Error(failed) for what is none, or names a parameter twice.
[[nodiscard]] MediaType parse_media_type(std::string_view text);

struct PartEvents {
  std::function<void(const std::map<std::string, std::string>& head)> begin;  ///< names in small letters
  std::function<void(std::string_view piece)> data;
  std::function<void()> end;
};

/// Memory: one piece, and 16 kB.
class MultipartReader {
 public:
  /// Error(failed) when `boundary` is none (RFC 2046: 1 to 70 characters of a list).
  MultipartReader(std::string boundary, PartEvents events);
  /// Error(failed) for what is no multipart; what the events throw.
  void feed(std::string_view piece);
  /// Whether the last boundary has come. What follows it is nobody's.
  [[nodiscard]] bool whole() const { return state_ == State::done; }

 private:
  enum class State { preamble, boundary, head, body, done };
  bool step();

  std::string delimiter_;
  PartEvents events_;
  State state_ = State::preamble;
  std::string buffer_ = "\r\n";  // a boundary at the very beginning has no line before it
};

}  // namespace osteo::inline hospital::pacs
