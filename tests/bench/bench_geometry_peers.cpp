#include "bench_geometry_peers.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <embree3/rtcore.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <vtkCellArray.h>
#include <vtkImplicitPolyDataDistance.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>

#include <cmath>
#include <nanoflann.hpp>
#include <set>

namespace osteo::bench {
namespace {

// C. Ericson's closest point in single precision, as an Embree user would write it.
float squared_distance(const float* p, const float* a, const float* b, const float* c) {
  float ab[3], ac[3], ap[3];
  const auto dot3 = [](const float* x, const float* y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
  for (int i = 0; i < 3; ++i) ab[i] = b[i] - a[i], ac[i] = c[i] - a[i], ap[i] = p[i] - a[i];
  const auto from = [&](float s, float t) {
    float sum = 0;
    for (int i = 0; i < 3; ++i) {
      const float d = ap[i] - s * ab[i] - t * ac[i];
      sum += d * d;
    }
    return sum;
  };
  const float d1 = dot3(ab, ap), d2 = dot3(ac, ap);
  if (d1 <= 0 && d2 <= 0) return from(0, 0);
  float bp[3], cp[3];
  for (int i = 0; i < 3; ++i) bp[i] = p[i] - b[i], cp[i] = p[i] - c[i];
  const float d3 = dot3(ab, bp), d4 = dot3(ac, bp);
  if (d3 >= 0 && d4 <= d3) return from(1, 0);
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return from(d1 / (d1 - d3), 0);
  const float d5 = dot3(ab, cp), d6 = dot3(ac, cp);
  if (d6 >= 0 && d5 <= d6) return from(0, 1);
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return from(0, d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return from(1 - w, w);
  }
  const float k = 1 / (va + vb + vc);
  return from(vb * k, vc * k);
}

struct EmbreeQuery {
  const float* vertices;
  const std::uint32_t* triangles;
  float best2;
  std::uint32_t triangle;
};

bool on_triangle(RTCPointQueryFunctionArguments* args) {
  auto* const q = static_cast<EmbreeQuery*>(args->userPtr);
  const std::uint32_t* t = q->triangles + 3 * static_cast<std::size_t>(args->primID);
  const float p[3] = {args->query->x, args->query->y, args->query->z};
  const float d2 = squared_distance(p, q->vertices + 3 * t[0], q->vertices + 3 * t[1], q->vertices + 3 * t[2]);
  if (d2 >= q->best2) return false;
  q->best2 = d2;
  q->triangle = args->primID;
  args->query->radius = std::sqrt(d2);
  return true;
}

vtkSmartPointer<vtkPolyData> poly_of(const TriangleSoup& soup) {
  auto poly = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vec3 p : soup.points_mm) points->InsertNextPoint(p.x, p.y, p.z);
  vtkNew<vtkCellArray> cells;
  for (const auto& t : soup.triangles) {
    const vtkIdType ids[3] = {t[0], t[1], t[2]};
    cells->InsertNextCell(3, ids);
  }
  poly->SetPoints(points);
  poly->SetPolys(cells);
  return poly;
}

}  // namespace

std::vector<double> by_embree(const TriangleSoup& soup, std::span<const Vec3> points) {
  const RTCDevice device = rtcNewDevice("threads=1");
  const RTCScene scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const v = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, soup.points_mm.size()));
  auto* const t = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, soup.triangles.size()));
  for (std::size_t i = 0; i < soup.points_mm.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) v[3 * i + a] = static_cast<float>(soup.points_mm[i][a]);
  }
  for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) t[3 * i + a] = soup.triangles[i][a];
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  std::vector<double> d;
  d.reserve(points.size());
  std::uint32_t last = 0;
  for (const Vec3 x : points) {
    RTCPointQuery query{static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z), 0, 0};
    const float p[3] = {query.x, query.y, query.z};
    const std::uint32_t* h = t + 3 * static_cast<std::size_t>(last);
    EmbreeQuery state{v, t, squared_distance(p, v + 3 * h[0], v + 3 * h[1], v + 3 * h[2]), last};
    query.radius = std::sqrt(state.best2);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &query, &context, on_triangle, &state);
    last = state.triangle;
    d.push_back(std::sqrt(static_cast<double>(state.best2)));
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return d;
}

std::vector<double> by_cgal(const TriangleSoup& soup, std::span<const Vec3> points) {
  using K = CGAL::Simple_cartesian<double>;
  using Iterator = std::vector<K::Triangle_3>::const_iterator;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, CGAL::AABB_triangle_primitive<K, Iterator>>>;
  std::vector<K::Triangle_3> triangles;
  const auto p = [&](std::uint32_t i) {
    return K::Point_3(soup.points_mm[i].x, soup.points_mm[i].y, soup.points_mm[i].z);
  };
  for (const auto& t : soup.triangles) {
    if (!K::Triangle_3(p(t[0]), p(t[1]), p(t[2])).is_degenerate()) triangles.emplace_back(p(t[0]), p(t[1]), p(t[2]));
  }
  Tree tree(triangles.begin(), triangles.end());
  tree.build();
  std::vector<double> d;
  d.reserve(points.size());
  Tree::Point_and_primitive_id hint(p(soup.triangles[0][0]), triangles.begin());
  for (const Vec3 x : points) {
    const K::Point_3 q(x.x, x.y, x.z);
    hint = tree.closest_point_and_primitive(q, hint);
    d.push_back(std::sqrt(CGAL::squared_distance(q, hint.first)));
  }
  return d;
}

