// What programs propose to type, as a person copies it into a shell's line.
#pragma once
#include <filesystem>
#include <string>

namespace osteo {

/// A path as one word of a shell's line: in single quotes where it holds a blank or another character that a shell
/// takes for its own.
[[nodiscard]] std::string shell_path(const std::filesystem::path& path);

}  // namespace osteo
