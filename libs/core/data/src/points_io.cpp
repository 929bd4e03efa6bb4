#include "osteo/core/data/points_io.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"

namespace osteo {
namespace {

// 3D Slicer's points (.fcsv): "# CoordinateSystem = LPS" (or its number), then rows of id,x,y,z,... What older versions
// write without a word is RAS.
enum class Fcsv { none, lps, ras };
Fcsv fcsv_of(const fs::path& path, std::string_view text) {
  if (lower_case(path.extension().string()) != ".fcsv") return Fcsv::none;
  constexpr std::string_view kKey = "# CoordinateSystem = ";
  const std::size_t at = text.find(kKey);
  if (at == std::string_view::npos) return Fcsv::ras;
  std::string_view value = text.substr(at + kKey.size());
  value = value.substr(0, value.find_first_of("\r\n"));
  if (value == "LPS" || value == "1") return Fcsv::lps;
  if (value == "RAS" || value == "0") return Fcsv::ras;
  throw Error(
      ExitCode::corrupt,
      "'" + path.string() + "' has its points in the coordinates '" + std::string(value) + "', not in LPS or RAS",
      "save them again in Slicer");
}

Error no_points(const fs::path& path) {
  return {ExitCode::no_input, "'" + path.string() + "' holds no points",
          "one point a line: x, y, z in LPS mm; or points, a line or a curve that 3D Slicer saved"};
}

std::string text_of(const Json& object, std::string_view key, std::string absent) {
  const Json* const v = object.find(key);
  return v != nullptr && v->text() != nullptr ? *v->text() : std::move(absent);
}

// What 3D Slicer saves since version 5 (.mrk.json): points, a line, a curve. Points that are named and not yet placed
// are none.
std::vector<Vec3> markup_points(const fs::path& path, std::string_view text) {
  const auto wrong = [&](const std::string& what) {
    return Error(ExitCode::corrupt, "'" + path.string() + "' " + what, "save the points again in Slicer");
  };
  const auto json = Json::parse(text);
  const Json* const lists = json ? json->find("markups") : nullptr;
  if (lists == nullptr || lists->items().empty()) throw wrong("is no list of points as 3D Slicer saves it");
  if (lists->items().size() > 1) throw wrong("holds " + std::to_string(lists->items().size()) + " lists, not one");
  const Json& list = lists->items().front();
  const std::string system = text_of(list, "coordinateSystem", "LPS"), unit = text_of(list, "coordinateUnits", "mm");
  if (system != "LPS" && system != "RAS")
    throw wrong("has its points in the coordinates '" + system + "', not in LPS or RAS");
  if (unit != "mm") throw wrong("has its points in '" + unit + "', not in mm");
  std::vector<Vec3> points;
  const Json* const placed = list.find("controlPoints");
  for (const Json& one : placed != nullptr ? placed->items() : Json::List()) {
    if (text_of(one, "positionStatus", "defined") != "defined") continue;
    const Json* const position = one.find("position");
    Vec3 p;
    bool good = position != nullptr && position->items().size() == 3;
    for (std::size_t a = 0; a < 3 && good; ++a) {
      const auto v = position->items()[a].number();
      good = v && std::isfinite(*v);
      if (good) p[a] = *v;
    }
    if (!good) throw wrong("has a point without three finite numbers");
    points.push_back(system == "RAS" ? Vec3{-p.x, -p.y, p.z} : p);
  }
  if (points.empty()) throw no_points(path);
  return points;
}

}  // namespace

std::vector<Vec3> load_points(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (lower_case(path.extension().string()) == ".json") return markup_points(path, text);
  const Fcsv fcsv = fcsv_of(path, text);
  std::vector<Vec3> points;
  std::size_t line = 0;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) end = text.size();
    std::string row(text.substr(at, end - at));
    at = end + 1;
    ++line;
    for (char& c : row) {
      if (c == ',' || c == ';' || c == '\t' || c == '\r') c = ' ';
    }
    if (row.find_first_not_of(' ') == std::string::npos || row[row.find_first_not_of(' ')] == '#') continue;
    Vec3 p;
    const char* s = row.data() + (fcsv == Fcsv::none ? 0 : std::min(row.find(' '), row.size()));
    const char* const last = row.data() + row.size();
    bool good = true;
    for (std::size_t a = 0; a < 3 && good; ++a) {
      while (s < last && *s == ' ') ++s;
      const auto [next, problem] = std::from_chars(s, last, p[a]);
      good = problem == std::errc() && std::isfinite(p[a]);
      s = next;
    }
    if (!good) {
      if (line == 1) continue;  // a heading
      throw Error(ExitCode::corrupt, "'" + path.string() + "', line " + std::to_string(line) +
                                         ": three finite numbers x, y, z are wanted");
    }
    if (fcsv == Fcsv::ras) p = {-p.x, -p.y, p.z};
    points.push_back(p);
  }
  if (points.empty()) throw no_points(path);
  return points;
}

}  // namespace osteo
