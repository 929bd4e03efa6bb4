// What the window shows, for programs that test it. Private to libs/window.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/bone/rigid_transform.h"
#include "osteo/bone/saw.h"
#include "osteo/camera/microscope.h"
#include "osteo/haptics/stream.h"
#include "osteo/view/quality.h"

namespace osteo {

/// Of what is around the bone.
struct RoomState {
  std::string layout;
  int em_pixels = 0;
  bool full_screen = false, asking = false, wheel = false, panel_keys = false, before = false, writing = false, ended = false,
       ruler = false;
  double ruler_mm = 0;
  std::size_t notes = 0;
  int steps_done = 0;
  std::array<float, 4> view{};  // x, y, width, height
};

struct WindowState {
  RoomState room;
  std::uint64_t pictures = 0;  // turns of the loop
  std::uint64_t drawn = 0;     // pictures of the scene
  bool at_rest = false;
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
  std::size_t bodies = 0, fixtures = 0, undo_steps = 0;
  std::vector<Vec3> places_mm;
};

/// As JSON, in place of what was there; a reader sees the one or the other. What cannot be written is left out.
void write_window_state(const WindowState& state, const std::filesystem::path& file);

}  // namespace osteo
