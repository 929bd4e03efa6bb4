// The window of 'osteo rehearse', a program of its own.
#include <iostream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/bone/burr.h"
#include "osteo/cli/command.h"
#include "osteo/devices/devices.h"
#include "osteo/grid/grid_io.h"
#include "osteo/scene/session_folder.h"
#include "osteo/window/rehearsal_window.h"

namespace osteo {
namespace {

enum class Hand : int { automatic, mouse, spacemouse, woodenhaptics };

}  // namespace

template <>
struct EnumNames<Hand> {
  static constexpr std::array<std::string_view, 4> values{"auto", "mouse", "spacemouse", "woodenhaptics"};
};

namespace {

// What moves the drill: as asked, or the best that is plugged in; with a pedal where there is one.
class Hands {
 public:
  Hands(Hand wanted, const std::string& arm_file) : hand_(wanted) {
    for (const FoundDevice& f : find_devices()) {
      const bool mouse = f.model == DeviceModel::space_mouse || f.model == DeviceModel::space_mouse_wireless;
      if (hand_ == Hand::automatic && f.readable && (mouse || f.model == DeviceModel::woodenhaptics))
        found_ = std::max(found_, mouse ? 1 : 2);
      if (f.readable && (f.model == DeviceModel::pedal_infinity || f.model == DeviceModel::pedal_pcsensor))
        pedal_ = std::make_unique<FootPedal>(f.model,
                                             open_first([m = f.model](const HidInfo& i) { return model_of(i.vendor, i.product) == m; }));
    }
    if (hand_ == Hand::automatic) hand_ = found_ == 2 ? Hand::woodenhaptics : found_ == 1 ? Hand::spacemouse : Hand::mouse;
    if (!arm_file.empty()) geometry_ = load_woodenhaptics(arm_file);
  }
  /// `start_mm`: where the tool is when the device is first heard of.
  [[nodiscard]] std::unique_ptr<Device> make(Vec3 start_mm, int tool) const {
    // The user looks at the patient's left side, as the window does: away from the user is to the right, right is to the back.
    if (hand_ == Hand::spacemouse) {
      return std::make_unique<SpaceMouseDevice>(open_first([](const HidInfo& i) {
                                                  const DeviceModel m = model_of(i.vendor, i.product);
                                                  return m == DeviceModel::space_mouse || m == DeviceModel::space_mouse_wireless;
                                                }),
                                                start_mm, Mat3{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, tool, pedal_.get());
    }
    if (hand_ == Hand::woodenhaptics) {
      return std::make_unique<WoodenHapticsDevice>(
          open_first([](const HidInfo& i) { return model_of(i.vendor, i.product) == DeviceModel::woodenhaptics; }), geometry_,
          WorkspaceMap(start_mm, Mat3{{Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}}}, 1), tool, pedal_.get());
    }
    return std::make_unique<MouseDevice>();
  }
  [[nodiscard]] std::string name() const {
    return std::string(EnumNames<Hand>::values[static_cast<std::size_t>(hand_)]) + (pedal_ ? " and pedal" : "");
  }

 private:
  Hand hand_;
  int found_ = 0;
  WoodenHapticsGeometry geometry_;
  std::unique_ptr<FootPedal> pedal_;
};

Vec3 in_front_of(const World& world, int tool) {
  try {
    return make_default_script(world, true, tool, 10).waypoints.front().at_mm;
  } catch (const Error&) {
    return world.bodies().front().body->bone.frame().centre_mm();  // no bone on the left
  }
}

struct WindowCommand {
  struct Params {
    std::string out;
    BurrKind burr = BurrKind::cutting;
    double diameter_mm = 4;
    BurrShape shape = BurrShape::ball;
    ContactMethod contact = ContactMethod::overlap;
    std::string settings;
    Hand device = Hand::automatic;
    std::string arm;
    bool dust = false;
    double rate_hz = 1000;
    std::string resume;
    int width = 1360;
    int height = 860;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the first session (empty: a new one in CASE/sessions)"}, p.out);
    visit({"burr", "kind of burr at the start"}, p.burr);
    visit({"diameter_mm", "of the burr at the start", "mm", 1, 7}, p.diameter_mm);
    visit({"shape", "of the burr at the start"}, p.shape);
    visit({"contact", "how the burr feels bone"}, p.contact);
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"device", "what moves the drill; auto takes the best that is plugged in ('osteo devices')"}, p.device);
    visit({"arm", "geometry and motors of a WoodenHaptics arm, as JSON (empty: Polhem v3)"}, p.arm);
    visit({"dust", "bone dust: falls, piles up and hides the bone until it is sucked off (V)"}, p.dust);
    visit({"rate_hz", "ticks of the servo a second", "Hz", 100, 5000}, p.rate_hz);
    visit({"resume", "go on from the end of this session"}, p.resume);
    visit({"width", "of the window", "pixels", 640, 8192}, p.width);
    visit({"height", "of the window", "pixels", 480, 8192}, p.height);
  }
  static cli::CommandInfo info() {
    return {"rehearse",
            "drill the bone of a case in a window",
            "The same as 'osteo rehearse CASE'.",
            {{"case", "a folder made by prepare"}},
            "osteo-rehearse CASE"};
  }

