// Included by one file for each instruction set, which defines OSTEO_ISA. No inline function of others is called: the
// linker keeps one copy of such a function for the whole program, perhaps one with the wider instructions.
#include "curve_kernel.h"

namespace osteo::inline geometry {
namespace {

inline float larger(float a, float b) {
  return a < b ? b : a;
}
inline float smaller(float a, float b) {
  return b < a ? b : a;
}

}  // namespace

const Curve::Loops Curve::Loops::OSTEO_ISA{
    [](const Leaf& g, const float p[3], float arc, float penalty, float out[16]) {
      for (int i = 0; i < 16; ++i) {
        const float x = p[0] - g.at[0][i], y = p[1] - g.at[1][i], z = p[2] - g.at[2][i];
        const float foot =
            smaller(larger(x * g.direction[0][i] + y * g.direction[1][i] + z * g.direction[2][i], 0.0F), g.length[i]);
        const float rx = x - foot * g.direction[0][i], ry = y - foot * g.direction[1][i],
                    rz = z - foot * g.direction[2][i];
        const float way = larger(larger(g.arc[i] - arc, arc - g.arc[i] - g.length[i]), 0.0F);
        out[i] = __builtin_sqrtf(rx * rx + ry * ry + rz * rz) + penalty * way;
      }
    },
    [](const Group& g, const float p[3], float arc, float penalty, float out[16]) {
      for (int i = 0; i < 16; ++i) {
        const float x = larger(larger(g.lo[0][i] - p[0], p[0] - g.hi[0][i]), 0.0F);
        const float y = larger(larger(g.lo[1][i] - p[1], p[1] - g.hi[1][i]), 0.0F);
        const float z = larger(larger(g.lo[2][i] - p[2], p[2] - g.hi[2][i]), 0.0F);
        const float way = larger(larger(g.arc_lo[i] - arc, arc - g.arc_hi[i]), 0.0F);
        out[i] = __builtin_sqrtf(x * x + y * y + z * z) + penalty * way;
      }
    }};

}  // namespace osteo::inline geometry
