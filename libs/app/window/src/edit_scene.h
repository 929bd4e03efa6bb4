// The bone under correction in 3D, drawn into a texture only when something changed. Private to libs/app/window.
#pragma once
#include <memory>
#include <optional>

#include "edit_worker.h"

namespace osteo::inline app {

class EditScene {
 public:
  /// With an OpenGL context that is current.
  EditScene();
  ~EditScene();
  EditScene(const EditScene&) = delete;
  EditScene& operator=(const EditScene&) = delete;

  void show(const Preview& preview);
  /// Looks from a side (unit, LPS) at all of it.
  void look_from(Vec3 eye);
  void turn(double dx, double dy);  ///< pixels
  void shift(double dx, double dy);
  void zoom(double factor);
  /// The lower left `width` x `height` pixels of the back buffer are overwritten when it has to be drawn. The texture
  /// stays the scene's own.
  [[nodiscard]] unsigned texture(int width, int height);
  /// Where a point of the world lies in the picture, from its upper left corner; as last drawn.
  [[nodiscard]] std::array<double, 2> pixel(Vec3 world_mm);
  [[nodiscard]] std::size_t triangles() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline app
