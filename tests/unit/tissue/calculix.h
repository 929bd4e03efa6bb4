// CalculiX, where it is installed: the same problem solved by others.
#pragma once
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "osteo/core/data/tet_mesh.h"
#include "scratch.h"

namespace osteo::test {

inline bool calculix_is_here() {
  return std::system("command -v ccx > /dev/null 2>&1") == 0;
}

/// Displacements (U) of the last step of an .inp, as ccx prints them; empty where it failed or some point has none.
inline std::vector<Vec3> by_calculix(const std::string& inp, std::size_t points) {
  const ScratchFolder scratch;
  const auto& folder = scratch.path();
  std::ofstream(folder / "job.inp") << inp;
  if (std::system(("cd " + folder.string() + " && OMP_NUM_THREADS=1 ccx job > ccx.log 2>&1").c_str()) != 0) return {};
  std::vector<Vec3> u(points);
  std::size_t read = 0;
  std::ifstream dat(folder / "job.dat");
  for (std::string line; std::getline(dat, line);) {
    std::istringstream fields(line);
    std::size_t n = 0;
    Vec3 v;
    if (fields >> n >> v.x >> v.y >> v.z && n >= 1 && n <= points) u[n - 1] = v, ++read;
  }
  return read < points ? std::vector<Vec3>{} : u;
}

}  // namespace osteo::test
