#include "folders.h"

namespace osteo {

std::filesystem::path source_folder() {
  return OSTEO_SOURCE;
}
std::filesystem::path shared_data() {
  return OSTEO_SHARED_DATA;
}

}  // namespace osteo
