// osteo-camera.so: pictures by OpenCV's imgcodecs and videoio (marker/src/video_module.h says why it is a module).
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "video_module.h"

namespace osteo::inline simulation::video {

struct Capture {
  cv::VideoCapture capture;
};

namespace {

// What went wrong is said by the caller, and without the names of files.
void quiet() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
}

void gray_of(const cv::Mat& m, GrayPicture& p) {
  cv::Mat gray;
  if (m.channels() == 1) {
    gray = m;
  } else {
    cv::cvtColor(m, gray, m.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  }
  p = {gray.cols, gray.rows, {}};
  p.pixels.reserve(static_cast<std::size_t>(gray.cols) * static_cast<std::size_t>(gray.rows));
  for (int y = 0; y < gray.rows; ++y)
    p.pixels.insert(p.pixels.end(), gray.ptr<std::uint8_t>(y), gray.ptr<std::uint8_t>(y) + gray.cols);
}

bool is_picture(const char* file) {
  return cv::haveImageReader(file);
}

bool read_picture(const char* file, GrayPicture& picture) {
  quiet();
  const cv::Mat m = cv::imread(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (m.empty()) return false;
  gray_of(m, picture);
  return true;
}

Capture* opened(cv::VideoCapture&& capture) {
  return capture.isOpened() ? new Capture{std::move(capture)} : nullptr;
}

Capture* open_video(const char* file) {
  quiet();
  return opened(cv::VideoCapture(file));
}

Capture* open_camera(const char* device, int width, int height, double fps) {
  quiet();
  Capture* const camera = opened(cv::VideoCapture(device, cv::CAP_V4L2));
  if (camera == nullptr) return nullptr;
  cv::VideoCapture& c = camera->capture;
  // Compressed: cheap cameras give large pictures at full rate in no other form.
  c.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'));
  if (width > 0) c.set(cv::CAP_PROP_FRAME_WIDTH, width);
  if (height > 0) c.set(cv::CAP_PROP_FRAME_HEIGHT, height);
  if (fps > 0) c.set(cv::CAP_PROP_FPS, fps);
  c.set(cv::CAP_PROP_BUFFERSIZE, 1);
  c.set(cv::CAP_PROP_AUTOFOCUS, 0);  // focus changes the focal length; a camera without it ignores that
  return camera;
}

void close(Capture* c) {
  delete c;
}

bool next(Capture* c, GrayPicture& picture) {
  cv::Mat m;
  if (!c->capture.read(m) || m.empty()) return false;
  gray_of(m, picture);
  return true;
}

double fps(Capture* c) {
  return c->capture.get(cv::CAP_PROP_FPS);
}

constexpr Module kModule{kModuleVersion, is_picture, read_picture, open_video, open_camera, close, next, fps};

}  // namespace
}  // namespace osteo::inline simulation::video

extern "C" [[gnu::visibility("default")]] const osteo::video::Module* osteo_video_module() {
  return &osteo::video::kModule;
}
