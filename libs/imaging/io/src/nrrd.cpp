// NRRD, read and written here: VTK's reader ignores the orientation. Format: teem.sourceforge.net/nrrd/format.html
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "gzip.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "raw_volume.h"

namespace osteo::inline imaging::io {
namespace {

const std::map<std::string, Scalar, std::less<>> kTypes{
    {"signed char", Scalar::i8},
    {"int8", Scalar::i8},
    {"int8_t", Scalar::i8},
    {"uchar", Scalar::u8},
    {"unsigned char", Scalar::u8},
    {"uint8", Scalar::u8},
    {"uint8_t", Scalar::u8},
    {"short", Scalar::i16},
    {"short int", Scalar::i16},
    {"signed short", Scalar::i16},
    {"int16", Scalar::i16},
    {"int16_t", Scalar::i16},
    {"signed short int", Scalar::i16},
    {"ushort", Scalar::u16},
    {"unsigned short", Scalar::u16},
    {"uint16", Scalar::u16},
    {"uint16_t", Scalar::u16},
    {"unsigned short int", Scalar::u16},
    {"int", Scalar::i32},
    {"signed int", Scalar::i32},
    {"int32", Scalar::i32},
    {"int32_t", Scalar::i32},
    {"uint", Scalar::u32},
    {"unsigned int", Scalar::u32},
    {"uint32", Scalar::u32},
    {"uint32_t", Scalar::u32},
    {"float", Scalar::f32},
    {"double", Scalar::f64},
};

std::string_view type_name(Scalar type) {
  switch (type) {
    case Scalar::u8:
      return "uint8";
    case Scalar::i8:
      return "int8";
    case Scalar::u16:
      return "uint16";
    case Scalar::i16:
      return "int16";
    case Scalar::u32:
      return "uint32";
    case Scalar::i32:
      return "int32";
    case Scalar::f32:
      return "float";
    case Scalar::f64:
      return "double";
  }
  return {};
}

[[noreturn]] void fail(const fs::path& path, const std::string& what, const std::string& advice = {}) {
  throw Error(ExitCode::corrupt, "'" + path.string() + "': " + what, advice);
}

std::vector<double> numbers_in(std::string_view text) {
  std::string clean(text);
  std::replace_if(
      clean.begin(), clean.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  std::istringstream in(clean);
  std::vector<double> out;
  std::string word;
  while (in >> word) {
    out.push_back(word == "nan" || word == "NaN" ? std::numeric_limits<double>::quiet_NaN()
                                                 : parse_number(word, "NRRD header"));
  }
  return out;
}

void inflate_into(std::span<const std::byte> packed, std::byte* out, std::size_t size, const fs::path& path) {
  if (gunzip_exactly(packed, {out, size})) return;
  // Whatever else zlib reads: its own wrapping, and of a damaged or cut file what there is.
  z_stream z{};
  if (inflateInit2(&z, 15 + 32) != Z_OK) fail(path, "cannot start decompression");
  std::size_t in_done = 0, out_done = 0;
  constexpr std::size_t kChunk = 1U << 30;
  int rc = Z_OK;
  while (rc == Z_OK && out_done < size) {
    z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data() + in_done));
    z.avail_in = static_cast<uInt>(std::min(kChunk, packed.size() - in_done));
    z.next_out = reinterpret_cast<Bytef*>(out + out_done);
    z.avail_out = static_cast<uInt>(std::min(kChunk, size - out_done));
    const auto in_before = z.avail_in, out_before = z.avail_out;
    rc = inflate(&z, Z_NO_FLUSH);
    in_done += in_before - z.avail_in;
    out_done += out_before - z.avail_out;
    if (in_before == z.avail_in && out_before == z.avail_out) break;
  }
  inflateEnd(&z);
  if (out_done < size)
    fail(path, "the compressed voxels end early or are damaged", "copy the file again from its source");
}

struct Header {
  std::map<std::string, std::string, std::less<>> fields;  // keys in lower case
  std::map<std::string, std::string> notes;
  std::vector<std::string> list;    // of data files
  std::optional<std::size_t> body;  // where the voxels begin, unless they are in another file

