#include "align_loop.h"

void osteo::experiment::diagonal_avx512(const Diagonal& d) {
  run_any(d);
}
