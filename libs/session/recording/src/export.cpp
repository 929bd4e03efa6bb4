#include "osteo/session/recording/export.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "mcap_writer.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;

// As short as reads back to the same number: floats are floats.
std::string number(const RecordField& f, const void* record) {
  const double value = value_of(f, record);
  if (f.type == FieldType::f64) return format_number(value);
  char text[32];
  const auto end = is_whole(f.type) ? std::to_chars(text, text + sizeof text, static_cast<std::int64_t>(value))
                                    : std::to_chars(text, text + sizeof text, static_cast<float>(value));
  return {text, end.ptr};
}

/// What write_atomically() writes into, a block at a time.
class OutFile {
 public:
  OutFile(const fs::path& temporary, const fs::path& shown) : shown_(shown) {
    fd_ = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd_ < 0) fail();
  }
  ~OutFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  OutFile(const OutFile&) = delete;
  OutFile& operator=(const OutFile&) = delete;
  void write(std::string_view text) {
    buffer_.append(text);
    if (buffer_.size() >= kBlock) flush();
  }
  void close() {
    if (fd_ < 0) return;
    flush();
    const int rc = ::close(fd_);
    fd_ = -1;
    if (rc != 0) fail();
  }

 private:
  static constexpr std::size_t kBlock = 1 << 20;
  void flush() {
    for (std::size_t done = 0; done < buffer_.size();) {
      const ssize_t n = ::write(fd_, buffer_.data() + done, buffer_.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail();
      done += static_cast<std::size_t>(n);
    }
    buffer_.clear();
  }
  [[noreturn]] void fail() const {
    throw Error(ExitCode::cannot_write, "cannot write '" + shown_.string() + "': " + std::strerror(errno),
                errno == ENOSPC || errno == EFBIG ? "free some space, or write to another disk"
                                                  : "choose a folder that you may write to");
  }
  fs::path shown_;
  int fd_ = -1;
  std::string buffer_;
};

// What all formats need of a session while it goes by.
class Rows {
 public:
  Rows(const SessionReader& session, const Context& context)
      : outline_(session.outline()), context_(context), parts_(session.parts()) {}

  const SessionPart* next() {
    const double ticks = std::max(1.0, static_cast<double>(outline_.tick_records));
    const SessionPart* const p = parts_.next();
    if (p == nullptr) return nullptr;
    context_.progress(std::min(1.0, static_cast<double>(done_) / ticks), "writing");
    done_ += p->ticks.size();
    return p;
  }
  [[nodiscard]] double seconds(std::uint64_t tick) const { return static_cast<double>(tick) / outline_.header.rate_hz; }
  // How many ticks are missing right before this one, but for none.
  std::uint64_t lost_before(const TickRecord& t) {
    const std::uint64_t lost = t.tick > next_tick_ ? t.tick - next_tick_ : 0;
    next_tick_ = t.tick + 1;
    return lost;
  }
  [[nodiscard]] std::string action_name(const SceneAction& a) const {
    const auto name = outline_.action_names.find(a.kind);
    return name != outline_.action_names.end() ? name->second : "kind " + std::to_string(a.kind);
  }
  [[nodiscard]] const SessionOutline& outline() const { return outline_; }

 private:
  const SessionOutline& outline_;
  const Context& context_;
  SessionReader::Parts parts_;
  std::uint64_t done_ = 0, next_tick_ = 0;
};

