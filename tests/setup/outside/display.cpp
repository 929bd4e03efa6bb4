// Component pictures: cuts and a lit view of a CT, without a display.
#include <cstdio>

#include "osteo/display/view/pictures.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/io/surface_io.h"

int main() {
  const osteo::Phantom head = osteo::make_phantom({.region = osteo::PhantomRegion::temporal, .spacing_mm = 2});
  const osteo::Picture picture = osteo::snapshot({.subject = head.ct, .mask = {}, .surface = {}},
                                                 {.width = 640, .height = 480, .title = "Outside"});
  osteo::save_picture(picture, "picture.png");
  std::size_t bright = 0;
  for (const unsigned char v : picture.rgb) bright += v > 128;
  std::printf("%d x %d, %.0f %% bright\n", picture.width, picture.height,
              100.0 * static_cast<double>(bright) / static_cast<double>(picture.rgb.size()));
  return picture.width == 640 && bright > 1000 ? 0 : 1;
}