  [[nodiscard]] std::string get(std::string_view key) const {
    const auto it = fields.find(key);
    return it == fields.end() ? std::string() : it->second;
  }
};

// What "data file" names (teem.sourceforge.net/nrrd/format.html#detached): one file, "LIST [subdim]" with a name a
// line, or "NAME%03d.EXT first last step [subdim]". Each holds as much as the others, one after the other along the
// slowest axis.
std::vector<fs::path> data_files(const std::string& value, const std::vector<std::string>& list, const fs::path& path) {
  std::vector<fs::path> files;
  const auto add = [&](const std::string& name) { files.push_back(path.parent_path() / name); };
  std::istringstream words(value);
  std::string name;
  words >> name;
  const std::size_t sign = name.find('%');
  if (name == "LIST") {
    for (const std::string& line : list) add(line);
  } else if (sign != std::string::npos) {
    std::size_t end = sign + 1;
    while (end < name.size() && name[end] >= '0' && name[end] <= '9') ++end;
    const std::string width = name.substr(sign + 1, end - sign - 1);
    long first = 0, last = 0, step = 0;
    if (end >= name.size() || name[end] != 'd' || width.size() > 2 || name.find('%', end) != std::string::npos ||
        !(words >> first >> last >> step) || step == 0 || (last - first) / step < 0 || (last - first) / step > 65536) {
      fail(path, "the data files '" + value + "' are not like slice%03d.raw 1 100 1");
    }
    for (long n = first; step > 0 ? n <= last : n >= last; n += step) {
      std::string number = std::to_string(std::abs(n));
      const std::size_t wanted = width.empty() ? 0 : static_cast<std::size_t>(std::stoi(width));
      const std::size_t missing =
          wanted > number.size() + (n < 0 ? 1 : 0) ? wanted - number.size() - (n < 0 ? 1 : 0) : 0;
      number.insert(0, missing, width.starts_with('0') ? '0' : ' ');
      add(name.substr(0, sign) + (n < 0 ? "-" : "") + number + name.substr(end + 1));
    }
  } else {
    add(value);
  }
  if (files.empty()) fail(path, "its list of data files is empty");
  return files;
}

Header parse_header(std::string_view all, const fs::path& path) {
  if (!all.starts_with("NRRD")) fail(path, "this is not an NRRD file");
  Header header;
  bool listing = false;
  std::size_t at = all.find('\n');
  while (at != std::string_view::npos && ++at < all.size()) {
    const std::size_t end = all.find('\n', at);
    std::string_view line = all.substr(at, end == std::string_view::npos ? end : end - at);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at = end;
    if (line.empty()) {
      header.body = std::min(at, all.size() - 1) + 1;
      break;
    }
    if (line.starts_with('#')) continue;
    if (listing) {
      header.list.emplace_back(line);
      continue;
    }
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos)
      fail(path, "the header line '" + std::string(line.substr(0, 60)) + "' has no colon");
    if (line.substr(colon).starts_with(":=")) {
      header.notes[std::string(line.substr(0, colon))] = std::string(line.substr(colon + 2));
      continue;
    }
    std::string_view value = line.substr(colon + 1);
    while (value.starts_with(' ') || value.starts_with('\t')) value.remove_prefix(1);
    const std::string key = lower_case(std::string(line.substr(0, colon)));
    listing = (key == "data file" || key == "datafile") && (value == "LIST" || value.starts_with("LIST "));
    header.fields[key] = std::string(value);
  }
  return header;
}

// Sets type, layers and dims; leaves "space directions" with the three of space.
void read_shape(Header& header, RawVolume& raw, const fs::path& path) {
  const auto type = kTypes.find(header.get("type"));
  if (type == kTypes.end()) fail(path, "the scalar type '" + header.get("type") + "' is not supported");
  raw.type = type->second;
  auto sizes = numbers_in(header.get("sizes"));
  const std::string kinds = lower_case(header.get("kinds"));
  if (sizes.size() == 4 && (kinds.starts_with("list ") || kinds.starts_with("vector "))) {
    if (!(sizes[0] >= 1 && sizes[0] <= 255)) fail(path, "it has " + format_number(sizes[0]) + " layers");
    raw.layers = static_cast<int>(sizes[0]);
    sizes.erase(sizes.begin());
    std::string& directions = header.fields["space directions"];
    if (directions.starts_with("none")) directions.erase(0, 4);
  }
  if (sizes.size() != 3)
    fail(path, "it has " + std::to_string(sizes.size()) + " axes; a volume has three",
         sizes.size() == 4 ? "a series over time or of channels: save one of its volumes as a file of its own" : "");
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(sizes[a] >= 1 && sizes[a] <= 65536)) fail(path, "the size " + format_number(sizes[a]) + " is out of range");
    raw.frame.dims[a] = static_cast<int>(sizes[a]);
  }
}

