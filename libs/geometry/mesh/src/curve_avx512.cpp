#if defined(__x86_64__)
#define OSTEO_ISA avx512
#include "curve_loops.h"
#endif
