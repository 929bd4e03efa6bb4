// What reads cameras, videos and pictures lies in a module of its own, osteo-camera.so, that is loaded when one is
// opened: with it come 140 shared libraries (codecs, GDAL, poppler), some of them under the GPL, that nothing else
// needs. Both sides are made of one tree; names are in C.
#pragma once
#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation::video {

/// Raised when a function below changes.
inline constexpr int kModuleVersion = 1;

/// A camera or a video, opened by the module; nullptr where it cannot be.
struct Capture;

struct Module {
  int version;
  /// Is this the name of a picture that can be read?
  bool (*is_picture)(const char* file);
  /// False: not a picture.
  bool (*read_picture)(const char* file, GrayPicture& picture);
  Capture* (*open_video)(const char* file);
  /// What is 0 is left to the camera.
  Capture* (*open_camera)(const char* device, int width, int height, double fps);
  void (*close)(Capture*);
  /// False at the end.
  bool (*next)(Capture*, GrayPicture& picture);
  /// As it says itself; not always sensible.
  double (*fps)(Capture*);
};
inline constexpr const char* kModuleEntry = "osteo_video_module";

}  // namespace osteo::inline simulation::video
