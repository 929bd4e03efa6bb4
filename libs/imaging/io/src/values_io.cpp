#include "osteo/imaging/io/tet_io.h"

#include "osteo/core/base/error.h"
#include "raw_volume.h"

namespace osteo::inline imaging {

void save_values(const Volume<float>& values, const std::filesystem::path& path) {
  io::RawVolume raw;
  raw.frame = values.frame;
  raw.type = io::Scalar::f32;
  raw.data = std::shared_ptr<const void>(values.voxels, values.voxels.get());
  if (path.extension() == ".nrrd") return io::write_nrrd(raw, path);
  if (path.extension() == ".vti") return io::write_vti(raw, path);
  throw Error(ExitCode::usage, "cannot write a grid as '" + path.filename().string() + "'",
              "name it .vdb, .nrrd or .vti");
}

}  // namespace osteo::inline imaging
