// The verbs of osteo beside its stages.
#pragma once
#include <string>

#include "edit_flags.h"
#include "osteo/bone/burr.h"
#include "osteo/cli/command.h"
#include "osteo/haptics/contact.h"
#include "osteo/image/bone_threshold.h"
#include "osteo/image/crop.h"
#include "osteo/marker/body.h"
#include "osteo/marker/sheet.h"
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

struct DoctorCommand {
  struct Params {
    double seconds = 2;
    double rate_hz = 1000;
  };
  static void describe(Params& p, auto& visit) {
    visit({"seconds", "for which the loop's lateness is measured", "s", 0.1, 600}, p.seconds);
    visit({"rate_hz", "of that loop", "Hz", 100, 10000}, p.rate_hz);
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
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"cutting_share", "of force times surface speed of a cutting burr that becomes heat in bone", "", 0, 1}, p.cutting_share);
    visit({"diamond_w_per_n", "heat of a diamond burr in bone, for each newton", "W/N", 0, 20}, p.diamond_w_per_n);
    visit({"water_c", "of the water that is poured", "C", 0, 60}, p.water_c);
    visit({"film", "how well running water cools", "W/(m2 K)", 0, 100000}, p.film);
    visit({"cell_mm", "wanted width of the cells that heat is computed in", "mm", 0.1, 2}, p.cell_mm);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct BenchCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct RunCommand {
  struct Params {
    bool validate = false;
    bool dry_run = false;
    bool reuse = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"validate", "check the whole pipeline without reading any data, answer in JSON, and stop"}, p.validate);
    visit({"dry_run", "show what would be run and written, and stop"}, p.dry_run);
    visit({"reuse", "keep outputs that exist and would come out the same"}, p.reuse);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct DocsCommand {
  struct Params {
    bool check = false;
  };
  static void describe(Params& p, auto& visit) { visit({"check", "compare instead of writing; fails when a page is stale"}, p.check); }
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
    std::string scan;
  };
  static void describe(Params& p, auto& visit) {
    visit({"scan", "the scan that the case was made from, when it is not where it was (empty: as this machine remembers)"}, p.scan);
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

enum class Side : int { left, right };
template <>
struct EnumNames<Side> {
  static constexpr std::array<std::string_view, 2> values{"left", "right"};
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
  };
  static void describe(Params& p, auto& visit) {
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"contact", "how the burr feels bone"}, p.contact);
    visit({"dust", "with bone dust"}, p.dust);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

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
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "every view and its time, as CSV (empty: only the table; also -o)"}, p.out);
    visit({"targets", "views to bring the camera to", "", 1, 10000}, p.targets);
    visit({"noise", "standard deviation of a move's end, of its length", "", 0, 0.5}, p.noise);
    visit({"crosstalk", "six degrees and rates: what an axis that was not meant gets of the others", "", 0, 1}, p.crosstalk);
    visit({"reaction_s", "a look before each move", "s", 0, 2}, p.reaction_s);
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
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"procedure", "what was to be done, as JSON (pipelines/procedures); empty: no items, regions or rules"}, p.procedure);
    visit({"mirror", "the procedure is written for the other side of the body: its directions and curves turn about x = 0"}, p.mirror);
    visit({"reference", "folder with reference.json and sessions of others on the same case; empty: no comparison"}, p.reference);
    visit({"subject", "who this is, by the reference's code: sessions of the same person are left out of the comparison"}, p.subject);
    visit({"csv", "also write a header and a row of all values (.csv)"}, p.csv);
    visit({"evidence", "with --json: also the places that prove each item, and all bone removed unseen"}, p.evidence);
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
    std::string out;
    int resamples = 2000;
    double level = 0.95;
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