// World axes: LPS unless the header says RAS or LAS.
void read_place(const Header& header, RawVolume& raw, const fs::path& path) {
  Frame& frame = raw.frame;
  const std::string space = lower_case(header.get("space"));
  Vec3 to_lps{1, 1, 1};
  if (space != "lps" && space != "left-posterior-superior" && space != "ras" && space != "right-anterior-superior" &&
      space != "las" && space != "left-anterior-superior") {
    raw.findings.push_back(
        {VolumeFinding::What::axes_not_stated,
         (space.empty() ? "the NRRD header states no anatomical space"
                        : "the NRRD space '" + space + "' is not anatomical") +
             std::string(": left and right, front and back, head and foot are not known; LPS is taken")});
  }
  if (space == "ras" || space == "right-anterior-superior") to_lps = {-1, -1, 1};
  if (space == "las" || space == "left-anterior-superior") to_lps = {1, -1, 1};
  if (!header.get("space directions").empty()) {
    const auto d = numbers_in(header.get("space directions"));
    if (d.size() != 9) fail(path, "'space directions' needs three vectors of three numbers");
    for (std::size_t a = 0; a < 3; ++a) {
      const Vec3 v{d[3 * a] * to_lps.x, d[3 * a + 1] * to_lps.y, d[3 * a + 2] * to_lps.z};
      frame.spacing_mm[a] = length(v);
      frame.direction.column[a] = normalized(v);
    }
  } else if (!header.get("spacings").empty()) {
    const auto s = numbers_in(header.get("spacings"));
    if (s.size() != 3) fail(path, "'spacings' needs three numbers");
    for (std::size_t a = 0; a < 3; ++a) frame.spacing_mm[a] = std::isnan(s[a]) ? 1 : s[a];
  }
  if (!header.get("space origin").empty()) {
    const auto o = numbers_in(header.get("space origin"));
    if (o.size() != 3) fail(path, "'space origin' needs three numbers");
    frame.origin_mm = {o[0] * to_lps.x, o[1] * to_lps.y, o[2] * to_lps.z};
  }
}

// Quoted words: "mm" "mm" "mm".
std::vector<std::string> quoted(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = text.find('"'); at != std::string::npos;) {
    const std::size_t end = text.find('"', at + 1);
    if (end == std::string::npos) break;
    words.push_back(text.substr(at + 1, end - at - 1));
    at = text.find('"', end + 1);
  }
  return words;
}

// Lengths in mm: by "space units" of the space's axes, or "units" of the volume's where it has spacings only.
void read_units(const Header& header, RawVolume& raw, const fs::path& path) {
  const char* const key = header.get("space units").empty() ? "units" : "space units";
  std::vector<std::string> units = quoted(header.get(key));
  if (units.size() > 3) units.erase(units.begin(), units.end() - 3);  // the first is of layers
  std::erase(units, "");
  if (units.empty()) return;
  if (std::any_of(units.begin(), units.end(), [&](const std::string& u) { return u != units.front(); }))
    fail(path, "its axes have different units ('" + units.front() + "', '" + units.back() + "')",
         "save it in millimetres");
  static const std::map<std::string, double, std::less<>> kMillimetres{
      {"mm", 1},           {"millimeter", 1},  {"millimeters", 1}, {"millimetre", 1},    {"millimetres", 1},
      {"cm", 10},          {"centimeter", 10}, {"centimetre", 10}, {"m", 1000},          {"meter", 1000},
      {"meters", 1000},    {"metre", 1000},    {"metres", 1000},   {"um", 1e-3},         {"\xC2\xB5m", 1e-3},
      {"\xCE\xBCm", 1e-3}, {"micron", 1e-3},   {"microns", 1e-3},  {"micrometer", 1e-3}, {"micrometre", 1e-3},
      {"nm", 1e-6},        {"inch", 25.4},     {"in", 25.4}};
  const auto mm = kMillimetres.find(lower_case(units.front()));
  if (mm == kMillimetres.end()) {
    fail(path, "its unit of length '" + units.front() + "' ('" + key + "') is not known",
         "save it in millimetres (\"mm\")");
  }
  convert_lengths(raw, mm->second, units.front() + " ('" + key + "')");
}

void require_valid_in(const fs::path& path, const Frame& frame) {
  try {
    require_valid(frame);
  } catch (const Error& e) {
    throw e.in("'" + path.string() + "'");
  }
}

