#include "osteo/simulation/marker/detail/picture.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "video_module.h"

namespace osteo::inline simulation {
namespace {

// Beside the program, then where the libraries were installed; what OSTEO_CAMERA_MODULE names is taken alone.
std::vector<fs::path> module_places() {
  constexpr const char* kFile = "osteo-camera.so";
  if (const char* const own = std::getenv("OSTEO_CAMERA_MODULE"); own != nullptr && *own != 0) return {own};
  std::vector<fs::path> places;
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  if (!ec) {
    const fs::path up = program.parent_path().parent_path();
    places = {up / "lib" / "osteo" / kFile, up / OSTEO_LIB_FOLDER / "osteo" / kFile};
  }
  places.push_back(fs::path(OSTEO_FULL_LIB_FOLDER) / "osteo" / kFile);
  return places;
}

// Never unloaded: a camera's own threads may outlive its last picture.
const video::Module& video_module() {
  static const video::Module& module = []() -> const video::Module& {
    std::string why;
    for (const fs::path& place : module_places()) {
      if (!fs::exists(place)) continue;
      void* const handle = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
      void* const entry = handle != nullptr ? ::dlsym(handle, video::kModuleEntry) : nullptr;
      if (entry == nullptr) {
        why = ::dlerror();
        continue;
      }
      const video::Module* const m = reinterpret_cast<const video::Module* (*)()>(entry)();
      if (m->version != video::kModuleVersion) {
        why = place.string() + " is of another version";
        continue;
      }
      return *m;
    }
    throw Error(ExitCode::failed,
                "what reads cameras and videos (osteo-camera.so) " +
                    (why.empty() ? "is not on this machine" : "cannot be loaded: " + why),
                "install the package osteo-camera, or name the file in OSTEO_CAMERA_MODULE");
  }();
  return module;
}

class Folder final : public PictureSource {
 public:
  explicit Folder(const fs::path& folder) {
    for (const auto& e : fs::directory_iterator(folder)) {
      if (e.is_regular_file() && module_.is_picture(e.path().c_str())) files_.push_back(e.path());
    }
    std::sort(files_.begin(), files_.end());
    if (files_.empty())
      throw Error(ExitCode::no_input, "'" + folder.string() + "' holds no picture", "PNG and JPEG are read");
  }
  bool next(GrayPicture& picture) override {
    if (at_ == files_.size()) return false;
    const fs::path& file = files_[at_++];
    if (!module_.read_picture(file.c_str(), picture))
      throw Error(ExitCode::corrupt, "'" + file.string() + "' cannot be read as a picture",
                  "copy the file again, or take it out");
    return true;
  }

 private:
  const video::Module& module_ = video_module();
  std::vector<fs::path> files_;
  std::size_t at_ = 0;
};

class Video final : public PictureSource {
 public:
  Video(video::Capture* capture, bool live) : capture_(capture), live_(live) {
    const double fps = video_module().fps(capture);
    if (fps >= 1 && fps <= 1000) fps_ = fps;
  }
  ~Video() override { video_module().close(capture_); }
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;
  bool next(GrayPicture& picture) override { return video_module().next(capture_, picture); }
  [[nodiscard]] double fps() const override { return fps_; }
  [[nodiscard]] bool live() const override { return live_; }

 private:
  video::Capture* capture_;
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
  if (is_camera(from)) {
    const std::string path = from[0] == '/' ? from : "/dev/video" + from;
    if (!fs::exists(path))
      throw Error(ExitCode::no_input, "there is no camera at '" + path + "'",
                  "plug it in; 'ls /dev/video*' shows what there is");
    require_readable(path);
    video::Capture* const camera = video_module().open_camera(path.c_str(), width, height, fps);
    if (camera == nullptr)
      throw Error(ExitCode::cannot_read, "the camera at '" + path + "' cannot be opened",
                  "another program may hold it; of a camera's two devices the first is the one");
    return std::make_unique<Video>(camera, true);
  }
  require_readable(from);
  if (fs::is_directory(from)) return std::make_unique<Folder>(from);
  video::Capture* const file = video_module().open_video(from.c_str());
  if (file == nullptr)
    throw Error(ExitCode::corrupt, "'" + from + "' cannot be read as a video",
                "a video, a folder of pictures, or /dev/video0");
  return std::make_unique<Video>(file, false);
}

}  // namespace osteo::inline simulation
