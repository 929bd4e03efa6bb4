#define OSTEO_ISA avx2
#include "dynamics_loops.h"
