// For VTK 9.4 and later, whose OpenGL functions come by GLAD instead of GLEW: the calls of GLEW's that this project makes. Nothing else finds this
// header; with an earlier VTK its own of the same name is read.
#pragma once
#include <vtk_glad.h>

inline int glewExperimental = 0;
/// Loads the functions of the current context. 0 on success, as GLEW's.
inline int glewInit() { return gladLoaderLoadGL() != 0 ? 0 : 1; }
