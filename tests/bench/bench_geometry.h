// What the tables of 'osteo bench geometry' share: clocks, surfaces, peers from PyPI.
#pragma once
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "folders.h"
#include "meshes.h"
#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo::bench {

namespace fs = std::filesystem;

// Of this process and of those that it ran: TetGen and CGAL have their own.
inline double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  rusage ended{};
  getrusage(RUSAGE_CHILDREN, &ended);
  const auto seconds = [](const timeval& v) {
    return static_cast<double>(v.tv_sec) + 1e-6 * static_cast<double>(v.tv_usec);
  };
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec) + seconds(ended.ru_utime) +
         seconds(ended.ru_stime);
}
inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The least of a few runs; long ones run once.
template <class F>
double cpu(F&& f, int repeats = 3) {
  double best = 1e30;
  for (int r = 0; r < repeats; ++r) {
    const double begin = cpu_seconds();
    f();
    best = std::min(best, cpu_seconds() - begin);
    if (best > 0.5) break;
  }
  return best;
}
template <class F>
double wall(F&& f, int repeats = 3) {
  double best = 1e30;
  for (int r = 0; r < repeats; ++r) {
    const double begin = wall_seconds();
    f();
    best = std::min(best, wall_seconds() - begin);
    if (best > 1) break;
  }
  return best;
}

struct Subject {
  std::string name;
  TriangleSoup soup;
};
inline std::vector<Subject> subjects() {
  std::vector<Subject> all;
  const fs::path folder = shared_data() / "meshes";
  for (const auto& [name, file] :
       {std::pair{"bunny", "bunny_capped_69664_morris.obj"}, std::pair{"gear", "gear_tetgen_542.obj"},
        std::pair{"happy", "happy_vrip_res4_15536.ply"}, std::pair{"dragon", "dragon_vrip_res3_47794.ply"}}) {
    if (fs::exists(folder / file)) all.push_back({name, soup_of(*load_surface(folder / file))});
  }
  if (all.empty()) {
    std::printf("(The thesis' meshes are not at hand: a sphere and two boxes stand in.)\n\n");
    all.push_back({"sphere", test::sphere(10, 6)});
    all.push_back({"boxes", test::joined(test::box({0, 0, 0}, {5, 10, 10}), test::box({5, 5, 2}, {10, 12, 8}))});
  }
  return all;
}

template <class T>
void write_raw(const fs::path& path, const std::vector<T>& values) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

struct Line {
  std::string name;
  double seconds;
  std::string file;
};
// Peers from PyPI, where build/peers has them.
inline std::vector<Line> python_peers(const fs::path& folder, const char* what) {
  std::vector<Line> lines;
  std::error_code ec;
  const fs::path bin = fs::read_symlink("/proc/self/exe", ec).parent_path();
  const fs::path python = bin.parent_path().parent_path() / "peers" / "bin" / "python3";
  if (!fs::exists(python)) return lines;
  const std::string command =
      python.string() + " " OSTEO_BENCH_FOLDER "/peers.py " + folder.string() + " " + what + " 2>/dev/null";
  FILE* const pipe = ::popen(command.c_str(), "r");
  char buffer[1024];
  while (pipe != nullptr && std::fgets(buffer, sizeof buffer, pipe) != nullptr) {
    std::istringstream in(buffer);
    Line l;
    std::string seconds;
    if (std::getline(in, l.name, '|') && std::getline(in, seconds, '|') && std::getline(in, l.file)) {
      l.seconds = std::stod(seconds);
      lines.push_back(l);
    }
  }
  if (pipe != nullptr) ::pclose(pipe);
  return lines;
}

/// Each prints its tables. `folder` is for what peers from PyPI read and write.
void distance_tables(const Context& context, const std::filesystem::path& folder);
void mask_table(const Context& context, const std::filesystem::path& folder);
void live_table();
void tet_tables(const Context& context);
void curve_table();
void skin_table(const Context& context);

}  // namespace osteo::bench
