// Flags of the window: declared once, for 'osteo rehearse', which passes them on, and for osteo-rehearse.
#pragma once
#include <string>
#include <vector>

#include "osteo/app/cli/command.h"
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
  std::string second_instrument = "suction tube 10 Fr";
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
  bool mirror = false;
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
    visit({"diameter_mm", "diameter of the burr at the start: 1, 2, 3, 4, 5, 6 or 7", "mm", 1, 7}, p.diameter_mm);
    visit({"shape", "shape of the burr at the start"}, p.shape);
    visit({"contact",
           "how the burr feels bone: rays, volume, overlap or proxy; docs/validation/haptics.md compares them"},
          p.contact);
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"device",
           "device that moves the drill; auto takes the best that is plugged in ('osteo devices'); marker is a pen "
           "before a camera, of pose only (docs/how-to/marker.md); igtl is a tool that somebody else tracks "
           "(docs/how-to/network.md), also with --headless"},
          p.device);
    visit({"tracker", "OpenIGTLink server that tracks the tool with --device igtl: HOST:PORT or HOST:PORT/NAME"},
          p.tracker);
    visit({"arm", "geometry and motors of a WoodenHaptics arm, as JSON (empty: Polhem v3)"}, p.arm);
    visit({"camera", "lens of the marker's camera, made by calibrate-camera"}, p.camera);
    visit({"pen",
           "pen that carries the markers, made by calibrate-pen (empty: pen 1, its tip 100 mm below the middle of the "
           "prism)"},
          p.pen);
    visit({"video", "camera that sees the markers; a video file stands for one"}, p.video);
    visit({"camera_place",
           "place of the marker's camera: facing you from the screen, above the desk (its picture's top away from "
           "you), or behind you"},
          p.camera_place);
    visit({"hand_scale", "movement in the scene for 1 mm of the hand, with --device marker", "", 0.05, 10},
          p.hand_scale);
    visit({"second_device",
           "device that moves the second hand; keys: a suction tube comes beside the drill while V is held, water from "
           "one "
           "I to the next"},
          p.second_device);
    visit({"second_instrument",
           "instrument of the second hand where it has a device of its own: suction tube 10 Fr, irrigator 2 mm, probe "
           "1 mm, "
           "a burr"},
          p.second_instrument);
    visit({"dust",
           "bone dust from the first tick on: falls, piles up and hides the bone until it is sucked off; with water it "
           "becomes a paste"},
          p.dust);
    visit({"heat",
           "how warm drilling makes bone and structures, on a guess of what share of a burr's work heats bone "
           "(docs/validation/heat.md; nothing "
           "clinical): shown "
           "on the bone from 42 C on and at the nearest structure"},
          p.heat);
    visit({"position", "how the patient lies: where dust and water fall to"}, p.position);
    visit({"head_turned_deg", "rotation of the head, positive where the face turns towards the left shoulder", "deg",
           -180, 180},
          p.head_turned_deg);
    visit({"rate_hz", "ticks of the servo a second", "Hz", 100, 5000}, p.rate_hz);
    visit({"resume", "go on from the end of this session"}, p.resume);
    visit({"playback", "session whose hand guides yours; see 'osteo playback'"}, p.playback);
    visit({"playback_as", "flags of --playback, like mode=guide,pace=way,from_s=2"}, p.playback_as);
    visit({"tutor",
           "let others join: as the trainee, whose hand is a second one here, or to watch; docs/guides/tutoring.md"},
          p.tutor);
    visit({"listen",
           "address to accept connections on with --tutor; 127.0.0.1 or ::1: this machine alone, 0.0.0.0 or :: : "
           "everybody who can reach it"},
          p.listen);
    visit({"port", "UDP port for --tutor (0: any that is free)", "", 0, 65535}, p.port);
    visit({"two_way", "couple both ways with --tutor: the trainee's hand pulls yours, too"}, p.two_way);
    visit({"join", "join a session that runs elsewhere: HOST:PORT, as it is shown there"}, p.join);
    visit({"code",
           "code for --join that is shown there (empty: the window asks; on the command line others can see it in the "
           "list of processes)"},
          p.code);
    visit({"role", "role for --join. trainee: the instructor's hand guides yours; watcher: no hand"}, p.role);
    visit({"review",
           "session to review in the window: findings, its course over time, the bone as of any moment; nothing is "
           "written into it"},
          p.review);
    visit({"scan",
           "the case's CT as a volume file, so that cuts show soft tissue, too (empty: the bone's values, which the "
           "case keeps)"},
          p.scan);
    visit({"procedure",
           "procedure to follow, by name (mastoidectomy, mastoid-window, mandible-split) or as JSON: its regions are "
           "outlined in bone and cuts, the page "
           "at the end has its findings, and no alarm is raised for what it opens (empty: none)"},
          p.procedure);
    visit({"mirror", "the procedure is for the other side of the body: left and right of its directions are exchanged"},
          p.mirror);
    visit({"sound", "play the sound of drilling (a model, docs/validation/sound.md)"}, p.sound);
    visit({"volume", "volume of the sound; long loud parts are held below the level that is safe with headphones", "",
           0, 1},
          p.volume);
    visit({"alarms", "alarm tones: a beep on contact with a critical structure, two tones on a violation"}, p.alarms);
    visit({"monitor",
           "play a nerve monitor: what it would show of drilling near the case's nerves (a model for practice, "
           "docs/validation/monitor.md)"},
          p.monitor);
    visit({"monitor_setup", "constants and channels of the nerve monitor, as JSON (empty: the built-in ones)"},
          p.monitor_setup);
    visit({"stream",
           "sends to the network what happens meanwhile: igtl:PORT, igtl:HOST:PORT, igtl:PORT/stimulator, "
           "cerebus:HOST:PORT/VERSION, lsl, "
           "with commas "
           "between (empty: nobody; docs/how-to/network.md)"},
          p.stream);
    visit({"stereo", "stereo display: how the pictures of both eyes share the screen; docs/how-to/camera.md"},
          p.stereo);
    visit({"stereo_base", "distance between the eyes, whose pictures agree on what lies in the focus", "mm", 0, 65},
          p.stereo_base);
    visit({"experiment",
           "experiment in the window; 'camera': views to bring the camera to, timed, as CSV in the session's folder "
           "(empty: none)"},
          p.experiment);
    visit({"require_approved", "reject a case that nobody has approved as it is ('osteo approve')"},
          p.require_approved);
    visit({"quality",
           "how the picture is drawn: plain; calm, with shade in the creases and smooth edges when it rests; deep, "
           "always so; auto by "
           "measured "
           "time"},
          p.quality);
    visit({"width", "width of the window, at most the screen's", "pixels", 640, 8192}, p.width);
    visit({"height", "height of the window, at most the screen's", "pixels", 480, 8192}, p.height);
    visit({"scale", "size of text and panels (0: by the monitor); Ctrl + and Ctrl - change it in the window", "", 0, 4},
          p.scale);
    visit({"layout", "layout of the window at the start; last: the one that was left. F2 changes it"}, p.layout);
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
  if (flags.position == Posture::supine && flags.head_turned_deg == 0) return {};
  return {SceneAction::posture(down_of(flags.position, flags.head_turned_deg))};
}

/// The titles of these flags in the help. `first`: fields of the command itself that most people need.
inline std::vector<cli::FlagGroup> window_flag_groups(const std::vector<std::string>& first = {}) {
  std::vector<cli::FlagGroup> groups{
      {"Most used", first},
      {"Devices",
       {"second_device", "second_instrument", "tracker", "arm", "camera", "pen", "video", "camera_place", "hand_scale",
        "rate_hz"}},
      {"Patient and scene", {"position", "head_turned_deg", "heat", "scan", "require_approved"}},
      {"Instrument and force", {"shape", "contact", "settings"}},
      {"Sound and nerve monitor", {"sound", "volume", "alarms", "monitor", "monitor_setup"}},
      {"Sessions and teaching",
       {"resume", "review", "playback", "playback_as", "tutor", "listen", "port", "two_way", "join", "code", "role",
        "stream", "experiment"}},
      {"Window",
       {"layout", "full_screen", "quality", "stereo", "stereo_base", "width", "height", "scale", "end_page",
        "state_file"}}};
  for (const char* const name : {"out", "burr", "diameter_mm", "device", "dust", "procedure"})
    groups.front().fields.emplace_back(name);
  return groups;
}

}  // namespace osteo
