// What a program that links every stage says of its licence.
#pragma once
#include <string>

#include "osteo/stages/mesh.h"
#include "osteo/tissue/calibrate.h"

namespace osteo {

[[nodiscard]] inline std::string licence_of_all_stages() {
  std::string licence =
      "Osteotome's own sources: Apache-2.0. This binary links VTK, vtk-dicom, GDCM, DCMTK, libarchive, OpenVDB, oneTBB, hidapi, HDF5 and "
      "zlib (all "
      "permissive or MPL-2.0)";
  std::string parts(copyleft_parts());
  if (has_ceres()) parts += std::string(parts.empty() ? "" : " and ") + "Ceres, whose package brings parts of SuiteSparse under the GPL";
  if (!parts.empty()) {
    licence += ",\nand " + parts + ", so that as a whole it falls under the " + (parts.find("AGPL") != std::string::npos ? "AGPL" : "GPL") +
               "; build with -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF for one that does not.\n";
  } else {
    licence += ";\nit contains neither CGAL (GPL) nor TetGen (AGPL), so it falls under Apache-2.0 as a whole.\n";
  }
  licence += "Not a medical device: for rehearsal, teaching and research, not for treatment decisions.";
  return licence;
}

}  // namespace osteo
