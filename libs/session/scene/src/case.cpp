#include "osteo/session/scene/case.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/shell.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/pipeline/report_json.h"

namespace osteo::inline session {
namespace {

Json triple(Vec3 v) {
  return {v.x, v.y, v.z};
}

constexpr const char* kNext = ".osteo-next";          // complete, being moved to its places
constexpr const char* kStaging = ".osteo-tmp-case-";  // in the making, or dead

// An object without members when there is none, or it cannot be read.
JsonValue manifest_of(const fs::path& folder) {
  const fs::path file = folder / "manifest.json";
  if (!output_exists(file)) return {};
  try {
    const JsonFile m(read_text(file), file.string(), ExitCode::corrupt);
    if (m.root().find("osteotome_case") != nullptr) return m.root();
  } catch (const Error&) {
    // What cannot be read is no manifest.
  }
  return {};
}

// A text of an object; empty when there is none.
std::string text_of(const JsonValue& object, std::string_view key) {
  const JsonValue* const value = object.find(key);
  return value == nullptr ? std::string() : value->text;
}

// The entries of the manifest's "files".
const std::vector<JsonMember>& files_of(const JsonValue& manifest) {
  static const std::vector<JsonMember> none;
  const JsonValue* const files = manifest.find("files");
  return files == nullptr ? none : files->members;
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return fs::absolute(path).lexically_normal().parent_path() ==
         fs::absolute(folder / "x").lexically_normal().parent_path();
}

void move_over(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  fs::rename(from, to, ec);
  if (ec)
    throw Error(ExitCode::cannot_write, "cannot write '" + to.string() + "': " + ec.message(),
                "choose a folder that you may write to");
}

// Moves a complete next state to its places; may be cut anywhere and begun again. The manifest goes last. Needs the
// lock.
void settle(const fs::path& folder) {
  const fs::path next = folder / kNext;
  std::error_code ec;
  if (fs::exists(next / "manifest.json", ec)) {
    const JsonValue before = manifest_of(folder), after = manifest_of(next);
    std::set<std::string> kept;
    for (const auto& [role, f] : files_of(after)) kept.insert(text_of(f, "file"));
    for (const auto& [role, f] : files_of(before)) {
      const fs::path stale = folder / text_of(f, "file");
      if (kept.contains(text_of(f, "file")) || !fs::is_regular_file(stale, ec) ||
          hash_path(stale) != text_of(f, "hash"))
        continue;
      fs::remove(stale, ec);
      fs::remove(provenance_path(stale), ec);
    }
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(next)) files.push_back(entry.path());
    for (const fs::path& file : files) {
      if (file.filename() != "manifest.json") move_over(file, folder / file.filename());
    }
    move_over(next / "manifest.json", folder / "manifest.json");
  }
  fs::remove(next, ec);
}

// -1 where the file system knows no locks: then nobody is kept out.
int lock_folder(const fs::path& folder, bool wait) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return -1;
  if (::flock(fd, LOCK_EX | (wait ? 0 : LOCK_NB)) == 0) return fd;
  const bool taken = errno == EWOULDBLOCK;
  ::close(fd);
  if (taken)
    throw Error(ExitCode::cannot_write, "another prepare is at work in '" + folder.string() + "'",
                "wait until it is done");
  return -1;
}

}  // namespace

CaseUpdate::CaseUpdate(fs::path folder) : folder_(std::move(folder)), is_new_(!output_exists(folder_)) {
  make_output_folder(folder_);
  if (::access(folder_.c_str(), W_OK | X_OK) != 0) {
    throw Error(ExitCode::cannot_write, "cannot write into '" + folder_.string() + "': " + std::strerror(errno),
                "choose a folder that you may write to");
  }
  try {
    lock_ = lock_folder(folder_, false);
    settle(folder_);
    // We have the lock: whoever made these is gone.
    std::vector<fs::path> dead;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (entry.path().filename().string().starts_with(kStaging)) dead.push_back(entry.path());
    }
    for (const fs::path& path : dead) fs::remove_all(path);
    staging_ = folder_ / (kStaging + std::to_string(::getpid()));
    fs::create_directory(staging_);
  } catch (const fs::filesystem_error& e) {
    close();
    throw error_of(e);
  } catch (...) {
    close();
    throw;
  }
}

