// Who owns what cairo and Pango hand out: for sources that draw with them.
#pragma once
#include <cairo.h>
#include <pango/pangocairo.h>

#include <memory>

namespace osteo {

struct CairoFree {
  void operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }
  void operator()(cairo_t* c) const { cairo_destroy(c); }
  void operator()(PangoLayout* l) const { g_object_unref(l); }
};
template <class T>
using CairoOwned = std::unique_ptr<T, CairoFree>;

}  // namespace osteo
