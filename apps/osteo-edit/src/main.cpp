// The window of 'osteo edit', a program of its own.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <future>
#include <iostream>

#include "edit_flags.h"
#include "edited_scan.h"
#include "licence.h"
#include "osteo/app/cli/command.h"
#include "osteo/app/stages/registry.h"
#include "osteo/app/window/edit_window.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/neural/segment_network.h"
#include "window_main.h"

extern char** environ;

namespace osteo {
namespace {

// Writes corrections into the case as anyone else does, by 'osteo prepare', beside the window. What it has in memory
// goes with it.
class Saver {
 public:
  Saver(fs::path case_folder, fs::path scan, int threads)
      : case_(std::move(case_folder)), scan_(std::move(scan)), threads_(threads) {}

  void begin(const std::string& edits) {
    running_ = std::async(std::launch::async, [this, edits] { return save(edits); });
  }
  std::optional<EditSaved> ended() {
    if (!running_.valid() || running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
      return std::nullopt;
    return running_.get();
  }

 private:
  EditSaved save(const std::string& edits) const {
    try {
      const TemporaryFolder folder;
      const fs::path file = folder.path() / "edits.json", said = folder.path() / "said";
      write_file(file, edits);
      const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "osteo";
      std::vector<std::string> args{program.string(), "prepare", scan_.string(), "-o",
                                    case_.string(),   "--edits", file.string(),  "--quiet"};
      if (threads_ != 0) args.push_back("--threads=" + std::to_string(threads_));
      const int code = run(args, said);
      if (code == 0) {
        std::string written;
        for (const char* const name :
             {"edits.json", "bone.vdb", "hu.vdb", "surface.ply", "preview.png", "structures.seg.nrrd"}) {
          if (output_exists(case_ / name)) written += (written.empty() ? "" : ", ") + std::string(name);
        }
        return {true, "saved into the case: " + written};
      }
      std::string text = read_text(said);
      while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
      for (char& c : text) c = c == '\n' ? ' ' : c;
      return {false, "NOT SAVED, the case is unchanged: " + text};
    } catch (const std::exception& e) {
      return {false, std::string("NOT SAVED, the case is unchanged: ") + e.what()};
    }
  }

  static int run(std::vector<std::string>& args, const fs::path& said) {
    std::vector<char*> argv;
    for (auto& a : args) argv.push_back(a.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = 0;
    const int failed = ::posix_spawn(&child, args[0].c_str(), &actions, nullptr, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) throw Error(ExitCode::failed, "cannot start '" + args[0] + "': " + std::strerror(failed));
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  }

  fs::path case_, scan_;
  int threads_;
  std::future<EditSaved> running_;
};

// Where a network could not say where a boundary lies, the largest first.
std::vector<EditPlace> uncertain_in(const Labels& structures, const Labels& uncertainty) {
  std::vector<EditPlace> places;
  for (const UncertainPlace& p : uncertain_places(structures, uncertainty, 12)) {
    for (const Structure& s : structures.structures)
      if (s.value == p.structure) places.push_back({p.at_mm, p.structure, s.name, p.voxels});
  }
  return places;
}

// As 'osteo segment-network' has it.
EditFound found_by(const Image& ct, const std::string& network, const Context& context) {
  if (!is_network_folder(network))
    throw Error(ExitCode::no_input, "'" + network + "' holds no trained network",
                "give a folder with plans.json and dataset.json, or with network.json");
  const std::unique_ptr<Stage> stage = osteo_stages().make("segment-network");
  const std::vector<Data> inputs{ct, Source{network}};
  const std::vector<Data> out = stage->run(inputs, context);
  EditFound found;
  found.structures = std::get<Labels>(out[0]);
  if (const auto* const uncertainty = std::get_if<Labels>(&out[1]))
    found.places = uncertain_in(found.structures, *uncertainty);
  for (const auto& [key, value] : context.take_report()) {
    const auto* const text = std::get_if<std::string>(&value);
    if (text == nullptr || (key != "disagreement" && key != "not_to_be_trusted")) continue;
    found.note += (found.note.empty() ? "" : "; ") + *text;
  }
  return found;
}

struct EditWindowCommand {
  using Params = EditFlags;
  static void describe(Params& p, auto& visit) { EditFlags::describe(p, visit); }
  static cli::CommandInfo info() {
    return {"edit",
            "correct the bone and the structures of a case by hand",
            "What 'osteo edit CASE' opens.",
            {{"case", "a folder made by prepare"}},
            "osteo-edit CASE"};
  }

  static int run(const Params& p, cli::Invocation& io) {
    const fs::path folder = io.arguments[0];
    std::optional<EditedScan> scan = open_edited_scan(folder, p.scan, osteo_stages(), io.context);
    EditDocument document(scan->ct, scan->mask, scan->structures ? &*scan->structures : nullptr);
    const fs::path source = scan->scan;
    const std::optional<EditRecipe> edits = scan->edits;
    std::vector<EditPlace> places;
    if (scan->uncertainty) places = uncertain_in(*scan->structures, *scan->uncertainty);
    const std::string network = scan->network.string();
    scan.reset();
    if (edits) apply_edits(document, *edits, io.context);
    io.end_progress();
    if (!io.common.quiet) {
      io.err << "open: " << document.ct().frame.dims[0] << " x " << document.ct().frame.dims[1] << " x "
             << document.ct().frame.dims[2] << " voxels"
             << (edits ? ", " + std::to_string(edits->operations.size()) + " earlier corrections" : std::string())
             << std::endl;
    }
    EditWindowOptions options;
    options.width = p.width;
    options.height = p.height;
    options.scale = p.scale;
    options.title = "Osteotome edit - " + folder.filename().string();
    options.state_file = p.state_file;
    options.places = places;
    options.network = network;
    Saver saver(folder, source, io.common.threads);
    EditWindowActions actions;
    actions.save = [&](const std::string& text) { saver.begin(text); };
    actions.saved = [&] { return saver.ended(); };
    actions.find = [&](const Image& ct, const std::string& folder, const Context& context) {
      Context threads = context;
      threads.threads = io.common.threads;
      return found_by(ct, folder, threads);
    };
    actions.stop = [&] { return io.context.cancelled(); };
    const int gl_errors = run_edit_window(document, options, actions);
    if (io.context.cancelled()) throw Error(ExitCode::cancelled, "ended from outside; what was not saved is lost");
    require_no_gl_errors(gl_errors);
    return 0;
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  return osteo::run_window_program<osteo::EditWindowCommand>(
      argc, argv, "osteo-edit: correct the bone and the structures of a case by hand", osteo::licence_of_all_stages());
}
