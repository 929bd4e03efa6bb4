// CHAI3D's finger proxy as a renderer of 'osteo ground-truth --program': see docs/validation/ground-truth.md. Built where
// CHAI3D 3.2 or 3.3 is found (cmake -DCHAI3D_ROOT=FOLDER), and elsewhere compiled against declarations of what it calls
// (chai3d_declared). Never run with CHAI3D.
//   chai3d_renderer [EPSILON_MM] [shaded]
#include <chai3d.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>

using namespace chai3d;

int main(int argc, char** argv) {
  double epsilon = 1e-4, stiffness = 1, friction = 0;
  bool shaded = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "shaded") == 0)
      shaded = true;
    else
      epsilon = std::stod(argv[i]);
  }
  // Both own what hangs on them.
  auto* const world = new cWorld();
  auto* const mesh = new cMesh();
  world->addChild(mesh);
  cAlgorithmFingerProxy proxy;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    double x = 0, y = 0, z = 0;
    if (what == "mesh") {
      std::ifstream off(line.substr(5));
      std::string head;
      unsigned points = 0, triangles = 0, other = 0, a = 0, b = 0, c = 0;
      off >> head >> points >> triangles >> other;
      for (unsigned i = 0; i < points; ++i) {
        off >> x >> y >> z;
        mesh->newVertex(x, y, z);
      }
      for (unsigned i = 0; i < triangles; ++i) {
        off >> other >> a >> b >> c;
        mesh->newTriangle(a, b, c);
      }
    } else if (what == "stiffness") {
      words >> stiffness;
    } else if (what == "friction") {
      words >> friction;
    } else if (what == "ready?") {
      mesh->computeAllNormals();
      mesh->createAABBCollisionDetector(0);
      mesh->m_material->setStiffness(stiffness);
      mesh->m_material->setUseHapticFriction(friction > 0);
      mesh->m_material->setStaticFriction(friction);
      mesh->m_material->setDynamicFriction(friction);
      mesh->m_material->setUseHapticShading(shaded);
      world->computeGlobalPositions(true);
      std::cout << "ready CHAI3D finger proxy" << std::endl;
    } else if (what == "place") {
      words >> x >> y >> z;
      proxy.initialize(world, cVector3d(x, y, z));
      proxy.setProxyRadius(0);
      proxy.setEpsilonBaseValue(epsilon);
    } else if (what == "at") {
      words >> x >> y >> z;
      const auto begin = std::chrono::steady_clock::now();
      const cVector3d force = proxy.computeForces(cVector3d(x, y, z), cVector3d(0, 0, 0));
      const double ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
      const cVector3d at = proxy.getProxyGlobalPosition();
      std::printf("force %.17g %.17g %.17g contact %d %.17g %.17g %.17g ns %.0f\n", force.x(), force.y(), force.z(),
                  proxy.getNumCollisionEvents() > 0 ? 1 : 0, at.x(), at.y(), at.z(), ns);
      std::fflush(stdout);
    }
  }
  delete world;
  return 0;
}
