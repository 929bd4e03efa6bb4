// Sound: on, how loud. Private to libs/app/window.
#pragma once
#include "osteo/app/window/sound_out.h"

namespace osteo::inline app {

/// Into the current ImGui window, two lines.
void draw_sound(SoundOut& sound);

}  // namespace osteo::inline app
