#include "osteo/session/export.h"

#include <hdf5.h>
#include <zlib.h>

#include <array>
#include <charconv>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <string_view>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/param.h"
#include "osteo/bone/burr.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

/// A column of the export: one number of a tick. Units are in the name.
struct Column {
  const char* name;
  double (*value)(const TickRecord&);
  bool whole;
};
constexpr Column kColumns[] = {
    {"tick", [](const TickRecord& t) { return static_cast<double>(t.tick); }, true},
    {"x_mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[0]); }, false},
    {"y_mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[1]); }, false},
    {"z_mm", [](const TickRecord& t) { return static_cast<double>(t.device.position_mm[2]); }, false},
    {"axis_x", [](const TickRecord& t) { return static_cast<double>(t.device.axis[0]); }, false},
    {"axis_y", [](const TickRecord& t) { return static_cast<double>(t.device.axis[1]); }, false},
    {"axis_z", [](const TickRecord& t) { return static_cast<double>(t.device.axis[2]); }, false},
    {"drill_on", [](const TickRecord& t) { return static_cast<double>(t.device.drill_on); }, true},
    {"tool", [](const TickRecord& t) { return static_cast<double>(t.device.tool); }, true},
    {"device_age_ms", [](const TickRecord& t) { return static_cast<double>(t.device.age_ms); }, true},
    {"force_x_n", [](const TickRecord& t) { return static_cast<double>(t.force_n[0]); }, false},
    {"force_y_n", [](const TickRecord& t) { return static_cast<double>(t.force_n[1]); }, false},
    {"force_z_n", [](const TickRecord& t) { return static_cast<double>(t.force_n[2]); }, false},
    {"torque_x_n_mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[0]); }, false},
    {"torque_y_n_mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[1]); }, false},
    {"torque_z_n_mm", [](const TickRecord& t) { return static_cast<double>(t.torque_n_mm[2]); }, false},
    {"shown_offset_x_mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[0]); }, false},
    {"shown_offset_y_mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[1]); }, false},
    {"shown_offset_z_mm", [](const TickRecord& t) { return static_cast<double>(t.shown_offset_mm[2]); }, false},
    {"normal_force_n", [](const TickRecord& t) { return static_cast<double>(t.normal_force_n); }, false},
    {"depth_mm", [](const TickRecord& t) { return static_cast<double>(t.depth_mm); }, false},
    {"removed_mm3", [](const TickRecord& t) { return static_cast<double>(t.removed_mm3); }, false},
    {"voxels_changed", [](const TickRecord& t) { return static_cast<double>(t.voxels_changed); }, true},
    {"flags", [](const TickRecord& t) { return static_cast<double>(t.flags); }, true},
    {"energy_mj", [](const TickRecord& t) { return static_cast<double>(t.energy_mj); }, false},
    {"thickness_mm", [](const TickRecord& t) { return static_cast<double>(t.thickness_mm); }, false},
    {"clearance_mm", [](const TickRecord& t) { return static_cast<double>(t.clearance_mm); }, false},
    {"structure", [](const TickRecord& t) { return static_cast<double>(t.structure); }, true},
    {"work_us", [](const TickRecord& t) { return static_cast<double>(t.work_us); }, false},
    {"lateness_us", [](const TickRecord& t) { return static_cast<double>(t.lateness_us); }, false},
};

/// As short as reads back to the same number: floats are floats.
std::string number(const Column& c, const TickRecord& t) {
  char text[32];
  const auto end = c.whole ? std::to_chars(text, text + sizeof text, static_cast<std::int64_t>(c.value(t)))
                           : std::to_chars(text, text + sizeof text, static_cast<float>(c.value(t)));
  return {text, end.ptr};
}

double seconds_of(const Session& s, const TickRecord& t) {
  return static_cast<double>(t.tick) / s.header.rate_hz;
}

std::string csv(const Session& s, const Context& context) {
  std::string text = "time_s";
  for (const Column& c : kColumns) text += std::string(",") + c.name;
  text += "\n";
  for (std::size_t i = 0; i < s.ticks.size(); ++i) {
    if (i % 4096 == 0) context.progress(static_cast<double>(i) / static_cast<double>(s.ticks.size()), "writing");
    text += format_number(seconds_of(s, s.ticks[i]));
    for (const Column& c : kColumns) text += "," + number(c, s.ticks[i]);
    text += "\n";
  }
  return text;
}

// --- MCAP, https://mcap.dev/spec: magic, header, schema, channel, messages, data end, footer, magic -----------------------------------

class Mcap {
 public:
  Mcap() { bytes_.append(kMagic); }
  void record(unsigned char op, const std::string& content) {
    bytes_ += static_cast<char>(op);
    put<std::uint64_t>(bytes_, content.size());
    bytes_ += content;
  }
  template <class T>
  static void put(std::string& out, T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);  // little endian, as this machine is
    out.append(raw, sizeof value);
  }
  static void put_text(std::string& out, std::string_view text) {
    put<std::uint32_t>(out, static_cast<std::uint32_t>(text.size()));
    out.append(text);
  }
  std::string finish() {
    std::string end;
    const auto crc = ::crc32(::crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes_.data()), static_cast<uInt>(bytes_.size()));
    put<std::uint32_t>(end, static_cast<std::uint32_t>(crc));
    record(0x0f, end);
    std::string footer;
    put<std::uint64_t>(footer, 0);  // no summary
    put<std::uint64_t>(footer, 0);
    put<std::uint32_t>(footer, 0);
    record(0x02, footer);
    bytes_.append(kMagic);
    return std::move(bytes_);
  }
  static constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

 private:
  std::string bytes_;
};

std::string mcap(const Session& s, const Context& context) {
  Mcap out;
  std::string header;
  Mcap::put_text(header, "");
  Mcap::put_text(header, "osteotome " + s.header.program_version);
  out.record(0x01, header);

  ordered_json schema{{"type", "object"}, {"title", "osteotome.Tick"}, {"properties", ordered_json::object()}};
  schema["properties"]["time_s"] = {{"type", "number"}};
  for (const Column& c : kColumns) schema["properties"][c.name] = {{"type", c.whole ? "integer" : "number"}};
  std::string record;
  Mcap::put<std::uint16_t>(record, 1);
  Mcap::put_text(record, "osteotome.Tick");
  Mcap::put_text(record, "jsonschema");
  Mcap::put_text(record, schema.dump());
  out.record(0x03, record);

  record.clear();
  Mcap::put<std::uint16_t>(record, 1);  // channel
  Mcap::put<std::uint16_t>(record, 1);  // schema
  Mcap::put_text(record, "/ticks");
  Mcap::put_text(record, "json");
  std::string metadata;
  for (const auto& [key, value] :
       {std::pair<std::string, std::string>{"rate_hz", format_number(s.header.rate_hz)}, {"bone_hash", s.header.bone_hash}}) {
    Mcap::put_text(metadata, key);
    Mcap::put_text(metadata, value);
  }
  Mcap::put_text(record, metadata);
  out.record(0x04, record);

  for (std::size_t i = 0; i < s.ticks.size(); ++i) {
    if (i % 4096 == 0) context.progress(static_cast<double>(i) / static_cast<double>(s.ticks.size()), "writing");
    const TickRecord& t = s.ticks[i];
    std::string text = "{\"time_s\":" + format_number(seconds_of(s, t));
    for (const Column& c : kColumns) text += std::string(",\"") + c.name + "\":" + number(c, t);
    text += "}";
    record.clear();
    Mcap::put<std::uint16_t>(record, 1);
    Mcap::put<std::uint32_t>(record, static_cast<std::uint32_t>(i));
    const auto ns = static_cast<std::uint64_t>(seconds_of(s, t) * 1e9 + 0.5);
    Mcap::put<std::uint64_t>(record, ns);
    Mcap::put<std::uint64_t>(record, ns);
    record += text;
    out.record(0x05, record);
  }
  return out.finish();
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
  void column(const std::string& name, const std::vector<T>& values, hid_t type) {
    const hsize_t n = values.size(), chunk = std::min<hsize_t>(std::max<hsize_t>(n, 1), 16384);
    const hid_t space = H5Screate_simple(1, &n, nullptr), list = H5Pcreate(H5P_DATASET_CREATE);
    if (n > 0) {
      H5Pset_chunk(list, 1, &chunk);
      H5Pset_deflate(list, 3);
    }
    const hid_t set = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT);
    const bool written = set >= 0 && (n == 0 || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    if (set >= 0) H5Dclose(set);
    H5Pclose(list);
    H5Sclose(space);
    need(written);
  }
  void text(const char* name, const std::string& value) {
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, std::max<std::size_t>(value.size(), 1));
    H5Tset_cset(type, H5T_CSET_UTF8);
    const hid_t a = H5Acreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
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
  for (const Burr& b : burr_library()) burrs += (burrs.empty() ? "" : "; ") + b.name();
  file.text("tools", burrs);
  file.group("/ticks");
  std::vector<double> values(s.ticks.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = seconds_of(s, s.ticks[i]);
  file.column("/ticks/time_s", values, H5T_NATIVE_DOUBLE);
  std::vector<std::int64_t> whole(s.ticks.size());
  for (const Column& c : kColumns) {
    context.check_cancelled();
    if (c.whole) {
      for (std::size_t i = 0; i < whole.size(); ++i) whole[i] = static_cast<std::int64_t>(c.value(s.ticks[i]));
      file.column(std::string("/ticks/") + c.name, whole, H5T_NATIVE_INT64);
    } else {
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = c.value(s.ticks[i]);
      file.column(std::string("/ticks/") + c.name, values, H5T_NATIVE_DOUBLE);
    }
  }
  file.group("/voxel_changes");
  std::vector<std::uint32_t> voxels;
  std::vector<float> densities;
  for (const VoxelChange& c : s.changes) {
    voxels.push_back(c.voxel);
    densities.push_back(c.density);
  }
  file.column("/voxel_changes/voxel", voxels, H5T_NATIVE_UINT32);
  file.column("/voxel_changes/density", densities, H5T_NATIVE_FLOAT);
  file.close();
}

}  // namespace

void export_session(const Session& s, const fs::path& path, const Context& context) {
  const std::string ending = lower_case(path.extension().string());
  if (ending == ".csv") {
    write_file(path, csv(s, context));
  } else if (ending == ".mcap") {
    write_file(path, mcap(s, context));
  } else if (ending == ".h5" || ending == ".hdf5") {
    // HDF5 writes by itself: beside the file first, then in its place.
    fs::path part = path;
    part += ".part";
    try {
      hdf5(s, part, context);
      fs::rename(part, path);
    } catch (const fs::filesystem_error&) {
      throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "'", "choose a folder that you may write to");
    } catch (...) {
      std::error_code ignored;
      fs::remove(part, ignored);
      throw;
    }
  } else {
    throw Error(ExitCode::usage, "'" + path.string() + "': sessions are exported as .csv, .h5 or .mcap");
  }
}

}  // namespace osteo
