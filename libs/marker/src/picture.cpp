#include "osteo/marker/picture.h"

#include <algorithm>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "osteo/base/error.h"
#include "osteo/base/files.h"

namespace osteo {
namespace {

GrayPicture gray_of(const cv::Mat& m) {
  cv::Mat gray;
  if (m.channels() == 1) {
    gray = m;
  } else {
    cv::cvtColor(m, gray, m.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  }
  GrayPicture p{gray.cols, gray.rows, {}};
  p.pixels.reserve(static_cast<std::size_t>(gray.cols) * static_cast<std::size_t>(gray.rows));
  for (int y = 0; y < gray.rows; ++y) p.pixels.insert(p.pixels.end(), gray.ptr<std::uint8_t>(y), gray.ptr<std::uint8_t>(y) + gray.cols);
  return p;
}

class Folder final : public PictureSource {
 public:
  explicit Folder(const fs::path& folder) {
    for (const auto& e : fs::directory_iterator(folder)) {
      if (e.is_regular_file() && cv::haveImageReader(e.path().string())) files_.push_back(e.path());
    }
    std::sort(files_.begin(), files_.end());
    if (files_.empty()) throw Error(ExitCode::no_input, "'" + folder.string() + "' holds no picture", "PNG and JPEG are read");
  }
  bool next(GrayPicture& picture) override {
    if (at_ == files_.size()) return false;
    const fs::path& file = files_[at_++];
    const cv::Mat m = cv::imread(file.string(), cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (m.empty())
      throw Error(ExitCode::corrupt, "'" + file.string() + "' cannot be read as a picture", "copy the file again, or take it out");
    picture = gray_of(m);
    return true;
  }

 private:
  std::vector<fs::path> files_;
  std::size_t at_ = 0;
};

class Video final : public PictureSource {
 public:
  Video(cv::VideoCapture&& capture, bool live) : capture_(std::move(capture)), live_(live) {
    const double fps = capture_.get(cv::CAP_PROP_FPS);
    if (fps >= 1 && fps <= 1000) fps_ = fps;
  }
  bool next(GrayPicture& picture) override {
    cv::Mat m;
    if (!capture_.read(m) || m.empty()) return false;
    picture = gray_of(m);
    return true;
  }
  [[nodiscard]] double fps() const override { return fps_; }
  [[nodiscard]] bool live() const override { return live_; }

 private:
  cv::VideoCapture capture_;
  bool live_;
  double fps_ = 0;
};

// "/dev/video0" or "0".
bool is_camera(const std::string& from) {
  return from.rfind("/dev/video", 0) == 0 ||
         (!from.empty() && from.size() <= 2 && from.find_first_not_of("0123456789") == std::string::npos);
}

}  // namespace

void mirror(GrayPicture& p) {
  for (int y = 0; y < p.height; ++y) {
    const auto row = p.pixels.begin() + static_cast<std::ptrdiff_t>(y) * p.width;
    std::reverse(row, row + p.width);
  }
}

std::unique_ptr<PictureSource> open_pictures(const std::string& from, int width, int height, double fps) {
  // What went wrong is said here, and without the names of files.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (is_camera(from)) {
    const std::string path = from[0] == '/' ? from : "/dev/video" + from;
    if (!fs::exists(path))
      throw Error(ExitCode::no_input, "there is no camera at '" + path + "'", "plug it in; 'ls /dev/video*' shows what there is");
    require_readable(path);
    cv::VideoCapture capture(path, cv::CAP_V4L2);
    if (!capture.isOpened())
      throw Error(ExitCode::cannot_read, "the camera at '" + path + "' cannot be opened",
                  "another program may hold it; of a camera's two devices the first is the one");
    // Compressed: cheap cameras give large pictures at full rate in no other form.
    capture.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'));
    if (width > 0) capture.set(cv::CAP_PROP_FRAME_WIDTH, width);
    if (height > 0) capture.set(cv::CAP_PROP_FRAME_HEIGHT, height);
    if (fps > 0) capture.set(cv::CAP_PROP_FPS, fps);
    capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
    capture.set(cv::CAP_PROP_AUTOFOCUS, 0);  // focus changes the focal length; a camera without it ignores that
    return std::make_unique<Video>(std::move(capture), true);
  }
  require_readable(from);
  if (fs::is_directory(from)) return std::make_unique<Folder>(from);
  cv::VideoCapture capture(from);
  if (!capture.isOpened())
    throw Error(ExitCode::corrupt, "'" + from + "' cannot be read as a video", "a video, a folder of pictures, or /dev/video0");
  return std::make_unique<Video>(std::move(capture), false);
}

}  // namespace osteo
