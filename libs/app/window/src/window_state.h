// What the window shows, for programs that test it. Private to libs/app/window.
#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/display/view/quality.h"
#include "osteo/simulation/bone/saw.h"
#include "osteo/simulation/camera/microscope.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline app {

/// Of what is around the bone.
struct ViewState {
  std::string layout;
  int em_pixels = 0;
  bool full_screen = false, asking = false, wheel = false, before = false, writing = false, ended = false,
       ruler = false;
  double ruler_mm = 0;
  std::size_t notes = 0;
  std::string hint;  // that is shown
  bool hints = false;
  int findings = -1;  // -1: not known yet
  bool timeline = false, playing = false;
  double review_s = 0, review_mm3 = 0;            // the time that is shown, and the bone there is then
  double speed = 1;                               // at which it plays
  std::map<std::string, std::string> structures;  // how each is shown
  std::vector<std::string> steps_done;            // of the first five minutes, by name
  std::string next_step;
  bool typing = false;        // in the list of commands
  std::string search, found;  // what, and the name of the row that is chosen
  std::string settings;       // the page that is open
  struct Place {
    std::string name;
    float x = 0, y = 0;
  };
  std::vector<Place> rows;      // of that page: where they are
  std::string focus;            // the part of the window that has the keys
  std::array<float, 4> view{};  // x, y, width, height
};

/// Of the hand.
struct HandState {
  int one_to = 1;
  bool clutch = false, wrist_rest = false, left_handed = false;
  std::string listening, row;  // for what; of the page that the keys are on
  double burr_share = 1, tilted_rad = 0;
  Vec3 second_mm, axis{0, 0, 1};  // axis: as it is wanted
};

/// Of the nerve monitor; no channels: there is none.
struct MonitorState {
  std::size_t channels = 0, events = 0;
  double seconds = 0;
  bool shown = false, muted = false;
};

/// Of who leads and who takes part; title empty: nobody.
struct TutorState {
  std::string title, invitation;
  std::vector<std::string> steps, harm;  // of steps those that are done
  std::size_t links = 0, heard = 0;
  bool guiding = false;
  double pull = 0, apart_mm = -1;
};

struct WindowState {
  TutorState tutor;
  ViewState main_view;
  HandState motion;
  MonitorState monitor;
  std::uint64_t pictures = 0;  // turns of the loop
  std::uint64_t drawn = 0;     // pictures of the scene
  bool at_rest = false;
  std::size_t kept = 0;  // parts of the last one that were not drawn again
  double scale = 1;
  QualityChoice quality;
  std::string failure, message, tool;
  std::filesystem::path session;
  bool leading = false, drill_latched = false, help = false, sucking = false, washing = false, sound = false;
  int hand = 0;  // SceneTools::Tool
  int cut_in_middle = -1;
  bool cuts_along_tool = false;
  double cuts_ms = 0;  // that drawing cuts took last
  SawCut cut;
  RigidTransform plate;
  Vec3 eye, centre_mm, goal_mm;
  double radius_mm = 0;
  ScopeView view;
  double pixels_per_mm = 0;
  bool camera_moves = false;  // flies
  int stereo = 0;             // StereoMode
  int width = 0, height = 0;
  TickRecord tick;
  double removed_mm3 = 0;
  double hottest_c = 0;  // 0: the scene has no heat
  Vec3 down;             // where dust falls to; zero: the scene has none
  std::size_t bodies = 0, fixtures = 0, undo_steps = 0;
  std::vector<Vec3> places_mm;
};

/// As JSON, in place of what was there; a reader sees the one or the other. What cannot be written is left out.
void write_window_state(const WindowState& state, const std::filesystem::path& file);

}  // namespace osteo::inline app
