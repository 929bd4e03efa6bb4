// What was done with a case, for the audit trail.
#pragma once
#include "osteo/assessment/case_report/case_report.h"
#include "osteo/core/base/error.h"
#include "osteo/hospital/pacs/audit.h"

namespace osteo {

/// Tells that `kind` was done with the case. What is no case has no code, and is reported of by who opens it.
inline void audit_case(const AuditTrail& trail, AuditEvent::Kind kind, const fs::path& folder, const Context& context) {
  if (!trail.on()) return;
  AuditEvent event;
  event.kind = kind;
  try {
    event.case_code = case_code(folder);
  } catch (const Error&) {
    return;
  }
  trail.notify(event, context);
}

}  // namespace osteo
