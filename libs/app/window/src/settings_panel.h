// How it feels, to be changed while it runs. Private to libs/app/window.
#pragma once
#include <string>

#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline app {

/// Into the current ImGui window: a header that opens, and under it all haptic settings, each an action of the session
/// when it is changed.
void draw_settings(Rehearsal& rehearsal);
/// The window's language, by its name in the settings: "auto", "en", "de", ...; used from the next picture on.
void draw_language(std::string& chosen);
/// The same for how the patient lies; nothing in a scene without dust.
void draw_posture(Rehearsal& rehearsal);
/// The bodies of soft tissue by name, with what was cut off each and how its time goes; nothing in a scene without.
void draw_tissue(const Rehearsal& rehearsal);

}  // namespace osteo::inline app
