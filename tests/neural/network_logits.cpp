// The logits of a network on its own grid, for scripts that fit or compare: 16-bit numbers, class by class, z, y, x.
// usage: network_logits CT MODEL_FOLDER OUT.f16
#include <cstdio>
#include <fstream>

#include "osteo/core/base/error.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/neural/detail/predict.h"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: network_logits CT MODEL_FOLDER OUT.f16\n");
    return 2;
  }
  try {
    osteo::NetworkModel model;
    const auto logits = osteo::network_logits(osteo::load_image(argv[1]), argv[2], model, {}, {});
    std::ofstream out(argv[3], std::ios::binary);
    out.write(reinterpret_cast<const char*>(logits.values.data()),
              static_cast<std::streamsize>(logits.values.size() * sizeof(logits.values[0])));
    if (!out.flush()) throw osteo::Error(osteo::ExitCode::failed, "the logits cannot be written");
    std::printf("%d %d %d %d\n", model.unet.classes, logits.size[0], logits.size[1], logits.size[2]);
  } catch (const osteo::Error& error) {
    std::fprintf(stderr, "network_logits: %s\n", error.what());
    return 1;
  }
  return 0;
}
