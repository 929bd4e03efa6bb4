// study demo: a whole study by simulated trainees.
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

/// `osteo study demo`. What is there already is kept. `movies`: blinded ones for raters, where this build and OpenGL
/// make them; else said. Errors: cannot_write (the folder holds something else), usage (another seed).
int run_study_demo(const std::string& folder, int resamples, double level, bool movies, cli::Invocation& invocation);

}  // namespace osteo
