// Included once by each dynamics_<isa>.cpp, with OSTEO_ISA the name of its namespace. No library that inlines may be
// included here: the compiler's flags differ between those files.
#include <cmath>

#include "dynamics_kernel.h"
#include "voxel_split.h"

namespace osteo::inline simulation::tissue::OSTEO_ISA {
namespace {

constexpr std::size_t kLanes = 16;

// Corners of sixteen elements side by side; lanes beyond the end repeat the last element and are not written.
template <class Real, int N>
struct Corners {
  alignas(64) Real x[N][kLanes], y[N][kLanes], z[N][kLanes];
  alignas(64) Real gx[N][kLanes], gy[N][kLanes], gz[N][kLanes];

  void gather(const Arrays<Real>& a, const std::uint32_t* node, std::size_t count, std::size_t first,
              std::size_t lanes) {
    for (int n = 0; n < N; ++n) {
      const std::uint32_t* const at = node + static_cast<std::size_t>(n) * count + first;
      if (lanes == kLanes) {
        for (std::size_t l = 0; l < kLanes; ++l) {
          x[n][l] = a.x[at[l]];
          y[n][l] = a.y[at[l]];
          z[n][l] = a.z[at[l]];
        }
      } else {
        for (std::size_t l = 0; l < kLanes; ++l) {
          const std::uint32_t p = at[l < lanes ? l : lanes - 1];
          x[n][l] = a.x[p];
          y[n][l] = a.y[p];
          z[n][l] = a.z[p];
        }
      }
    }
  }
  void clear() {
    for (int n = 0; n < N; ++n)
      for (std::size_t l = 0; l < kLanes; ++l) gx[n][l] = gy[n][l] = gz[n][l] = 0;
  }
  // Forces: the gradients times what each element pushes with.
  void scatter(const Arrays<Real>& a, const std::uint32_t* node, std::size_t count, std::size_t first,
               std::size_t lanes) {
    for (int n = 0; n < N; ++n) {
      const std::uint32_t* const at = node + static_cast<std::size_t>(n) * count + first;
      for (std::size_t l = 0; l < lanes; ++l) {
        a.fx[at[l]] += gx[n][l];
        a.fy[at[l]] += gy[n][l];
        a.fz[at[l]] += gz[n][l];
      }
    }
  }
};

template <class Real, int N, int T>
void add_volumes(Corners<Real, N>& c, const int (&tets)[T][4], Real* volume) {
  for (std::size_t l = 0; l < kLanes; ++l) volume[l] = 0;
  for (const auto& t : tets) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Real ox = c.x[t[0]][l], oy = c.y[t[0]][l], oz = c.z[t[0]][l];
      const Real ax = c.x[t[1]][l] - ox, ay = c.y[t[1]][l] - oy, az = c.z[t[1]][l] - oz;
      const Real bx = c.x[t[2]][l] - ox, by = c.y[t[2]][l] - oy, bz = c.z[t[2]][l] - oz;
      const Real dx = c.x[t[3]][l] - ox, dy = c.y[t[3]][l] - oy, dz = c.z[t[3]][l] - oz;
      constexpr Real kSixth = Real(1) / Real(6);
      const Real px = (by * dz - bz * dy) * kSixth, py = (bz * dx - bx * dz) * kSixth,
                 pz = (bx * dy - by * dx) * kSixth;
      const Real qx = (dy * az - dz * ay) * kSixth, qy = (dz * ax - dx * az) * kSixth,
                 qz = (dx * ay - dy * ax) * kSixth;
      const Real rx = (ay * bz - az * by) * kSixth, ry = (az * bx - ax * bz) * kSixth,
                 rz = (ax * by - ay * bx) * kSixth;
      volume[l] += ax * px + ay * py + az * pz;
      c.gx[t[1]][l] += px;
      c.gy[t[1]][l] += py;
      c.gz[t[1]][l] += pz;
      c.gx[t[2]][l] += qx;
      c.gy[t[2]][l] += qy;
      c.gz[t[2]][l] += qz;
      c.gx[t[3]][l] += rx;
      c.gy[t[3]][l] += ry;
      c.gz[t[3]][l] += rz;
      c.gx[t[0]][l] -= px + qx + rx;
      c.gy[t[0]][l] -= py + qy + ry;
      c.gz[t[0]][l] -= pz + qz + rz;
    }
  }
}

