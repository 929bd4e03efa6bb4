// Mouse and keys, as the window's help lists them. Private to libs/window.
#pragma once

namespace osteo {

/// A window of its own; `open` becomes false when it is closed.
void draw_help(bool& open, int width);

}  // namespace osteo
