# Compiler settings and the one call that declares a library.

include(CheckLinkerFlag)
foreach(linker mold lld)
  check_linker_flag(CXX "-fuse-ld=${linker}" OSTEO_HAS_${linker})
  if(OSTEO_HAS_${linker})
    add_link_options(-fuse-ld=${linker})
    break()
  endif()
endforeach()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# -ffp-contract=off: the same bits with and without FMA, so that a session replays bit for bit on another machine.
add_compile_options(-Wall -Wextra -Wconversion -Wno-sign-conversion -Wshadow -ffp-contract=off -fdiagnostics-color=auto)
if(OSTEO_WERROR)
  add_compile_options(-Werror)
endif()
if(OSTEO_SANITIZE)
  add_compile_options(-fsanitize=${OSTEO_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${OSTEO_SANITIZE})
endif()

# One heavy translation unit (OpenVDB: 0.8 GiB) at a time.
set_property(GLOBAL PROPERTY JOB_POOLS heavy=1)

# osteo_library(name [HEAVY] [PUBLIC targets...] [PRIVATE targets...])
# Sources are libs/<name>/src/*.cpp, public headers libs/<name>/include.
function(osteo_library name)
  cmake_parse_arguments(ARG "HEAVY" "" "PUBLIC;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/libs/${name}/src/*.cpp)
  if(sources)
    add_library(osteo_${name} STATIC ${sources})
    target_include_directories(osteo_${name} PUBLIC ${CMAKE_SOURCE_DIR}/libs/${name}/include PRIVATE ${CMAKE_SOURCE_DIR}/libs/${name}/src)
    target_link_libraries(osteo_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  else()
    add_library(osteo_${name} INTERFACE)
    target_include_directories(osteo_${name} INTERFACE ${CMAKE_SOURCE_DIR}/libs/${name}/include)
    target_link_libraries(osteo_${name} INTERFACE ${ARG_PUBLIC})
  endif()
  add_library(osteo::${name} ALIAS osteo_${name})
  if(ARG_HEAVY)
    set_property(TARGET osteo_${name} PROPERTY JOB_POOL_COMPILE heavy)
  endif()
endfunction()
