// Commands: stages and the verbs beside them (run, prepare, rehearse, ...), all declared by the same kind of Params
// struct.
#pragma once
#include <iosfwd>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/stage/stage.h"

namespace osteo::inline app::cli {

enum class ProgressStyle : int { automatic, bar, json, slicer, none };
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(ProgressStyle) {
  return {"auto", "bar", "json", "slicer", "none"};
}

/// Flags that every command has.
struct Common {
  struct Params {
    int threads = 0;
    bool force = false;
    bool quiet = false;
    bool json = false;
    ProgressStyle progress = ProgressStyle::automatic;
    int seed = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"threads", "worker threads (0: all cores); results do not depend on it", "", 0, 1024}, p.threads);
    visit({"force", "replace outputs that exist"}, p.force);
    visit({"quiet", "no progress and no notes, only errors"}, p.quiet);
    visit({"json", "print what was done as JSON on standard output"}, p.json);
    visit({"progress",
           "bar or JSON lines on standard error, Slicer's form on standard output and all notes with it; auto: a bar "
           "on a terminal"},
          p.progress);
    visit({"seed", "seed of random numbers", "", 0, 2147483647}, p.seed);
  }
};

struct Positional {
  std::string name, help;
  bool optional = false;
};

/// Flags of a long command under a title, by the names of their fields; the flags that most people need come first.
struct FlagGroup {
  std::string title;
  std::vector<std::string> fields;
};

struct CommandInfo {
  std::string name, synopsis, description;
  std::vector<Positional> positionals;
  std::string example;
  bool takes_settings = false;              ///< --set NAME=VALUE
  std::vector<FlagGroup> flag_groups = {};  ///< none: one list. Fields of no group come last
  /// Fields and positionals that name what is written, and what is read beside it: no two that are written, and none
  /// that is read, may be one file.
  std::vector<std::string> writes = {}, reads = {};
};

/// What a verb gets to work with.
struct Invocation {
  const Registry& registry;
  Common::Params common;
  std::vector<std::string> arguments;  ///< positionals, in order
  std::set<std::string> given;         ///< names of the fields that were on the command line, whatever their value
  std::vector<std::pair<std::string, std::string>> settings;  ///< --set k=v, in order
  Context context;
  std::ostream& out;
  std::ostream& err;
  /// Ends the progress bar, so that text does not run into it.
  std::function<void()> end_progress;
};

/// A verb. C has `struct Params`, `describe`, `static CommandInfo info()`, `static int run(const Params&,
/// Invocation&)`.
class Command {
 public:
  virtual ~Command() = default;
  [[nodiscard]] virtual const CommandInfo& info() const = 0;
  [[nodiscard]] virtual std::vector<FieldRef> fields() = 0;
  virtual int run(Invocation& invocation) const = 0;
};

template <class C>
class CommandOf final : public Command {
 public:
  [[nodiscard]] const CommandInfo& info() const override {
    static const CommandInfo value = C::info();
    return value;
  }
  [[nodiscard]] std::vector<FieldRef> fields() override { return fields_of<C>(params_); }
  int run(Invocation& invocation) const override { return C::run(params_, invocation); }

 private:
  typename C::Params params_;
};

/// Stages and commands that one kind of user needs, in the order in which they are needed.
struct Group {
  std::string title;
  std::vector<std::string> members;
};

/// What most people want to do, and the one command that does it: the first screen of the help.
struct Task {
  std::string what, command;
};

struct Program {
  Registry registry;
  std::vector<std::unique_ptr<Command>> commands;
  std::string about;        ///< one line
  std::string licence;      ///< for --version
  std::vector<Task> tasks;  ///< none: the help lists all names at once
  std::vector<Group>
      groups;  ///< none: one list. Else each name is in exactly one; names that the build lacks are passed over
  template <class C>
  void add() {
    commands.push_back(std::make_unique<CommandOf<C>>());
  }
  [[nodiscard]] Command* find(std::string_view name) const;
  /// Of all stages, then of all commands.
  [[nodiscard]] std::vector<std::string> names() const;
  /// The groups with the names that this build has, those of no group last. Error(failed) for a name in two groups.
  [[nodiscard]] std::vector<Group> grouped() const;
  [[nodiscard]] std::string synopsis_of(std::string_view name) const;
};

/// The whole of a command-line program: parses, runs, reports errors, returns the exit code. stdout carries data only.
/// With --json a failure is told there too: { "error": { "exit_code", "name", "message", "advice" } }, and beside it
/// what the stage had to show of it, such as the "verdict" on a rejected scan.
int run_program(Program& program, int argc, char** argv, std::ostream& out, std::ostream& err);

}  // namespace osteo::inline app::cli
