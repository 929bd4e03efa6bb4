// The window's help: mouse and keys in columns, on as many pages as they need, so that nothing has to be scrolled.
// Private to libs/app/window.
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

namespace osteo::inline app {

struct HelpRow {
  float height = 0;
  bool heading = false;  ///< is kept with the row that follows
};
/// Rows from `from` up to but without `to`.
struct HelpColumn {
  std::size_t from = 0, to = 0;
};
/// Rows in their order into columns, of which the first `lower` are at most `low` high and the others at most `height`;
/// a row that is higher than its column is the last of it. A heading is never the last of a column that others follow.
/// No ImGui.
[[nodiscard]] std::vector<HelpColumn> into_columns(const std::vector<HelpRow>& rows, std::size_t lower, float low,
                                                   float height);

class HelpPage {
 public:
  [[nodiscard]] bool open() const { return open_; }
  void show(bool on) {
    open_ = on;
    page_ = 0;
  }
  /// By so many pages, as far as there are.
  void turn(int by);
  [[nodiscard]] int page() const { return page_; }
  /// As it was drawn last.
  [[nodiscard]] int pages() const { return pages_; }
  /// Between ImGui::NewFrame and Render, in a window of this size; `steps`: drawn above the first page's keys. No-op
  /// while it is closed.
  void draw(int width, int height, const std::function<void()>& steps = {});

 private:
  bool open_ = false;
  int page_ = 0, pages_ = 1;
  float steps_high_ = 0;  // as they were drawn last
};

}  // namespace osteo::inline app
