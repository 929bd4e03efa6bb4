// The window of 'osteo edit': three slices and the bone in 3D, tools, structures. GLFW, Dear ImGui and VTK in one
// OpenGL context.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/edit/document.h"

namespace osteo::inline app {

/// A place that should be looked at first: where the boundary of a structure is uncertain.
struct EditPlace {
  Vec3 at_mm;
  int structure = 0;  ///< its value
  std::string name;
  std::size_t voxels = 0;  ///< of the boundary that are uncertain there
};

struct EditWindowOptions {
  int width = 1360, height = 860;  ///< made smaller where the screen is
  double scale = 0;                ///< of text; 0: as the monitor has it. Times what the person chose.
  std::string title;
  std::vector<EditPlace> places;  ///< listed in this order
  std::string network;            ///< folder of a trained network that is proposed; empty: none
  std::filesystem::path
      state_file;  ///< what the window shows is written there as JSON after each picture, for tests; empty: nowhere
};

/// What was found in the scan: label map on its grid, with names, and where it should be looked at first.
struct EditFound {
  Labels structures;
  std::vector<EditPlace> places;  ///< by the label map's values
  std::string note;               ///< what is not to be trusted; may be empty
};

/// How a save ended.
struct EditSaved {
  bool ok = false;
  std::string text;  ///< what was written, or why it was not
};

/// What the window asks of whoever runs it.
struct EditWindowActions {
  /// Begins to write the corrections (the text of edits.json) into the case; returns at once.
  std::function<void(const std::string& edits)> save;
  /// How the save ended, once; nothing while it is at work or none was begun.
  std::function<std::optional<EditSaved>()> saved;
  /// Runs the trained network of a folder on a CT, on another thread; empty: there is no such action.
  std::function<EditFound(const Image& ct, const std::string& network, const Context& context)> find;
  /// Asked before each picture: whether the window is to close.
  std::function<bool()> stop;
};

/// Opens a window and runs until it is closed; asks before it closes with corrections that were not saved. Nothing of
/// the scan is written anywhere. Returns the number of OpenGL errors seen (0 when all is well). Error(failed) when no
/// window can be opened. Mouse and keys: docs/guides/edit.md, and F1 in the window.
int run_edit_window(EditDocument& document, const EditWindowOptions& options, const EditWindowActions& actions);

}  // namespace osteo::inline app
