# librelit, shared and static, and everything that is installed with it. Components: runtime (the command, the
# shared library), dev (header, static library, what finds them), bake.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(here ${CMAKE_CURRENT_LIST_DIR})
set(made ${PROJECT_BINARY_DIR}/install)

# Both are made of the same objects; nothing of a folder is compiled again.
set(objects)
foreach(folder container decoders gles player)
  list(APPEND objects $<TARGET_OBJECTS:relit_${folder}>)
endforeach()

if(RELIT_SHARED)
  add_library(relit_shared SHARED ${objects})
  set_target_properties(relit_shared PROPERTIES OUTPUT_NAME relit EXPORT_NAME relit LINKER_LANGUAGE CXX
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR} LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib
    LINK_DEPENDS ${here}/install/librelit.map)
  target_link_libraries(relit_shared PRIVATE PkgConfig::AVFORMAT PkgConfig::AVCODEC PkgConfig::AVUTIL
    PkgConfig::SWSCALE PkgConfig::ZSTD meshoptimizer::meshoptimizer Threads::Threads ${CMAKE_DL_LIBS})
  # What is not relit_* stays inside, templates of the standard library included.
  target_link_options(relit_shared PRIVATE -Wl,--no-undefined -Wl,--as-needed
    -Wl,--version-script=${here}/install/librelit.map)
  target_include_directories(relit_shared INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  install(TARGETS relit_shared EXPORT relitTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev)
endif()
if(RELIT_STATIC)
  add_library(relit_static STATIC ${objects})
  set_target_properties(relit_static PROPERTIES OUTPUT_NAME relit LINKER_LANGUAGE CXX
    ARCHIVE_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
  install(TARGETS relit_static ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endif()

install(TARGETS relit RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
install(FILES ${here}/relit.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/relit)
if(RELIT_SHARED)
  install(EXPORT relitTargets NAMESPACE relit:: DESTINATION ${package_dir} COMPONENT dev)
endif()
configure_package_config_file(${here}/install/relitConfig.cmake.in ${made}/relitConfig.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS CMAKE_INSTALL_LIBDIR CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file(${made}/relitConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${made}/relitConfig.cmake ${made}/relitConfigVersion.cmake DESTINATION ${package_dir} COMPONENT dev)

# From the .pc file to the prefix, so that the tree may be moved.
file(RELATIVE_PATH relit_prefix_from_pc /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
configure_file(${here}/install/relit.pc.in ${made}/relit.pc @ONLY)
install(FILES ${made}/relit.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)

install(FILES ${here}/man/relit.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
install(FILES ${here}/install/relit.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  COMPONENT runtime RENAME relit)
install(FILES ${here}/install/_relit DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT runtime)
install(DIRECTORY ${here}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev)

if(RELIT_BAKE)
  install(TARGETS relit-bake RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bake)
  install(FILES ${here}/man/relit-bake.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT bake)
  install(FILES ${here}/install/relit-bake.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    COMPONENT bake RENAME relit-bake)
  install(FILES ${here}/install/_relit-bake DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT bake)
endif()

set(packages runtime=relit dev=relit-dev)
if(RELIT_BAKE)
  list(APPEND packages bake=relit-bake)
endif()
foreach(package ${packages})
  string(REPLACE "=" ";" package ${package})
  list(GET package 0 component)
  list(GET package 1 name)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    COMPONENT ${component} RENAME copyright)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "relit")
set(CPACK_PACKAGE_CONTACT "The relit maintainers <maintainers@relit.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION video)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME relit)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "player of relightable animation
 The relit command, and librelit, which plays .relit files inside other
 programs: animated characters that take any light of the moment.")
# EGL and GLES are loaded at run time, so nothing links them.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "libegl1, libgles2, libegl-mesa0")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME relit-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "relit (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS
  "libavformat-dev, libavcodec-dev, libavutil-dev, libswscale-dev, libzstd-dev, libmeshoptimizer-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "player of relightable animation, for programs
 The header of librelit, the static library, what CMake and pkg-config need
 to find them, and examples.")
set(CPACK_DEBIAN_BAKE_PACKAGE_NAME relit-bake)
set(CPACK_COMPONENT_BAKE_DESCRIPTION "baker of relightable animation
 relit-bake traces how an animated glTF character answers to any light, and
 writes it as a .relit file for the relit player.")
include(CPack)
