# Installs the solver for use by other programs. Like Debian's packages, it has two parts: `library`
# to run programs, `development` to build them. find_package(oblique) provides oblique::solver in
# any prefix. `library` is optional, so that installing works when only the programs were built.
install(TARGETS oblique_shared EXPORT oblique-targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library OPTIONAL NAMELINK_COMPONENT development)
set(solver_folder ${PROJECT_SOURCE_DIR}/worker/solver/library)
get_target_property(solver_files oblique_shared BINARY_DIR)
install(DIRECTORY ${solver_files}/include/oblique DESTINATION include COMPONENT development)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/oblique)
install(EXPORT oblique-targets NAMESPACE oblique:: DESTINATION ${config_folder} COMPONENT development)
install(FILES ${solver_folder}/oblique-config.cmake ${solver_files}/oblique-config-version.cmake
        DESTINATION ${config_folder} COMPONENT development)

set(pkgconfig_folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
cmake_path(RELATIVE_PATH CMAKE_SOURCE_DIR BASE_DIRECTORY ${CMAKE_SOURCE_DIR}/${pkgconfig_folder}
           OUTPUT_VARIABLE OBLIQUE_PREFIX_FROM_PC)
configure_file(${solver_folder}/oblique.pc.in oblique.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/oblique.pc DESTINATION ${pkgconfig_folder} COMPONENT development)

# The example program for users of the library.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/tests/deploy/consumer
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/liboblique-dev/examples COMPONENT development)