template <class Real, int N, int T>
void volumes(const Arrays<Real>& a, const int (&tets)[T][4], std::size_t count, const std::uint32_t* node,
             const Real* k, const Real* inverse) {
  Corners<Real, N> c;
  alignas(64) Real push[kLanes];
  for (std::size_t e = 0; e < count; e += kLanes) {
    const std::size_t lanes = count - e < kLanes ? count - e : kLanes;
    c.gather(a, node, count, e, lanes);
    c.clear();
    add_volumes(c, tets, push);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t i = e + (l < lanes ? l : lanes - 1);
      push[l] = -k[i] * (push[l] * inverse[i] - 1);
    }
    for (int n = 0; n < N; ++n) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        c.gx[n][l] *= push[l];
        c.gy[n][l] *= push[l];
        c.gz[n][l] *= push[l];
      }
    }
    c.scatter(a, node, count, e, lanes);
  }
}

template <class Real>
void edges(const Arrays<Real>& a) {
  Corners<Real, 2> c;
  for (std::size_t e = 0; e < a.edges; e += kLanes) {
    const std::size_t lanes = a.edges - e < kLanes ? a.edges - e : kLanes;
    c.gather(a, a.edge, a.edges, e, lanes);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t i = e + (l < lanes ? l : lanes - 1);
      const Real dx = c.x[1][l] - c.x[0][l], dy = c.y[1][l] - c.y[0][l], dz = c.z[1][l] - c.z[0][l];
      const Real square = dx * dx + dy * dy + dz * dz;
      // Of no length: no direction, no force.
      const Real f = a.edge_k[i] * (a.edge_inverse[i] - (square > 0 ? 1 / std::sqrt(square) : a.edge_inverse[i]));
      c.gx[0][l] = f * dx;
      c.gy[0][l] = f * dy;
      c.gz[0][l] = f * dz;
    }
    for (std::size_t l = 0; l < lanes; ++l) {
      const std::uint32_t p = a.edge[e + l], q = a.edge[a.edges + e + l];
      a.fx[p] += c.gx[0][l];
      a.fy[p] += c.gy[0][l];
      a.fz[p] += c.gz[0][l];
      a.fx[q] -= c.gx[0][l];
      a.fy[q] -= c.gy[0][l];
      a.fz[q] -= c.gz[0][l];
    }
  }
}

template <class Real>
void faces(const Arrays<Real>& a) {
  Corners<Real, 3> c;
  for (std::size_t e = 0; e < a.faces; e += kLanes) {
    const std::size_t lanes = a.faces - e < kLanes ? a.faces - e : kLanes;
    c.gather(a, a.face, a.faces, e, lanes);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t i = e + (l < lanes ? l : lanes - 1);
      const Real ux = c.x[1][l] - c.x[0][l], uy = c.y[1][l] - c.y[0][l], uz = c.z[1][l] - c.z[0][l];
      const Real vx = c.x[2][l] - c.x[0][l], vy = c.y[2][l] - c.y[0][l], vz = c.z[2][l] - c.z[0][l];
      const Real nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      const Real twice = std::sqrt(nx * nx + ny * ny + nz * nz);
      const Real push =
          twice > 0 ? -a.face_k[i] * (Real(0.5) * twice * a.face_inverse[i] - 1) * (Real(0.5) / twice) : 0;
      const Real wx = vx - ux, wy = vy - uy, wz = vz - uz;  // opposite the first corner
      const Real px = push * (ny * wz - nz * wy), py = push * (nz * wx - nx * wz), pz = push * (nx * wy - ny * wx);
      const Real qx = push * (nz * vy - ny * vz), qy = push * (nx * vz - nz * vx), qz = push * (ny * vx - nx * vy);
      c.gx[0][l] = px;
      c.gy[0][l] = py;
      c.gz[0][l] = pz;
      c.gx[1][l] = qx;
      c.gy[1][l] = qy;
      c.gz[1][l] = qz;
      c.gx[2][l] = -px - qx;
      c.gy[2][l] = -py - qy;
      c.gz[2][l] = -pz - qz;
    }
    c.scatter(a, a.face, a.faces, e, lanes);
  }
}

template <class Real>
void forces(const Arrays<Real>& a) {
  edges(a);
  faces(a);
  for (int s = 0; s < 2; ++s)
    volumes<Real, 8>(a, kVoxelSplit[s], a.voxels[s].count, a.voxels[s].node, a.voxels[s].k, a.voxels[s].inverse);
  constexpr int kOne[1][4] = {{0, 1, 2, 3}};
  volumes<Real, 4>(a, kOne, a.tets.count, a.tets.node, a.tets.k, a.tets.inverse);
}

}  // namespace

void forces_float(const Arrays<float>& a) {
  forces(a);
}
void forces_double(const Arrays<double>& a) {
  forces(a);
}

}  // namespace osteo::inline simulation::tissue::OSTEO_ISA
