// Pictures as PNG and back, by cairo; text made fit to be shown.
#include <cairo.h>
#include <glib.h>

#include <cmath>
#include <cstring>

#include "layout.h"
#include "osteo/core/base/error.h"

namespace osteo::report {

cairo_surface_t* surface_of(const Picture& picture, std::vector<unsigned char>& pixels) {
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, picture.width);
  pixels.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(picture.height));
  const std::uint8_t* from = picture.rgb.data();
  for (int y = 0; y < picture.height; ++y) {
    auto* to = reinterpret_cast<std::uint32_t*>(pixels.data() +
                                                static_cast<std::size_t>(y) * static_cast<std::size_t>(stride));
    for (int x = 0; x < picture.width; ++x, from += 3, ++to)
      *to = static_cast<std::uint32_t>(from[0]) << 16 | static_cast<std::uint32_t>(from[1]) << 8 | from[2];
  }
  return cairo_image_surface_create_for_data(pixels.data(), CAIRO_FORMAT_RGB24, picture.width, picture.height, stride);
}

std::string png_of(const Picture& picture) {
  std::vector<unsigned char> pixels;
  cairo_surface_t* const surface = surface_of(picture, pixels);
  std::string png;
  const cairo_status_t status = cairo_surface_write_to_png_stream(
      surface,
      [](void* sink, const unsigned char* bytes, unsigned n) {
        static_cast<std::string*>(sink)->append(reinterpret_cast<const char*>(bytes), n);
        return CAIRO_STATUS_SUCCESS;
      },
      &png);
  cairo_surface_destroy(surface);
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error(ExitCode::failed, std::string("cannot make a PNG: ") + cairo_status_to_string(status));
  return png;
}

Picture picture_of_png(std::string_view png) {
  cairo_surface_t* const surface = cairo_image_surface_create_from_png_stream(
      [](void* source, unsigned char* to, unsigned n) {
        auto& rest = *static_cast<std::string_view*>(source);
        if (rest.size() < n) return CAIRO_STATUS_READ_ERROR;
        std::memcpy(to, rest.data(), n);
        rest.remove_prefix(n);
        return CAIRO_STATUS_SUCCESS;
      },
      &png);
  Picture picture;
  if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS) {
    picture.width = cairo_image_surface_get_width(surface);
    picture.height = cairo_image_surface_get_height(surface);
    const unsigned char* const data = cairo_image_surface_get_data(surface);
    const int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        std::uint32_t p = 0;
        std::memcpy(&p, data + static_cast<std::ptrdiff_t>(y) * stride + 4 * static_cast<std::ptrdiff_t>(x), 4);
        for (const int shift : {16, 8, 0}) picture.rgb.push_back(static_cast<std::uint8_t>(p >> shift));
      }
    }
  }
  cairo_surface_destroy(surface);
  return picture;
}

std::string valid_utf8(std::string_view text) {
  char* const made = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
  std::string result(made);
  g_free(made);
  // Control characters are no text, and XML parsers reject them.
  for (char& c : result) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return result;
}

std::string tick_text(double value) {
  return std::to_string(std::lround(value));
}

Rgb ink(Tone tone) {
  switch (tone) {
    case Tone::quiet:
      return {0.40, 0.43, 0.47};
    case Tone::good:
      return {0.07, 0.40, 0.20};
    case Tone::caution:
      return {0.55, 0.33, 0.00};
    case Tone::bad:
      return {0.65, 0.08, 0.08};
    case Tone::plain:
      break;
  }
  return {0.11, 0.13, 0.16};
}

Rgb wash(Tone tone) {
  switch (tone) {
    case Tone::good:
      return {0.90, 0.96, 0.91};
    case Tone::caution:
      return {1.00, 0.95, 0.84};
    case Tone::bad:
      return {0.99, 0.89, 0.88};
    case Tone::quiet:
    case Tone::plain:
      break;
  }
  return {0.945, 0.95, 0.96};
}

std::string css(Rgb c) {
  char text[8];
  const auto part = [](double v) { return static_cast<unsigned>(std::lround(255 * v)) & 255U; };
  std::snprintf(text, sizeof text, "#%02x%02x%02x", part(c.r), part(c.g), part(c.b));
  return text;
}

std::string_view sign(Tone tone) {
  return tone == Tone::good ? "\u2713 " : tone == Tone::caution ? "! " : tone == Tone::bad ? "\u2717 " : "";
}

double row_height_mm(const sheet::Pictures& pictures, double width_mm, double gap_mm) {
  double aspects = 0;
  for (const sheet::Image& i : pictures.row)
    aspects += i.picture.height > 0 ? double(i.picture.width) / i.picture.height : 1;
  const double room = width_mm - gap_mm * static_cast<double>(pictures.row.empty() ? 0 : pictures.row.size() - 1);
  return aspects > 0 ? std::min(pictures.height_mm, room / aspects) : 0;
}

}  // namespace osteo::report
