// What the editor works out beside the window: changes of the whole volume, and the surface in 3D. Private to
// libs/app/window; no OpenGL.
#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "osteo/app/window/edit_window.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/imaging/edit/document.h"

namespace osteo::inline app {

/// What a picture in 3D is made of: values, so that the document may change meanwhile.
struct PreviewRequest {
  Image ct;
  std::optional<ThresholdEdit> live;  ///< else `bone`
  std::shared_ptr<const BitMask> bone;
  struct Part {
    std::array<std::uint8_t, 3> rgb{};
    Frame frame;
    BitMask voxels;
  };
  std::vector<Part> structures;
  std::size_t most_voxels = 3'000'000;
};
struct Preview {
  TriMesh bone;
  struct Part {
    std::array<std::uint8_t, 3> rgb{};
    TriMesh mesh;
  };
  std::vector<Part> structures;
};
/// Of coarse voxels; empty where there is nothing. Error(cancelled).
[[nodiscard]] Preview make_preview(const PreviewRequest& request, const Context& context = {});

/// Two threads: one for the change that was asked for, one for the picture. All members are for the window's thread.
class EditWorker {
 public:
  EditWorker();
  ~EditWorker();  ///< what runs is cancelled
  EditWorker(const EditWorker&) = delete;
  EditWorker& operator=(const EditWorker&) = delete;

  /// Works out operations on bone. The document must stay as it is until `take_plan` gives something; false when one is
  /// at work.
  bool plan(const EditDocument& document, std::vector<EditOperation> operations);
  [[nodiscard]] bool planning() const { return planning_; }
  [[nodiscard]] double progress() const { return progress_.load(); }
  /// It ends soon, with an Error(cancelled).
  void cancel_plan() { cancel_plan_ = true; }
  /// Works out structures beside the window, as `plan` does bone.
  bool find(std::function<EditFound(const Context&)> work);
  struct Planned {
    std::optional<BonePlan> plan;
    std::optional<EditFound> found;
    std::optional<Error> error;
  };
  [[nodiscard]] std::optional<Planned> take_plan();

  /// The latest wins: one that is being made is given up.
  void preview(PreviewRequest request);
  [[nodiscard]] bool previewing() const;
  [[nodiscard]] std::optional<Preview> take_preview();

 private:
  void plan_loop();
  void preview_loop();

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  bool planning_ = false;  // the window's
  struct Job {
    const EditDocument* document;
    std::vector<EditOperation> operations;
    std::function<EditFound(const Context&)> find;  // in place of these
  };
  bool begin(Job job);
  std::optional<Job> job_;
  std::optional<Planned> planned_;
  std::atomic<bool> cancel_plan_{false}, cancel_preview_{false};
  std::atomic<double> progress_{0};
  std::optional<PreviewRequest> wanted_;
  bool making_ = false;
  std::optional<Preview> made_;
  std::thread planner_, previewer_;
};

}  // namespace osteo::inline app
