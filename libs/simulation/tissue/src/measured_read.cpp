// Files of what was measured of a body.
#include <algorithm>
#include <cmath>
#include <optional>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/points_io.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/tissue/measured.h"

namespace osteo::inline simulation {

namespace fs = std::filesystem;

MeasuredPoints read_measured_csv(std::string_view text, const std::string& name) {
  const Csv csv = read_csv(text, name);
  const std::string columns =
      "the columns are x_mm, y_mm, z_mm; of markers also x0_mm, y0_mm, z0_mm, where each was at rest; perhaps noise_mm";
  constexpr std::array<std::string_view, 7> kNames{"x_mm", "y_mm", "z_mm", "x0_mm", "y0_mm", "z0_mm", "noise_mm"};
  std::array<std::optional<std::size_t>, 7> at;
  for (std::size_t c = 0; c < csv.columns.size(); ++c) {
    const auto known = std::find(kNames.begin(), kNames.end(), csv.columns[c]);
    if (known == kNames.end()) throw csv.wrong(1, "there is a column '" + csv.columns[c] + "'", columns);
    at[static_cast<std::size_t>(known - kNames.begin())] = c;
  }
  const bool markers = at[3] || at[4] || at[5];
  for (std::size_t k = 0; k < (markers ? 6U : 3U); ++k) {
    if (!at[k]) throw csv.wrong(1, "there is no column " + std::string(kNames[k]), columns);
  }
  MeasuredPoints measured;
  measured.name = name;
  for (const CsvRow& row : csv.rows) {
    const auto number = [&](std::size_t k) {
      const std::string& field = row.fields[*at[k]];
      try {
        return parse_number(field, kNames[k]);
      } catch (const Error&) {
        throw csv.wrong(row.line, std::string(kNames[k]) + " is '" + field + "', no finite number");
      }
    };
    measured.points_mm.push_back({number(0), number(1), number(2)});
    if (markers) measured.rest_mm.push_back({number(3), number(4), number(5)});
    if (!at[6]) continue;
    measured.noise_mm.push_back(number(6));
    if (!(measured.noise_mm.back() > 0))
      throw csv.wrong(row.line, "noise_mm is " + row.fields[*at[6]] + "; it must be above 0",
                      "leave the column out if it is not known");
  }
  if (measured.points_mm.empty()) throw csv.wrong(1, "there is no line under the names");
  return measured;
}

std::vector<MeasuredOfLoad> read_measured(const fs::path& path, const std::vector<std::string>& load_names) {
  std::vector<fs::path> files;
  if (fs::is_directory(path)) {
    for (const auto& entry : fs::directory_iterator(path)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(".") && !name.ends_with(".prov.json")) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    if (files.empty())
      throw Error(ExitCode::usage, "the folder '" + path.filename().string() + "' holds no file",
                  "each file is called like its load: pull.ply");
  } else {
    files.push_back(path);
  }
  std::vector<MeasuredOfLoad> all;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    // The longest that fits: one load may be called like the beginning of another.
    std::optional<std::size_t> load;
    std::string names;
    for (std::size_t n = 0; n < load_names.size(); ++n) {
      names += (n > 0 ? ", " : "") + load_names[n];
      if (name.starts_with(load_names[n] + ".") && (!load || load_names[n].size() > load_names[*load].size())) load = n;
    }
    if (!load)
      throw Error(ExitCode::usage, "'" + name + "' is called like no load",
                  "each file is called like its load, as in pull.ply; the loads are: " + names);
    const auto e = file.extension();
    MeasuredPoints points;
    if (e == ".csv") {
      points = read_measured_csv(read_text(file), name);
    } else if (e == ".xyz" || e == ".txt") {
      points.points_mm = load_points(file);
    } else if (is_surface_file(file)) {
      points.points_mm = load_surface_points(file);
    } else {
      throw Error(ExitCode::usage, "'" + name + "' is no file of points by its name",
                  "they are .csv .xyz .txt .ply .stl .obj .vtp");
    }
    points.name = name;
    all.push_back({*load, std::move(points)});
  }
  return all;
}

}  // namespace osteo::inline simulation
