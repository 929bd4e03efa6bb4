// Draws a scene again without what has not changed in it.
#pragma once
#include <vtkSmartPointer.h>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

class vtkOpenGLRenderWindow;
class vtkProp;
class vtkRenderer;

namespace osteo::inline display {

/// While the camera rests, what has lain still is drawn once, and its colours and depths are kept; later pictures begin
/// with these, and only what changes is drawn into them. They look as if all had been drawn. What changes twice within
/// kLive pictures counts as live until it has not done so for as many. The renderer must be of make_layered_renderer().
class StillLayer {
 public:
  static constexpr std::uint64_t kLive = 30;
  /// Both must outlive this; the window's OpenGL context must be current in the end.
  StillLayer(vtkOpenGLRenderWindow* window, vtkRenderer* renderer);
  ~StillLayer();
  StillLayer(const StillLayer&) = delete;
  StillLayer& operator=(const StillLayer&) = delete;

  /// In place of the window's Render(). The camera's clipping range may be widened. With ambient occlusion or smooth
  /// edges, or where another renderer draws too, all is drawn; what is kept stays.
  void render();
  /// Of the triangles of the last picture the share that cannot be kept.
  [[nodiscard]] double live_share() const { return live_share_; }
  /// Props that the last picture took from what is kept, and those that it drew. For tests.
  [[nodiscard]] std::size_t kept() const { return kept_now_; }
  [[nodiscard]] std::size_t drawn() const { return drawn_now_; }

 private:
  struct Known {
    std::uint64_t stamp = 0;
    std::uint64_t last = 0, before = 0;  // pictures before which it changed; 0: never
    std::uint64_t seen = 0;
    double cells = 0;
    bool kept = false, may_be_kept = false;
  };
  [[nodiscard]] std::vector<vtkProp*> visible() const;
  [[nodiscard]] bool live(const Known& k) const { return k.before != 0 && picture_ - k.before < kLive; }
  bool look(const std::vector<vtkProp*>& props);
  void draw_in_two(const std::vector<vtkProp*>& props, bool valid);
  bool make_frame(int width, int height);
  void copy(bool keep);
  void forget();
  vtkOpenGLRenderWindow* window_;
  vtkRenderer* renderer_;
  std::unordered_map<vtkProp*, Known> known_;
  std::uint64_t picture_ = 0, view_ = 0, made_at_ = 0;
  bool valid_ = false;
  std::array<double, 2> range_{};  // clipping planes of what is kept
  std::array<int, 2> size_{};
  std::array<unsigned, 3> gl_{};  // frame buffer, colours, depths
  std::size_t kept_now_ = 0, drawn_now_ = 0;
  double live_share_ = 0;
};

/// As vtkRenderer::New(), for a StillLayer.
[[nodiscard]] vtkSmartPointer<vtkRenderer> make_layered_renderer();

}  // namespace osteo::inline display
