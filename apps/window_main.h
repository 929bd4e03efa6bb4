// What the windows' programs have in common.
#pragma once
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/app/cli/command.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"

namespace osteo {

/// Of what is ours alone.
inline constexpr std::string_view kOwnLicence = "Osteotome's own sources: Apache-2.0. Not a medical device.";

/// main() of a program of one command, whose name need not be given. Returns its exit code.
template <class Command>
int run_window_program(int argc, char** argv, std::string about, std::string licence) {
  use_language(language_named(PersonSettings(PersonSettings::usual_file()).values.language));
  cli::Program program;
  program.about = std::move(about);
  program.licence = std::move(licence);
  program.add<Command>();
  std::vector<char*> args{argv[0]};
  std::string name = Command::info().name;
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first != "--version" && first != "help") args.push_back(name.data());
  args.insert(args.end(), argv + 1, argv + argc);
  return cli::run_program(program, static_cast<int>(args.size()), args.data(), std::cout, std::cerr);
}

/// Error(failed) when a window has seen errors of OpenGL. `then`: what is well all the same, in words.
inline void require_no_gl_errors(int seen, const std::string& then = {}) {
  if (seen > 0)
    throw Error(ExitCode::failed, std::to_string(seen) + " OpenGL errors were seen" + then,
                "please report this with the name of the graphics card");
}

}  // namespace osteo
