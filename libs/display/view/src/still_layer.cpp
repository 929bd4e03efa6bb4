#include "osteo/display/view/detail/still_layer.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkDataSet.h>
#include <vtkMapper.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLRenderer.h>
#include <vtkOpenGLState.h>
#include <vtkPropCollection.h>
#include <vtkRendererCollection.h>

#include <algorithm>
#include <functional>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/world_view.h"
#include "stamp.h"

namespace osteo::inline display {
namespace {

// Hiding an actor from a picture by its visibility would make VTK send all its triangles again.
class LayeredRenderer : public vtkOpenGLRenderer {
 public:
  static LayeredRenderer* New();
  vtkTypeMacro(LayeredRenderer, vtkOpenGLRenderer);
  std::function<bool(vtkProp*)> only;  // of which the next picture consists; null: of all

 protected:
  int UpdateGeometry(vtkFrameBufferObjectBase* frame) override {
    if (only)
      PropArrayCount = static_cast<int>(std::stable_partition(PropArray, PropArray + PropArrayCount, only) - PropArray);
    return Superclass::UpdateGeometry(frame);
  }
};
vtkStandardNewMacro(LayeredRenderer);

// The planes may come a little nearer to each other, or go a little apart, before all is drawn again.
constexpr double kSlack = 0.15;

// Of the frame that is bound for reading.
int of_attachment(GLenum place, GLenum what) {
  GLint value = 0;
  glGetFramebufferAttachmentParameteriv(GL_READ_FRAMEBUFFER, place, what, &value);
  return value;
}

// Triangles, or what else it consists of.
double cells_of(vtkProp* prop) {
  auto* const actor = vtkActor::SafeDownCast(prop);
  vtkDataSet* const data = actor != nullptr && actor->GetMapper() != nullptr ? actor->GetMapper()->GetInput() : nullptr;
  return data != nullptr ? static_cast<double>(data->GetNumberOfCells()) : 0;
}

}  // namespace

vtkSmartPointer<vtkRenderer> make_layered_renderer() {
  return vtkSmartPointer<LayeredRenderer>::New();
}

StillLayer::StillLayer(vtkOpenGLRenderWindow* window, vtkRenderer* renderer) : window_(window), renderer_(renderer) {}

StillLayer::~StillLayer() {
  forget();
}

void StillLayer::forget() {
  if (gl_[0] == 0) return;
  glDeleteFramebuffers(1, &gl_[0]);
  glDeleteRenderbuffers(2, &gl_[1]);
  gl_ = {};
  size_ = {};
}

std::vector<vtkProp*> StillLayer::visible() const {
  std::vector<vtkProp*> r;
  vtkCollectionSimpleIterator at{};
  vtkPropCollection* const props = renderer_->GetViewProps();
  for (props->InitTraversal(at); vtkProp* const prop = props->GetNextProp(at);) {
    if (prop->GetVisibility() != 0) r.push_back(prop);
  }
  return r;
}

// What has changed since the last picture. True: what is kept is still as it was.
bool StillLayer::look(const std::vector<vtkProp*>& props) {
  bool as_kept = true, waiting = false;
  double cells = 0, lively = 0;
  for (vtkProp* const prop : props) {
    Known& k = known_[prop];
    k.seen = picture_;
    if (const std::uint64_t stamp = prop_stamp(prop); k.stamp != stamp) {
      k.stamp = stamp;
      k.before = k.last;
      k.last = picture_;
      k.may_be_kept = !is_late(prop) && prop->HasTranslucentPolygonalGeometry() == 0;
      as_kept &= !k.kept;
      k.cells = cells_of(prop);
    }
    cells += k.cells;
    if (!k.may_be_kept || live(k)) lively += k.cells;
    waiting |= k.may_be_kept && !k.kept && !live(k);
  }
  live_share_ = cells > 0 ? lively / cells : 0;
  // What is no longer there, or not to be seen.
  std::erase_if(known_, [&](const auto& k) {
    if (k.second.seen == picture_) return false;
    as_kept &= !k.second.kept;
    return true;
  });
  return as_kept && !(waiting && picture_ - made_at_ >= kLive);
}

void StillLayer::render() {
  auto* const part = LayeredRenderer::SafeDownCast(renderer_);
  ++picture_;
  const int* const size = window_->GetSize();
  // The size is part of the view.
  const std::uint64_t view =
      view_stamp(renderer_) * 31 + static_cast<std::uint64_t>(size[0]) * 65536 + static_cast<std::uint64_t>(size[1]);
  const std::vector<vtkProp*> props = visible();
  const bool as_kept = look(props), same_view = view == view_;
  // What camera and size bring with them tells nothing about what lies still.
  if (!same_view) {
    for (auto& [prop, k] : known_) k.last = k.before = 0;
  }
  view_ = view;
  valid_ = valid_ && as_kept && same_view;
  bool alone = true;
  vtkCollectionSimpleIterator at{};
  vtkRendererCollection* const all = window_->GetRenderers();
  for (all->InitTraversal(at); vtkRenderer* const r = all->GetNextRenderer(at);)
    alone &= r == renderer_ || r->GetDraw() == 0;
  if (part == nullptr || !same_view || !alone || renderer_->GetDraw() == 0 || renderer_->GetUseSSAO() ||
      renderer_->GetUseFXAA()) {
    window_->Render();
    kept_now_ = 0;
    drawn_now_ = props.size();
  } else {
    double range[2];
    renderer_->GetActiveCamera()->GetClippingRange(range);
    int frame[2] = {0, 0};  // others may have drawn another size into it
    if (valid_) window_->GetRenderFramebuffer()->GetLastSize(frame);
    draw_in_two(props,
                valid_ && range[0] >= range_[0] && range[1] <= range_[1] && frame[0] == size[0] && frame[1] == size[1]);
  }
  // Drawing touches what it draws for the first time, or in another way than before.
  for (vtkProp* const prop : props) known_[prop].stamp = prop_stamp(prop);
}

void StillLayer::draw_in_two(const std::vector<vtkProp*>& props, bool valid) {
  auto* const part = LayeredRenderer::SafeDownCast(renderer_);
  vtkCamera* const camera = renderer_->GetActiveCamera();
  if (!valid) {
    double range[2];
    camera->GetClippingRange(range);
    range_ = {range[0] * (1 - kSlack), range[1] * (1 + kSlack)};
    std::size_t kept = 0;
    for (vtkProp* const prop : props) {
      Known& k = known_[prop];
      k.kept = k.may_be_kept && !live(k);
      kept += k.kept ? 1 : 0;
    }
    made_at_ = picture_;
    valid_ = false;
    if (kept > 0) {
      camera->SetClippingRange(range_.data());
      part->only = [this](vtkProp* prop) { return known_[prop].kept; };
      window_->Render();
      part->only = nullptr;
      const int* const size = window_->GetSize();
      valid_ = make_frame(size[0], size[1]);
    }
    if (!valid_) {
      for (auto& [prop, k] : known_) k.kept = false;
      window_->Render();
      kept_now_ = 0;
      drawn_now_ = props.size();
      return;
    }
    copy(true);
  } else {
    copy(false);
  }
  camera->SetClippingRange(range_.data());
  part->only = [this](vtkProp* prop) { return !known_[prop].kept; };
  part->PreserveColorBufferOn();
  part->PreserveDepthBufferOn();
  window_->Render();
  part->PreserveColorBufferOff();
  part->PreserveDepthBufferOff();
  part->only = nullptr;
  kept_now_ = static_cast<std::size_t>(
      std::count_if(props.begin(), props.end(), [&](vtkProp* prop) { return known_[prop].kept; }));
  drawn_now_ = props.size() - (valid ? kept_now_ : 0);
}

// Of the same formats as the window's, or the graphics would have to convert.
bool StillLayer::make_frame(int width, int height) {
  if (gl_[0] != 0 && size_ == std::array{width, height}) return true;
  forget();
  if (window_->GetMultiSamples() > 1) return false;
  vtkOpenGLState* const state = window_->GetState();
  state->PushFramebufferBindings();
  state->vtkglBindFramebuffer(GL_READ_FRAMEBUFFER, window_->GetRenderFramebuffer()->GetFBOIndex());
  const int bits = of_attachment(GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE);
  const bool stencil = of_attachment(GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE) > 0,
             floats = of_attachment(GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE) == GL_FLOAT,
             bytes = of_attachment(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE) == 8;
  if (bits == 0 || !bytes) {
    state->PopFramebufferBindings();
    return false;
  }
  const int depths = floats       ? (stencil ? GL_DEPTH32F_STENCIL8 : GL_DEPTH_COMPONENT32F)
                     : stencil    ? GL_DEPTH24_STENCIL8
                     : bits == 16 ? GL_DEPTH_COMPONENT16
                     : bits == 32 ? GL_DEPTH_COMPONENT32
                                  : GL_DEPTH_COMPONENT24;
  const int formats[2] = {GL_RGBA8, depths};
  const int places[2] = {GL_COLOR_ATTACHMENT0, stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT};
  glGenFramebuffers(1, &gl_[0]);
  glGenRenderbuffers(2, &gl_[1]);
  state->vtkglBindFramebuffer(GL_FRAMEBUFFER, gl_[0]);
  for (std::size_t n = 0; n < 2; ++n) {
    glBindRenderbuffer(GL_RENDERBUFFER, gl_[1 + n]);
    glRenderbufferStorage(GL_RENDERBUFFER, static_cast<GLenum>(formats[n]), width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, static_cast<GLenum>(places[n]), GL_RENDERBUFFER, gl_[1 + n]);
  }
  glBindRenderbuffer(GL_RENDERBUFFER, 0);
  const bool good = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  state->PopFramebufferBindings();
  if (!good) {
    forget();
    return false;
  }
  size_ = {width, height};
  return true;
}

// From the window's frame to what is kept, or back.
void StillLayer::copy(bool keep) {
  vtkOpenGLState* const state = window_->GetState();
  const unsigned frame = window_->GetRenderFramebuffer()->GetFBOIndex();
  state->PushFramebufferBindings();
  state->vtkglBindFramebuffer(GL_READ_FRAMEBUFFER, keep ? frame : gl_[0]);
  state->vtkglBindFramebuffer(GL_DRAW_FRAMEBUFFER, keep ? gl_[0] : frame);
  state->vtkglReadBuffer(GL_COLOR_ATTACHMENT0);
  state->vtkglDrawBuffer(GL_COLOR_ATTACHMENT0);
  state->vtkglDisable(GL_SCISSOR_TEST);
  glBlitFramebuffer(0, 0, size_[0], size_[1], 0, 0, size_[0], size_[1], GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT,
                    GL_NEAREST);
  state->PopFramebufferBindings();
}

}  // namespace osteo::inline display
