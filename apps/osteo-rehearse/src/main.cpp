// The window of 'osteo rehearse', a program of its own.
#include <iostream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/bone/burr.h"
#include "osteo/cli/command.h"
#include "osteo/grid/grid_io.h"
#include "osteo/scene/session_folder.h"
#include "osteo/window/rehearsal_window.h"

namespace osteo {
namespace {

struct WindowCommand {
  struct Params {
    std::string out;
    BurrKind burr = BurrKind::cutting;
    double diameter_mm = 4;
    BurrShape shape = BurrShape::ball;
    ContactMethod contact = ContactMethod::overlap;
    std::string settings;
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
    options.haptics.device = MouseDevice().traits();
    options.haptics.params.contact.method = p.contact;
    apply_haptic_settings(the_case.folder, p.settings, options.haptics);

    WindowActions actions;
    actions.begin = [&](bool from_case) {
      const std::filesystem::path from = from_case ? std::filesystem::path() : resume_from;
      session = create_session_folder(std::exchange(next_folder, {}), the_case.folder, from);
      options.session_file = session.stream();
      rehearsal.reset();
      BrickGrid bone = bone_at_begin(session);
      if (options.haptics.hardness) options.hardness = hardness_of(the_case, bone);
      rehearsal = std::make_unique<Rehearsal>(std::move(bone), std::make_unique<MouseDevice>(), options, io.context);
      rehearsal->start();
    };
    actions.save = [&] {
      const RehearsalSummary s = rehearsal->stop();
      write_summary(session, s, p.rate_hz, "window");
      resume_from = session.folder;
      if (!io.common.quiet)
        io.err << "session: " << session.folder.string() << "  (" << s.ticks << " ticks, " << s.removed_mm3 << " mm3)\n";
    };
    actions.rehearsal = [&]() -> Rehearsal& { return *rehearsal; };
    actions.folder = [&] { return session.folder; };

    actions.begin(p.resume.empty());
    io.end_progress();
    WindowOptions window;
    window.title = "Osteotome - " + the_case.folder.filename().string();
    window.tool = tool;
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
