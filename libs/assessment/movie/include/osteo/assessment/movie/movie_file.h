// A movie file that browsers play, frame by frame. libav (FFmpeg) inside.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "osteo/core/data/data.h"

namespace osteo::inline assessment {

/// .mp4: H.264 (libx264, else libopenh264), 4:2:0, its index in front so that it plays while it loads; .webm: VP9
/// (libvpx). The file holds pictures and their times and nothing else: no date, no name, no word on what made it. One
/// thread encodes, so that the same pictures give the same bytes with the same libraries (pictures of two runs need not
/// be the same: docs/how-to/movie.md).
class MovieFile {
 public:
  static constexpr int kMinEdge = 64, kMaxEdge = 7680, kMaxFps = 120;

  /// Writes over `path`. `width`, `height`: even, kMinEdge to kMaxEdge; `fps`: 1 to kMaxFps; else Error(usage), as
  /// for another ending than .mp4 and .webm. Error(failed) where this machine's libav has no encoder for it (says which
  /// would do). Error(cannot_write).
  MovieFile(const std::filesystem::path& path, int width, int height, int fps);
  ~MovieFile();
  MovieFile(const MovieFile&) = delete;
  MovieFile& operator=(const MovieFile&) = delete;

  /// A picture of the movie's size. Error(cannot_write): disk full and the like.
  void add(const Picture& picture);
  /// Ends the file, then reads it back: Error(failed) when it does not hold as many frames of that size as were added.
  void finish();
  [[nodiscard]] std::uint64_t frames() const;
  /// "libx264", ...
  [[nodiscard]] const std::string& encoder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What a movie file holds, as read back.
struct MovieFileFacts {
  std::uint64_t frames = 0;
  int width = 0, height = 0;
  double seconds = 0;
  std::string codec;     ///< "h264", "vp9"
  std::size_t tags = 0;  ///< of the container and its streams that tell of anything but the format
};
/// Errors: no_input, corrupt.
[[nodiscard]] MovieFileFacts read_movie_facts(const std::filesystem::path& path);

/// The licence that libav was built under, as it says itself: "GPL version 2 or later", "LGPL version 2.1 or later".
[[nodiscard]] std::string movie_encoder_licence();

}  // namespace osteo::inline assessment
