// Reports in records and manifests.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline imaging {

[[nodiscard]] Json report_to_json(const Report& report);
/// What report_to_json wrote; values of other kinds are left out.
[[nodiscard]] Report report_from_json(const JsonValue& object);

}  // namespace osteo::inline imaging
