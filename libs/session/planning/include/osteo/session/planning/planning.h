// Surgery that is planned, led by a printed guide, and measured afterwards.
#pragma once
#include "osteo/session/planning/detail/cutting_guide.h"
#include "osteo/session/planning/detail/outcome.h"
#include "osteo/session/planning/detail/reconstruct.h"