  static int run(const Params& p, cli::Invocation& io) {
    const Case the_case = load_case(io.arguments[0]);
    std::optional<SparseGrid> hu;
    if (const auto it = the_case.files.find("hu"); it != the_case.files.end()) hu = load_grid(it->second);
    const int tool = burr_index(p.burr, p.diameter_mm, p.shape);

    SessionFolder session;
    std::unique_ptr<Rehearsal> rehearsal;
    std::filesystem::path next_folder = p.out, resume_from = p.resume;
    RehearsalOptions options;
    options.rate_hz = p.rate_hz;
    options.follow = {true, true, p.dust};
    const Hands hands(p.device, p.arm);
    options.haptics.params.contact.method = p.contact;
    apply_haptic_settings(the_case.folder, p.settings, options.haptics);

    WindowActions actions;
    actions.begin = [&](bool from_case) {
      const std::filesystem::path from = from_case ? std::filesystem::path() : resume_from;
      session = create_session_folder(std::exchange(next_folder, {}), the_case.folder, from);
      options.session_file = session.stream();
      rehearsal.reset();
      options.anatomy = anatomy_of(the_case, options.haptics, io.context);
      World world = world_at_begin(session, the_case, options.anatomy, io.context);
      // In front of the bone on the patient's left, where the window looks.
      auto device = hands.make(in_front_of(world, tool), tool);
      options.haptics.device = device->traits();
      options.soft = soft_body_of(the_case.folder);
      rehearsal = std::make_unique<Rehearsal>(std::move(world), std::move(device), options, io.context);
      rehearsal->start();
    };
    actions.save = [&] {
      const RehearsalSummary s = rehearsal->stop();
      write_summary(session, s, p.rate_hz, "window", options.anatomy);
      resume_from = session.folder;
      if (!io.common.quiet)
        io.err << "session: " << session.folder.string() << "  (" << s.ticks << " ticks, " << s.removed_mm3 << " mm3)\n";
    };
    actions.rehearsal = [&]() -> Rehearsal& { return *rehearsal; };
    actions.folder = [&] { return session.folder; };

    actions.begin(p.resume.empty());
    io.end_progress();
    if (!io.common.quiet) io.err << told_hardness(options.anatomy) << '\n';
    WindowOptions window;
    window.title = "Osteotome - " + the_case.folder.filename().string();
    window.tool = tool;
    window.device = hands.name();
    window.width = p.width;
    window.height = p.height;
    if (const auto it = the_case.files.find("verdict"); it != the_case.files.end()) window.scan = read_verdict(read_text(it->second));
    int gl_errors = 0;
    try {
      gl_errors = run_rehearsal_window(window, hu ? &*hu : nullptr, actions);
    } catch (...) {
      actions.save();
      throw;
    }
    actions.save();
    if (gl_errors > 0)
      throw Error(ExitCode::failed, std::to_string(gl_errors) + " OpenGL errors were seen; the session is saved",
                  "please report this with the name of the graphics card");
    return 0;
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  osteo::cli::Program program;
  program.about = "osteo-rehearse: drill the bone of a case in a window";
  program.licence = "Osteotome's own sources: Apache-2.0. Not a medical device.";
  program.add<osteo::WindowCommand>();
  // The only command needs no name.
  std::vector<char*> args{argv[0]};
  static char name[] = "rehearse";
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first != "--help" && first != "-h" && first != "--version" && first != "help") args.push_back(name);
  args.insert(args.end(), argv + 1, argv + argc);
  return osteo::cli::run_program(program, static_cast<int>(args.size()), args.data(), std::cout, std::cerr);
}
