// The loops of kernel.h, written once over
//   F: a vector of kF floats   (F::load, F::all; + - *; fma, fnma, min, max, select, at_least, at_most, less, root)
//   D: a vector of kD doubles  (the same, without fused operations)
// Included by kernel_*.cpp after those. No library functions here: each file is compiled for another instruction set,
// and an inline function shared with the rest of the program could end up there in a form this machine cannot run.

namespace {

constexpr std::uint32_t kNone = 0xffffffffU;

struct Edges {
  F dx, dy, dz, d2;  // from the nearest point of the triangle to the point
};

struct Lanes {
  F f[16];
  F at(int i) const { return f[i]; }
};
// The same in memory.
struct Turned {
  const float* p;
  F at(int i) const { return F::load(p + kF * i); }
};

template <class Records>
inline Edges nearest_of(const Records& t, F px, F py, F pz) {
  const F qx = px - t.at(0), qy = py - t.at(1), qz = pz - t.at(2);
  const F ux = t.at(3), uy = t.at(4), uz = t.at(5), vx = t.at(6), vy = t.at(7), vz = t.at(8);
  const F lu = t.at(9), lv = t.at(10), lw = t.at(11), iw = t.at(12), cosine = t.at(13), face = t.at(14);
  const F zero = F::all(0);
  const F du = fma(ux, qx, fma(uy, qy, uz * qz)), dv = fma(vx, qx, fma(vy, qy, vz * qz));
  // The three edges: along AB, along AC, along BC; each one's squared distance less |q|^2.
  const F tu = min(max(du, zero), lu);
  const F tv = min(max(dv, zero), lv);
  const F m = fma(lv, dv, lu * (fnma(lv, cosine, lu) - du)) * iw;
  const F tw = min(max(m, zero), lw);
  const F fu = tu * (tu - (du + du)), fv = tv * (tv - (dv + dv));
  const F fw = fma(lu, lu - (du + du), tw * (tw - (m + m)));
  const F rho = tw * iw;
  F s = tu, r = zero, best = fu;
  const auto second = less(fv, best);
  s = select(second, zero, s);
  r = select(second, tv, r);
  best = select(second, fv, best);
  const auto third = less(fw, best);
  s = select(third, fnma(lu, rho, lu), s);
  r = select(third, lv * rho, r);
  // The face, when the foot of the perpendicular lies in it. NaN in `face` compares false.
  const F fs = face * fnma(cosine, dv, du), fr = face * fnma(cosine, du, dv);
  const auto inside = both(both(at_least(fs, zero), at_least(fr, zero)), at_most(fma(fs, lv, fr * lu), lu * lv));
  s = select(inside, fs, s);
  r = select(inside, fr, r);
  Edges e;
  e.dx = fnma(r, vx, fnma(s, ux, qx));
  e.dy = fnma(r, vy, fnma(s, uy, qy));
  e.dz = fnma(r, vz, fnma(s, uz, qz));
  e.d2 = fma(e.dx, e.dx, fma(e.dy, e.dy, e.dz * e.dz));
  return e;
}

inline float smallest_of(const float* v, int count) {
  F lowest = F::all(3e38F);
  for (int i = 0; i < count; i += kF) lowest = min(lowest, F::load(v + i));
  return smallest(lowest);
}

void filter(FilterTask& task) {
  const int padded = (task.count + kF - 1) / kF * kF;
  float* const turned = task.scratch;  // the records, field by field in vectors: turned once for all children
  for (int i = 0; i < padded; i += kF) {
    const Lanes t = load_records(task.records, task.ids + i);
    for (int f = 0; f < 16; ++f) t.f[f].store(turned + 16 * i + kF * f);
  }
  float* const sd = turned + 16 * padded;
  float* const sx = sd + padded;
  float* const sy = sx + padded;
  float* const sz = sy + padded;
  const F tiny = F::all(1e-30F);
  const bool single = task.half[0] == 0 && task.half[1] == 0 && task.half[2] == 0;
  const float r2 = task.half[0] * task.half[0] + task.half[1] * task.half[1] + task.half[2] * task.half[2];
  for (int k = 0; k < 8; ++k) {
    task.out_count[k] = 0;
    if ((task.wanted >> k & 1U) == 0) continue;
    const F px = F::all(task.centre[k][0]), py = F::all(task.centre[k][1]), pz = F::all(task.centre[k][2]);
    float nearest = 3e38F;
    float direction[3] = {0, 0, 0};
    std::uint32_t* const out = task.out[k];
    int kept = 0;
    if (single) {
      F lowest = F::all(3e38F);
      for (int i = 0; i < padded; i += kF) {
        const Turned t{turned + 16 * i};
        const Edges e = nearest_of(t, px, py, pz);
        const F d = root(max(e.d2, tiny));
        lowest = min(lowest, d + t.at(15));
        (d - t.at(15)).store(sd + i);
      }
      nearest = smallest(lowest) + task.margin;
      const F limit = F::all(nearest + task.margin);
      for (int i = 0; i < padded; i += kF) {
        const auto keep = at_most(F::load(sd + i), limit);
        kept += compress(out + kept, task.ids + i, bits(keep) & tail(task.count - i));
      }
    } else {
      // Distances and directions of all, and which lane had the smallest.
      F lowest = F::all(3e38F), lx = tiny, ly = tiny, lz = tiny;
      for (int i = 0; i < padded; i += kF) {
        const Turned t{turned + 16 * i};
        const Edges e = nearest_of(t, px, py, pz);
        const F d2 = max(e.d2, tiny);
        const F inverse = inverse_root(d2);
        const F d = d2 * inverse;
        const F gx = e.dx * inverse, gy = e.dy * inverse, gz = e.dz * inverse;
        const F upper = d + t.at(15);
        const auto lower = less(upper, lowest);
        lowest = select(lower, upper, lowest);
        lx = select(lower, gx, lx);
        ly = select(lower, gy, ly);
        lz = select(lower, gz, lz);
        (d - t.at(15)).store(sd + i);
        gx.store(sx + i);
        gy.store(sy + i);
        gz.store(sz + i);
      }
      float v[kF], x[kF], y[kF], z[kF];
      lowest.store(v);
      lx.store(x);
      ly.store(y);
      lz.store(z);
      for (int l = 0; l < kF; ++l) {
        if (v[l] < nearest) {
          nearest = v[l];
          direction[0] = x[l];
          direction[1] = y[l];
          direction[2] = z[l];
        }
      }
      nearest += task.margin;
      // d(x,T) >= d(c,T) + g.(x-c), as T is convex; d(x,T*) <= m + g*.(x-c) + |x-c|^2/2m.
      const float r = __builtin_sqrtf(r2);
      const F base = F::all(nearest + task.margin + r * 4e-6F);
      const F curve = F::all(nearest > 0 ? r2 / (2 * nearest) : 3e38F), most = F::all(2 * r);
      const F limit = F::all(task.reach + r * 1.00001F + 2 * task.margin);
      const F hx = F::all(task.half[0]), hy = F::all(task.half[1]), hz = F::all(task.half[2]);
      const F ox = F::all(direction[0]), oy = F::all(direction[1]), oz = F::all(direction[2]);
      for (int i = 0; i < padded; i += kF) {
        const F turn = fma(hx, absolute(F::load(sx + i) - ox),
                           fma(hy, absolute(F::load(sy + i) - oy), fma(hz, absolute(F::load(sz + i) - oz), curve)));
        const auto keep = at_most(F::load(sd + i), min(base + min(turn, most), limit));
        kept += compress(out + kept, task.ids + i, bits(keep) & tail(task.count - i));
      }
    }
    task.out_count[k] = kept;
    task.lowest[k] = smallest_of(sd, padded) - task.margin;
  }
}

// --- double precision ------------------------------------------------------------------------------------------------

inline D dot3(D ax, D ay, D az, D bx, D by, D bz) {
  return (ax * bx + ay * by) + az * bz;
}

// Squared distance of p to the triangle in f[0..15] (the fields of ExactTriangle in order).
inline D measure(const D* f, D px, D py, D pz) {
  const D zero = D::all(0), one = D::all(1);
  const D pax = px - f[0], pay = py - f[1], paz = pz - f[2];
  const D pbx = px - f[3], pby = py - f[4], pbz = pz - f[5];
  const D abx = f[3] - f[0], aby = f[4] - f[1], abz = f[5] - f[2];
  const D acx = f[6] - f[0], acy = f[7] - f[1], acz = f[8] - f[2];
  const D bcx = f[6] - f[3], bcy = f[7] - f[4], bcz = f[8] - f[5];
  const D tab = min(max(dot3(pax, pay, paz, abx, aby, abz) * f[12], zero), one);
  const D x0 = pax - tab * abx, y0 = pay - tab * aby, z0 = paz - tab * abz;
  const D tac = min(max(dot3(pax, pay, paz, acx, acy, acz) * f[13], zero), one);
  const D x1 = pax - tac * acx, y1 = pay - tac * acy, z1 = paz - tac * acz;
  const D sbc = dot3(pbx, pby, pbz, bcx, bcy, bcz) * f[14];
  const D tbc = min(max(sbc, zero), one);
  const D x2 = pbx - tbc * bcx, y2 = pby - tbc * bcy, z2 = pbz - tbc * bcz;
  const D edges = min(min(dot3(x0, y0, z0, x0, y0, z0), dot3(x1, y1, z1, x1, y1, z1)), dot3(x2, y2, z2, x2, y2, z2));
  // Inside when the point is to the left of AB, BC and CA, seen against the normal.
  const D nx = f[9], ny = f[10], nz = f[11];
  const auto left = [&](D ex, D ey, D ez, D qx, D qy, D qz) {
    return dot3(ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex, qx, qy, qz);
  };
  const auto inside =
      both(both(at_least(left(abx, aby, abz, pax, pay, paz), zero), at_least(zero, left(acx, acy, acz, pax, pay, paz))),
           at_least(left(bcx, bcy, bcz, pbx, pby, pbz), zero));
  // The height over the plane, measured from the foot on the longest edge: exact to rounding even for slivers.
  const D h = dot3(pbx - sbc * bcx, pby - sbc * bcy, pbz - sbc * bcz, nx, ny, nz);
  return select(inside, min(h * h, edges), edges);
}

void measure_voxels(const ExactTriangle* exact, const std::uint32_t* ids, const std::uint32_t* voxels, int count,
                    const double origin[3], const double step[3], double* d2) {
  const D ox = D::all(origin[0]), oy = D::all(origin[1]), oz = D::all(origin[2]);
  const D sx = D::all(step[0]), sy = D::all(step[1]), sz = D::all(step[2]);
  for (int i = 0; i < count; i += kD) {
    D f[16];
    load_exact(exact, ids + i, f);
    double x[kD], y[kD], z[kD];
    for (int l = 0; l < kD; ++l) {
      x[l] = static_cast<double>(voxels[i + l] & 15U);
      y[l] = static_cast<double>(voxels[i + l] >> 4 & 15U);
      z[l] = static_cast<double>(voxels[i + l] >> 8);
    }
    measure(f, ox + D::load(x) * sx, oy + D::load(y) * sy, oz + D::load(z) * sz).store(d2 + i);
  }
}

void measure_block(const ExactTriangle* exact, const std::uint32_t* ids, int count, const double* px, const double* py,
                   const double* pz, int points, double* best_d2, std::uint32_t* best_id) {
  for (int t = 0; t < count; ++t) {
    const auto* e = reinterpret_cast<const double*>(exact + ids[t]);
    D f[16];
    for (int i = 0; i < 15; ++i) f[i] = D::all(e[i]);
    for (int i = 0; i < points; i += kD) {
      double d2[kD];
      measure(f, D::load(px + i), D::load(py + i), D::load(pz + i)).store(d2);
      for (int l = 0; l < kD; ++l) {
        const bool nearer = d2[l] < best_d2[i + l] || (d2[l] == best_d2[i + l] && ids[t] < best_id[i + l]);
        best_d2[i + l] = nearer ? d2[l] : best_d2[i + l];
        best_id[i + l] = nearer ? ids[t] : best_id[i + l];
      }
    }
  }
}

inline double measure_one(const ExactTriangle* exact, std::uint32_t id, const double p[3]) {
  D f[16];
  const auto* e = reinterpret_cast<const double*>(exact + id);
  for (int i = 0; i < 15; ++i) f[i] = D::all(e[i]);
  double d2[kD];
  measure(f, D::all(p[0]), D::all(p[1]), D::all(p[2])).store(d2);
  return d2[0];
}

// --- the tree --------------------------------------------------------------------------------------------------------

// Distances of a point to sixteen boxes.
inline void box_distances(const BoxGroup& g, F px, F py, F pz, float* d) {
  const F zero = F::all(0);
  for (int i = 0; i < 16; i += kF) {
    const F x = max(max(F::load(g.lo[0] + i) - px, px - F::load(g.hi[0] + i)), zero);
    const F y = max(max(F::load(g.lo[1] + i) - py, py - F::load(g.hi[1] + i)), zero);
    const F z = max(max(F::load(g.lo[2] + i) - pz, pz - F::load(g.hi[2] + i)), zero);
    root(fma(x, x, fma(y, y, z * z))).store(d + i);
  }
}

Nearest closest(const TreeView& tree, const double p[3], std::uint32_t hint, double limit_d2) {
  struct Entry {
    float d;
    std::uint32_t item;
    int level;  // 0: item is a pack
  };
  Entry stack[16 * (TreeView::kMaxLevels + 1)];
  int top = 0;
  const float q[3] = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
  const F px = F::all(q[0]), py = F::all(q[1]), pz = F::all(q[2]);
  // A far point rounds more than the tree does.
  const float size =
      __builtin_fmaxf(__builtin_fmaxf(__builtin_fabsf(q[0]), __builtin_fabsf(q[1])), __builtin_fabsf(q[2]));
  const float margin = tree.margin + size * 2e-6F;
  Nearest best{limit_d2, kNone};
  float reach = 0;
  const auto set_reach = [&] { reach = static_cast<float>(__builtin_sqrt(best.d2)) * 1.000001F + margin; };
  set_reach();
  const auto measure_candidate = [&](std::uint32_t id) {
    const double d2 = measure_one(tree.exact, id, p);
    if (d2 < best.d2 || (d2 == best.d2 && id < best.triangle)) {
      best = {d2, id};
      set_reach();
    }
  };
  if (hint < tree.triangles) measure_candidate(hint);
  stack[top++] = {0, 0, tree.levels};
  while (top > 0) {
    const Entry e = stack[--top];
    if (e.d > reach) continue;
    if (e.level == 0) {
      for (int i = 0; i < 16; i += kF) {
        std::uint32_t ids[kF];
        for (int l = 0; l < kF; ++l) ids[l] = e.item * 16 + static_cast<std::uint32_t>(i + l);
        const Lanes t = load_records(tree.records, ids);
        const Edges n = nearest_of(t, px, py, pz);
        const F d = root(n.d2) - t.at(15);
        float distance[kF];
        d.store(distance);
        unsigned near = bits(at_most(d, F::all(reach)));
        // The nearest first, so that the others need not be measured.
        while (near != 0) {
          int first = __builtin_ctz(near);
          for (unsigned rest = near & (near - 1); rest != 0; rest &= rest - 1) {
            const int l = __builtin_ctz(rest);
            if (distance[l] < distance[first]) first = l;
          }
          near &= ~(1U << first);
          if (distance[first] > reach) break;
          if (ids[first] < tree.triangles) measure_candidate(ids[first]);
        }
      }
      continue;
    }
    float d[16];
    box_distances(tree.boxes[e.level - 1][e.item], px, py, pz, d);
    const int begin = top;
    for (std::uint32_t i = 0; i < 16; ++i) {
      if (d[i] > reach) continue;
      // Insertion: farther ones lie deeper.
      int at = top++;
      while (at > begin && stack[at - 1].d < d[i]) {
        stack[at] = stack[at - 1];
        --at;
      }
      stack[at] = {d[i], e.item * 16 + i, e.level - 1};
    }
  }
  return best;
}

int collect(const TreeView& tree, const float centre[3], const float half[3], const Pivot& pivot, float reach,
            float margin, std::uint32_t* packs) {
  struct Entry {
    std::uint32_t group;
    int level;
  };
  Entry stack[16 * (TreeView::kMaxLevels + 1)];
  int top = 0, count = 0;
  const float r2 = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
  const float r = __builtin_sqrtf(r2);
  const float m = pivot.distance + margin;
  const F px = F::all(centre[0]), py = F::all(centre[1]), pz = F::all(centre[2]);
  const F base = F::all(m + margin + r * 4e-6F + m * 1e-6F);
  const F curve = F::all(m > 0 ? r2 / (2 * m) : 3e38F), most = F::all(2 * r);
  const F hx = F::all(half[0]), hy = F::all(half[1]), hz = F::all(half[2]);
  const F ox = F::all(pivot.direction[0]), oy = F::all(pivot.direction[1]), oz = F::all(pivot.direction[2]);
  const F zero = F::all(0), tiny = F::all(1e-30F), limit = F::all(reach + r * 1.00001F + 2 * margin);
  stack[top++] = {0, tree.levels - 1};
  while (top > 0) {
    const Entry e = stack[--top];
    const BoxGroup& g = tree.boxes[e.level][e.group];
    unsigned keep = 0;
    for (int i = 0; i < 16; i += kF) {
      const F lx = F::load(g.lo[0] + i), ly = F::load(g.lo[1] + i), lz = F::load(g.lo[2] + i);
      const F dx = px - min(max(px, lx), F::load(g.hi[0] + i));
      const F dy = py - min(max(py, ly), F::load(g.hi[1] + i));
      const F dz = pz - min(max(pz, lz), F::load(g.hi[2] + i));
      const F d2 = max(fma(dx, dx, fma(dy, dy, dz * dz)), tiny);
      const F inverse = inverse_root(d2);
      const F turn =
          fma(hx, absolute(fma(dx, inverse, zero - ox)),
              fma(hy, absolute(fma(dy, inverse, zero - oy)), fma(hz, absolute(fma(dz, inverse, zero - oz)), curve)));
      // Empty boxes have lo > hi far away: their distance is huge.
      keep |= bits(at_most(d2 * inverse, min(base + min(turn, most), limit))) << i;
    }
    for (unsigned rest = keep; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::uint32_t>(__builtin_ctz(rest));
      if (e.level == 0) {
        packs[count++] = e.group * 16 + i;
      } else {
        stack[top++] = {e.group * 16 + i, e.level - 1};
      }
    }
  }
  return count;
}

}  // namespace
