#include "osteo/scene/case.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"
#include "osteo/grid/grid_io.h"
#include "osteo/pipeline/report_json.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

ordered_json triple(Vec3 v) {
  return {v.x, v.y, v.z};
}

constexpr const char* kNext = ".osteo-next";          // complete, being moved to its places
constexpr const char* kStaging = ".osteo-tmp-case-";  // in the making, or dead

// Empty when there is none.
ordered_json manifest_of(const fs::path& folder) {
  const fs::path file = folder / "manifest.json";
  if (!output_exists(file)) return ordered_json::object();
  try {
    auto m = ordered_json::parse(read_text(file), nullptr, false);
    if (m.is_object() && m.contains("osteotome_case")) return m;
  } catch (const Error&) {
    // What cannot be read is no manifest.
  }
  return ordered_json::object();
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return fs::absolute(path).lexically_normal().parent_path() == fs::absolute(folder / "x").lexically_normal().parent_path();
}

void move_over(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  fs::rename(from, to, ec);
  if (ec)
    throw Error(ExitCode::cannot_write, "cannot write '" + to.string() + "': " + ec.message(), "choose a folder that you may write to");
}

// Moves a complete next state to its places; may be cut anywhere and begun again. The manifest goes last. Needs the lock.
void settle(const fs::path& folder) {
  const fs::path next = folder / kNext;
  std::error_code ec;
  if (fs::exists(next / "manifest.json", ec)) {
    const ordered_json before = manifest_of(folder), after = manifest_of(next);
    std::set<std::string> kept;
    for (const auto& f : after.value("files", ordered_json::object())) kept.insert(f.value("file", ""));
    for (const auto& f : before.value("files", ordered_json::object())) {
      const fs::path stale = folder / f.value("file", "");
      if (kept.contains(f.value("file", "")) || !fs::is_regular_file(stale, ec) || hash_path(stale) != f.value("hash", "")) continue;
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
  if (taken) throw Error(ExitCode::cannot_write, "another prepare is at work in '" + folder.string() + "'", "wait until it is done");
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
  const auto without_program = [](ordered_json j) {
    j.erase("program");
    return j;
  };
  const ordered_json before = manifest_of(folder_);
  if (fs::is_empty(staging_) && !before.empty() && without_program(before) == without_program(ordered_json::parse(manifest))) return;
  write_file(staging_ / "manifest.json", manifest);
  move_over(staging_, folder_ / kNext);
  settle(folder_);
}

std::vector<std::string> foreign_files(const fs::path& folder, const std::vector<fs::path>& outputs) {
  std::vector<std::string> foreign;
  if (!output_exists(folder)) return foreign;
  const ordered_json manifest = manifest_of(folder);
  std::set<std::string> ours;
  if (!manifest.empty()) ours.insert("manifest.json");
  for (const auto& f : manifest.value("files", ordered_json::object())) ours.insert(f.value("file", ""));
  bool is_case = !manifest.empty();
  std::vector<std::string> all;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name == kNext || name.starts_with(".osteo-tmp-")) continue;
      // Outputs lie beside their records; the verdict on a refused scan, a damaged manifest and the record of a lost output stand alone.
      bool made = fs::exists(provenance_path(entry.path()));
      for (const auto& [ending, word] : {std::pair{"import.json", "\"osteotome_verdict\""},
                                         {"manifest.json", "\"osteotome_case\""},
                                         {".prov.json", "\"output_hash\""}}) {
        if (!made && name.ends_with(ending) && entry.is_regular_file()) made = read_text(entry.path()).find(word) != std::string::npos;
      }
      if (made) ours.insert({name, name + ".prov.json"});
      is_case = is_case || (made && (name == "bone.vdb" || name == "import.json" || name == "manifest.json"));
      all.push_back(name);
    }
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
  for (const std::string& name : all) {
    const bool replaced = name == "manifest.json" || std::any_of(outputs.begin(), outputs.end(), [&](const fs::path& o) {
                            return lies_in(o, folder) && (o.filename() == name || provenance_path(o).filename() == name);
                          });
    if (!ours.contains(name) && (!is_case || replaced)) foreign.push_back(name);
  }
  std::sort(foreign.begin(), foreign.end());
  return foreign;
}

void recall_facts(const fs::path& folder, std::vector<NodeResult>& results) {
  const ordered_json manifest = manifest_of(folder);
  for (NodeResult& r : results) {
    if (!r.reused || !r.report.empty()) continue;
    for (const auto& step : manifest.value("steps", ordered_json::array())) {
      if (step.value("id", "") == r.id && step.value("key", "") == r.key)
        r.report = report_from_json(step.value("report", ordered_json::object()));
    }
  }
}

std::string make_manifest(const CaseUpdate& update, const std::string& pipeline_name, const std::vector<NodeResult>& results,
                          const Recipe& recipe) {
  ordered_json m;
  m["osteotome_case"] = 1;
  m["program"] = std::string(program_version());
  m["pipeline"] = pipeline_name;
  m["recipe"] = ordered_json::parse(recipe_json(recipe));
  m["units"] = {{"length", "mm"}, {"world", "LPS"}, {"density", "share of the voxel filled with bone, 0 to 1"}, {"hu", "Hounsfield units"}};
  m["privacy"] = "No identity, no dates, no file names of the source. Only voxels that hold bone are stored: no skin, no face.";
  m["files"] = ordered_json::object();
  m["steps"] = ordered_json::array();
  fs::path bone_file;
  for (const NodeResult& r : results) {
    m["steps"].push_back({{"id", r.id}, {"stage", r.stage}, {"params", r.params}, {"key", r.key}, {"report", report_to_json(r.report)}});
    for (const auto& [port, path] : r.outputs) {
      if (!lies_in(path, update.folder())) continue;
      // A finer part of the bone is bone too: its stage's name tells them apart.
      const std::string role = r.id == "region" && port == "bone" ? "region" : port;
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
                 {triple(bone.frame.direction.column[0]), triple(bone.frame.direction.column[1]), triple(bone.frame.direction.column[2])}},
                {"axes", orientation_code(bone.frame)}};
  m["bone_memory_mb"] = static_cast<double>(bone.memory_bytes) / 1e6;
  return m.dump(2) + "\n";
}

std::map<std::string, ManifestFile> parse_manifest(std::string_view json) {
  std::map<std::string, ManifestFile> files;
  try {
    const ordered_json m = ordered_json::parse(json);
    if (m.at("osteotome_case") != 1) throw Error(ExitCode::corrupt, "it is of an unknown version");
    for (const auto& [role, f] : m.at("files").items()) {
      ManifestFile file{f.at("file").get<std::string>(), f.at("hash").get<std::string>()};
      if (file.name.empty() || file.name.find('/') != std::string::npos || file.name == "..") {
        throw Error(ExitCode::corrupt, "it names a file outside the case");
      }
      files[role] = std::move(file);
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::corrupt, std::string("it is damaged: ") + json_complaint(e), "run 'osteo prepare' again");
  }
  if (!files.contains("bone")) throw Error(ExitCode::corrupt, "it names no bone");
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
                "make one with: osteo prepare CT -o " + folder.string());
  }
  Case result;
  result.folder = folder;
  std::map<std::string, ManifestFile> files;
  try {
    files = parse_manifest(read_text(manifest));
  } catch (const Error& e) {
    throw e.in("'" + manifest.string() + "'");
  }
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

}  // namespace osteo
