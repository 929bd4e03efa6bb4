#define OSTEO_ISA scalar
#include "curve_loops.h"
