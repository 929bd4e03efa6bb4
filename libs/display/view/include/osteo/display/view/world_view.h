// A scene that is operated on, in a VTK renderer: bodies, plates, dust.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "osteo/core/data/data.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/detail/dust_view.h"
#include "osteo/display/view/instrument_view.h"
#include "osteo/session/scene/scene_readers.h"
#include "osteo/session/scene/soft_tissue.h"

class vtkRenderer;

namespace osteo::inline display {

class WorldView {
 public:
  /// `structures` (may be null) tint thin bone over them; must outlive this. They are drawn by StructuresView.
  WorldView(vtkRenderer* renderer, const StructureMap* structures);
  ~WorldView();
  WorldView(const WorldView&) = delete;
  WorldView& operator=(const WorldView&) = delete;

  /// What is done in an update: what can wait a quarter of a second waits, when it runs in real time; or all, so that a
  /// picture follows from the scene.
  enum class Work { urgent, all };
  /// Shows the scene as it is; after the first time only what changed is made again.
  void update(const World& world, SceneReaders& readers, Work work = Work::urgent);
  /// Soft tissue as it is now; under the lock that keeps it still.
  void update_soft(SoftTissue& soft);
  /// One body stands out; kNobody: none.
  void highlight(std::uint32_t body);
  [[nodiscard]] std::size_t triangles() const;
  /// Before each frame of a window: while the camera rests, a thread finds what can be seen, and only that is drawn
  /// until camera or pieces move. Bone that changes meanwhile is drawn whole. With `coarse`, while the camera moves a
  /// quarter of the triangles stand for the bone, off by at most kCoarse of a voxel, once another thread has made them.
  /// True: nothing is to come but by a change of scene or camera.
  bool rest(int width, int height, bool coarse = true);
  static constexpr double kCoarse = 0.35;
  /// All is drawn again, for pictures from elsewhere than the camera rests.
  void wake() { wake(false); }
  [[nodiscard]] bool making_coarse() const { return coarsening_.valid(); }
  [[nodiscard]] std::size_t drawn_triangles() const;

 private:
  struct Seen {
    std::uint32_t body;
    std::size_t chunk;
    BoneView::Arrays arrays;
    std::vector<std::uint32_t> triangles;
    double error_mm;
  };
  void shade_regions(const World& world, const SceneReaders& readers);
  bool look_at_film(const SceneReaders& readers, std::chrono::steady_clock::time_point now);
  bool look_at_heat(const SceneReaders& readers, std::chrono::steady_clock::time_point now);
  void wake(bool coarse);
  void make_coarse();
  void take_coarse();
  vtkRenderer* renderer_;
  const StructureMap* structures_;
  struct SoftView {
    vtkSmartPointer<vtkActor> actor;
    vtkSmartPointer<vtkPolyData> data;
    std::uint64_t version = 0, updates = 0;
  };
  std::vector<SoftView> soft_;
  WetFilm film_;
  std::map<std::uint32_t, std::unique_ptr<BoneView>> bodies_;
  PlateView plates_;
  std::unique_ptr<DustView> dust_;
  std::vector<double> camera_;  // and poses, when last looked at
  std::chrono::steady_clock::time_point since_{};
  std::future<std::vector<Seen>> looking_;
  std::future<std::vector<Seen>> coarsening_;
  std::atomic<bool> stop_ = false;
  std::chrono::steady_clock::time_point settle_at_, changed_at_;
  std::chrono::steady_clock::time_point film_at_{};  // when it is looked at again
  const Dust* film_dust_ = nullptr;
  std::optional<std::uint64_t> film_of_;  // version of the dust
  std::vector<std::pair<Vec3, double>> warm_places_;
  std::chrono::steady_clock::time_point heat_at_{};  // when it is looked at again
  bool looked_ = false;
  std::uint64_t looked_version_ = 0, coarse_version_ = 0;
};

/// With all effects (Quality::deep).
struct WorldPicture {
  Vec3 centre_mm;
  double radius_mm = 50;
  Vec3 eye{1, 0, 0};
  int width = 900, height = 700;
};
/// Works without a display. Error(failed) when there is no OpenGL.
[[nodiscard]] Picture draw_world(const World& world, SceneReaders& readers, const StructureMap* structures,
                                 const WorldPicture& picture, SoftTissue* soft = nullptr);

// -- Whether a scene would look different if it were drawn again.

/// Another number whenever camera, lights, or anything in the scene was changed, put in or taken out since; the same
/// while nothing was, however often it is drawn in the same way; the first drawing with other effects changes it once.
/// Clipping planes do not count: they follow the scene. About 0.2 us a prop.
[[nodiscard]] std::uint64_t scene_stamp(vtkRenderer* renderer);
/// The same of camera, lights and background alone.
[[nodiscard]] std::uint64_t view_stamp(vtkRenderer* renderer);

}  // namespace osteo::inline display
