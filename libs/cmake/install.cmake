# cmake --install: programs, what they share, and the libraries for other projects (find_package(osteo)).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Components are what packages are made of (package.cmake): server, window, camera, dev.
if(OSTEO_PROGRAMS)
  install(TARGETS osteo RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT server)
  if(OSTEO_WINDOW)
    install(TARGETS osteo-rehearse osteo-edit osteo-console osteo-experiment RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT window)
    install(FILES apps/share/osteo.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT window)
    install(FILES apps/share/osteo.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT window)
    install(FILES apps/share/osteo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT window)
  endif()
  install(FILES apps/share/70-osteotome.rules DESTINATION lib/udev/rules.d COMPONENT server)
  install(FILES apps/share/osteo-receive.service apps/share/osteo-watch.service apps/share/osteo-watch-orthanc@.service DESTINATION lib/systemd/system COMPONENT server)
  install(DIRECTORY pipelines/ DESTINATION ${CMAKE_INSTALL_DATADIR}/osteo/pipelines COMPONENT server)
  install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT server)
  install(FILES README.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT server)
  # Man pages, completion and modules of 3D Slicer are made from the declarations, by the program that is installed.
  install(CODE "
  execute_process(COMMAND \"$<TARGET_FILE:osteo>\" docs --shared \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}\" --quiet
      COMMAND_ERROR_IS_FATAL ANY)
  message(STATUS \"Man pages, completion and modules of 3D Slicer are in \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}\")" COMPONENT server)
endif()

# The window's own library stays inside; a shared one is needed by the programs.
set(OSTEO_EXPORTED ${OSTEO_LAYERS})
list(REMOVE_ITEM OSTEO_EXPORTED window)
set(shared_component server)
if(NOT OSTEO_PROGRAMS)
  set(shared_component dev)
endif()
foreach(name ${OSTEO_EXPORTED})
  if(NOT TARGET osteo_${name})
    list(REMOVE_ITEM OSTEO_EXPORTED ${name})
    continue()
  endif()
  set_target_properties(osteo_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS osteo_${name} EXPORT osteoTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/osteo COMPONENT dev
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/osteo COMPONENT ${shared_component} NAMELINK_COMPONENT dev)
  install(DIRECTORY libs/${OSTEO_LAYER_${name}_AREA}/${name}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev FILES_MATCHING PATTERN "*.h")
endforeach()
if(OSTEO_LIBRARY_KIND STREQUAL SHARED AND TARGET osteo_window)
  install(TARGETS osteo_window LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/osteo COMPONENT window NAMELINK_SKIP)
endif()
install(TARGETS osteo_camera_module LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/osteo COMPONENT camera)
foreach(name ${OSTEO_AREAS})
  set_target_properties(osteo_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS osteo_${name} EXPORT osteoTargets COMPONENT dev)
endforeach()
set(config ${CMAKE_INSTALL_LIBDIR}/cmake/osteo)
install(EXPORT osteoTargets NAMESPACE osteo:: DESTINATION ${config} COMPONENT dev)
export(EXPORT osteoTargets NAMESPACE osteo:: FILE ${PROJECT_BINARY_DIR}/osteoTargets.cmake)  # for OSTEO_BUILT
configure_package_config_file(libs/cmake/osteoConfig.cmake.in ${PROJECT_BINARY_DIR}/osteoConfig.cmake INSTALL_DESTINATION ${config})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/osteoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/osteoConfig.cmake ${PROJECT_BINARY_DIR}/osteoConfigVersion.cmake libs/cmake/dependencies.cmake
  DESTINATION ${config} COMPONENT dev)
