// A text for the screen in the person's language, with the English that the session's file keeps of it. Private to
// libs/app/window; no ImGui.
#pragma once
#include <concepts>
#include <string>
#include <utility>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {

struct LocalText {
  std::string shown;    ///< in the language of the window
  std::string english;  ///< for files, which do not depend on the language

  LocalText() = default;
  /// `make` returns the text by tr(), filled() and shown_number(). It runs twice, so it changes nothing.
  template <std::invocable Make>
  LocalText(const Make& make) : shown(make()) {  // NOLINT(google-explicit-constructor): written where it is said
    const EnglishHere files;
    english = make();
  }
  /// A text that is no catalogue's: an error of the system, a file's name.
  [[nodiscard]] static LocalText untranslated(std::string text) {
    LocalText t;
    t.shown = t.english = std::move(text);
    return t;
  }

  [[nodiscard]] bool empty() const { return shown.empty(); }
  LocalText& operator+=(const LocalText& more) {
    shown += more.shown;
    english += more.english;
    return *this;
  }
  friend bool operator==(const LocalText&, const LocalText&) = default;
};

}  // namespace osteo::inline app
