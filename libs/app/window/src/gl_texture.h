// A picture on the graphics card, as ImGui shows it. Private to libs/app/window; a current GL context.
#pragma once

namespace osteo::inline app {

/// One without pixels, which does not repeat beyond its edges; `smooth`: linear between them, else the nearest. Its
/// owner deletes it (glDeleteTextures).
[[nodiscard]] unsigned make_texture(bool smooth = true);
/// Rows of 3 (RGB) or 4 (RGBA) bytes a pixel without gaps; null: room for so many. Nothing is bound afterwards.
void put_pixels(unsigned texture, int width, int height, int channels, const void* pixels);

}  // namespace osteo::inline app
