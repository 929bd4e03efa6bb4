#include "osteo/session/export.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "mcap_writer.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/param.h"
#include "osteo/bone/instrument.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

/// A column of the export: one number of a tick. Units are also in the name, but where it has none.
struct Column {
  const char* name;
  const char* unit;
  double (*value)(const TickRecord&);
  bool whole;
};
constexpr Column kColumns[] = {
    {"tick", "1", [](const TickRecord& t) { return static_cast<double>(t.tick); }, true},
    {"hand", "number, from 0", [](const TickRecord& t) { return static_cast<double>(t.hand); }, true},
    {"x_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[0]); }, false},
    {"y_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[1]); }, false},
    {"z_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[2]); }, false},
    {"axis_x", "1", [](const TickRecord& t) { return static_cast<double>(t.device.axis[0]); }, false},
    {"axis_y", "1", [](const TickRecord& t) { return static_cast<double>(t.device.axis[1]); }, false},
    {"axis_z", "1", [](const TickRecord& t) { return static_cast<double>(t.device.axis[2]); }, false},
    {"pedal", "0 to 255", [](const TickRecord& t) { return static_cast<double>(t.device.pedal); }, true},
    {"tool", "index", [](const TickRecord& t) { return static_cast<double>(t.device.tool); }, true},
    {"buttons", "bits", [](const TickRecord& t) { return static_cast<double>(t.device.buttons); }, true},
    {"device_age_ms", "ms", [](const TickRecord& t) { return static_cast<double>(t.device.age_ms); }, true},
    {"force_x_n", "N", [](const TickRecord& t) { return static_cast<double>(t.force_n[0]); }, false},
    {"force_y_n", "N", [](const TickRecord& t) { return static_cast<double>(t.force_n[1]); }, false},
    {"force_z_n", "N", [](const TickRecord& t) { return static_cast<double>(t.force_n[2]); }, false},
    {"torque_x_n_mm", "N mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[0]); }, false},
    {"torque_y_n_mm", "N mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[1]); }, false},
    {"torque_z_n_mm", "N mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[2]); }, false},
    {"shown_offset_x_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[0]); }, false},
    {"shown_offset_y_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[1]); }, false},
    {"shown_offset_z_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[2]); }, false},
    {"speed_rpm", "1/min", [](const TickRecord& t) { return static_cast<double>(t.speed_rpm); }, false},
    {"normal_force_n", "N", [](const TickRecord& t) { return static_cast<double>(t.normal_force_n); }, false},
    {"depth_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.depth_mm); }, false},
    {"removed_mm3", "mm3", [](const TickRecord& t) { return static_cast<double>(t.removed_mm3); }, false},
    {"voxels_changed", "voxels", [](const TickRecord& t) { return static_cast<double>(t.voxels_changed); }, true},
    {"immersed", "voxels", [](const TickRecord& t) { return static_cast<double>(t.immersed); }, true},
    {"flags", "bits", [](const TickRecord& t) { return static_cast<double>(t.flags); }, true},
    {"energy_mj", "mJ", [](const TickRecord& t) { return static_cast<double>(t.energy_mj); }, false},
    {"thickness_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.thickness_mm); }, false},
    {"clearance_mm", "mm", [](const TickRecord& t) { return static_cast<double>(t.clearance_mm); }, false},
    {"structure", "label value", [](const TickRecord& t) { return static_cast<double>(t.structure); }, true},
    {"work_us", "us", [](const TickRecord& t) { return static_cast<double>(t.work_us); }, false},
    {"lateness_us", "us", [](const TickRecord& t) { return static_cast<double>(t.lateness_us); }, false},
};

/// As short as reads back to the same number: floats are floats.
std::string number(const Column& c, const TickRecord& t) {
  char text[32];
  const auto end = c.whole ? std::to_chars(text, text + sizeof text, static_cast<std::int64_t>(c.value(t)))
                           : std::to_chars(text, text + sizeof text, static_cast<float>(c.value(t)));
  return {text, end.ptr};
}

double seconds_of(const Session& s, std::uint64_t tick) {
  return static_cast<double>(tick) / s.header.rate_hz;
}

// How many ticks are missing right before each of those that there are, but for none.
std::uint64_t lost_before(const Session& s, std::size_t i) {
  return s.ticks[i].hand > 0 ? 0 : s.ticks[i].tick - (i == 0 ? 0 : s.ticks[i - 1].tick + 1);
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
                errno == ENOSPC ? "free some space, or write to another disk" : "choose a folder that you may write to");
  }
  fs::path shown_;
  int fd_ = -1;
  std::string buffer_;
};

void csv(const Session& s, OutFile& out, const Context& context) {
  std::string line = "time_s";
  for (const Column& c : kColumns) line += std::string(",") + c.name;
  out.write(line + ",ticks_lost_before\n");
  for (std::size_t i = 0; i < s.ticks.size(); ++i) {
    if (i % 4096 == 0) context.progress(static_cast<double>(i) / static_cast<double>(s.ticks.size()), "writing");
    line = format_number(seconds_of(s, s.ticks[i].tick));
    for (const Column& c : kColumns) line += "," + number(c, s.ticks[i]);
    out.write(line + "," + std::to_string(lost_before(s, i)) + "\n");
  }
}

// The plate, fixture or setting of those actions that have one.
std::uint32_t item_of(const SceneAction& a) {
  return row_of(a).item.empty() ? SceneAction::kNobody : a.item;
}

// A piece, plate or fixture; "" where the action names none.
std::string who(std::uint32_t id) {
  return id == SceneAction::kNobody ? "" : std::to_string(id);
}

void actions_csv(const Session& s, OutFile& out) {
  std::string line = "time_s,tick,action,piece,second_piece,item";
  for (int v = 0; v < 12; ++v) line += ",value_" + std::to_string(v);
  out.write(line + "\n");
  for (const RecordedAction& r : s.actions) {
    const SceneAction& a = r.action;
    line = format_number(seconds_of(s, a.tick)) + "," + std::to_string(a.tick) + "," + std::string(name_of(a)) + "," + who(a.body) + "," +
           who(a.other) + "," + who(item_of(a));
    for (const double v : a.values) line += "," + format_number(v);
    out.write(line + "\n");
  }
}

void mcap(const Session& s, OutFile& out, const Context& context) {
  McapWriter file([&](std::string_view bytes) { out.write(bytes); }, "osteotome " + s.header.program_version);
  const std::vector<std::pair<std::string, std::string>> about{
      {"rate_hz", format_number(s.header.rate_hz)}, {"bone_hash", s.header.bone_hash}, {"complete", s.end ? "yes" : "no"}};
  const auto schema = [](const char* title) {
    ordered_json j{{"type", "object"}, {"title", title}, {"properties", ordered_json::object()}};
    j["properties"]["time_s"] = {{"type", "number"}, {"unit", "s"}};
    return j;
  };
  ordered_json ticks = schema("osteotome.Tick");
  for (const Column& c : kColumns) ticks["properties"][c.name] = {{"type", c.whole ? "integer" : "number"}, {"unit", c.unit}};
  ordered_json actions = schema("osteotome.Action"), gaps = schema("osteotome.Gap");
  actions["properties"]["tick"] = {{"type", "integer"}};
  actions["properties"]["action"] = {{"type", "string"}};
  for (const char* name : {"piece", "second_piece", "item"})
    actions["properties"][name] = {{"type", ordered_json::array({"integer", "null"})}};
  actions["properties"]["values"] = {{"type", "array"}, {"items", {{"type", "number"}}}};
  for (const char* name : {"first_tick", "ticks", "bytes"}) gaps["properties"][name] = {{"type", "integer"}};
  gaps["properties"]["bone_lost"] = {{"type", "boolean"}};
  const auto on_ticks = file.add_channel("/ticks", "osteotome.Tick", ticks.dump(), about);
  const auto on_actions = s.actions.empty() ? std::uint16_t{0} : file.add_channel("/actions", "osteotome.Action", actions.dump(), about);
  const auto on_gaps = s.gaps.empty() ? std::uint16_t{0} : file.add_channel("/gaps", "osteotome.Gap", gaps.dump(), about);

  const auto ns = [&](std::uint64_t tick) { return static_cast<std::uint64_t>(seconds_of(s, tick) * 1e9 + 0.5); };
  const auto or_null = [](std::uint32_t id) { return id == SceneAction::kNobody ? ordered_json() : ordered_json(id); };
  std::size_t action = 0, gap = 0;
  // In the order of their times: what was done, or is missing, before a tick.
  const auto up_to = [&](std::uint64_t tick) {
    for (; gap < s.gaps.size() && s.gaps[gap].first_tick <= tick; ++gap) {
      const Gap& g = s.gaps[gap];
      const ordered_json j{{"time_s", seconds_of(s, g.first_tick)},
                           {"first_tick", g.first_tick},
                           {"ticks", g.ticks},
                           {"bytes", g.bytes},
                           {"bone_lost", g.bone_lost}};
      file.message(on_gaps, ns(g.first_tick), j.dump());
    }
    for (; action < s.actions.size() && s.actions[action].action.tick <= tick; ++action) {
      const SceneAction& a = s.actions[action].action;
      const ordered_json j{{"time_s", seconds_of(s, a.tick)},
                           {"tick", a.tick},
                           {"action", name_of(a)},
                           {"piece", or_null(a.body)},
                           {"second_piece", or_null(a.other)},
                           {"item", or_null(item_of(a))},
                           {"values", a.values}};
      file.message(on_actions, ns(a.tick), j.dump());
    }
  };
  std::string text;
  for (std::size_t i = 0; i < s.ticks.size(); ++i) {
    if (i % 4096 == 0) context.progress(static_cast<double>(i) / static_cast<double>(s.ticks.size()), "writing");
    const TickRecord& t = s.ticks[i];
    up_to(t.tick);
    text = "{\"time_s\":" + format_number(seconds_of(s, t.tick));
    for (const Column& c : kColumns) text += std::string(",\"") + c.name + "\":" + number(c, t);
    text += "}";
    file.message(on_ticks, ns(t.tick), text);
  }
  up_to(~std::uint64_t{0});
  file.finish();
}

// --- HDF5 ------------------------------------------------------------------------------------------------------------------------------

class Hdf5 {
 public:
  explicit Hdf5(const fs::path& path) {
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
    need(H5Fclose(file_) >= 0);
    file_ = -1;
  }
  void group(const char* name) {
    const hid_t g = H5Gcreate2(file_, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    need(g >= 0);
    H5Gclose(g);
  }
  template <class T>
  void column(const std::string& name, const std::vector<T>& values, hid_t type, const char* unit) {
    const hsize_t n = values.size(), chunk = std::min<hsize_t>(std::max<hsize_t>(n, 1), 16384);
    const hid_t space = H5Screate_simple(1, &n, nullptr), list = H5Pcreate(H5P_DATASET_CREATE);
    if (n > 0) {
      H5Pset_chunk(list, 1, &chunk);
      H5Pset_deflate(list, 3);
    }
    const hid_t set = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT);
    const bool written = set >= 0 && (n == 0 || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    if (written) text("unit", unit, set);
    if (set >= 0) H5Dclose(set);
    H5Pclose(list);
    H5Sclose(space);
    need(written);
  }
  /// Names, as strings of one length.
  void column(const std::string& name, const std::vector<std::string>& values) {
    std::size_t longest = 1;
    for (const std::string& v : values) longest = std::max(longest, v.size());
    std::string all;
    for (const std::string& v : values) all += v + std::string(longest - v.size(), '\0');
    const hsize_t n = values.size();
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate_simple(1, &n, nullptr);
    H5Tset_size(type, longest);
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    const hid_t set = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const bool written = set >= 0 && (n == 0 || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) >= 0);
    if (set >= 0) H5Dclose(set);
    H5Sclose(space);
    H5Tclose(type);
    need(written);
  }
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
    const hid_t space = H5Screate(H5S_SCALAR), a = H5Acreate2(file_, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
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

void hdf5(const Session& s, const fs::path& path, const Context& context) {
  Hdf5 file(path);
  file.text("program", "osteotome " + s.header.program_version);
  file.text("bone_hash", s.header.bone_hash);
  file.number("rate_hz", s.header.rate_hz);
  file.text("complete", s.end ? "yes" : "no");
  std::string burrs;
  for (const Instrument& i : instrument_library()) burrs += (burrs.empty() ? "" : "; ") + i.name;
  file.text("tools", burrs);
  std::vector<double> values;
  std::vector<std::int64_t> whole;
  const auto numbers = [&](const std::string& name, const char* unit, std::size_t n, auto&& value) {
    context.check_cancelled();
    values.resize(n);
    for (std::size_t i = 0; i < n; ++i) values[i] = value(i);
    file.column(name, values, H5T_NATIVE_DOUBLE, unit);
  };
  const auto integers = [&](const std::string& name, const char* unit, std::size_t n, auto&& value) {
    context.check_cancelled();
    whole.resize(n);
    for (std::size_t i = 0; i < n; ++i) whole[i] = static_cast<std::int64_t>(value(i));
    file.column(name, whole, H5T_NATIVE_INT64, unit);
  };
  file.group("/ticks");
  numbers("/ticks/time_s", "s", s.ticks.size(), [&](std::size_t i) { return seconds_of(s, s.ticks[i].tick); });
  for (const Column& c : kColumns) {
    const auto value = [&](std::size_t i) { return c.value(s.ticks[i]); };
    const std::string name = std::string("/ticks/") + c.name;
    if (c.whole) {
      integers(name, c.unit, s.ticks.size(), value);
    } else {
      numbers(name, c.unit, s.ticks.size(), value);
    }
  }
  integers("/ticks/ticks_lost_before", "ticks", s.ticks.size(), [&](std::size_t i) { return lost_before(s, i); });

  file.group("/voxel_changes");
  std::vector<std::uint32_t> voxels;
  std::vector<float> densities;
  for (const VoxelChange& c : s.changes) {
    voxels.push_back(c.voxel);
    densities.push_back(c.density);
  }
  file.column("/voxel_changes/voxel", voxels, H5T_NATIVE_UINT32, "name");
  file.column("/voxel_changes/density", densities, H5T_NATIVE_FLOAT, "share of a voxel");

  file.group("/actions");
  const std::size_t n = s.actions.size();
  const auto action = [&](std::size_t i) -> const SceneAction& { return s.actions[i].action; };
  const auto or_none = [](std::uint32_t id) { return id == SceneAction::kNobody ? std::int64_t{-1} : std::int64_t{id}; };
  numbers("/actions/time_s", "s", n, [&](std::size_t i) { return seconds_of(s, action(i).tick); });
  integers("/actions/tick", "1", n, [&](std::size_t i) { return action(i).tick; });
  std::vector<std::string> names;
  for (const RecordedAction& r : s.actions) names.emplace_back(name_of(r.action));
  file.column("/actions/action", names);
  integers("/actions/piece", "number, -1: none or all", n, [&](std::size_t i) { return or_none(action(i).body); });
  integers("/actions/second_piece", "number, -1: none", n, [&](std::size_t i) { return or_none(action(i).other); });
  integers("/actions/item", "plate or fixture, -1: none", n, [&](std::size_t i) { return or_none(item_of(action(i))); });
  for (std::size_t v = 0; v < SceneAction{}.values.size(); ++v)
    numbers("/actions/value_" + std::to_string(v), "by action", n, [&](std::size_t i) { return action(i).values[v]; });
  integers("/actions/voxel_changes_before", "rows of /voxel_changes", n, [&](std::size_t i) { return s.actions[i].changes_before; });

  file.group("/gaps");
  integers("/gaps/first_tick", "1", s.gaps.size(), [&](std::size_t i) { return s.gaps[i].first_tick; });
  integers("/gaps/ticks", "ticks", s.gaps.size(), [&](std::size_t i) { return s.gaps[i].ticks; });
  integers("/gaps/bytes", "bytes of the file", s.gaps.size(), [&](std::size_t i) { return s.gaps[i].bytes; });
  integers("/gaps/bone_lost", "0 or 1", s.gaps.size(), [&](std::size_t i) { return s.gaps[i].bone_lost; });
  file.close();
}

}  // namespace

std::vector<fs::path> export_files(const fs::path& path) {
  std::vector<fs::path> files{path};
  if (lower_case(path.extension().string()) == ".csv")
    files.push_back(path.parent_path() / (path.stem().string() + "-actions" + path.extension().string()));
  return files;
}

void export_session(const Session& s, const fs::path& path, const Context& context) {
  const std::string ending = lower_case(path.extension().string());
  const auto streamed = [](const fs::path& file, auto&& fill) {
    write_atomically(file, [&](const fs::path& temporary) {
      OutFile out(temporary, file);
      fill(out);
      out.close();
    });
  };
  if (ending == ".csv") {
    // Both are whole before the first takes its name.
    streamed(path, [&](OutFile& out) {
      csv(s, out, context);
      streamed(export_files(path)[1], [&](OutFile& actions) { actions_csv(s, actions); });
    });
  } else if (ending == ".mcap") {
    streamed(path, [&](OutFile& out) { mcap(s, out, context); });
  } else if (ending == ".h5" || ending == ".hdf5") {
    write_atomically(path, [&](const fs::path& temporary) { hdf5(s, temporary, context); });
  } else {
    throw Error(ExitCode::usage, "'" + path.string() + "': sessions are exported as .csv, .h5 or .mcap");
  }
}

}  // namespace osteo
