// Sound: on, how loud. Private to libs/window.
#pragma once
#include "osteo/window/sound_out.h"

namespace osteo {

/// Into the current ImGui window, two lines.
void draw_sound(SoundOut& sound);

}  // namespace osteo
