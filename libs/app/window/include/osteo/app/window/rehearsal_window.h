// The rehearsal in a window: bone in 3D, three linked cuts, panel. GLFW, Dear ImGui and VTK in one OpenGL context.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "osteo/app/window/monitor_controller.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/app/window/session_review.h"
#include "osteo/app/window/sound_out.h"
#include "osteo/app/window/start_page.h"
#include "osteo/app/window/tutor_now.h"
#include "osteo/app/window/window_shell.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/volume.h"
#include "osteo/display/view/planned_regions.h"
#include "osteo/display/view/quality.h"
#include "osteo/imaging/dicom/verdict.h"
#include "osteo/session/recording/planned_cuts.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/camera/microscope.h"
#include "osteo/simulation/camera/stereo.h"

namespace osteo::inline simulation {
struct HandTuning;
}

namespace osteo::inline app {

struct WindowOptions {
  Quality quality = Quality::automatic;
  int tool = 3;
  bool from_case = true;         ///< how the first session begins
  std::string device = "mouse";  ///< as the panel names it
  VerdictSummary scan;           ///< what the import found in the scan; status empty: unknown
  std::string approval;          ///< of the case, in words; empty: unknown
  bool approval_ended = false;   ///< by a later change: said in another colour
  std::vector<SparseGrid>
      bone;  ///< density as the case has it, the finest first: cuts show what is missing of it; empty: they do not
  std::optional<Image> ct;  ///< the scan of the case, for its cuts; none: they show what the case keeps of it
  std::vector<PlannedRegion>
      regions;  ///< of a procedure, to be outlined; those of structures that the case lacks are told
  std::vector<std::string> thinned;  ///< structures whose wall a procedure thins: clear at first, for they are spaces
  std::optional<Labels>
      uncertainty;  ///< of boundaries, as segment-network gives it; what is in its last class is hatched
  std::vector<PlannedCut> planned_cuts;     ///< to choose from
  std::filesystem::path planned_cuts_file;  ///< that a cut kept as planned is added to
  std::vector<Vec3> way;                    ///< of a recorded hand that leads; drawn; empty: none does
  StereoParams stereo;
  bool review_only = false;  ///< a session that is over is shown: the page at the end, and nothing that begins another
  bool camera_trial =
      false;  ///< views to bring the camera to are shown and timed; camera-trial.csv in the session's folder
  std::string case_hash;                   ///< of the manifest: names the case in captions, without its folder
  std::vector<StartProcedure> procedures;  ///< to choose from in the settings
  std::optional<ScopeView> view;           ///< where one looks from at first; none: from the left
  bool end_page = true;  ///< what was done is shown when the person ends the session; false: the window closes
  std::filesystem::path
      state_file;  ///< what the window shows is written there as JSON after each picture, for tests; empty: nowhere
};

/// What a session that has ended came to.
struct SessionFacts {
  struct Structure {
    std::string name;
    double least_clearance_mm = 0, touched_s = 0, injured_s = 0;
    /// Of it, by what took it ("saw": by its plane, "burr", "hand saw", "shaft", "plate screws"; 0: contact).
    std::map<std::string, double> cut_mm3 = {};
  };
  bool past = false;  ///< it was over before the window opened, and is only looked at
  std::filesystem::path folder;
  double seconds = 0, rate_hz = 1000, removed_mm3 = 0, sawn_mm3 = 0, tissue_mm3 = 0;
  std::size_t bodies = 1;
  std::vector<std::string> plates;    ///< in words
  bool has_structures = false;        ///< the case knows critical structures
  std::vector<Structure> structures;  ///< those that came near
  /// Something went through one (StructureCutEvent), or touched it: 0 mm3.
  void add_cut(const std::string& structure, const std::string& by, double mm3);
  std::vector<std::string> warnings;
  std::optional<std::string> score;  ///< in words, where somebody gives one
};

/// How the window looks at the bone when a session begins. Unit vectors.
struct HandView {
  Vec3 eye;   ///< from the bone towards who looks
  Vec3 axis;  ///< along the handle
  int tool = 3;
};

/// Hardware for the camera, as it is now. Lengths, pushes and turns in the device's own right, up and towards the user.
struct CameraDevices {
  std::optional<Vec3> hand_mm;    ///< of an arm whose hand is lent to the camera
  std::optional<Vec3> hand_axis;  ///< its handle
  std::optional<Vec3> push;       ///< deflection of a puck that is not the drill now, 0 to 1
  Vec3 turn;                      ///< and its twist
};

/// What the window asks of whoever runs the rehearsal. After save, and after anything that throws, nothing runs.
struct WindowActions {
  /// Ends the session that runs, closes its files; where none runs, does nothing.
  std::function<void()> save;
  /// Starts a session: from the case's bone (true) or from where the last one ended (false). The hand waits beside the
  /// bone, as returned.
  std::function<HandGoal(bool from_case, const HandView& view)> begin;
  /// The rehearsal that runs now; null where none does.
  std::function<Rehearsal*()> rehearsal;
  /// Notes of the session that the first one goes on from, asked for once when that has begun; none: it goes on from
  /// none.
  std::function<std::vector<Note>()> notes_before;
  /// Folder for screenshots of the session that runs now, or ran last.
  std::function<std::filesystem::path()> folder;
  /// Why the session that runs has to end now (its recording has): the window saves it and says so.
  std::function<std::optional<Error>()> failure;
  /// Each frame: what hardware says to the camera. `lend`: the drill's hand is to rest where it is, its device moves
  /// the camera. May be empty.
  std::function<CameraDevices(bool lend)> camera;
  /// Each frame, of a hand that moves by itself: how it works on its tool, and what keys and buttons of the window
  /// press. May be empty.
  std::function<void(const HandTuning&)> tune;
  /// Each frame: switches of a foot pedal that are down, as bits; nothing: there is no pedal. `attended`: the window
  /// has the keys; while it has not, no switch is to press anything, and after that not before it has come up. May be
  /// empty.
  std::function<std::optional<std::uint32_t>(bool attended)> switches;
  /// Asked before each picture: whether the window is to close.
  std::function<bool()> stop;
  /// Of the session that was saved last.
  std::function<SessionFacts()> facts = {};
  /// The scene as the session that runs began with it; may take seconds, and is called in another thread. Empty: cannot
  /// be told.
  std::function<World(const Context&)> world_at_begin = {};
  /// Of the session that was saved last: what there is to say of it. May take seconds, and is called in another thread,
  /// in which no session is begun meanwhile. Empty: nothing is shown.
  std::function<SessionReview(const Context&)> review = {};
  /// From now on the rehearsal has a nerve monitor, or none. False: it has to stay as it is. Empty: it always has.
  std::function<bool(bool)> turn_monitor = {};
  /// From now on dust and water, or heat, are simulated in the session, or not. Empty: they are as another has them.
  std::function<void(Simulated, bool)> simulate = {};
  /// The nerve monitor of the rehearsal that runs; null: it has none. Empty: there never is one.
  std::function<MonitorController*()> monitor = {};
  /// Who leads the hand, and who takes part from elsewhere. Empty: nobody ever does.
  std::function<TutorNow()> tutor = {};
  /// Each frame of a session with a tutor: how far the procedure is. `injured`: structures that a rotating burr or a
  /// saw has reached. Empty: it is not judged here.
  std::function<std::vector<TutorNow::Step>(const std::vector<std::string>& injured)> steps = {};
  /// The hand is to be led, or let go; softly. Empty: nobody leads it.
  std::function<void(bool)> lead = {};
};

/// How a rehearsal was left.
struct WindowEnd {
  bool another = false;                               ///< the person wants another case
  std::optional<std::filesystem::path> dropped = {};  ///< which, when it was dropped onto the window
  bool changed = false;  ///< that is the session itself, to continue with what was chosen in the settings meanwhile
  std::optional<ScopeView> view = {};  ///< and from where one looked then
  bool dust = false, heat = false;     ///< and whether it had these
};

/// Begins a session in the window and runs until the person leaves it; the session that runs then is the caller's to
/// save. What fails meanwhile is shown in the window, which offers to begin again; what was not put right, or was lost,
/// is thrown at the end. `person`: what is changed in the window is changed there. `sound`: turned on and off, louder
/// and softer in the window; whoever runs the rehearsal tells it which to follow. Mouse and keys:
/// docs/guides/surgeon.md, and F1 in the window.
WindowEnd run_rehearsal_window(WindowShell& shell, PersonSettings& person, const WindowOptions& options,
                               const SparseGrid* hu, const WindowActions& actions, SoundOut& sound);

}  // namespace osteo::inline app
