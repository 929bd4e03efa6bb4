// What a program that links every stage says of its licence.
#pragma once
#include <string>

#include "osteo/app/stages/mesh.h"
#include "osteo/simulation/tissue/calibrate.h"

namespace osteo {

/// `libav`: the licence that libav was built under, as it says; empty where it is not linked.
[[nodiscard]] inline std::string licence_of_all_stages(const std::string& libav = {}) {
  std::string licence =
      "Osteotome's own sources: Apache-2.0. This binary links VTK, vtk-dicom, GDCM, DCMTK, libarchive, OpenVDB, "
      "oneTBB, hidapi, libsodium, "
      "HDF5, libdeflate and "
      "zlib (all "
      "permissive or MPL-2.0)";
  std::string parts(copyleft_parts());
  if (has_ceres())
    parts +=
        std::string(parts.empty() ? "" : " and ") + "Ceres, whose package brings parts of SuiteSparse under the GPL";
  const bool gpl_libav = libav.starts_with("GPL");
  if (gpl_libav) parts += std::string(parts.empty() ? "" : " and ") + "libav, built under the " + libav;
  if (!parts.empty()) {
    licence += ",\nand " + parts + ", so that as a whole it falls under the " +
               (parts.find("AGPL") != std::string::npos ? "AGPL" : "GPL") +
               "; build with -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF " +
               (gpl_libav ? std::string("-DOSTEO_MOVIE=OFF ") : std::string()) + "for one that does not.\n";
  } else {
    licence += ";\nit contains neither CGAL (GPL) nor TetGen (AGPL), so it falls under Apache-2.0 as a whole.\n";
  }
  licence += "Not a medical device: for rehearsal, teaching and research, not for treatment decisions.";
  return licence;
}

}  // namespace osteo
