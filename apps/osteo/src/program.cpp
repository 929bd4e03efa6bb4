#include "commands.h"
#include "osteo/stages/mesh.h"
#include "osteo/stages/registry.h"
#include "osteo/tissue/calibrate.h"

namespace osteo {

cli::Program make_osteo_program() {
  cli::Program p;
  p.about = "osteo: from a patient's CT to a bone that can be drilled and felt";
  p.licence =
      "Osteotome's own sources: Apache-2.0. This binary links VTK, vtk-dicom, GDCM, DCMTK, libarchive, OpenVDB, oneTBB, hidapi, HDF5 and "
      "zlib (all "
      "permissive or MPL-2.0)";
  std::string parts(copyleft_parts());
  if (has_ceres()) parts += std::string(parts.empty() ? "" : " and ") + "Ceres, whose package brings parts of SuiteSparse under the GPL";
  if (!parts.empty()) {
    p.licence += ",\nand " + parts + ", so that as a whole it falls under the " +
                 (parts.find("AGPL") != std::string::npos ? "AGPL" : "GPL") +
                 "; build with -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF for one that does not.\n";
  } else {
    p.licence += ";\nit contains neither CGAL (GPL) nor TetGen (AGPL), so it falls under Apache-2.0 as a whole.\n";
  }
  p.licence += "Not a medical device: for rehearsal, teaching and research, not for treatment decisions.";
  p.registry = osteo_stages();
  p.add<ListCommand>();
  p.add<InfoCommand>();
  p.add<SeriesCommand>();
  p.add<GuideCommand>();
  p.add<ConvertCommand>();
  p.add<RunCommand>();
  p.add<PrepareCommand>();
  p.add<HandOverCommand>();
  p.add<TakeBackCommand>();
  p.add<SceneCommand>();
  p.add<PlanCommand>();
  p.add<RehearseCommand>();
  p.add<ReplayCommand>();
  p.add<ExportCommand>();
  p.add<DevicesCommand>();
  p.add<DoctorCommand>();
  p.add<DemoCommand>();
  p.add<BenchCommand>();
  p.add<DocsCommand>();
  return p;
}

}  // namespace osteo
