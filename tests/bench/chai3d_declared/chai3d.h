// Only what chai3d_renderer.cpp calls of CHAI3D 3.3, declared after its public headers, so that the adapter keeps compiling where CHAI3D is
// not. Nothing here does anything: there is nothing to link.
#pragma once
#include <memory>

namespace chai3d {

struct cVector3d {
  cVector3d(double x, double y, double z);
  double x() const;
  double y() const;
  double z() const;
};
struct cMaterial {
  void setStiffness(const double a_stiffness);
  void setUseHapticFriction(const bool a_useHapticFriction);
  void setStaticFriction(const double a_friction);
  void setDynamicFriction(const double a_friction);
  void setUseHapticShading(const bool a_useHapticShading);
};
class cGenericObject {
 public:
  virtual ~cGenericObject();
  virtual bool addChild(cGenericObject* a_object);
  virtual void computeGlobalPositions(const bool a_frameOnly = true);
  std::shared_ptr<cMaterial> m_material;
};
class cMesh : public cGenericObject {
 public:
  cMesh(std::shared_ptr<cMaterial> a_material = {});
  unsigned int newVertex(const double a_x, const double a_y, const double a_z);
  unsigned int newTriangle(const unsigned int a_index0, const unsigned int a_index1, const unsigned int a_index2);
  void computeAllNormals();
  virtual void createAABBCollisionDetector(const double a_radius);
};
class cWorld : public cGenericObject {
 public:
  cWorld();
};
class cAlgorithmFingerProxy {
 public:
  cAlgorithmFingerProxy();
  virtual ~cAlgorithmFingerProxy();
  void initialize(cWorld* a_world, const cVector3d& a_initialGlobalPosition);
  virtual cVector3d computeForces(const cVector3d& a_toolPos, const cVector3d& a_toolVel);
  void setProxyRadius(const double& a_radius);
  cVector3d getProxyGlobalPosition() const;
  int getNumCollisionEvents();
  void setEpsilonBaseValue(double a_value);
};

}  // namespace chai3d
