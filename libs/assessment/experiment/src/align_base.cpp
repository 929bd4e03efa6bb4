#include "align_loop.h"

void osteo::experiment::diagonal_base(const Diagonal& d) {
  run_any(d);
}
