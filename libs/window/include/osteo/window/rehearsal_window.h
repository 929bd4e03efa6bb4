// The rehearsal in a window: bone in 3D, three linked cuts, panel. GLFW, Dear ImGui and VTK in one OpenGL context.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "osteo/dicom/verdict.h"
#include "osteo/data/sparse_grid.h"
#include "osteo/scene/rehearsal.h"

namespace osteo {

struct WindowOptions {
  int width = 1360, height = 860;
  std::string title;
  int tool = 3;
  std::string device = "mouse";  ///< as the panel names it
  VerdictSummary scan;  ///< what the import found in the scan; status empty: unknown
};

/// What the window asks of whoever runs the rehearsal.
struct WindowActions {
  /// Ends the session that runs, closes its files.
  std::function<void()> save;
  /// Starts a session: from the case's bone (true) or from where the last one ended (false).
  std::function<void(bool from_case)> begin;
  /// The rehearsal that runs now; changes with `begin`.
  std::function<Rehearsal&()> rehearsal;
  /// Folder for screenshots of the session that runs now.
  std::function<std::filesystem::path()> folder;
};

/// Runs until the window is closed. Returns the number of OpenGL errors seen (0 when all is well).
/// Error(failed) when no window can be opened. Mouse and keys: docs/guide-surgeon.md, and F1 in the window.
int run_rehearsal_window(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions);

}  // namespace osteo
