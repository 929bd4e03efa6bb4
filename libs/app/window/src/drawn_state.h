// What was drawn, as members of a state file that a test reads: where components and windows are, and what of them has
// no room. Private to libs/app/window.
#pragma once
#include <set>
#include <string>

#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

/// `J`: an object of either kind of JSON that state files are written by.
template <class J>
void add_drawn(J& state) {
  J items = J::object(), windows = J::object();
  for (const auto& [name, at] : kept_places()) items[name] = J{static_cast<double>(at[0]), static_cast<double>(at[1])};
  std::set<std::string> cut;
  for (const ShownWindow& w : shown_windows()) {
    windows[w.name] = J{static_cast<double>(w.box.x), static_cast<double>(w.box.y), static_cast<double>(w.box.width),
                        static_cast<double>(w.box.height)};
    if (w.cut) cut.insert(w.name);
  }
  state["items"] = items;
  state["windows"] = windows;
  state["windows_cut"] = J(cut);
  state["texts_cut"] = J(texts_cut());
}

}  // namespace osteo::inline app
