// A scene that is operated on, in a VTK renderer: bodies, plates, structures at risk, dust.
#pragma once
#include <map>
#include <memory>

#include "osteo/data/data.h"
#include "osteo/scene/follower.h"
#include "osteo/view/bone_view.h"
#include "osteo/view/dust_view.h"

namespace osteo {

class WorldView {
 public:
  /// `structures` (may be null) must outlive this.
  WorldView(vtkRenderer* renderer, const StructureMap* structures);
  ~WorldView();
  WorldView(const WorldView&) = delete;
  WorldView& operator=(const WorldView&) = delete;

  /// Shows the scene as it is; after the first time only what changed is made again.
  void update(const World& world, Follower& follower);
  /// One body stands out; kNobody: none.
  void highlight(std::uint32_t body);
  [[nodiscard]] std::size_t triangles() const;

 private:
  struct Plate {
    vtkSmartPointer<vtkActor> actor, moving;
  };
  vtkRenderer* renderer_;
  const StructureMap* structures_;
  vtkSmartPointer<vtkActor> structures_actor_;
  std::map<std::uint32_t, std::unique_ptr<BoneView>> bodies_;
  std::map<std::uint32_t, Plate> plates_;
  std::unique_ptr<DustView> dust_;
};

struct WorldPicture {
  Vec3 centre_mm;
  double radius_mm = 50;
  Vec3 eye{1, 0, 0};
  int width = 900, height = 700;
};
/// Works without a display. Error(failed) when there is no OpenGL.
[[nodiscard]] Picture draw_world(const World& world, Follower& follower, const StructureMap* structures, const WorldPicture& picture);

}  // namespace osteo
