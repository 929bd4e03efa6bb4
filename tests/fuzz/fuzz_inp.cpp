// Input files of Abaqus and CalculiX: mesh, and the problem in it.
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/imaging/io/inp_io.h"
#include "osteo/simulation/tissue/problem.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const osteo::InpFile file = osteo::parse_inp(text, "fuzz");
    static_cast<void>(osteo::parse_tissue_problem(text, file.mesh, false));
  } catch (const osteo::Error&) {
  }
  return 0;
}
