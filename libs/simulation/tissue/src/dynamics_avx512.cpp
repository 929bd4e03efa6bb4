#define OSTEO_ISA avx512
#include "dynamics_loops.h"
