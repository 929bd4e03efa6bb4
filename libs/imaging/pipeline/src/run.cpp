#include <algorithm>
#include <chrono>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/pipeline/engine.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/imaging/pipeline/report_json.h"

namespace osteo::inline imaging {

extern const char* const kCommit;  // made at build time, see version.cmake

namespace {

const Port* find_port(const std::vector<Port>& ports, const std::string& name) {
  for (const Port& p : ports) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

std::vector<std::string> names_of(const std::vector<Port>& ports) {
  std::vector<std::string> names;
  for (const Port& p : ports) names.push_back(p.name);
  return names;
}

[[noreturn]] void unknown(const std::string& where, const std::string& what, const std::string& name,
                          const std::vector<std::string>& known) {
  const std::string near = nearest_name(name, known);
  std::string list;
  for (const auto& k : known) list += (list.empty() ? "" : ", ") + k;
  throw Error(ExitCode::usage, where + ": there is no " + what + " '" + name + "'",
              !near.empty()   ? "did you mean '" + near + "'?"
              : known.empty() ? "it has none"
                              : "it has " + list);
}

void set_params(Stage& stage, const PipelineNode& node) {
  auto fields = stage.fields();
  for (const auto& param : node.params) {
    const std::string &name = param.first, &text = param.second;
    const FieldRef* const it = find_field(fields, name);
    if (it == nullptr) {
      std::vector<std::string> known;
      for (const auto& f : fields) known.emplace_back(f.doc.name);
      unknown("stage '" + node.id + "'", "parameter", name, known);
    }
    try {
      it->from_text(text);
    } catch (const Error& e) {
      throw e.in("stage '" + node.id + "'");
    }
  }
}

class Runner {
 public:
  Runner(const Pipeline& pipeline, const Registry& registry, const RunOptions& options, const Context& context)
      : pipeline_(pipeline), options_(options), context_(context) {
    for (const PipelineNode& node : pipeline.nodes) {
      auto stage = registry.make(node.stage);
      if (const std::string& name = stage->info().name; name != node.stage)
        context.info("stage '" + node.id + "': " + renamed_text(node.stage, name));
      set_params(*stage, node);
      stages_.push_back(std::move(stage));
      index_[node.id] = stages_.size() - 1;
    }
    values_.resize(stages_.size());
    results_.resize(stages_.size());
  }

  std::vector<NodeResult> run(const MakeEngine& make_engine) {
    check_inputs_exist();
    if (!options_.overwrite && !options_.reuse) refuse_to_overwrite();
    for (std::size_t n = 0; n < stages_.size(); ++n) compute_key(n);
    std::vector<bool> fresh(stages_.size());
    std::size_t to_run = 0;
    for (std::size_t n = 0; n < stages_.size(); ++n) {
      fresh[n] = options_.reuse && outputs_are_fresh(n);
      const bool always = options_.always.contains(pipeline_.nodes[n].id);
      if (!always && (fresh[n] || pipeline_.nodes[n].outputs.empty())) continue;
      mark_needed(n, fresh);
      for (const auto& [port, path] : pipeline_.nodes[n].outputs)
        check_place(*find_port(stages_[n]->info().outputs, port), path);
    }
    for (const bool b : needed_) to_run += b ? 1 : 0;
    if (make_engine && to_run > 0) engine_ = make_engine(pipeline_to_run());
    std::size_t done = 0;
    for (std::size_t n = 0; n < stages_.size(); ++n) {
      if (!is_needed(n)) {
        results_[n].reused = true;
        continue;
      }
      const double share = 1.0 / static_cast<double>(to_run);
      run_node(n, context_.sub(share * static_cast<double>(done), share * static_cast<double>(done + 1)));
      ++done;
    }
    return std::move(results_);
  }

 private:
  void check_inputs_exist() const {
    for (const auto& node : pipeline_.nodes) {
      for (const auto& [port, input] : node.inputs) {
        if (input.node.empty()) require_readable(input.file);
      }
    }
  }

  void refuse_to_overwrite() const {
    for (const auto& node : pipeline_.nodes) {
      for (const auto& [port, path] : node.outputs) {
        if (output_exists(path))
          throw Error(ExitCode::cannot_write, "'" + path.string() + "' exists already",
                      "give another name, or --force to replace it");
      }
    }
  }

  // Before hours of work rather than after: is there something in the way that must not be replaced?
  static void check_place(const Port& port, const fs::path& path) {
    if (!output_exists(path)) return;
    if (becomes_folder(port.kinds.front(), path)) {
      require_replaceable(output_folder(path), path);
    } else if (std::error_code ec; fs::is_directory(path, ec)) {
      throw Error(ExitCode::cannot_write, "'" + path.string() + "' is a folder, not a file", "give another name");
    }
  }

  [[nodiscard]] fs::path written(const fs::path& path) const { return options_.place ? options_.place(path) : path; }

  // What the result depends on: the stage and its version, every parameter, the seed, and the content of the inputs.
  void compute_key(std::size_t n) {
    const PipelineNode& node = pipeline_.nodes[n];
    NodeResult& result = results_[n];
    result.id = node.id;
    result.stage = node.stage;
    result.outputs = node.outputs;
    std::string text = node.stage + "/" + std::to_string(stages_[n]->info().version) +
                       "\nseed=" + std::to_string(context_.seed) + "\n";
    for (const auto& f : stages_[n]->fields()) {
      // The key depends on a UID, the record says only that there was one.
      result.params[std::string(f.doc.name)] = without_uid(f.to_text());
      text += std::string(f.doc.name) + "=" + f.to_text() + "\n";
    }
    for (const auto& [port, input] : node.inputs) {
      if (input.node.empty()) {
        auto& hash = file_hashes_[input.file.string()];
        if (hash.empty()) hash = hash_path(input.file);
        text += port + "<" + hash + "\n";
      } else {
        text += port + "<" + results_[index_.at(input.node)].key + "." + input.port + "\n";
      }
    }
    result.key = hash_text(text);
  }

  bool outputs_are_fresh(std::size_t n) {
    NodeResult& result = results_[n];
    for (const auto& [port, path] : pipeline_.nodes[n].outputs) {
      if (!fs::exists(path) || !fs::exists(provenance_path(path))) return false;
      try {
        const JsonFile p(read_text(provenance_path(path)), provenance_path(path).string(), ExitCode::corrupt);
        const auto text = [&](const char* key) { return p.text(p.need(p.root(), "", key), key); };
        if (text("key") != result.key || text("output_hash") != hash_path(path)) return false;
        result.output_hashes[port] = text("output_hash");
        result.report = report_from_json(p.need(p.root(), "", "report"));
      } catch (const std::exception&) {
        return false;  // an unreadable record is no record
      }
    }
    return true;
  }

  void mark_needed(std::size_t n, const std::vector<bool>& fresh) {
    needed_.resize(stages_.size());
    if (needed_[n]) return;
    needed_[n] = true;
    for (const auto& [port, input] : pipeline_.nodes[n].inputs) {
      if (input.node.empty()) continue;
      const std::size_t m = index_.at(input.node);
      if (!(fresh[m] && saved_path(m, input.port))) mark_needed(m, fresh);
    }
  }
  [[nodiscard]] bool is_needed(std::size_t n) const { return n < needed_.size() && needed_[n]; }

  // What is left when steps whose outputs are there become these files.
  [[nodiscard]] Pipeline pipeline_to_run() const {
    Pipeline part{pipeline_.name, pipeline_.description, {}};
    for (std::size_t n = 0; n < pipeline_.nodes.size(); ++n) {
      if (!is_needed(n)) continue;
      part.nodes.push_back(pipeline_.nodes[n]);
      for (auto& [port, input] : part.nodes.back().inputs) {
        if (input.node.empty() || is_needed(index_.at(input.node))) continue;
        input = {{}, {}, *saved_path(index_.at(input.node), input.port)};
      }
    }
    return part;
  }

  const fs::path* saved_path(std::size_t n, const std::string& port) const {
    const auto& node = pipeline_.nodes[n];
    const auto it = node.outputs.find(port.empty() ? stages_[n]->info().outputs.front().name : port);
    return it == node.outputs.end() ? nullptr : &it->second;
  }

  Data input_of(std::size_t n, const Port& port, const Context& context) {
    const auto it = pipeline_.nodes[n].inputs.find(port.name);
    if (it == pipeline_.nodes[n].inputs.end()) return std::monostate{};
    const auto& input = it->second;
    if (input.node.empty()) return load_data(input.file, port.kinds, context);
    const std::size_t m = index_.at(input.node);
    if (values_[m].empty()) return load_data(*saved_path(m, input.port), port.kinds, context);
    const auto& ports = stages_[m]->info().outputs;
    for (std::size_t p = 0; p < ports.size(); ++p) {
      if (input.port.empty() || ports[p].name == input.port) return values_[m][p];
    }
    return std::monostate{};
  }

  void run_node(std::size_t n, const Context& context) {
    const PipelineNode& node = pipeline_.nodes[n];
    const StageInfo& info = stages_[n]->info();
    NodeResult& result = results_[n];
    const auto start = std::chrono::steady_clock::now();
    try {
      context.progress(0, info.name);
      if (engine_) {
        static_cast<void>(context.take_report());
        values_[n] = engine_->run(node.id, context);
      } else {
        std::vector<Data> inputs;
        for (const Port& port : info.inputs) inputs.push_back(input_of(n, port, context));
        static_cast<void>(context.take_report());
        values_[n] = stages_[n]->run(inputs, context);
      }
      result.report = context.take_report();
      context.check_cancelled();
      result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      for (std::size_t p = 0; p < info.outputs.size(); ++p) {
        const auto it = node.outputs.find(info.outputs[p].name);
        if (it != node.outputs.end()) save_output(n, info.outputs[p].name, values_[n][p], it->second, context);
        if (options_.seen) options_.seen(node.id, info.outputs[p].name, values_[n][p]);
      }
    } catch (const ErrorWithDocument& e) {
      const auto it = node.outputs.find(e.port());
      if (it != node.outputs.end()) {
        save_data(e.document(), written(it->second), context);
        if (!e.picture().empty()) {
          write_file(written(it->second).replace_extension(".svg"), e.picture());
          context.info("a picture of what was found is in " + fs::path(it->second).replace_extension(".svg").string());
        }
      }
      if (pipeline_.nodes.size() == 1) throw;
      throw ErrorWithDocument(e.in("stage '" + node.id + "'"), e.port(), e.document(), e.picture());
    } catch (const Error& e) {
      if (e.code() == ExitCode::cancelled || pipeline_.nodes.size() == 1) throw;
      throw e.in("stage '" + node.id + "'");
    } catch (const std::bad_alloc&) {
      throw Error(ExitCode::resources, "stage '" + node.id + "' ran out of memory",
                  "use larger voxels or a smaller region");
    }
    free_unneeded(n);
  }

  void save_output(std::size_t n, const std::string& port, const Data& value, const fs::path& path,
                   const Context& context) {
    const fs::path place = written(path);
    const bool is_new = !output_exists(place);
    save_data(value, place, context, [&](const fs::path& old) { require_replaceable(old, path); });
    try {
      save_provenance(n, port, place, context);
    } catch (...) {
      // An output is not complete without its record.
      std::error_code ignored;
      if (is_new) fs::remove_all(place, ignored);
      throw;
    }
  }

  void save_provenance(std::size_t n, const std::string& port, const fs::path& path, const Context& context) {
    NodeResult& result = results_[n];
    result.output_hashes[port] = hash_path(path);
    Json p;
    p["osteotome"] = std::string(program_version());
    p["stage"] = result.stage;
    p["version"] = stages_[n]->info().version;
    p["output"] = port;
    p["params"] = result.params;
    Json inputs = Json::object();
    for (const auto& [name, input] : pipeline_.nodes[n].inputs) {
      inputs[name] = input.node.empty() ? file_hashes_.at(input.file.string()) : results_[index_.at(input.node)].key;
    }
    p["inputs"] = inputs;
    p["key"] = result.key;
    p["output_hash"] = result.output_hashes[port];
    if (fs::is_directory(path)) p["files"] = hash_files(path);
    p["report"] = report_to_json(result.report);
    p["seed"] = context.seed;
    p["seconds"] = result.seconds;
    p["peak_memory_mb"] = peak_memory_mb();
    write_file(provenance_path(path), p.dump(2) + "\n");
  }

  // A value is dropped after its last reader.
  void free_unneeded(std::size_t done) {
    for (std::size_t m = 0; m <= done; ++m) {
      bool used = false;
      for (std::size_t n = done + 1; n < stages_.size() && !used; ++n) {
        for (const auto& [port, input] : pipeline_.nodes[n].inputs)
          used = used || (is_needed(n) && !input.node.empty() && index_.at(input.node) == m);
      }
      if (used || values_[m].empty()) continue;
      values_[m].clear();
      if (engine_) engine_->release(pipeline_.nodes[m].id);
    }
  }

  const Pipeline& pipeline_;
  RunOptions options_;
  const Context& context_;
  std::vector<std::unique_ptr<Stage>> stages_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::vector<Data>> values_;
  std::vector<NodeResult> results_;
  std::vector<bool> needed_;
  std::map<std::string, std::string> file_hashes_;
  std::unique_ptr<Engine> engine_;
};

}  // namespace

void validate(Pipeline& pipeline, const Registry& registry) {
  std::map<std::string, const StageInfo*> infos;
  std::vector<std::string> ids;
  std::vector<std::unique_ptr<Stage>> stages;
  for (const PipelineNode& node : pipeline.nodes) {
    try {
      stages.push_back(registry.make(node.stage));
    } catch (const Error& e) {
      throw pipeline.nodes.size() == 1 ? e : e.in("stage '" + node.id + "'");
    }
    set_params(*stages.back(), node);
    infos[node.id] = &stages.back()->info();
    ids.push_back(node.id);
  }
  std::map<std::string, std::string> written_by;
  for (const PipelineNode& node : pipeline.nodes) {
    const StageInfo& info = *infos[node.id];
    const std::string where = "stage '" + node.id + "'";
    for (const auto& [name, input] : node.inputs) {
      const Port* const port = find_port(info.inputs, name);
      if (port == nullptr) unknown(where, "input", name, names_of(info.inputs));
      if (input.node.empty()) continue;
      if (!infos.contains(input.node)) unknown(where + " input '" + name + "'", "stage", input.node, ids);
      const StageInfo& from = *infos[input.node];
      if (from.outputs.empty()) throw Error(ExitCode::usage, where + ": stage '" + input.node + "' has no output");
      const Port* const out = input.port.empty() ? &from.outputs.front() : find_port(from.outputs, input.port);
      if (out == nullptr)
        unknown(where + " input '" + name + "'", "output of '" + input.node + "'", input.port, names_of(from.outputs));
      if (std::find(port->kinds.begin(), port->kinds.end(), out->kinds.front()) == port->kinds.end()) {
        throw Error(ExitCode::usage, where + " takes " + kinds_text(port->kinds) + " as '" + name + "', but '" +
                                         input.node + "." + out->name + "' is " +
                                         std::string(kind_name(out->kinds.front())));
      }
    }
    for (const Port& port : info.inputs) {
      if (!port.optional && !node.inputs.contains(port.name))
        throw Error(ExitCode::usage, where + ": the input '" + port.name + "' is missing");
    }
    for (const auto& [name, path] : node.outputs) {
      const Port* const port = find_port(info.outputs, name);
      if (port == nullptr) unknown(where, "output", name, names_of(info.outputs));
      require_savable(port->kinds.front(), path);
      const auto [it, inserted] = written_by.try_emplace(true_place(path), node.id);
      if (!inserted)
        throw Error(ExitCode::usage, where + " and stage '" + it->second + "' both write '" + path.string() + "'");
    }
  }
  // Order of the file, each node after its inputs.
  std::vector<PipelineNode> ordered;
  std::set<std::string> placed;
  while (ordered.size() < pipeline.nodes.size()) {
    const std::size_t before = ordered.size();
    for (const PipelineNode& node : pipeline.nodes) {
      if (placed.contains(node.id)) continue;
      const bool ready = std::all_of(node.inputs.begin(), node.inputs.end(), [&](const auto& in) {
        return in.second.node.empty() || placed.contains(in.second.node);
      });
      if (!ready) continue;
      placed.insert(node.id);
      ordered.push_back(node);
    }
    if (ordered.size() == before) throw Error(ExitCode::usage, "pipeline: the stages wait for each other in a circle");
  }
  pipeline.nodes = std::move(ordered);
}

std::vector<NodeResult> run_pipeline(Pipeline pipeline, const Registry& registry, const RunOptions& options,
                                     const Context& context) {
  return run_pipeline(std::move(pipeline), registry, options, context, {});
}

std::vector<NodeResult> run_pipeline(Pipeline pipeline, const Registry& registry, const RunOptions& options,
                                     const Context& context, const MakeEngine& make_engine) {
  validate(pipeline, registry);
  return Runner(pipeline, registry, options, context).run(make_engine);
}

void require_replaceable(const fs::path& folder, const fs::path& output) {
  std::map<std::string, std::string> ours;
  bool whole = false;
  try {
    const JsonFile p(read_text(provenance_path(output)), provenance_path(output).string(), ExitCode::corrupt);
    if (const JsonValue* const files = p.root().find("files"); files != nullptr) {
      for (const auto& [name, hash] : files->members) ours[name] = p.text(hash, name);
    }
    const JsonValue* const hash = p.root().find("output_hash");
    whole = ours.empty() && hash != nullptr && hash->text == hash_path(folder);
  } catch (const std::exception&) {
    // An unreadable record is no record.
  }
  std::vector<std::string> foreign;
  for (const auto& [name, hash] : hash_files(folder)) {
    const auto it = ours.find(name);
    if (!whole && (hash.empty() || it == ours.end() || it->second != hash)) foreign.push_back(name);
  }
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder, ec)) {
    if (entry.is_directory() && !entry.is_symlink() && fs::is_empty(entry.path(), ec))
      foreign.push_back(entry.path().filename().string());
  }
  if (foreign.empty()) return;
  throw Error(ExitCode::cannot_write,
              "'" + output.string() + "' holds what this program has no record of: " + list_names(foreign),
              "give another name, or move them away; --force replaces only what the program made");
}

std::string without_uid(const std::string& text) {
  const bool digits = text.find_first_not_of("0123456789.") == std::string::npos;
  return digits && std::count(text.begin(), text.end(), '.') >= 3 ? "(UID)" : text;
}

std::string list_names(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text;
}

std::string true_place(const fs::path& path) {
  std::error_code ec;
  fs::path place = fs::weakly_canonical(fs::absolute(path, ec), ec);
  if (ec) place = path.lexically_normal();
  return (place.has_filename() ? place : place.parent_path()).string();
}

fs::path provenance_path(const fs::path& output) {
  fs::path path = output.has_filename() ? output : output.parent_path();
  return path += ".prov.json";
}

std::string_view program_version() {
  static const std::string text = std::string(OSTEO_VERSION) + " (" + kCommit + ")";
  return text;
}

}  // namespace osteo::inline imaging
