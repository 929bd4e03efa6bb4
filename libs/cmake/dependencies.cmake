# Everything from outside, found once for the whole tree.

find_package(nlohmann_json REQUIRED)
find_package(TBB REQUIRED)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(VTK 9.1 REQUIRED COMPONENTS CommonCore CommonTransforms CommonDataModel CommonExecutionModel CommonMath CommonSystem
  FiltersCore FiltersSources FiltersGeneral IOImage IOXML IOPLY IOGeometry IOCore CommonMisc ImagingCore RenderingCore RenderingOpenGL2
  RenderingFreeType metaio OPTIONAL_COMPONENTS glew glad)
# VTK 9.4 and later have glad instead of glew; libs/cmake/glad gives its calls the names of the other.
if(TARGET VTK::glad)
  set(OSTEO_VTK_GL VTK::glad)
else()
  set(OSTEO_VTK_GL VTK::glew)
endif()
find_package(DICOM REQUIRED)
find_package(GDCM REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(LIBARCHIVE REQUIRED IMPORTED_TARGET libarchive)
find_package(DCMTK CONFIG REQUIRED)
# HTJ2K (from 2.5 on) and JPEG XL in DICOM; a build does without, and says so where it meets one.
pkg_check_modules(OPENJPEG IMPORTED_TARGET QUIET libopenjp2>=2.5)
pkg_check_modules(JXL IMPORTED_TARGET QUIET libjxl)
pkg_check_modules(DEFLATE REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
# Debian has it for one process as well as for MPI, whose libraries would be loaded by every command.
pkg_check_modules(H5 IMPORTED_TARGET QUIET hdf5-serial)
if(NOT H5_FOUND)
  pkg_check_modules(H5 REQUIRED IMPORTED_TARGET hdf5)
endif()
pkg_check_modules(HIDAPI REQUIRED IMPORTED_TARGET hidapi-hidraw)
pkg_check_modules(PANGOCAIRO REQUIRED IMPORTED_TARGET pangocairo cairo-pdf)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(SODIUM REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(CURL REQUIRED IMPORTED_TARGET libcurl>=7.85)
list(APPEND CMAKE_MODULE_PATH ${CMAKE_SYSTEM_PREFIX_PATH})
# Debian keeps OpenVDB's find module below the library folder.
find_path(OPENVDB_CMAKE_DIR FindOpenVDB.cmake PATH_SUFFIXES cmake/OpenVDB lib/cmake/OpenVDB
  lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB PATHS /usr /usr/local REQUIRED)
list(APPEND CMAKE_MODULE_PATH ${OPENVDB_CMAKE_DIR})
find_package(OpenVDB REQUIRED)
find_package(OpenCV 4 REQUIRED COMPONENTS core imgproc photo video calib3d)
# Printed markers moved from the contributed modules into OpenCV's own with 4.7.
set(OSTEO_OPENCV_MARKERS opencv_objdetect)
if(OpenCV_VERSION VERSION_LESS 4.7)
  set(OSTEO_OPENCV_MARKERS opencv_aruco)
endif()
find_package(OpenCV 4 REQUIRED COMPONENTS ${OSTEO_OPENCV_MARKERS})
find_library(EGL_LIBRARY EGL REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(meshoptimizer REQUIRED)

# What a build takes in only where its options ask for it.
macro(osteo_optional_dependencies with_cgal with_ceres with_movie)
  if(${with_cgal})
    find_package(CGAL REQUIRED)
  endif()
  if(${with_ceres})
    find_package(Ceres REQUIRED)
  endif()
  if(${with_movie})
    pkg_check_modules(LIBAV REQUIRED IMPORTED_TARGET libavcodec libavformat libavutil libswscale)
  endif()
endmacro()
