// The rehearsal in a window: bone in 3D, three linked cuts, panel. GLFW, Dear ImGui and VTK in one OpenGL context.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "osteo/base/error.h"
#include "osteo/camera/stereo.h"
#include "osteo/data/sparse_grid.h"
#include "osteo/data/volume.h"
#include "osteo/dicom/verdict.h"
#include "osteo/scene/rehearsal.h"
#include "osteo/view/quality.h"
#include "osteo/window/sound_out.h"

namespace osteo {

struct WindowOptions {
  int width = 1360, height = 860;  ///< made smaller where the screen is
  Quality quality = Quality::automatic;
  std::string title;
  int tool = 3;
  bool from_case = true;             ///< how the first session begins
  std::string device = "mouse";      ///< as the panel names it
  VerdictSummary scan;               ///< what the import found in the scan; status empty: unknown
  std::string approval;              ///< of the case, in words; empty: unknown
  bool approval_ended = false;       ///< by a later change: said in another colour
  std::vector<SparseGrid> bone;      ///< density as the case has it, the finest first: cuts show what is missing of it; empty: they do not
  std::optional<Image> ct;           ///< the scan of the case, for its cuts; none: they show what the case keeps of it
  StereoParams stereo;
  bool camera_trial = false;         ///< views to bring the camera to are shown and timed; camera-trial.csv in the session's folder
  std::filesystem::path state_file;  ///< what the window shows is written there as JSON after each picture, for tests; empty: nowhere
};

/// How the window looks at the bone when a session begins. Unit vectors.
struct HandView {
  Vec3 eye;   ///< from the bone towards who looks
  Vec3 axis;  ///< along the handle
  int tool = 3;
};

/// Hardware for the camera, as it is now. Lengths, pushes and turns in the device's own right, up and towards the user.
struct CameraDevices {
  bool pedal = false;             ///< its brake is released, as by the key
  std::optional<Vec3> hand_mm;    ///< of an arm whose hand is lent to the camera
  std::optional<Vec3> hand_axis;  ///< its handle
  std::optional<Vec3> push;       ///< deflection of a puck that is not the drill now, 0 to 1
  Vec3 turn;                      ///< and its twist
};

/// What the window asks of whoever runs the rehearsal. After save, and after anything that throws, nothing runs.
struct WindowActions {
  /// Ends the session that runs, closes its files; where none runs, does nothing.
  std::function<void()> save;
  /// Starts a session: from the case's bone (true) or from where the last one ended (false). The hand waits beside the bone, as returned.
  std::function<HandGoal(bool from_case, const HandView& view)> begin;
  /// The rehearsal that runs now; null where none does.
  std::function<Rehearsal*()> rehearsal;
  /// Folder for screenshots of the session that runs now, or ran last.
  std::function<std::filesystem::path()> folder;
  /// Why the session that runs has to end now (its recording has): the window saves it and says so.
  std::function<std::optional<Error>()> failure;
  /// Each frame: what hardware says to the camera. `lend`: the drill's hand is to rest where it is, its device moves the camera. May be
  /// empty.
  std::function<CameraDevices(bool lend)> camera;
  /// The pedal of a hand that moves by itself but has none of its own, by the window's keys and buttons; may be empty.
  std::function<void(bool drill)> press;
  /// Asked before each picture: whether the window is to close.
  std::function<bool()> stop;
};

/// Opens a window, begins a session, and runs until the window is closed; the session that runs then is the caller's to save. Returns the
/// number of OpenGL errors seen (0 when all is well). What fails meanwhile is shown in the window, which offers to begin anew; what was not
/// put right, or was lost, is thrown once the window is closed. Error(failed) when no window can be opened: then nothing was begun.
/// `sound`: turned on and off, louder and softer in the window; whoever runs the rehearsal tells it which to follow.
/// Mouse and keys: docs/guide-surgeon.md, and F1 in the window.
int run_rehearsal_window(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions, SoundOut& sound);

}  // namespace osteo
