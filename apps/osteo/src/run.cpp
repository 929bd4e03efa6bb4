// run and docs.
#include <ostream>

#include "commands/docs.h"
#include "commands/run.h"
#include "osteo/app/cli/report.h"
#include "osteo/app/vtk/pipeline.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/pacs/peer.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/pipeline/engine.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/recording/script.h"
#include "program.h"

namespace osteo {

cli::CommandInfo RunCommand::info() {
  return {"run",
          "run a pipeline file",
          "Variables of the file are set with --set NAME=VALUE, a parameter of one stage with --set "
          "ID.PARAMETER=VALUE. The whole graph is "
          "checked before anything is read.",
          {{"pipeline", "a .json file"}},
          "osteo run pipelines/temporal-bone.json --set source=CT_FOLDER --set case=CASE",
          true};
}

int RunCommand::run(const Params& p, cli::Invocation& io) {
  const std::string text = read_text(io.arguments[0]);
  std::map<std::string, std::string> settings(io.settings.begin(), io.settings.end());
  if (p.validate) {
    // Variables without value get a stand-in: the graph can be checked without them.
    try {
      for (const auto& v : pipeline_variables(text)) {
        if (!v.fallback) settings.try_emplace(v.name, "VALUE");
      }
      Pipeline pipeline = parse_pipeline(text, settings);
      validate(pipeline, io.registry);
      Json answer{{"valid", true}, {"stages", Json::list()}};
      for (const auto& n : pipeline.nodes) answer["stages"].push_back({{"id", n.id}, {"stage", n.stage}});
      io.out << answer.dump(2) << '\n';
      return 0;
    } catch (const Error& e) {
      io.out << Json{{"valid", false}, {"error", e.what()}, {"advice", e.advice()}}.dump(2) << '\n';
      return static_cast<int>(e.code());
    }
  }
  Pipeline pipeline = parse_pipeline(text, settings);
  if (p.dry_run) {
    validate(pipeline, io.registry);
    for (const auto& n : pipeline.nodes) {
      io.out << n.id << " (" << n.stage << ")\n";
      for (const auto& [port, in] : n.inputs)
        io.out << "  " << port << " <- "
               << (in.node.empty() ? in.file.string() : in.node + (in.port.empty() ? "" : "." + in.port)) << '\n';
      for (const auto& [name, value] : n.params) io.out << "  " << name << " = " << value << '\n';
      for (const auto& [port, path] : n.outputs)
        io.out << "  " << port << " -> " << path.string() << (output_exists(path) ? " (exists)" : "") << '\n';
    }
    return 0;
  }
  const auto results = run_pipeline(std::move(pipeline), io.registry, {.overwrite = io.common.force, .reuse = p.reuse},
                                    io.context, p.engine == RunEngine::vtk ? vtk_engine(io.registry) : MakeEngine());
  io.end_progress();
  cli::print_results(results, io);
  return 0;
}

cli::CommandInfo DocsCommand::info() {
  return {"docs",
          "write the reference pages, the schema and the completion",
          "All of them are made from the declarations of the stages and commands.",
          {{"folder", "usually docs/reference; with --shared the folder 'share' of an installation"}},
          "osteo docs docs/reference"};
}

namespace {

// The table of actions, for who reads session files.
std::string actions_page() {
  std::string page =
      "<!-- Made by `osteo docs`; a test fails when it is stale. -->\n\n# Actions\n\nWhat is done to a scene besides "
      "drilling, as session "
      "files hold it. Numbers 0xffffffff mean none.\n\n| kind | name | what it does | names | values, from the first "
      "on "
      "|\n|---|---|---|---|---|\n";
  for (const ActionRow& row : action_table()) {
    std::string names, values;
    const auto add = [&](const char* field, std::string_view what) {
      if (!what.empty()) names += (names.empty() ? "`" : "; `") + std::string(field) + "` " + std::string(what);
    };
    add("body", row.body);
    add("other", row.other);
    add("item", row.item);
    add("hand", row.hand);
    for (const ActionValue& v : row.values)
      values +=
          (values.empty() ? "" : ", ") + std::string(v.name) + (v.unit == "1" ? "" : " (" + std::string(v.unit) + ")");
    page += "| " + std::to_string(static_cast<std::uint32_t>(row.kind)) + " | " + std::string(row.name) + " | " +
            std::string(row.help) + " | " + names + " | " + values + " |\n";
  }
  page +=
      "\n| name | changes the world | and what is touched | after a hold | ends a hold | the last of several counts | "
      "moves dust |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const ActionRow& row : action_table()) {
    page += "| " + std::string(row.name);
    for (const bool is :
         {row.changes_world, row.changes_touch, row.reads_bone, row.ends_hold, row.last_counts, row.moves_dust})
      page += is ? " | yes" : " | ";
    page += " |\n";
  }
  return page;
}

std::string conformance_page() {
  return "<!-- Made by `osteo docs`; a test fails when it is stale. -->\n\n# DICOM conformance statement\n\n"
         "What Osteotome takes, offers and writes, from the tables that the program itself goes by. The test "
         "`pacs.conformance` holds it against what the storage node negotiates. Not a medical device: "
         "[Intended use](../intended-use.md).\n\n" +
         network_conformance() + objects_conformance();
}

}  // namespace

int DocsCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[0];
  if (p.shared) {
    if (p.check)
      throw Error(ExitCode::usage, "--check is for the reference pages, not for --shared", "leave one of them out");
    for (const auto& [name, content] : cli::shared_files(make_osteo_program())) {
      const fs::path path = folder / name;
      make_output_folder(path.parent_path());
      write_file(path, content);
      if (!content.starts_with("#!")) continue;
      fs::permissions(path, fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec,
                      fs::perm_options::add);
    }
    return 0;
  }
  int stale = 0;
  auto pages = cli::reference_pages(make_osteo_program());
  pages["script.schema.json"] = script_schema();
  pages["actions.md"] = actions_page();
  pages["conformance.md"] = conformance_page();
  for (const auto& [name, content] : pages) {
    const fs::path path = folder / name;
    if (!p.check) {
      make_output_folder(folder);
      write_file(path, content);
    } else if (!fs::exists(path) || read_text(path) != content) {
      io.err << "stale: " << path.string() << '\n';
      ++stale;
    }
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (pages.contains(entry.path().filename().string())) continue;
    io.err << "stale: " << entry.path().string() << " belongs to nothing\n";
    ++stale;
  }
  if (p.check && stale > 0)
    throw Error(ExitCode::failed, std::to_string(stale) + " reference pages are stale",
                "run: osteo docs " + folder.string());
  return 0;
}

}  // namespace osteo
