// The verbs of osteo beside its stages.
#pragma once
#include <string>

#include "console_flags.h"
#include "edit_flags.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/app/cli/command.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/imaging/image/bone_threshold.h"
#include "osteo/imaging/image/crop.h"
#include "osteo/simulation/marker/body.h"
#include "osteo/simulation/marker/sheet.h"
#ifdef OSTEO_WITH_MOVIE
#include "osteo/assessment/movie/movie_options.h"
#endif
#include "osteo/imaging/segment/ear.h"
#include "osteo/network/tutor/playback_params.h"
#include "window_flags.h"

namespace osteo {

struct ListCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct InfoCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct SeriesCommand {
  struct Params {
    bool studies = false;
    std::string thumbnails;
  };
  static void describe(Params& p, auto& visit) {
    visit({"studies", "also the date and description of each study, which can tell who the patient is"}, p.studies);
    visit({"thumbnails", "a folder for a picture of the middle slice of each series, named by scan and series; a face may be seen in them"},
          p.thumbnails);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct GuideCommand {
  struct Params {
    std::string series;
    double hu_offset = 0;
    std::string picture;
  };
  static void describe(Params& p, auto& visit) {
    visit({"series", "DICOM series to take, by number, UID, or scan like A1a or A1a:203 (empty: the recommended one)"}, p.series);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"picture", "write the histogram with what was found in it, as .svg"}, p.picture);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ConvertCommand {
  struct Params {
    std::string source;
    std::string series;
    bool onto_source = false;
    std::string description = "Bone";
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "DICOM it was made from: a .dcm output takes over its patient, study and frame of reference"}, p.source);
    visit({"series", "which series of the source, by number, UID, or scan like A1a or A1a:203 (empty: the recommended one)"}, p.series);
    visit({"onto_source", "a label map as .dcm: on the source's own slices, tilted and uneven as they are"}, p.onto_source);
    visit({"description", "of a .dcm output, as a PACS lists it"}, p.description);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct DevicesCommand {
  struct Params {
    double watch = 0;
    std::string recording;
  };
  static void describe(Params& p, auto& visit) {
    visit({"watch", "print what the devices report for this long", "s", 0, 3600}, p.watch);
    visit({"recording", "instead: decode a recording made with hid-recorder"}, p.recording);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// Markers are printed, camera and pen calibrated.
struct MarkersCommand {
  struct Params {
    Paper paper = Paper::a4;
    int pen = 1;
    int page = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"paper", "a4 or letter"}, p.paper);
    visit({"pen", "which set of markers: another for each pen that one camera sees", "", 1, PenBody::kMostPens}, p.pen);
    visit({"page", "of a .png: 1 the pen's, 2 the plate", "", 1, kMarkerPages}, p.page);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct CalibrateCameraCommand {
  struct Params {
    std::string out = "camera.json";
    double seconds = 60;
    int width = 1280;
    int height = 720;
    double fps = 30;
    double latency_ms = -1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "the camera as JSON (also -o)"}, p.out);
    visit({"seconds", "from a camera: for this long", "s", 1, 3600}, p.seconds);
    visit({"width", "asked of a camera; files have their own", "pixels", 160, 8192}, p.width);
    visit({"height", "asked of a camera; files have their own", "pixels", 120, 8192}, p.height);
    visit({"fps", "pictures a second that it is asked for, here and later", "Hz", 1, 240}, p.fps);
    visit({"latency_ms", "from the middle of an exposure until the picture is here, where it is known (-1: one period is taken)", "ms", -1,
           500},
          p.latency_ms);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct CalibratePenCommand {
  struct Params {
    std::string camera = "camera.json";
    std::string out = "pen.json";
    int pen = 1;
    double ruler_mm = 100;
    double seconds = 15;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera", "made by calibrate-camera"}, p.camera);
    visit({"out", "the pen as JSON (also -o)"}, p.out);
    visit({"pen", "which set of markers it carries", "", 1, PenBody::kMostPens}, p.pen);
    visit({"ruler_mm", "how long the line of 100 mm on its page came out", "mm", 80, 120}, p.ruler_mm);
    visit({"seconds", "from a camera: for this long", "s", 1, 3600}, p.seconds);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct TrackPenCommand {
  struct Params {
    std::string camera = "camera.json";
    std::string pen;
    double seconds = 10;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera", "made by calibrate-camera"}, p.camera);
    visit({"pen", "made by calibrate-pen (empty: pen 1, its tip 100 mm below the middle of the prism)"}, p.pen);
    visit({"seconds", "from a camera: for this long", "s", 0.1, 86400}, p.seconds);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ExportCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct SoundCommand {
  struct Params {
    double volume = 1;
    bool alarms = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit(
        {"volume", "of the loudest that the model gives; long loud parts are held below the level that is safe with head-phones", "", 0, 1},
        p.volume);
    visit({"alarms", "beeps where a structure at risk is touched, two tones where it is injured"}, p.alarms);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct HeatCommand {
  struct Params {
    double cutting_share = 0.03, diamond_w_per_n = 0.5, water_c = 22, film = 3000, cell_mm = 0.5;
    std::string report, case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"cutting_share", "of force times surface speed of a cutting burr that becomes heat in bone", "", 0, 1}, p.cutting_share);
    visit({"diamond_w_per_n", "heat of a diamond burr in bone, for each newton", "W/N", 0, 20}, p.diamond_w_per_n);
    visit({"water_c", "of the water that is poured", "C", 0, 60}, p.water_c);
    visit({"film", "how well running water cools", "W/(m2 K)", 0, 100000}, p.film);
    visit({"cell_mm", "wanted width of the cells that heat is computed in", "mm", 0.1, 2}, p.cell_mm);
    visit({"report", "write sections through the warmest bone that is left, and the course of each structure: a .html or .pdf"}, p.report);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct MonitorCommand {
  struct Params {
    std::string out, setup, channel;
    double stimulator_ma = 0, pulses_per_s = 4, width_ms = 0.1;
    bool search = false;
    int hand = 0;
    bool heat = true;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for what it writes (also -o)"}, p.out);
    visit({"setup", "constants and channels, as JSON (empty: as the session was recorded with, or the built-in ones)"}, p.setup);
    visit({"channel", "that channel.wav has (empty: the first); 1 mV is full scale"}, p.channel);
    visit({"stimulator_ma", "what if: a tool's tip stimulates all the time it touches (0: as the session has it)", "mA", 0, 5},
          p.stimulator_ma);
    visit({"pulses_per_s", "of that", "1/s", 1, 30}, p.pulses_per_s);
    visit({"width_ms", "of its pulses", "ms", 0.05, 1}, p.width_ms);
    visit({"search", "it looks for the threshold, once, from --stimulator-ma on"}, p.search);
    visit({"hand", "whose tool", "", 0, 3}, p.hand);
    visit({"heat", "nerves feel the heat of burrs"}, p.heat);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct StreamCommand {
  struct Params {
    std::string to, setup;
    double speed = 1;
    int listeners = 1;
    double wait_s = 60;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"to",
           "where to: igtl:PORT, igtl:HOST:PORT (to listen on), cerebus:HOST:PORT/VERSION (3.11, 4.0, 4.1 or 4.2), lsl; several with "
           "commas between"},
          p.to);
    visit({"setup", "of the nerve monitor, as JSON (empty: as the session was recorded with, or the built-in one)"}, p.setup);
    visit({"speed", "times real time", "", 0.05, 20}, p.speed);
    visit({"listeners", "it begins when so many are there (0: at once); Cerebus packets have none", "", 0, 8}, p.listeners);
    visit({"wait_s", "for them, at most", "s", 1, 86400}, p.wait_s);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ConsoleCommand {
  using Params = ConsoleFlags;
  static void describe(Params& p, auto& visit) { ConsoleFlags::describe(p, visit); }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct BenchCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

enum class RunEngine : int { stages, vtk };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(RunEngine) {
  return {"stages", "vtk"};
}

struct RunCommand {
  struct Params {
    bool validate = false;
    bool dry_run = false;
    bool reuse = false;
    RunEngine engine = RunEngine::stages;
  };
  static void describe(Params& p, auto& visit) {
    visit({"validate", "check the whole pipeline without reading any data, answer in JSON, and stop"}, p.validate);
    visit({"dry_run", "show what would be run and written, and stop"}, p.dry_run);
    visit({"reuse", "keep outputs that exist and would come out the same"}, p.reuse);
    visit(
        {"engine", "who runs the stages: stages, one after the other; vtk, as connected filters by VTK's executive, with the same results"},
        p.engine);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct DocsCommand {
  struct Params {
    bool check = false;
    bool shared = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"check", "compare instead of writing; fails when a page is stale"}, p.check);
    visit({"shared", "instead: man pages, completion of bash, zsh and fish, modules of 3D Slicer; what is there is replaced"}, p.shared);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct PrepareCommand {
  struct Params {
    std::string out;
    BonePreset preset = BonePreset::fixed;
    double lower = 300;
    double spacing_mm = 0.5;
    Region region = Region::whole;
    bool remove_table = false;
    bool keep_table = false;
    std::string structures;
    std::string names;
    std::string series;
    std::string axes;
    double hu_offset = 0;
    std::string pipeline;
    std::string edits;
    bool fresh = false;
    bool no_report = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder of the case, made when it is not there (also -o)"}, p.out);
    visit({"preset", "how the bone threshold is found: fixed takes --lower, the others go by the scan ('osteo guide')"}, p.preset);
    visit({"lower", "bone threshold", "HU", -1024, 30000}, p.lower);
    visit({"spacing_mm", "edge of the voxels", "mm", 0.05, 10}, p.spacing_mm);
    visit({"region", "part of the head to keep; 'osteo crop' tells more"}, p.region);
    visit({"remove_table", "clear table and head holder also where it is not certain that they are; what is certain goes without it"},
          p.remove_table);
    visit({"keep_table", "leave table and head holder on, however certain"}, p.keep_table);
    visit({"structures", "label map of nerves, vessels, ... (.seg.nrrd, .nii.gz, .dcm) that belongs to the CT"}, p.structures);
    visit({"names", "what its values stand for, like '1=facial nerve, 2=sigmoid sinus'; values without a name are left out"}, p.names);
    visit({"series",
           "DICOM series to take, by number, UID, or scan as 'osteo import --list' shows it, like A1a or A1a:203 (empty: the recommended "
           "one)"},
          p.series);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPI"}, p.axes);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"pipeline", "another pipeline file than the built-in temporal-bone.json"}, p.pipeline);
    visit({"edits", "corrections by 'osteo edit' (edits.json), made again on the mask; the case keeps them until --no-edits"}, p.edits);
    visit({"fresh", "forget the flags that the case remembers: only those given now count"}, p.fresh);
    visit({"no_report", "write no report beside the case: its cuts are pictures of the patient"}, p.no_report);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ReportCommand {
  struct Params {
    std::string scan, dicom;
  };
  static void describe(Params& p, auto& visit) {
    visit({"scan", "the scan that the case was made from, when it is not where it was (empty: as this machine remembers)"}, p.scan);
    visit({"dicom", "file for the PDF as a DICOM object too, like CASE.report.dcm: it names the patient (empty: none)"}, p.dicom);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ApproveCommand {
  struct Params {
    std::string by;
    std::string note;
    bool withdraw = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"by", "name of the person who has looked at the case; kept in the case and in each session"}, p.by);
    visit({"note", "what that person has to say"}, p.note);
    visit({"withdraw", "take the approval back"}, p.withdraw);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct EditCommand {
  struct Params : EditFlags {
    std::string apply;
  };
  static void describe(Params& p, auto& visit) {
    visit({"apply", "without a window: make the corrections of this file (edits.json) again on the case"}, p.apply);
    EditFlags::describe(p, visit);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct HandOverCommand {
  struct Params {
    std::string source;
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "the scan of the case, where it is not known on this machine"}, p.source);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct TakeBackCommand {
  struct Params {
    std::string source;
    bool by_place = false;
    bool check = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "the scan of the case, where it is not known on this machine"}, p.source);
    visit({"by_place", "take segments that bear no mark of the scan, when most of the bone lies where it was"}, p.by_place);
    visit({"check", "say what changed, and leave the case as it is"}, p.check);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct RehearseCommand {
  struct Params : WindowFlags {
    bool headless = false;
    std::string script;
    bool show_settings = false;
    Side side = Side::left;
    double seconds = 60;
    bool fast = false;
    bool pieces = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"headless", "without a window: a scripted hand in front of the same servo"}, p.headless);
    visit({"script", "headless: strokes as JSON (empty: a cavity on one side of any head)"}, p.script);
    WindowFlags::describe(p, visit);
    visit({"show_settings", "print the settings that would be used, as a file to start from, and stop"}, p.show_settings);
    visit({"side", "headless: of the patient, for the built-in strokes"}, p.side);
    visit({"seconds", "headless: length of the built-in strokes", "s", 1, 3600}, p.seconds);
    visit({"fast", "headless: as fast as possible instead of by the clock; the result is the same"}, p.fast);
    visit({"pieces", "watch whether the bone still hangs together; the summary lists the pieces (the window always does)"}, p.pieces);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct SceneCommand {
  struct Params {
    std::string settings;
    ContactMethod contact = ContactMethod::overlap;
    bool dust = false;
    bool heat = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"contact", "how the burr feels bone"}, p.contact);
    visit({"dust", "with bone dust"}, p.dust);
    visit({"heat", "with heat of drilling"}, p.heat);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct PlaybackCommand {
  struct Params : PlaybackParams {
    std::string out;
    bool headless = false;
    std::string hand = "simulated:250";
    double from_s = 0, to_s = 0;
    std::string experts;
    Hand device = Hand::automatic;
    std::string case_folder;
    std::string state_file;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the guided session (empty: a new one in CASE/sessions; also -o)"}, p.out);
    PlaybackParams::describe(p, visit);
    visit({"from_s", "of the session: where the lesson begins; bone is as it was then", "s", 0, 1e6}, p.from_s);
    visit({"to_s", "and where it ends (0: with the session)", "s", 0, 1e6}, p.to_s);
    visit(
        {"experts",
         "fading, amplify: more sessions of the same step, by commas; three quarters of the distances between their ways and the lesson's "
         "are the dead zone"},
        p.experts);
    visit({"headless", "without a window and as fast as possible: a simulated hand is led"}, p.headless);
    visit({"hand", "headless: simulated:STIFFNESS, in N/m (100 to 500 is a grip); it has no will of its own"}, p.hand);
    visit({"device", "in the window, what moves the drill, as in 'rehearse'"}, p.device);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"state_file", "as in 'rehearse'"}, p.state_file);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// As what one joins.
struct TutorCommand {
  struct Params {
    std::string out, script, settings, resume;
    std::string listen = "127.0.0.1";
    int port = 0;
    bool two_way = false;
    double stiffness_n_per_mm = 1, most_n = 3, wait_s = 60;
    int attend = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the session (empty: a new one in CASE/sessions; also -o)"}, p.out);
    visit({"script", "the instructor's strokes, as JSON"}, p.script);
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"resume", "a session to go on from (empty: the case's bone); those who join are sent what it did"}, p.resume);
    visit({"listen",
           "address of this machine to be heard on; 127.0.0.1 or ::1: by this machine alone, 0.0.0.0 or :: : by all that can reach it"},
          p.listen);
    visit({"port", "UDP; 0: any that is free", "", 0, 65535}, p.port);
    visit({"two_way", "the instructor's hand is pulled by the trainee's too"}, p.two_way);
    visit({"stiffness_n_per_mm", "with --two-way, of that pull; less where the delay would not bear it", "N/mm", 0, 10},
          p.stiffness_n_per_mm);
    visit({"most_n", "with --two-way, at most", "N", 0, 20}, p.most_n);
    visit({"attend", "so many are to have joined, with their copies made, when the session begins", "", 0, 9}, p.attend);
    visit({"wait_s", "for them at most; then it begins with those who are there", "s", 0, 3600}, p.wait_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct JoinCommand {
  struct Params {
    std::string case_folder, code, hand = "simulated:250", out;
    Attend role = Attend::trainee;
    double stiffness_n_per_mm = 1, most_n = 3, patience_s = 10, wait_s = 60;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the session as it comes here: the host's, to the bit (empty: it is not recorded; also -o)"}, p.out);
    visit({"case_folder", "the same case as the host's"}, p.case_folder);
    visit({"code", "that the host shows (empty: asked for)"}, p.code);
    visit({"role", "trainee: the second hand; watcher: a copy of the bone, and no hand"}, p.role);
    visit({"hand", "trainee: simulated:STIFFNESS, in N/m; it has no will of its own"}, p.hand);
    visit({"stiffness_n_per_mm", "of the pull to the instructor's hand; less where the delay would not bear it", "N/mm", 0, 10},
          p.stiffness_n_per_mm);
    visit({"most_n", "of that pull, at most", "N", 0, 20}, p.most_n);
    visit({"wait_s", "for the host to answer, at most", "s", 0, 3600}, p.wait_s);
    visit({"patience_s", "the session counts as over when nothing was heard of the host for so long; else when the host says so", "s", 0.5,
           600},
          p.patience_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// "simulated:250", in N/m. Error(usage).
[[nodiscard]] double simulated_stiffness(const std::string& hand);

struct ReplayCommand {
  struct Params {
    std::string case_folder;
    std::string surface_out;
    std::string bone_out;
  };
  static void describe(Params& p, auto& visit) {
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"surface_out", "also write the surface at the end of the session (.ply, .stl, ...)"}, p.surface_out);
    visit({"bone_out", "also write the bone at the end of the session (.vdb); of bone in pieces the first, where it was cut"}, p.bone_out);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct PlanCommand {
  struct Params {
    std::string out;
    std::string case_folder;
    double at_s = -1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the plan (empty: SESSION/plan; also -o)"}, p.out);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"at_s", "how it was at this time of the session, exact to a tenth of a second (-1: at its end)", "s", -1, 86400}, p.at_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ExperimentCommand {
  struct Params {
    std::string out;
    int targets = 200;
    double noise = 0.1;
    double crosstalk = 0.15;
    double reaction_s = 0.25;
    std::string participant, people, device = "mouse", state_file;
    int trials = 72;
    bool headless = false, simulated = false, retention = false, null = false, chain = false;
    int experiments = 1000;
    double level = 0.95;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "camera: every view and its time, as CSV (empty: only the table); demo: its folder (also -o)"}, p.out);
    visit({"targets", "views to bring the camera to", "", 1, 10000}, p.targets);
    visit({"noise", "standard deviation of a move's end, of its length", "", 0, 0.5}, p.noise);
    visit({"crosstalk", "six degrees and rates: what an axis that was not meant gets of the others", "", 0, 1}, p.crosstalk);
    visit({"reaction_s", "a look before each move", "s", 0, 2}, p.reaction_s);
    visit({"participant", "force-skill: whose trials, by code"}, p.participant);
    visit({"people", "codes of a new experiment's participants, as 'P01, P02' (empty: twelve)"}, p.people);
    visit({"trials", "of each participant of a new experiment: a multiple of 9", "", 9, 999}, p.trials);
    visit({"device", "force-skill: what the hand holds: mouse, keys, woodenhaptics or spacemouse"}, p.device);
    visit({"headless", "force-skill: without a window"}, p.headless);
    visit({"simulated", "force-skill: a program takes part, and everything says so"}, p.simulated);
    visit({"retention", "force-skill: on another day: every stimulus once, without aid"}, p.retention);
    visit({"null", "programs that learn equally well by each training"}, p.null);
    visit({"experiments", "null: how many", "", 10, 100000}, p.experiments);
    visit({"chain", "null: small experiments by programs, run and scored, instead of drawn scores; 0.3 s of one core each"}, p.chain);
    visit({"level", "of intervals", "", 0.5, 0.999}, p.level);
    visit({"state_file", "force-skill: the window writes here what it shows, for tests"}, p.state_file);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct GroundTruthCommand {
  struct Params {
    std::string out, program, experiment, bone, trajectory, surface;
    std::string columns = "t x y z fx fy fz";
    double stiffness_n_per_mm = 0.5, share = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for tables, leaderboard and trajectories (also -o)"}, p.out);
    visit({"program", "command of a renderer to measure beside ours: positions come by its standard input, forces go by its output"},
          p.program);
    visit({"experiment", "solids, renderers and friction as JSON, as in pipelines/ground-truth (empty: all that is built in)"},
          p.experiment);
    visit({"bone", "closed surface of a bone to add to the solids (.ply, .stl, ...; empty: none)"}, p.bone);
    visit({"trajectory", "a recorded out-trajectory with its forces to play instead, as text (needs --surface)"}, p.trajectory);
    visit({"surface", "closed surface of what was probed, in the trajectory's own coordinates, mm"}, p.surface);
    visit({"columns", "of the trajectory: t, x, y, z, fx, fy, fz in their order, '-' for what is not wanted; s, mm, N"}, p.columns);
    visit({"stiffness_n_per_mm", "of the spring that the recorded forces are taken for", "N/mm", 0.01, 100}, p.stiffness_n_per_mm);
    visit({"share", "of each trajectory's length: less is quicker, and less is seen", "", 0.02, 10}, p.share);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct ScoreCommand {
  struct Params {
    std::string procedure;
    bool mirror = false;
    std::string reference;
    std::string subject;
    std::string csv;
    bool evidence = false;
    bool heat = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"procedure", "what was to be done, as JSON (pipelines/procedures); empty: no items, regions or rules"}, p.procedure);
    visit({"mirror", "the procedure is written for the other side of the body: its directions and curves turn about x = 0"}, p.mirror);
    visit({"reference", "folder with reference.json and sessions of others on the same case; empty: no comparison"}, p.reference);
    visit({"subject", "who this is, by the reference's code: sessions of the same person are left out of the comparison"}, p.subject);
    visit({"csv", "also write a header and a row of all values (.csv)"}, p.csv);
    visit({"evidence", "with --json: also the places that prove each item, and all bone removed unseen"}, p.evidence);
    visit({"heat", "also how warm bone and structures became: runs the session again, which takes several times as long"}, p.heat);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

#ifdef OSTEO_WITH_MOVIE
struct MovieCommand {
  struct Params {
    MovieCamera camera = MovieCamera::surgeon;
    double speed = 1, from_s = 0, to_s = -1;
    bool skip_idle = false, no_overlay = false, blind = false, deep = false;
    std::string size = "1280x720";
    int fps = 30;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera", "surgeon: from where was looked (notes of the session); fixed: from one place, all that was drilled"}, p.camera);
    visit({"speed", "times as fast as it was", "", 0.1, 100}, p.speed);
    visit({"from_s", "of the session", "s", 0, 1e6}, p.from_s);
    visit({"to_s", "of the session (-1: its end)", "s", -1, 1e6}, p.to_s);
    visit({"skip_idle", "leave out where for over 2 s neither hand nor camera moves and no pedal is down"}, p.skip_idle);
    visit({"no_overlay", "without time, force, nearest structure and volume removed"}, p.no_overlay);
    visit({"blind", "for raters: no overlay, and with a folder as output a random name"}, p.blind);
    visit({"size", "pixels, width and height, both even"}, p.size);
    visit({"fps", "frames a second", "Hz", 1, 120}, p.fps);
    visit({"deep", "creases shaded and edges smoothed, which without a graphics card takes several times as long"}, p.deep);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};
#endif

struct ReviewCommand {
  struct Params {
    std::string out;
    std::string procedure;
    bool mirror = false;
    std::string reference;
    std::string subject;
    std::string earlier;
    bool no_pictures = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for review.html, review.pdf and review.json, made when it is not there (also -o)"}, p.out);
    visit({"procedure", "what was to be done, as JSON (pipelines/procedures); empty: no items, regions or rules"}, p.procedure);
    visit({"mirror", "the procedure is written for the other side of the body: its directions and curves turn about x = 0"}, p.mirror);
    visit({"reference", "folder with reference.json and sessions of others on the same case; empty: no comparison"}, p.reference);
    visit({"subject", "who this is, by the reference's code: sessions of the same person are left out of the comparison"}, p.subject);
    visit({"earlier", "earlier sessions of the same person in their order, with commas between (empty: none)"}, p.earlier);
    visit({"no_pictures", "without pictures and the view in 3D: needs no OpenGL"}, p.no_pictures);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct StudyCommand {
  struct Params {
    std::string title, procedure, groups, competent, cases;
    std::string items = "overall";
    int attempts = 1, lowest = 1, highest = 5;
    std::string participant, group, case_name;
    int attempt = 1;
    std::string rater;
    std::string out, given;
    int resamples = 2000;
    double level = 0.95;
    bool no_movies = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"title", "new: what the study is called"}, p.title);
    visit({"procedure", "new: what is done on each case"}, p.procedure);
    visit({"groups", "new: groups of people, like 'novice, expert'"}, p.groups);
    visit({"competent", "new: the group that is meant to pass (empty: the last)"}, p.competent);
    visit({"cases", "new: cases that everybody does, like 'left-1, right-1'"}, p.cases);
    visit({"items", "new: what raters rate"}, p.items);
    visit({"attempts", "new: of each case by each participant", "", 1, 100}, p.attempts);
    visit({"lowest", "new: of the scale of each item", "", -1000, 1000}, p.lowest);
    visit({"highest", "new: of the scale of each item", "", -1000, 1000}, p.highest);
    visit({"participant", "add: a code, never a name (empty, for a person: the next free one)"}, p.participant);
    visit({"group", "add: of a new participant"}, p.group);
    visit({"case_name", "add: of the session"}, p.case_name);
    visit({"attempt", "add: of the session", "", 1, 100}, p.attempt);
    visit({"rater", "form: a code of who rates"}, p.rater);
    visit({"out", "analyse: files OUT.json, OUT.html and OUT.pdf (empty: STUDY/report; also -o)"}, p.out);
    visit({"resamples", "analyse: of each bootstrap", "", 100, 1000000}, p.resamples);
    visit({"level", "analyse: of intervals", "", 0.5, 0.999}, p.level);
    visit({"given", "analyse: metrics to hold, like 'duration_s, removed_mm3': correlations are told with and without them"}, p.given);
    visit({"no_movies", "demo: without the blinded movies (320x240, 15 times as fast, 10 frames a second, one a session)"}, p.no_movies);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct SimulateTraineeCommand {
  struct Params {
    std::string out;
    std::string skill = "expert";
    std::string procedure;
    bool mirror = false;
    double minutes = 3;
    std::array<double, 3> approach{0, 0, 0};
    double window_mm = 4.5;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder of the session (empty: CASE/sessions/N; also -o)"}, p.out);
    visit({"skill", "expert or novice, then KEY=VALUE by commas, like 'novice, undercut=0.8'; what is not named is an expert's"}, p.skill);
    visit({"procedure", "what is to be done, as JSON (pipelines/procedures)"}, p.procedure);
    visit({"mirror", "the procedure is written for the other side of the body: its directions and curves turn about x = 0"}, p.mirror);
    visit({"minutes", "then it stops, wherever it is", "min", 0.05, 60}, p.minutes);
    visit({"approach", "from the bone to who drills, LPS (0,0,0: as the procedure's items have it)", "", -1e4, 1e4}, p.approach);
    visit({"window_mm", "radius of what it opens, for the burr's middle", "mm", 1, 20}, p.window_mm);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct DemoCommand {
  struct Params {
    std::string out = "out/demo";
    double seconds = 10;
    std::string axes;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for everything that is made"}, p.out);
    visit({"seconds", "of drilling", "s", 1, 3600}, p.seconds);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPI"}, p.axes);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// All stages and commands of osteo, with their parameters at the defaults.
[[nodiscard]] cli::Program make_osteo_program();

}  // namespace osteo
