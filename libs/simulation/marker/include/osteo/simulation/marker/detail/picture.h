// Grey pictures and where they come from: a camera, a video, a folder.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace osteo::inline simulation {

/// 8 bits, top row first.
struct GrayPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};
/// Left becomes right.
void mirror(GrayPicture& picture);

/// Used by one thread.
class PictureSource {
 public:
  virtual ~PictureSource() = default;
  /// False when there are no more: the end of a video, an unplugged camera.
  virtual bool next(GrayPicture& picture) = 0;
  /// Of a video or camera; 0 where there is none.
  [[nodiscard]] virtual double fps() const { return 0; }
  /// A camera, whose pictures come when they come; others are read as fast as one likes.
  [[nodiscard]] virtual bool live() const { return false; }
};

/// "/dev/video0" or "0": a camera, asked for `width` x `height` at `fps` where they are not 0. A folder: its pictures
/// by name. Else a video. Error(no_input) where there is nothing, cannot_read, corrupt where it holds no picture.
[[nodiscard]] std::unique_ptr<PictureSource> open_pictures(const std::string& from, int width = 0, int height = 0,
                                                           double fps = 0);

}  // namespace osteo::inline simulation