std::vector<double> by_vtk_locator(const TriangleSoup& soup, std::span<const Vec3> points) {
  const auto poly = poly_of(soup);
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(poly);
  locator->BuildLocator();
  std::vector<double> d;
  for (const Vec3 x : points) {
    const double q[3] = {x.x, x.y, x.z};
    double at[3], d2 = 0;
    vtkIdType cell = 0;
    int sub = 0;
    locator->FindClosestPoint(q, at, cell, sub, d2);
    d.push_back(std::sqrt(d2));
  }
  return d;
}

std::vector<double> by_vtk_implicit(const TriangleSoup& soup, std::span<const Vec3> points) {
  vtkNew<vtkImplicitPolyDataDistance> distance;
  distance->SetInput(poly_of(soup));
  std::vector<double> d;
  for (const Vec3 x : points) {
    double q[3] = {x.x, x.y, x.z};
    d.push_back(distance->EvaluateFunction(q));
  }
  return d;
}

std::vector<float> by_openvdb(const TriangleSoup& soup, const Frame& frame, double inside_voxels,
                              double outside_voxels) {
  openvdb::initialize();
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  for (const Vec3 p : soup.points_mm) {
    const Vec3 i = frame.index_from_world(p);
    points.emplace_back(static_cast<float>(i.x), static_cast<float>(i.y), static_cast<float>(i.z));
  }
  for (const auto& t : soup.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points, triangles);
  const auto inside = inside_voxels < 0 ? std::numeric_limits<float>::max() : static_cast<float>(inside_voxels);
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      mesh, *openvdb::math::Transform::createLinearTransform(1.0), static_cast<float>(outside_voxels), inside);
  std::vector<float> d(frame.voxel_count(), std::numeric_limits<float>::quiet_NaN());
  for (auto v = grid->cbeginValueOn(); v; ++v) {
    const auto box = v.getBoundingBox();
    for (auto c = box.begin(); c; ++c) {
      const auto at = *c;
      if (at.x() < 0 || at.y() < 0 || at.z() < 0 || at.x() >= frame.dims[0] || at.y() >= frame.dims[1] ||
          at.z() >= frame.dims[2])
        continue;
      d[(static_cast<std::size_t>(at.z()) * frame.dims[1] + at.y()) * frame.dims[0] + at.x()] = *v;
    }
  }
  return d;
}

struct NearestNeighbours::Impl {
  std::vector<Vec3> points;
  std::vector<double> arcs;
  struct Adaptor {
    const std::vector<Vec3>* points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points->size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t a) const { return (*points)[i][a]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  } adaptor{&points};
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3, std::uint32_t>;
  std::unique_ptr<Tree> tree;
};

NearestNeighbours::NearestNeighbours(std::span<const Vec3> points) : impl_(new Impl) {
  impl_->points.assign(points.begin(), points.end());
  double arc = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) arc += length(points[i] - points[i - 1]);
    impl_->arcs.push_back(arc);
  }
  impl_->tree = std::make_unique<Impl::Tree>(3, impl_->adaptor);
}
NearestNeighbours::~NearestNeighbours() {
  delete impl_;
}

CurvePoint NearestNeighbours::find(Vec3 p, double arc, double penalty, int n) const {
  std::uint32_t ids[1000];
  double d2[1000];
  const double q[3] = {p.x, p.y, p.z};
  const std::size_t found = impl_->tree->knnSearch(q, static_cast<std::size_t>(n), ids, d2);
  std::set<std::uint32_t> segments;
  for (std::size_t i = 0; i < found; ++i) {
    if (ids[i] > 0) segments.insert(ids[i] - 1);
    if (ids[i] + 1 < impl_->points.size()) segments.insert(ids[i]);
  }
  CurvePoint best;
  best.score_mm = 1e300;
  for (const std::uint32_t s : segments) {
    const Vec3 a = impl_->points[s], e = impl_->points[s + 1] - a;
    const double l2 = dot(e, e);
    const double t = l2 > 0 ? std::clamp(dot(p - a, e) / l2, 0.0, 1.0) : 0;
    CurvePoint c;
    c.segment = s;
    c.t = t;
    c.point_mm = a + e * t;
    c.distance_mm = length(p - c.point_mm);
    c.arc_mm = impl_->arcs[s] + t * (impl_->arcs[s + 1] - impl_->arcs[s]);
    c.score_mm = c.distance_mm + penalty * std::abs(c.arc_mm - arc);
    if (c.score_mm < best.score_mm) best = c;
  }
  return best;
}

}  // namespace osteo::bench
