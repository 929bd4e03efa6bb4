// The mouse over slices, as whoever decides what it does is told. Private to libs/app/window.
#pragma once

namespace osteo::inline app {

enum class SliceButton { left, right, middle };

/// In pixels from the view's upper left corner; x and y to the right and down.
struct SlicePointer {
  int view = -1;  ///< none: beside all
  double x = 0, y = 0;
  bool shift = false, control = false;
};

}  // namespace osteo::inline app
