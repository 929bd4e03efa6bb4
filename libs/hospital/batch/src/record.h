#pragma once
#include <optional>

#include "osteo/hospital/batch/batch.h"
#include "osteo/hospital/batch/children.h"

namespace osteo::inline hospital {

/// None where there is none that can be read.
[[nodiscard]] std::optional<CaseRecord> known_record(const std::filesystem::path& out, const std::string& code);
void count(const std::optional<CaseRecord>& record, BatchResult& result);

[[nodiscard]] inline std::filesystem::path record_file(const std::filesystem::path& out, const std::string& code) {
  return out / "records" / (code + ".json");
}
[[nodiscard]] inline std::filesystem::path case_folder(const std::filesystem::path& out, const std::string& code) {
  return out / "cases" / code;
}

}  // namespace osteo::inline hospital