// How a field of an action is told.
enum class Reported { number, kind, nobody_or_number };
Reported reported(const RecordField& f) {
  if (f.name == "action") return Reported::kind;
  return f.unit.find("4294967295") != std::string_view::npos ? Reported::nobody_or_number : Reported::number;
}
// Where an action has no plate or fixture its item says nothing.
std::optional<std::uint32_t> who(const RecordField& f, const SceneAction& a) {
  const bool has_item =
      a.is(ActionKind::grip) || a.is(ActionKind::attach) || a.is(ActionKind::detach) || a.is(ActionKind::open);
  if (f.name == "item" && !has_item) return std::nullopt;
  const auto id = static_cast<std::uint32_t>(value_of(f, &a));
  return id == SceneAction::kNobody ? std::nullopt : std::optional(id);
}
bool is_value(const RecordField& f) {
  return f.name.starts_with("value_");
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

void csv(Rows rows, OutFile& ticks, OutFile& actions, OutFile& notes) {
  std::string line = "time_s";
  for (const RecordField* const f : rows.outline().tick_fields) line += "," + std::string(f->name);
  ticks.write(line + ",ticks_lost_before\n");
  line = "time_s";
  for (const RecordField& f : action_record_table().fields) line += "," + std::string(f.name);
  actions.write(line + "\n");
  notes.write("time_s,tick,kind,json\n");
  while (const SessionPart* const p = rows.next()) {
    for (const TickRecord& t : p->ticks) {
      line = format_number(rows.seconds(t.tick));
      for (const RecordField* const f : rows.outline().tick_fields) line += "," + number(*f, &t);
      ticks.write(line + "," + std::to_string(rows.lost_before(t)) + "\n");
    }
    for (const SceneAction& a : p->actions) {
      line = format_number(rows.seconds(a.tick));
      for (const RecordField& f : action_record_table().fields) {
        const auto id = who(f, a);
        line += "," + (reported(f) == Reported::kind     ? rows.action_name(a)
                       : reported(f) == Reported::number ? number(f, &a)
                       : id                              ? std::to_string(*id)
                                                         : "");
      }
      actions.write(line + "\n");
    }
    for (const Note& n : p->notes)
      notes.write(format_number(rows.seconds(n.tick)) + "," + std::to_string(n.tick) + "," + quoted(n.kind) + "," +
                  quoted(n.json) + "\n");
  }
}

void mcap(Rows rows, OutFile& out) {
  const SessionOutline& o = rows.outline();
  McapWriter file([&](std::string_view bytes) { out.write(bytes); }, "osteotome " + o.header.program_version);
  const std::vector<std::pair<std::string, std::string>> about{{"rate_hz", format_number(o.header.rate_hz)},
                                                               {"bone_hash", o.header.bone_hash},
                                                               {"complete", o.end ? "yes" : "no"}};
  const auto schema = [](const char* title) {
    ordered_json j{{"type", "object"}, {"title", title}, {"properties", ordered_json::object()}};
    j["properties"]["time_s"] = {{"type", "number"}, {"unit", "s"}};
    return j;
  };
  const auto described = [](ordered_json& j, const RecordField& f) {
    j["properties"][std::string(f.name)] = {
        {"type", is_whole(f.type) ? "integer" : "number"}, {"unit", f.unit}, {"description", f.meaning}};
  };
  ordered_json ticks = schema("osteotome.Tick"), actions = schema("osteotome.Action"), gaps = schema("osteotome.Gap"),
               notes = schema("osteotome.Note");
  for (const RecordField* const f : o.tick_fields) described(ticks, *f);
  for (const RecordField& f : action_record_table().fields) {
    if (is_value(f)) continue;
    described(actions, f);
    if (reported(f) == Reported::kind) actions["properties"][std::string(f.name)] = {{"type", "string"}};
    if (reported(f) == Reported::nobody_or_number)
      actions["properties"][std::string(f.name)]["type"] = ordered_json::array({"integer", "null"});
  }
  actions["properties"]["values"] = {{"type", "array"}, {"items", {{"type", "number"}}}};
  for (const char* name : {"first_tick", "ticks", "bytes"}) gaps["properties"][name] = {{"type", "integer"}};
  gaps["properties"]["bone_lost"] = {{"type", "boolean"}};
  notes["properties"]["tick"] = {{"type", "integer"}};
  notes["properties"]["kind"] = {{"type", "string"}};
  notes["properties"]["value"] = ordered_json::object();
  const auto on_ticks = file.add_channel("/ticks", "osteotome.Tick", ticks.dump(), about);
  const auto on_actions = file.add_channel("/actions", "osteotome.Action", actions.dump(), about);
  const auto on_gaps = file.add_channel("/gaps", "osteotome.Gap", gaps.dump(), about);
  const auto on_notes = file.add_channel("/notes", "osteotome.Note", notes.dump(), about);

  const auto ns = [&](std::uint64_t tick) { return static_cast<std::uint64_t>(rows.seconds(tick) * 1e9 + 0.5); };
  // A frame's actions stand before its ticks, each to be told before its own.
  std::deque<SceneAction> waiting;
  const auto act_up_to = [&](std::uint64_t tick) {
    for (; !waiting.empty() && waiting.front().tick <= tick; waiting.pop_front()) {
      const SceneAction& a = waiting.front();
      ordered_json j{{"time_s", rows.seconds(a.tick)}};
      for (const RecordField& f : action_record_table().fields) {
        if (is_value(f)) continue;
        const std::string name(f.name);
        const auto id = who(f, a);
        if (reported(f) == Reported::kind)
          j[name] = rows.action_name(a);
        else if (reported(f) == Reported::number)
          j[name] = static_cast<std::uint64_t>(value_of(f, &a));
        else
          j[name] = id ? ordered_json(*id) : ordered_json();
      }
      j["values"] = a.values;
      file.message(on_actions, ns(a.tick), j.dump());
    }
  };
  std::string text;
  while (const SessionPart* const p = rows.next()) {
    waiting.insert(waiting.end(), p->actions.begin(), p->actions.end());
    for (const TickRecord& t : p->ticks) {
      act_up_to(t.tick);
      text = "{\"time_s\":" + format_number(rows.seconds(t.tick));
      for (const RecordField* const f : o.tick_fields) text += ",\"" + std::string(f->name) + "\":" + number(*f, &t);
      file.message(on_ticks, ns(t.tick), text + "}");
    }
    if (const Gap* const g = p->gap) {
      act_up_to(g->first_tick);
      const ordered_json j{{"time_s", rows.seconds(g->first_tick)},
                           {"first_tick", g->first_tick},
                           {"ticks", g->ticks},
                           {"bytes", g->bytes},
                           {"bone_lost", g->bone_lost}};
      file.message(on_gaps, ns(g->first_tick), j.dump());
    }
    for (const Note& n : p->notes) {
      const ordered_json j{
          {"time_s", rows.seconds(n.tick)}, {"tick", n.tick}, {"kind", n.kind}, {"value", ordered_json::parse(n.json)}};
      file.message(on_notes, ns(n.tick), j.dump());
    }
  }
  act_up_to(~std::uint64_t{0});
  file.finish();
}

// --- HDF5
// ------------------------------------------------------------------------------------------------------------------------------

class Hdf5 {
 public:
  explicit Hdf5(const fs::path& path) {
    // A file that could not be flushed for want of room stays half open in the library, which would crash on it at
    // exit.
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    need(file_ >= 0);
  }
  ~Hdf5() {
    if (file_ >= 0) H5Fclose(file_);
  }
  Hdf5(const Hdf5&) = delete;
  Hdf5& operator=(const Hdf5&) = delete;
  void close() {
    // Once: a file that could not be flushed is gone all the same.
    need(H5Fclose(std::exchange(file_, -1)) >= 0);
  }
  void group(const char* name) {
    const hid_t g = H5Gcreate2(file_, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    need(g >= 0);
    H5Gclose(g);
  }
  /// A data set that grows.
  class Column {
   public:
    Column(const Hdf5& file, const std::string& name, hid_t type, std::string_view unit) : type_(H5Tcopy(type)) {
      const hsize_t none = 0, any = H5S_UNLIMITED, chunk = kRows;
      const hid_t space = H5Screate_simple(1, &none, &any), list = H5Pcreate(H5P_DATASET_CREATE);
      H5Pset_chunk(list, 1, &chunk);
      if (H5Tis_variable_str(type_) <= 0) H5Pset_deflate(list, 3);
      set_ = H5Dcreate2(file.file_, name.c_str(), type_, space, H5P_DEFAULT, list, H5P_DEFAULT);
      H5Pclose(list);
      H5Sclose(space);
      need(set_ >= 0);
      if (!unit.empty()) text("unit", std::string(unit), set_);
    }
    ~Column() {
      H5Dclose(set_);
      H5Tclose(type_);
    }
    Column(const Column&) = delete;
    Column& operator=(const Column&) = delete;
    void write(hsize_t n, const void* values) {
      if (n == 0) return;
      const hsize_t all = rows_ + n;
      need(H5Dset_extent(set_, &all) >= 0);
      const hid_t there = H5Dget_space(set_), here = H5Screate_simple(1, &n, nullptr);
      H5Sselect_hyperslab(there, H5S_SELECT_SET, &rows_, nullptr, &n, nullptr);
      const bool written = H5Dwrite(set_, type_, here, there, H5P_DEFAULT, values) >= 0;
      H5Sclose(here);
      H5Sclose(there);
      need(written);
      rows_ = all;
    }
    static constexpr std::size_t kRows = 16384;

   private:
    hid_t type_, set_ = -1;
    hsize_t rows_ = 0;
  };
  /// Numbers, collected to as many as are written at once.
  template <class T>
  class Numbers {
   public:
    Numbers(const Hdf5& file, const std::string& name, std::string_view unit)
        : column_(file, name,
                  std::is_same_v<T, double>          ? H5T_NATIVE_DOUBLE
                  : std::is_same_v<T, float>         ? H5T_NATIVE_FLOAT
                  : std::is_same_v<T, std::uint32_t> ? H5T_NATIVE_UINT32
                                                     : H5T_NATIVE_INT64,
                  unit) {}
    void add(T value) {
      values_.push_back(value);
      if (values_.size() == Column::kRows) flush();
    }
    void flush() {
      column_.write(values_.size(), values_.data());
      values_.clear();
    }

   private:
    Column column_;
    std::vector<T> values_;
  };
  class Texts {
   public:
    Texts(const Hdf5& file, const std::string& name) : column_(file, name, Type().id, "") {}
    void add(std::string value) {
      values_.push_back(std::move(value));
      if (values_.size() == 1024) flush();
    }
    void flush() {
      std::vector<const char*> all;
      for (const std::string& v : values_) all.push_back(v.c_str());
      column_.write(all.size(), all.data());
      values_.clear();
    }

   private:
    struct Type {
      Type() {
        H5Tset_size(id, H5T_VARIABLE);
        H5Tset_cset(id, H5T_CSET_UTF8);
      }
      ~Type() { H5Tclose(id); }
      Type(const Type&) = delete;
      Type& operator=(const Type&) = delete;
      hid_t id = H5Tcopy(H5T_C_S1);
    };
    Column column_;
    std::vector<std::string> values_;
  };
  void text(const char* name, const std::string& value) { text(name, value, file_); }
  static void text(const char* name, const std::string& value, hid_t of) {
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, std::max<std::size_t>(value.size(), 1));
    H5Tset_cset(type, H5T_CSET_UTF8);
    const hid_t a = H5Acreate2(of, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool written = a >= 0 && H5Awrite(a, type, value.empty() ? " " : value.data()) >= 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
    H5Tclose(type);
    need(written);
  }
  void number(const char* name, double value) {
    const hid_t space = H5Screate(H5S_SCALAR),
                a = H5Acreate2(file_, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool written = a >= 0 && H5Awrite(a, H5T_NATIVE_DOUBLE, &value) >= 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
    need(written);
  }

 private:
  static void need(bool done) {
    if (!done) throw Error(ExitCode::cannot_write, "HDF5 could not write the file", "is there room on the disk?");
  }
  hid_t file_ = -1;
};

// The data sets of a session. The order in which they are made is part of the file.
class Hdf5Session {
 public:
  Hdf5Session(const Hdf5& file, const SessionOutline& o)
      : file_(file),
        time_(real("/ticks/time_s", "s")),
        tick_columns_(columns_of_ticks(o)),
        lost_(integer("/ticks/ticks_lost_before", "ticks")),
        voxels_(file, "/voxel_changes/voxel", "name"),
        densities_(file, "/voxel_changes/density", "share of a voxel"),
        action_time_(real("/actions/time_s", "s")),
        action_columns_(columns_of_actions()),
        before_(integer("/actions/voxel_changes_before", "rows of /voxel_changes")),
        gap_first_(integer("/gaps/first_tick", "1")),
        gap_ticks_(integer("/gaps/ticks", "ticks")),
        gap_bytes_(integer("/gaps/bytes", "bytes of the file")),
        gap_lost_(integer("/gaps/bone_lost", "0 or 1")),
        note_time_(real("/notes/time_s", "s")),
        note_tick_(integer("/notes/tick", "1")),
        note_kind_(text("/notes/kind")),
        note_json_(text("/notes/json")) {}

  void add(const TickRecord& t, Rows& rows) {
    time_->add(rows.seconds(t.tick));
    for (const Field& c : tick_columns_) {
      const double value = value_of(*c.field, &t);
      c.real != nullptr ? c.real->add(value) : c.integer->add(static_cast<std::int64_t>(value));
    }
    lost_->add(static_cast<std::int64_t>(rows.lost_before(t)));
  }
  void add(const SceneAction& a, const Rows& rows) {
    action_time_->add(rows.seconds(a.tick));
    for (const Field& c : action_columns_) {
      const double value = value_of(*c.field, &a);
      if (c.text != nullptr)
        c.text->add(rows.action_name(a));
      else if (c.real != nullptr)
        c.real->add(value);
      else if (reported(*c.field) == Reported::nobody_or_number)
        c.integer->add(who(*c.field, a) ? static_cast<std::int64_t>(value) : -1);
      else
        c.integer->add(static_cast<std::int64_t>(value));
    }
    before_->add(changes_);
  }
  void add(const VoxelChange& c) {
    voxels_.add(c.voxel);
    densities_.add(c.density);
    ++changes_;
  }
  void add(const Gap& g) {
    gap_first_->add(static_cast<std::int64_t>(g.first_tick));
    gap_ticks_->add(static_cast<std::int64_t>(g.ticks));
    gap_bytes_->add(static_cast<std::int64_t>(g.bytes));
    gap_lost_->add(g.bone_lost ? 1 : 0);
  }
  void add(const Note& n, const Rows& rows) {
    note_time_->add(rows.seconds(n.tick));
    note_tick_->add(static_cast<std::int64_t>(n.tick));
    note_kind_->add(n.kind);
    note_json_->add(n.json);
  }
  void flush() {
    for (auto& c : doubles_) c.flush();
    for (auto& c : whole_) c.flush();
    for (auto& c : texts_) c.flush();
    voxels_.flush();
    densities_.flush();
  }

 private:
  using Real = Hdf5::Numbers<double>;
  using Integer = Hdf5::Numbers<std::int64_t>;
  // What takes a field of a record.
  struct Field {
    const RecordField* field;
    Real* real = nullptr;
    Integer* integer = nullptr;
    Hdf5::Texts* text = nullptr;
  };
  Real* real(const std::string& name, std::string_view unit) { return &doubles_.emplace_back(file_, name, unit); }
  Integer* integer(const std::string& name, std::string_view unit) { return &whole_.emplace_back(file_, name, unit); }
  Hdf5::Texts* text(const std::string& name) { return &texts_.emplace_back(file_, name); }
  Field column_of(const std::string& group, const RecordField& f, bool as_text) {
    const std::string name = group + "/" + std::string(f.name);
    if (as_text) return Field{&f, nullptr, nullptr, text(name)};
    std::string unit(f.unit);
    if (const auto at = unit.find("4294967295"); at != std::string::npos) unit.replace(at, 10, "-1");
    if (is_whole(f.type)) return Field{&f, nullptr, integer(name, unit), nullptr};
    return Field{&f, real(name, f.unit), nullptr, nullptr};
  }
  std::vector<Field> columns_of_ticks(const SessionOutline& o) {
    std::vector<Field> columns;
    for (const RecordField* const f : o.tick_fields) columns.push_back(column_of("/ticks", *f, false));
    return columns;
  }
  std::vector<Field> columns_of_actions() {
    std::vector<Field> columns;
    for (const RecordField& f : action_record_table().fields)
      columns.push_back(column_of("/actions", f, reported(f) == Reported::kind));
    return columns;
  }

  const Hdf5& file_;
  std::deque<Real> doubles_;
  std::deque<Integer> whole_;
  std::deque<Hdf5::Texts> texts_;
  Real* time_;
  std::vector<Field> tick_columns_;
  Integer* lost_;
  Hdf5::Numbers<std::uint32_t> voxels_;
  Hdf5::Numbers<float> densities_;
  Real* action_time_;
  std::vector<Field> action_columns_;
  Integer *before_, *gap_first_, *gap_ticks_, *gap_bytes_, *gap_lost_;
  Real* note_time_;
  Integer* note_tick_;
  Hdf5::Texts *note_kind_, *note_json_;
  std::int64_t changes_ = 0;
};

void hdf5(Rows rows, const fs::path& path) {
  const SessionOutline& o = rows.outline();
  Hdf5 file(path);
  file.text("program", "osteotome " + o.header.program_version);
  file.text("bone_hash", o.header.bone_hash);
  file.number("rate_hz", o.header.rate_hz);
  file.text("complete", o.end ? "yes" : "no");
  std::string burrs;
  for (const std::string& b : o.tools) burrs += (burrs.empty() ? "" : "; ") + b;
  file.text("tools", burrs);
  for (const char* const group : {"/ticks", "/voxel_changes", "/actions", "/gaps", "/notes"}) file.group(group);
  {
    Hdf5Session to(file, o);
    while (const SessionPart* const p = rows.next()) {
      for (const TickRecord& t : p->ticks) to.add(t, rows);
      for (const SceneAction& a : p->actions) to.add(a, rows);
      for (const VoxelChange& c : p->changes) to.add(c);
      if (const Gap* const g = p->gap) to.add(*g);
      for (const Note& n : p->notes) to.add(n, rows);
    }
    to.flush();
  }
  file.close();
}

}  // namespace

std::vector<fs::path> export_files(const fs::path& path) {
  std::vector<fs::path> files{path};
  if (lower_case(path.extension().string()) != ".csv") return files;
  for (const char* const what : {"-actions", "-notes"})
    files.push_back(path.parent_path() / (path.stem().string() + what + path.extension().string()));
  return files;
}

void export_session(const SessionReader& session, const fs::path& path, const Context& context) {
  const std::string ending = lower_case(path.extension().string());
  const auto streamed = [](const fs::path& file, auto&& fill) {
    write_atomically(file, [&](const fs::path& temporary) {
      OutFile out(temporary, file);
      fill(out);
      out.close();
    });
  };
  Rows rows(session, context);
  if (ending == ".csv") {
    // All are whole, and closed, before the first takes its name.
    const auto files = export_files(path);
    write_atomically(files[0], [&](const fs::path& ticks_file) {
      write_atomically(files[1], [&](const fs::path& actions_file) {
        write_atomically(files[2], [&](const fs::path& notes_file) {
          OutFile ticks(ticks_file, files[0]), actions(actions_file, files[1]), notes(notes_file, files[2]);
          csv(std::move(rows), ticks, actions, notes);
          for (OutFile* const out : {&ticks, &actions, &notes}) out->close();
        });
      });
    });
  } else if (ending == ".mcap") {
    streamed(path, [&](OutFile& out) { mcap(std::move(rows), out); });
  } else if (ending == ".h5" || ending == ".hdf5") {
    write_atomically(path, [&](const fs::path& temporary) { hdf5(std::move(rows), temporary); });
  } else {
    throw Error(ExitCode::usage, "'" + path.string() + "': sessions are exported as .csv, .h5 or .mcap");
  }
}

}  // namespace osteo::inline session
