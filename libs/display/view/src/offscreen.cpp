#include "osteo/display/view/offscreen.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include "osteo/core/base/error.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

struct OffscreenWindow::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> window;
};

OffscreenWindow::OffscreenWindow(int width, int height) : impl_(std::make_unique<Impl>()) {
  const auto fail = [](const char* what) {
    return Error(ExitCode::failed, std::string("cannot draw: ") + what,
                 "install Mesa's software OpenGL (libegl1, libgl1-mesa-dri)");
  };
  const auto get_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display != nullptr) impl_->display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (impl_->display == EGL_NO_DISPLAY) impl_->display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
  if (impl_->display == EGL_NO_DISPLAY || eglInitialize(impl_->display, nullptr, nullptr) == EGL_FALSE)
    throw fail("there is no EGL display");
  eglBindAPI(EGL_OPENGL_API);
  const EGLint config_wish[] = {
      EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_RED_SIZE, 8, EGL_DEPTH_SIZE, 24,
      EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  eglChooseConfig(impl_->display, config_wish, &config, 1, &count);
  if (count == 0) throw fail("EGL has no OpenGL configuration");
  const EGLint context_wish[] = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 2, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  impl_->context = eglCreateContext(impl_->display, config, EGL_NO_CONTEXT, context_wish);
  if (impl_->context == EGL_NO_CONTEXT) throw fail("OpenGL 3.2 is not available");
  if (eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context) == EGL_FALSE)
    throw fail("the OpenGL context cannot be used");

  impl_->window = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
  impl_->window->SetOwnContext(0);
  impl_->window->SetIsCurrent(true);
  impl_->window->SetReadyForRendering(true);
  impl_->window->SetMultiSamples(0);  // in software nearly three times the work; smooth edges: set_depth
  impl_->window->SetSize(width, height);
  {
    // GLEW, built for X, complains that there is no X display after it has loaded every function: harmless.
    const QuietVtk quiet;
    impl_->window->OpenGLInitContext();
  }
  impl_->window->SetFrameBlitModeToNoBlit();
}

OffscreenWindow::~OffscreenWindow() {
  if (!impl_) return;
  make_current();
  if (impl_->window) {
    impl_->window->Finalize();
    impl_->window = nullptr;
  }
  if (impl_->context != EGL_NO_CONTEXT) {
    eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(impl_->display, impl_->context);
  }
}

vtkGenericOpenGLRenderWindow* OffscreenWindow::window() {
  return impl_->window;
}

void OffscreenWindow::make_current() {
  eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context);
}

void OffscreenWindow::finish() {
  impl_->window->WaitForCompletion();
}

Picture OffscreenWindow::render() {
  const QuietVtk quiet;
  impl_->window->Render();
  return grab(impl_->window);
}

Picture grab(vtkGenericOpenGLRenderWindow* window) {
  Picture picture{window->GetSize()[0], window->GetSize()[1], {}};
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, picture.width - 1, picture.height - 1, 0, pixels.Get(), 0);
  const std::size_t row = static_cast<std::size_t>(picture.width) * 3;
  picture.rgb.resize(row * static_cast<std::size_t>(picture.height));
  for (int y = 0; y < picture.height; ++y) {
    std::copy_n(pixels->GetPointer(0) + static_cast<std::size_t>(picture.height - 1 - y) * row, row,
                picture.rgb.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(y) * row));
  }
  return picture;
}

}  // namespace osteo::inline display