void CaseUpdate::close() noexcept {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  if (is_new_) fs::remove(folder_, ignored);  // only when it is empty
  if (lock_ >= 0) ::close(lock_);
}

CaseUpdate::~CaseUpdate() {
  close();
}

fs::path CaseUpdate::place(const fs::path& output) const {
  return lies_in(output, folder_) && output.has_extension() ? staging_ / output.filename() : output;
}

void CaseUpdate::commit(const std::string& manifest) {
  if (fs::is_empty(staging_)) {
    const auto without_program = [](const std::string& text) {
      std::optional<Json> j = Json::parse(text);
      if (j) j->erase("program");
      return j;
    };
    const auto before =
        output_exists(folder_ / "manifest.json") ? without_program(read_text(folder_ / "manifest.json")) : std::nullopt;
    if (before && before == without_program(manifest)) return;
  }
  write_file(staging_ / "manifest.json", manifest);
  move_over(staging_, folder_ / kNext);
  settle(folder_);
}

std::vector<std::string> foreign_files(const fs::path& folder, const std::vector<fs::path>& outputs) {
  std::vector<std::string> foreign;
  if (!output_exists(folder)) return foreign;
  const JsonValue manifest = manifest_of(folder);
  std::set<std::string> ours;
  bool is_case = !manifest.members.empty();
  if (is_case) ours.insert("manifest.json");
  for (const auto& [role, f] : files_of(manifest)) ours.insert(text_of(f, "file"));
  std::vector<std::string> all;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name == kNext || name.starts_with(".osteo-tmp-")) continue;
      // Outputs lie beside their records; the verdict on a rejected scan, a damaged manifest and the record of a lost
      // output stand alone.
      bool made = fs::exists(provenance_path(entry.path()));
      for (const auto& [ending, word] : {std::pair{"import.json", "\"osteotome_verdict\""},
                                         {"manifest.json", "\"osteotome_case\""},
                                         {".prov.json", "\"output_hash\""}}) {
        if (!made && name.ends_with(ending) && entry.is_regular_file())
          made = read_text(entry.path()).find(word) != std::string::npos;
      }
      if (made) ours.insert({name, name + ".prov.json"});
      is_case = is_case || (made && (name == "bone.vdb" || name == "import.json" || name == "manifest.json"));
      all.push_back(name);
    }
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
  for (const std::string& name : all) {
    const bool replaced =
        name == "manifest.json" || std::any_of(outputs.begin(), outputs.end(), [&](const fs::path& o) {
          return lies_in(o, folder) && (o.filename() == name || provenance_path(o).filename() == name);
        });
    if (!ours.contains(name) && (!is_case || replaced)) foreign.push_back(name);
  }
  std::sort(foreign.begin(), foreign.end());
  return foreign;
}

void recall_facts(const fs::path& folder, std::vector<NodeResult>& results) {
  const JsonValue manifest = manifest_of(folder);
  const JsonValue* const steps = manifest.find("steps");
  if (steps == nullptr) return;
  for (NodeResult& r : results) {
    if (!r.reused || !r.report.empty()) continue;
    for (const JsonValue& step : steps->items) {
      const JsonValue* const report = step.find("report");
      if (report != nullptr && text_of(step, "id") == r.id && text_of(step, "key") == r.key)
        r.report = report_from_json(*report);
    }
  }
}