// The files that hold the voxels; empty when this one does.
std::vector<fs::path> data_files_of(const Header& header, const fs::path& path) {
  for (const char* const skip : {"byte skip", "byteskip", "line skip", "lineskip"}) {
    if (!header.get(skip).empty() && header.get(skip) != "0")
      fail(path, std::string("'") + skip + "' is not supported", "save it with its own header");
  }
  std::string name = header.get("data file");
  if (name.empty()) name = header.get("datafile");
  if (!name.empty()) return data_files(name, header.list, path);
  if (!header.body) fail(path, "the header does not end and names no data file");
  return {};
}

// `from`: where the bytes stand.
void decode(const Header& header, std::span<const std::byte> body, std::span<std::byte> voxels, const fs::path& from,
            const fs::path& path) {
  const std::string encoding = lower_case(header.get("encoding"));
  if (encoding == "raw") {
    if (body.size() < voxels.size()) {
      fail(from,
           "it holds " + std::to_string(body.size()) + " bytes of voxels but needs " + std::to_string(voxels.size()),
           "the file was cut short; copy it again from its source");
    }
    std::memcpy(voxels.data(), body.data(), voxels.size());
  } else if (encoding == "gzip" || encoding == "gz") {
    inflate_into(body, voxels.data(), voxels.size(), from);
  } else {
    fail(path, "the encoding '" + encoding + "' is not supported", "save it with gzip or raw encoding");
  }
}

}  // namespace

RawVolume read_nrrd(const fs::path& path) {
  const auto bytes = read_file(path);
  Header header = parse_header({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path);
  RawVolume raw;
  raw.notes = std::move(header.notes);
  read_shape(header, raw, path);
  read_place(header, raw, path);
  read_units(header, raw, path);
  require_valid_in(path, raw.frame);

  const auto files = data_files_of(header, path);
  const std::size_t scalar = size_of(raw.type),
                    size = raw.frame.voxel_count() * scalar * static_cast<std::size_t>(raw.layers);
  double there = 0;
  for (const fs::path& f : files) {
    require_readable(f);
    there += static_cast<double>(fs::file_size(f));
  }
  const bool packed = lower_case(header.get("encoding")) != "raw";
  // A plain body that is short is reported by how many bytes there are.
  if (packed || size > (std::size_t{1} << 32))
    require_room(path, static_cast<double>(raw.frame.voxel_count()) * raw.layers, static_cast<double>(scalar),
                 files.empty() ? static_cast<double>(bytes.size() - *header.body) : there, packed);
  auto voxels = std::make_shared_for_overwrite<std::byte[]>(size);
  const std::span<std::byte> all(voxels.get(), size);
  if (files.empty()) {
    decode(header, std::span(bytes).subspan(*header.body), all, path, path);
  } else {
    if (size % files.size() != 0)
      fail(path, std::to_string(size) + " bytes of voxels cannot lie in " + std::to_string(files.size()) +
                     " files of the same size");
    const std::size_t each = size / files.size();
    for (std::size_t i = 0; i < files.size(); ++i)
      decode(header, read_file(files[i]), all.subspan(i * each, each), files[i], path);
  }
  const bool big = lower_case(header.get("endian")) == "big";
  if (scalar > 1 && big != (std::endian::native == std::endian::big)) {
    for (std::size_t i = 0; i < size; i += scalar) std::reverse(voxels.get() + i, voxels.get() + i + scalar);
  }
  raw.data = std::shared_ptr<const void>(voxels, voxels.get());
  return raw;
}

void write_nrrd(const RawVolume& raw, const fs::path& path) {
  std::ostringstream header;
  header.precision(17);
  const Frame& f = raw.frame;
  header << "NRRD0004\n# Osteotome: left-posterior-superior, mm\ntype: " << type_name(raw.type) << "\ndimension: 3\n"
         << "space: left-posterior-superior\nsizes: " << f.dims[0] << ' ' << f.dims[1] << ' ' << f.dims[2]
         << "\nspace directions:";
  for (std::size_t a = 0; a < 3; ++a) {
    const Vec3 v = f.direction.column[a] * f.spacing_mm[a];
    header << " (" << v.x << ',' << v.y << ',' << v.z << ')';
  }
  header << "\nkinds: domain domain domain\nendian: little\nencoding: gzip\nspace origin: (" << f.origin_mm.x << ','
         << f.origin_mm.y << ',' << f.origin_mm.z << ")\n";
  for (const auto& [key, value] : raw.notes) header << key << ":=" << value << '\n';
  header << '\n';
  static_assert(std::endian::native == std::endian::little);
  const std::size_t size = f.voxel_count() * size_of(raw.type);
  write_parts(path, header.view(), gzip({}, {static_cast<const char*>(raw.data.get()), size}));
}

}  // namespace osteo::inline imaging::io
