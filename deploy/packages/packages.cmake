# Settings of cpack for an archive that runs in any folder, and for Debian packages. deploy/package
# runs cpack.
set(CPACK_PACKAGE_NAME oblique)
set(CPACK_PACKAGE_VENDOR oblique)
set(CPACK_PACKAGE_CONTACT "the oblique authors <maintainers@oblique.example>")
string(TOLOWER "${PROJECT_NAME}-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}"
       CPACK_PACKAGE_FILE_NAME)
set(CPACK_GENERATOR TGZ DEB)
set(CPACK_COMPONENTS_ALL ${parts})
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/packing/for_generator.cmake)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/packing/complete.cmake)
set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/packing/sort_archive.cmake)
set(CPACK_THREADS 0)

set(CPACK_ARCHIVE_COMPONENT_INSTALL OFF)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

include(${CMAKE_CURRENT_LIST_DIR}/descriptions.cmake)
# Multi-Arch: foreign allows packages of any architecture to depend on this package. cpack has no
# setting for this field, so the text of the field `Section` contains it as a second line.
set(foreign "science\nMulti-Arch: foreign")
set(scripts ${CMAKE_CURRENT_BINARY_DIR}/debian)
set(CPACK_DEBIAN_SERVER_PACKAGE_NAME oblique-server)
set(CPACK_DEBIAN_SERVER_PACKAGE_SECTION "${foreign}")
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS "systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS oblique)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
    ${scripts}/server/conffiles ${scripts}/server/postinst ${scripts}/server/prerm ${scripts}/server/postrm)
set(CPACK_DEBIAN_WORKER_PACKAGE_NAME oblique-worker)
set(CPACK_DEBIAN_WORKER_PACKAGE_SECTION "${foreign}")
set(CPACK_DEBIAN_WORKER_PACKAGE_CONTROL_EXTRA
    ${scripts}/worker/conffiles ${scripts}/worker/postinst ${scripts}/worker/prerm ${scripts}/worker/postrm)
set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME oblique)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION "${foreign}")
set(CPACK_DEBIAN_CLIENT_PACKAGE_RECOMMENDS
    "oblique-server (= ${PROJECT_VERSION}), oblique-worker (= ${PROJECT_VERSION}), gnuplot-nox")

set(CPACK_OBLIQUE_LIBDIR ${CMAKE_INSTALL_LIBDIR})
set(CPACK_OBLIQUE_MULTIARCH ${CMAKE_LIBRARY_ARCHITECTURE})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${package_of_library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION "libs\nMulti-Arch: same")
# packing/debian_library.cmake sets the dependencies, which cpack would otherwise determine.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS OFF)
# A program built with the library runs with the same and any later release of the same SONAME.
file(CONFIGURE OUTPUT debian/library/shlibs CONTENT "liboblique ${abi} ${package_of_library} (>= ${PROJECT_VERSION})\n")
file(CONFIGURE OUTPUT debian/library/triggers CONTENT "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${scripts}/library/shlibs ${scripts}/library/triggers)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME ${package_of_development})
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION "libdevel\nMulti-Arch: same")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${package_of_library} (= ${PROJECT_VERSION})")

if(OBLIQUE_PYTHON_MODULE)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME ${package_of_python})
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  # The Python version that the module was compiled for, in dh_python3's format.
  get_target_property(suffix oblique_python SUFFIX)
  string(REGEX REPLACE "^.*cpython-3([0-9]+).*$" "\\1" minor "${suffix}")
  math(EXPR next "${minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${minor}), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-pandas, python3-matplotlib")
  foreach(script postinst prerm)
    configure_file(debian/python.${script} debian/python/${script} @ONLY USE_SOURCE_PERMISSIONS)
  endforeach()
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${scripts}/python/postinst ${scripts}/python/prerm)
endif()

include(CPack)