std::string make_manifest(const CaseUpdate& update, const std::string& pipeline_name,
                          const std::vector<NodeResult>& results, const Recipe& recipe) {
  Json m;
  m["osteotome_case"] = 1;
  m["program"] = std::string(program_version());
  m["pipeline"] = pipeline_name;
  m["recipe"] = recipe_json(recipe);
  m["units"] = {{"length", "mm"},
                {"world", "LPS"},
                {"density", "share of the voxel filled with bone, 0 to 1"},
                {"hu", "Hounsfield units"}};
  m["privacy"] =
      "No identity, no dates, no file names of the source. Only voxels that hold bone are stored: no skin, no face.";
  m["files"] = Json::object();
  m["steps"] = Json::list();
  fs::path bone_file;
  for (const NodeResult& r : results) {
    m["steps"].push_back(
        {{"id", r.id}, {"stage", r.stage}, {"params", r.params}, {"key", r.key}, {"report", report_to_json(r.report)}});
    for (const auto& [port, path] : r.outputs) {
      if (!lies_in(path, update.folder())) continue;
      // A finer part of the bone is bone too: its stage's name tells them apart.
      std::string role = r.id == "region" && port == "bone" ? "region" : port;
      if (path.filename() == kGivenStructures) role = "structures_given";  // before they were corrected
      m["files"][role] = {{"file", path.filename().string()}, {"hash", r.output_hashes.at(port)}};
      if (role == "bone") bone_file = output_exists(update.place(path)) ? update.place(path) : path;
    }
  }
  if (bone_file.empty()) {
    throw Error(ExitCode::usage, "the pipeline writes no \"bone\" into the case folder",
                "a case needs a stage with the output bone, as in pipelines/temporal-bone.json");
  }
  const SparseGrid bone = load_grid(bone_file);
  m["frame"] = {{"dims", bone.frame.dims},
                {"spacing_mm", triple(bone.frame.spacing_mm)},
                {"origin_mm", triple(bone.frame.origin_mm)},
                {"direction",
                 {triple(bone.frame.direction.column[0]), triple(bone.frame.direction.column[1]),
                  triple(bone.frame.direction.column[2])}},
                {"axes", orientation_code(bone.frame)}};
  m["bone_memory_mb"] = static_cast<double>(bone.memory_bytes) / 1e6;
  return m.dump(2) + "\n";
}

std::map<std::string, ManifestFile> parse_manifest(std::string_view json, const std::string& name) {
  using Names = std::vector<std::string>;
  std::map<std::string, ManifestFile> files;
  try {
    const JsonFile m(json, name, ExitCode::corrupt);
    m.require_format("osteotome_case");
    m.allow(m.root(), "",
            Names{"osteotome_case", "program", "pipeline", "recipe", "units", "privacy", "files", "steps", "frame",
                  "bone_memory_mb"});
    const JsonValue& listed = m.need(m.root(), "", "files");
    if (listed.kind != JsonValue::Kind::object) throw m.wrong(listed, "\"files\" must be an object in braces");
    for (const auto& [role, f] : listed.members) {
      m.allow(f, role, Names{"file", "hash"});
      ManifestFile file{m.text(m.need(f, role, "file"), role + ": \"file\""),
                        m.text(m.need(f, role, "hash"), role + ": \"hash\"")};
      if (file.name.empty() || file.name.find('/') != std::string::npos || file.name == "..")
        throw m.wrong(f, role + ": '" + file.name + "' is no file inside the case");
      files[role] = std::move(file);
    }
    if (!files.contains("bone")) throw m.wrong(listed, "it names no bone");
  } catch (const Error& e) {
    throw e.advice().empty() ? Error(e.code(), e.what(), "run 'osteo prepare' again") : e;
  }
  return files;
}

Case load_case(const fs::path& folder) {
  require_readable(folder);
  const fs::path manifest = folder / "manifest.json";
  if (output_exists(folder / kNext)) {
    const int lock = lock_folder(folder, true);
    settle(folder);
    if (lock >= 0) ::close(lock);
  }
  if (!fs::is_directory(folder) || !fs::exists(manifest)) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is not a prepared case: it has no manifest.json",
                "make one with: osteo prepare CT -o " + shell_path(folder));
  }
  Case result;
  result.folder = folder;
  const std::map<std::string, ManifestFile> files = parse_manifest(read_text(manifest), manifest.string());
  for (const auto& [role, f] : files) {
    const fs::path path = folder / f.name;
    require_readable(path);
    if (hash_path(path) != f.hash) {
      throw Error(ExitCode::corrupt, "'" + path.string() + "' is not the file that the manifest describes",
                  "it was changed or damaged: run 'osteo prepare' again");
    }
    result.files[role] = path;
  }
  result.bone = load_grid(result.files["bone"]);
  return result;
}

}  // namespace osteo::inline session
