// Folders that tests read from. They stand in a file of their own: in a clone at another place it alone is compiled
// anew, and not every test.
#pragma once
#include <filesystem>

namespace osteo {

std::filesystem::path source_folder();  // of the repository
std::filesystem::path shared_data();    // real CTs and meshes; need not be there

}  // namespace osteo
