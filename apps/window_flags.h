// Flags of the window: declared once, for 'osteo rehearse', which passes them on, and for osteo-rehearse.
#pragma once
#include <string>
#include <vector>

#include "osteo/display/view/quality.h"
#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/posture.h"
#include "osteo/simulation/camera/stereo.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/simulation/marker/device.h"

namespace osteo {

enum class Hand : int { automatic, mouse, spacemouse, woodenhaptics, marker, igtl };
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(Hand) {
  return {"auto", "mouse", "spacemouse", "woodenhaptics", "marker", "igtl"};
}

/// Of the window at the start.
enum class StartLayout : int { last, beside, operate, plan };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(StartLayout) {
  return {"last", "beside", "operate", "plan"};
}

/// How someone takes part in a session that runs elsewhere.
enum class Attend : int { trainee, watcher };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Attend) {
  return {"trainee", "watcher"};
}

/// What moves the second hand.
enum class SecondDevice : int { keys, spacemouse, woodenhaptics };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(SecondDevice) {
  return {"keys", "spacemouse", "woodenhaptics"};
}

struct WindowFlags {
  using Params = WindowFlags;
  std::string out;
  BurrKind burr = BurrKind::cutting;
  double diameter_mm = 4;
  BurrShape shape = BurrShape::ball;
  ContactMethod contact = ContactMethod::overlap;
  std::string settings;
  Hand device = Hand::automatic;
  std::string arm;
  std::string tracker;
  std::string camera = "camera.json";
  std::string pen;
  std::string video = "/dev/video0";
  CameraPlace camera_place = CameraPlace::facing;
  double hand_scale = 1;
  SecondDevice second_device = SecondDevice::keys;
  std::string second_instrument = "sucker 10 Fr";
  bool dust = false;
  bool heat = false;
  Posture position = Posture::supine;
  double head_turned_deg = 0;
  double rate_hz = 1000;
  std::string resume;
  std::string playback, playback_as, review;
  bool tutor = false, two_way = false;
  std::string listen = "127.0.0.1", join, code;
  int port = 0;
  Attend role = Attend::trainee;
  std::string scan;
  std::string procedure;
  bool sound = true;
  double volume = 0.7;
  bool alarms = false;
  bool monitor = false;
  std::string monitor_setup;
  std::string stream;
  StereoMode stereo = StereoMode::off;
  double stereo_base = 22;
  std::string experiment;
  bool require_approved = false;
  Quality quality = Quality::automatic;
  int width = 1360;
  int height = 860;
  double scale = 0;
  StartLayout layout = StartLayout::last;
  bool full_screen = false;
  bool end_page = true;
  std::string state_file;
  static void describe(WindowFlags& p, auto& visit) {
    visit({"out", "folder for the session (empty: a new one in CASE/sessions; also -o)"}, p.out);
    visit({"burr", "kind of burr at the start"}, p.burr);
    visit({"diameter_mm", "of the burr at the start: 1, 2, 3, 4, 5, 6 or 7", "mm", 1, 7}, p.diameter_mm);
    visit({"shape", "of the burr at the start"}, p.shape);
    visit({"contact", "how the burr feels bone: rays, volume, overlap or proxy; docs/haptics.md compares them"},
          p.contact);
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"device",
           "in the window, what moves the drill; auto takes the best that is plugged in ('osteo devices'); marker is a "
           "pen before a "
           "camera, of pose "
           "only (docs/marker.md); igtl is a tool that somebody else tracks (docs/network.md), also with --headless"},
          p.device);
    visit({"tracker", "of igtl: HOST:PORT or HOST:PORT/NAME of an OpenIGTLink server that tells where the tool is"},
          p.tracker);
    visit({"arm", "in the window, geometry and motors of a WoodenHaptics arm, as JSON (empty: Polhem v3)"}, p.arm);
    visit({"camera", "of the marker: its lens, made by calibrate-camera"}, p.camera);
    visit({"pen", "of the marker: made by calibrate-pen (empty: pen 1, its tip 100 mm below the middle of the prism)"},
          p.pen);
    visit({"video", "of the marker: where its camera is; a video stands for one"}, p.video);
    visit(
        {"camera_place",
         "of the marker: facing you from the screen, above the desk (its picture's top away from you), or behind you"},
        p.camera_place);
    visit({"hand_scale", "of the marker: mm in the scene for a mm of the hand", "", 0.05, 10}, p.hand_scale);
    visit({"second_device",
           "in the window, what moves the second hand; keys: a sucker and water come beside the drill while V and I "
           "are held, with --dust"},
          p.second_device);
    visit({"second_instrument",
           "that the second hand holds, with a device of its own: sucker 10 Fr, irrigator 2 mm, probe 1 mm, a burr"},
          p.second_instrument);
    visit(
        {"dust", "bone dust: falls, piles up and hides the bone until it is sucked off; with water it becomes slurry"},
        p.dust);
    visit({"heat",
           "how warm drilling makes bone and structures, on a guess of what share of a burr's work heats bone "
           "(docs/heat.md; nothing "
           "clinical): shown "
           "on the bone from 42 C on and at the nearest structure"},
          p.heat);
    visit({"position", "how the patient lies: where dust and water fall to"}, p.position);
    visit({"head_turned_deg", "with it: positive where the face turns towards the left shoulder", "deg", -180, 180},
          p.head_turned_deg);
    visit({"rate_hz", "ticks of the servo a second", "Hz", 100, 5000}, p.rate_hz);
    visit({"resume", "go on from the end of this session"}, p.resume);
    visit({"playback", "in the window, a session whose hand leads yours; 'osteo playback' has all about it"},
          p.playback);
    visit({"playback_as", "with it, its flags: mode=guide,pace=way,from_s=2"}, p.playback_as);
    visit({"tutor",
           "in the window, others may join: as the trainee, whose hand is a second one here, or to watch; "
           "docs/tutoring.md"},
          p.tutor);
    visit({"listen",
           "with it, address to be heard on; 127.0.0.1 or ::1: by this machine alone, 0.0.0.0 or :: : by all that can "
           "reach it"},
          p.listen);
    visit({"port", "with it, UDP; 0: any that is free", "", 0, 65535}, p.port);
    visit({"two_way", "with it, your hand is pulled by the trainee's too"}, p.two_way);
    visit({"join", "in the window, take part in a session that runs elsewhere: HOST:PORT, as it is shown there"},
          p.join);
    visit({"code",
           "with it, the code that is shown there (empty: the window asks; here others can see it in the list of "
           "processes)"},
          p.code);
    visit({"role", "with it, trainee: your hand is led by the instructor's; watcher: no hand"}, p.role);
    visit({"review",
           "in the window, a session that is over, to be looked at again: findings, its course over time, the bone as "
           "of any moment; nothing "
           "is written into it"},
          p.review);
    visit({"scan",
           "in the window, the case's CT as a volume file: cuts then show soft tissue too (empty: the bone's values, "
           "which the case keeps)"},
          p.scan);
    visit({"procedure",
           "in the window, what is to be done, as JSON (pipelines/procedures): its regions are outlined in bone and "
           "cuts, the page at the "
           "end has its findings (empty: none)"},
          p.procedure);
    visit({"sound",
           "in the window, what drilling sounds like (a model, docs/sound.md), on the machine's sound card where there "
           "is one"},
          p.sound);
    visit({"volume", "of that sound; long loud parts are held below the level that is safe with head-phones", "", 0, 1},
          p.volume);
    visit({"alarms", "with it, beeps where a structure at risk is touched, two tones where it is injured"}, p.alarms);
    visit({"monitor",
           "in the window, a nerve monitor: what drilling near the case's nerves would be heard of (a model for "
           "practice, docs/monitor.md)"},
          p.monitor);
    visit({"monitor_setup", "its constants and channels, as JSON (empty: the built-in ones)"}, p.monitor_setup);
    visit({"stream",
           "tells the network what happens while it does: igtl:PORT, igtl:HOST:PORT, igtl:PORT/stimulator, "
           "cerebus:HOST:PORT/VERSION, lsl, "
           "with commas "
           "between (empty: nobody; docs/network.md)"},
          p.stream);
    visit({"stereo", "in the window, a picture for each eye, put together for the screen; docs/camera.md"}, p.stereo);
    visit({"stereo_base", "between the eyes; they agree on what lies in the focus", "mm", 0, 65}, p.stereo_base);
    visit(
        {"experiment",
         "in the window, 'camera': views to bring the camera to, timed, as CSV in the session's folder (empty: none)"},
        p.experiment);
    visit({"require_approved", "refuse a case that nobody has approved as it is ('osteo approve')"},
          p.require_approved);
    visit({"quality",
           "how the picture is drawn: plain; calm, with shade in the creases and smooth edges when it rests; deep, "
           "always so; auto by "
           "measured "
           "time"},
          p.quality);
    visit({"width", "of the window; no more than the screen has", "pixels", 640, 8192}, p.width);
    visit({"height", "of the window; no more than the screen has", "pixels", 480, 8192}, p.height);
    visit({"scale", "of text and panels (0: by the monitor); Ctrl + and Ctrl - in the window", "", 0, 4}, p.scale);
    visit({"layout", "of the window at the start; last: as it was left. F2 in the window"}, p.layout);
    visit({"full_screen", "the window fills the screen; F11 in the window"}, p.full_screen);
    visit({"end_page", "when the person ends the session (Q), what was done is shown; without, the window closes"},
          p.end_page);
    visit(
        {"state_file", "the window writes what it shows there as JSON after each picture, for tests (empty: nowhere)"},
        p.state_file);
  }
};

/// What begins a session of these flags, at its first tick: how the patient lies, where it is not on the back.
inline std::vector<SceneAction> first_actions(const WindowFlags& flags) {
  if (!flags.dust || (flags.position == Posture::supine && flags.head_turned_deg == 0)) return {};
  return {SceneAction::posture(down_of(flags.position, flags.head_turned_deg))};
}

}  // namespace osteo
