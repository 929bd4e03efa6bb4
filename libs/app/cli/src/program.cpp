#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <iostream>
#include <map>
#include <new>
#include <set>

#include "describe.h"
#include "osteo/app/cli/command.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/simd.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "pipes.h"
#include "progress.h"

namespace osteo::inline app::cli {
namespace {

std::atomic<bool> g_cancel{false};

extern "C" void on_signal(int signal) {
  // The first asks the work to stop and clean up; a second Ctrl-C ends the program at once. A logout may send SIGTERM
  // and SIGHUP together.
  if (g_cancel.exchange(true) && signal == SIGINT) ::_exit(130);
}

struct Parsed {
  std::vector<std::string> positionals;
  std::map<std::string, std::string> files;  // --mask FILE, --labels-out FILE: flag without dashes -> file
  std::vector<std::pair<std::string, std::string>> settings;
  std::set<std::string> given;
  std::vector<std::string> renamed;  // what was written by an old name, for people
};

// Flags may be written with underscores, as other programs (3D Slicer) must: --spacing_mm is --spacing-mm.
std::string dashed(std::string flag) {
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

Parsed parse(const std::vector<std::string>& args, std::vector<FieldRef> fields,
             const std::vector<std::string>& file_flags, bool takes_settings) {
  Parsed parsed;
  std::vector<std::string> known{"--help"};
  for (const auto& f : fields) known.push_back(f.flag());
  for (const auto& f : file_flags) known.push_back("--" + f);
  if (takes_settings) known.emplace_back("--set");
  bool only_positionals = false;
  for (std::size_t i = 0; i < args.size(); ++i) {
    const std::string& arg = args[i];
    if (arg == "--" && !only_positionals) {
      only_positionals = true;
      continue;
    }
    const bool short_out = arg == "-o";
    if (only_positionals || !arg.starts_with('-') || arg == "-" ||
        (arg.size() > 1 && (std::isdigit(static_cast<unsigned char>(arg[1])) != 0))) {
      parsed.positionals.push_back(arg);
      continue;
    }
    const std::size_t equals = arg.find('=');
    const std::string written = arg.substr(0, equals);
    const std::string name = short_out ? "--out" : dashed(written);
    std::optional<std::string> value;
    if (equals != std::string::npos && !short_out) value = arg.substr(equals + 1);
    const auto take_value = [&]() -> std::string {
      if (value) return *value;
      if (i + 1 >= args.size()) throw Error(ExitCode::usage, name + " needs a value");
      return args[++i];
    };
    if (takes_settings && name == "--set") {
      const std::string text = take_value();
      const std::size_t at = text.find('=');
      if (at == std::string::npos || at == 0) throw Error(ExitCode::usage, "--set: '" + text + "' is not NAME=VALUE");
      parsed.settings.emplace_back(text.substr(0, at), text.substr(at + 1));
      continue;
    }
    if (const auto it = std::find_if(file_flags.begin(), file_flags.end(),
                                     [&](const std::string& f) { return "--" + dashed(f) == name; });
        it != file_flags.end()) {
      parsed.files[*it] = take_value();
      continue;
    }
    std::string key = name.substr(std::min<std::size_t>(2, name.size()));
    std::replace(key.begin(), key.end(), '-', '_');
    if (const FieldRef* const field = find_field(fields, key); field != nullptr) {
      if (field->doc.name != key) parsed.renamed.push_back(renamed_text(written, field->flag()));
      parsed.given.emplace(field->doc.name);
      if (field->kind() == "flag") {
        field->from_text(value.value_or("true"));
      } else {
        field->from_text(take_value());
      }
      continue;
    }
    // --no-fill for a flag that is on by default; --no-structures for a text: left empty.
    if (name.starts_with("--no-") && !value) {
      const FieldRef* const off = find_field(fields, std::string_view(key).substr(3));
      if (off != nullptr && (off->kind() == "flag" || off->kind() == "text")) {
        parsed.given.emplace(off->doc.name);
        off->from_text(off->kind() == "flag" ? "false" : "");
        continue;
      }
    }
    const std::string near = nearest_name(name, known);
    throw Error(ExitCode::usage, "there is no flag " + written,
                near.empty() ? "--help shows the flags" : "did you mean " + near + "?");
  }
  return parsed;
}

// Before anything is done: a file that is written twice, or read and written, would be only the last of them.
void refuse_one_file_for_two(const CommandInfo& info, const std::vector<FieldRef>& fields,
                             const std::vector<std::string>& arguments) {
  struct Named {
    std::string flag, file;
  };
  const auto named = [&](const std::string& name) -> Named {
    for (std::size_t i = 0; i < info.positionals.size(); ++i) {
      if (info.positionals[i].name == name)
        return {"<" + name + ">", i < arguments.size() ? arguments[i] : std::string()};
    }
    const FieldRef* const field = find_field(fields, name);
    if (field == nullptr) throw Error(ExitCode::failed, "'" + info.name + "' has no flag '" + name + "'");
    return {field->flag(), field->to_text()};
  };
  std::map<std::string, std::string> taken;  // by place, what is written there
  for (const bool written : {true, false}) {
    for (const std::string& name : written ? info.writes : info.reads) {
      const Named one = named(name);
      if (one.file.empty()) continue;
      const std::string place = true_place(one.file);
      const auto other = taken.find(place);
      if (other != taken.end())
        throw Error(ExitCode::usage, other->second + " and " + one.flag + " are one file, '" + one.file + "'",
                    "give them two names");
      if (written) taken[place] = one.flag;
    }
  }
}

// " (2 names), but 3 were given"
std::string count_text(std::size_t wanted, std::size_t given) {
  return " (" + std::to_string(wanted) + (wanted == 1 ? " name" : " names") + "), but " +
         (given == 0 ? "none was" : std::to_string(given) + (given == 1 ? " was" : " were")) + " given";
}

int run_stage(const Registry& registry, Stage& stage, const std::vector<std::string>& args, Invocation& invocation,
              Common::Params& common, const std::function<void()>& ready) {
  const StageInfo& info = stage.info();
  auto fields = stage.fields();
  for (const auto& f : fields_of<Common>(common)) fields.push_back(f);
  std::vector<std::string> file_flags;
  std::vector<std::string> names;
  std::size_t required = 0;
  for (const Port& p : info.inputs) {
    if (p.optional) {
      file_flags.push_back(p.name);
    } else {
      names.push_back("<" + p.name + ">");
      ++required;
    }
  }
  for (const Port& p : info.outputs) {
    if (p.optional) {
      file_flags.push_back(p.name + "-out");
    } else {
      names.push_back("<" + p.name + ".out>");
      ++required;
    }
  }
  const Parsed parsed = parse(args, fields, file_flags, false);
  if (parsed.positionals.size() != required) {
    std::string wanted;
    for (const auto& n : names) wanted += " " + n;
    throw Error(ExitCode::usage,
                "osteo " + info.name + " takes" + wanted + count_text(required, parsed.positionals.size()),
                "'osteo help " + info.name + "' says more");
  }
  ready();
  for (const std::string& text : parsed.renamed) invocation.context.info(text);
  Pipes pipes;
  const auto read_from = [&](const Port& p, const std::string& file) {
    return file == "-" ? pipes.input(p, std::cin) : fs::path(file);
  };
  const auto write_to = [&](const Port& p, const std::string& file) {
    return file == "-" ? pipes.output(p) : fs::path(file);
  };
  // The same code path as a pipeline file with one node.
  PipelineNode node;
  node.id = node.stage = info.name;
  std::size_t next = 0;
  for (const Port& p : info.inputs) {
    if (!p.optional) {
      node.inputs[p.name].file = read_from(p, parsed.positionals[next++]);
    } else if (const auto it = parsed.files.find(p.name); it != parsed.files.end()) {
      node.inputs[p.name].file = read_from(p, it->second);
    }
  }
  for (const Port& p : info.outputs) {
    if (!p.optional) {
      node.outputs[p.name] = write_to(p, parsed.positionals[next++]);
    } else if (const auto it = parsed.files.find(p.name + "-out"); it != parsed.files.end()) {
      node.outputs[p.name] = write_to(p, it->second);
    } else if (!p.beside.empty()) {
      fs::path first = node.outputs[info.outputs.front().name];
      if (first.filename().empty()) first = first.parent_path();
      node.outputs[p.name] = first += p.beside;
    }
  }
  if (pipes.writes() && common.json)
    throw Error(ExitCode::usage, "an output '-' and --json both want standard output", "give one of them");
  for (const FieldRef& f : stage.fields()) node.params[std::string(f.doc.name)] = f.to_text();
  const auto results =
      run_pipeline({info.name, "", {node}}, registry, {.overwrite = common.force, .reuse = false}, invocation.context);
  invocation.end_progress();
  pipes.flush(invocation.out);
  if (!pipes.writes()) print_results(results, invocation);
  return 0;
}

// To people on standard error, with --json to programs on standard output too.
int fail(const Error& e, bool json, std::ostream& out, std::ostream& err) {
  err << "osteo: " << e.what() << '\n';
  if (!e.advice().empty()) err << "  " << e.advice() << '\n';
  if (json) out << error_json(e) << std::flush;
  remove_temporaries();
  return static_cast<int>(e.code());
}

}  // namespace

Command* Program::find(std::string_view name) const {
  for (const auto& c : commands) {
    if (c->info().name == name) return c.get();
  }
  return nullptr;
}

std::vector<std::string> Program::names() const {
  std::vector<std::string> all = registry.names();
  for (const auto& c : commands) all.push_back(c->info().name);
  return all;
}

std::vector<Group> Program::grouped() const {
  const std::vector<std::string> all = names();
  std::vector<Group> result;
  std::set<std::string> placed;
  for (const Group& g : groups) {
    Group there{g.title, {}};
    for (const std::string& name : g.members) {
      if (!placed.insert(name).second) throw Error(ExitCode::failed, "'" + name + "' stands in two groups of commands");
      if (std::find(all.begin(), all.end(), name) != all.end()) there.members.push_back(name);
    }
    if (!there.members.empty()) result.push_back(std::move(there));
  }
  Group rest{groups.empty() ? "Commands" : "Others", {}};
  for (const std::string& name : all) {
    if (!placed.contains(name)) rest.members.push_back(name);
  }
  if (!rest.members.empty()) result.push_back(std::move(rest));
  return result;
}

std::string Program::synopsis_of(std::string_view name) const {
  if (const Command* const command = find(name); command != nullptr) return command->info().synopsis;
  return registry.make(std::string(name))->info().synopsis;
}

namespace {

// Throws what went wrong; `printer` is the caller's, so that it can clear the bar before it prints an error.
int dispatch(Program& program, std::vector<std::string> args, std::ostream& out, std::ostream& err, bool slicer,
             std::unique_ptr<ProgressPrinter>& printer) {
  if (args.empty()) {
    err << program_help(program);
    return static_cast<int>(ExitCode::usage);
  }
  const std::string name = args.front();
  args.erase(args.begin());
  const bool wants_help = std::find(args.begin(), args.end(), "--help") != args.end() ||
                          std::find(args.begin(), args.end(), "-h") != args.end();
  const bool all = std::find(args.begin(), args.end(), "--all") != args.end();
  if (name == "--help" || name == "-h" || (name == "help" && (args.empty() || all))) {
    out << program_help(program, all);
    return 0;
  }
  if (name == "--version") {
    out << "osteo " << program_version() << "\n" << program.licence << "\n";
    return 0;
  }
  const std::string written = name == "help" ? args.front() : name;
  const std::string subject(current_command(written));
  Command* const command = program.find(subject);
  if (command == nullptr && !program.registry.has(subject)) {
    std::vector<std::string> known = program.names();
    known.emplace_back("help");
    const std::string near = nearest_name(subject, known);
    throw Error(ExitCode::usage, "there is no stage or command '" + subject + "'",
                near.empty() ? "'osteo help --all' shows them all" : "did you mean '" + near + "'?");
  }
  if (name == "help" || wants_help) {
    out << (command != nullptr ? command_help(*command) : stage_help(*program.registry.make(subject)));
    return 0;
  }
  if (command == nullptr) {
    const auto stage = program.registry.make(subject);
    if (std::find(args.begin(), args.end(), "--xml") != args.end())
      return out << stage_xml(*stage, group_of(program, subject)), 0;
    if (std::find(args.begin(), args.end(), "--describe") != args.end()) return out << stage_json(*stage), 0;
  }

  Common::Params common;
  std::vector<std::string> renamed;
  if (subject != written) renamed.push_back(renamed_text(written, subject));
  Invocation invocation{program.registry, {}, {}, {}, {}, {}, out, err, [] {}};
  const auto ready = [&] {
    if (common.json && common.progress == ProgressStyle::slicer)
      throw Error(ExitCode::usage, "--json and --progress slicer both want standard output", "give one of them");
    printer = std::make_unique<ProgressPrinter>(common.progress, common.quiet, err, ::isatty(2) != 0);
    invocation.common = common;
    invocation.context.threads = common.threads;
    invocation.context.seed = static_cast<std::uint64_t>(common.seed);
    invocation.context.set_cancel_flag(&g_cancel);
    invocation.context.on_progress([&](double f, std::string_view a) { printer->update(f, a); });
    invocation.context.on_log([&](LogLevel level, std::string_view text) {
      printer->message(level == LogLevel::warning ? "warning: " + std::string(text) : std::string(text));
    });
    invocation.end_progress = [&] { printer->clear(); };
    for (const std::string& text : renamed) invocation.context.info(text);
  };
  int code = 0;
  // 'osteo import --list FOLDER' asks what is there; that is the verb 'list-series'.
  if (command == nullptr && subject == "import" && std::find(args.begin(), args.end(), "--list") != args.end() &&
      program.find("list-series") != nullptr) {
    args.erase(std::find(args.begin(), args.end(), "--list"));
    Command* const series = program.find("list-series");
    auto fields = series->fields();
    for (const auto& f : fields_of<Common>(common)) fields.push_back(f);
    Parsed parsed = parse(args, fields, {}, false);
    renamed.insert(renamed.end(), parsed.renamed.begin(), parsed.renamed.end());
    invocation.arguments = std::move(parsed.positionals);
    invocation.given = std::move(parsed.given);
    ready();
    code = series->run(invocation);
  } else if (command == nullptr) {
    if (slicer) args = from_slicer(subject, args);
    code = run_stage(program.registry, *program.registry.make(subject), args, invocation, common, ready);
  } else {
    auto fields = command->fields();
    for (const auto& f : fields_of<Common>(common)) fields.push_back(f);
    Parsed parsed = parse(args, fields, {}, command->info().takes_settings);
    const auto& wanted = command->info().positionals;
    const auto required = static_cast<std::size_t>(
        std::count_if(wanted.begin(), wanted.end(), [](const auto& p) { return !p.optional; }));
    if (parsed.positionals.size() < required || parsed.positionals.size() > wanted.size()) {
      std::string list;
      for (const auto& p : wanted) list += p.optional ? " [" + p.name + "]" : " <" + p.name + ">";
      throw Error(ExitCode::usage, "osteo " + subject + " takes" + (list.empty() ? " no arguments" : list),
                  "'osteo help " + subject + "' says more");
    }
    invocation.arguments = std::move(parsed.positionals);
    refuse_one_file_for_two(command->info(), fields, invocation.arguments);
    invocation.settings = std::move(parsed.settings);
    renamed.insert(renamed.end(), parsed.renamed.begin(), parsed.renamed.end());
    invocation.given = std::move(parsed.given);
    ready();
    code = command->run(invocation);
  }
  return code;
}

}  // namespace

int run_program(Program& program, int argc, char** argv, std::ostream& out, std::ostream& err) {
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // A terminal that goes away, but not under nohup.
  struct sigaction hangup {};
  if (::sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
  ::signal(SIGXFSZ, SIG_IGN);
  std::unique_ptr<ProgressPrinter> printer;
  const std::vector<std::string> args{argv + 1, argv + argc};
  const bool json = std::find(args.begin(), std::find(args.begin(), args.end(), "--"), "--json") !=
                    std::find(args.begin(), args.end(), "--");
  // Slicer reads progress from standard output, and takes whatever comes on standard error for an error.
  const auto style = std::find(args.begin(), args.end(), "--progress");
  const bool slicer = std::find(args.begin(), args.end(), "--progress=slicer") != args.end() ||
                      (style != args.end() && style + 1 != args.end() && *(style + 1) == "slicer");
  const auto failed = [&](const Error& e) {
    if (printer) printer->clear();
    return fail(e, json, out, err);
  };
  try {
    static_cast<void>(simd());  // an unknown OSTEO_SIMD is reported by every command
    const int code = dispatch(program, args, out, slicer ? out : err, slicer, printer);
    if (printer) printer->clear();
    out.flush();
    if (!out) throw Error(ExitCode::cannot_write, "standard output cannot be written");
    return code;
  } catch (const Error& e) {
    return failed(e);
  } catch (const fs::filesystem_error& e) {
    return failed(error_of(e));
  } catch (const std::bad_alloc&) {
    return failed(Error(ExitCode::resources, "out of memory", "use larger voxels or a smaller region"));
  } catch (const std::exception& e) {
    return failed(Error(ExitCode::unspecified, std::string("unexpected: ") + e.what(),
                        "this is a defect of the program; please report it"));
  }
}

}  // namespace osteo::inline app::cli
