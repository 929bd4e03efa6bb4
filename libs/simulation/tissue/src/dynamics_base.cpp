#define OSTEO_ISA base
#include "dynamics_loops.h"
