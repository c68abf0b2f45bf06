# What cpack makes of the parts: an archive that runs wherever it is unpacked, and three Debian packages.
# deploy/package calls it.
set(CPACK_PACKAGE_NAME oblique)
set(CPACK_PACKAGE_VENDOR oblique)
set(CPACK_PACKAGE_CONTACT "the oblique authors <maintainers@oblique.example>")
string(TOLOWER "${PROJECT_NAME}-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}"
       CPACK_PACKAGE_FILE_NAME)
set(CPACK_GENERATOR TGZ DEB)
set(CPACK_COMPONENTS_ALL server worker client)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/for_generator.cmake)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/complete.cmake)
set(CPACK_THREADS 0)

set(CPACK_ARCHIVE_COMPONENT_INSTALL OFF)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(about
"oblique computes the oblique impact of a flexible robotic finger on rough
ground, for one point or for any number of them. A server hands the points of
studies to workers on any number of machines and keeps the results in an
SQLite database.")
set(CPACK_COMPONENT_SERVER_DESCRIPTION "server of parameter studies of an oblique impact
${about}
.
This is the server. Its systemd unit is installed and not started.")
set(CPACK_COMPONENT_WORKER_DESCRIPTION "worker that solves points of studies of an oblique impact
${about}
.
This is the worker. Its systemd unit is installed and not started.")
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "parameter studies of the oblique impact of a robotic finger
${about}
.
This is the command line. It computes single points by itself; to run a study
on this machine it starts a server and a worker, which are in the packages
oblique-server and oblique-worker.")

set(scripts ${CMAKE_CURRENT_BINARY_DIR}/debian)
set(CPACK_DEBIAN_SERVER_PACKAGE_NAME oblique-server)
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS "systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS oblique)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
    ${scripts}/server/conffiles ${scripts}/server/postinst ${scripts}/server/prerm ${scripts}/server/postrm)
set(CPACK_DEBIAN_WORKER_PACKAGE_NAME oblique-worker)
set(CPACK_DEBIAN_WORKER_PACKAGE_CONTROL_EXTRA
    ${scripts}/worker/conffiles ${scripts}/worker/postinst ${scripts}/worker/prerm ${scripts}/worker/postrm)
set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME oblique)
set(CPACK_DEBIAN_CLIENT_PACKAGE_RECOMMENDS
    "oblique-server (= ${PROJECT_VERSION}), oblique-worker (= ${PROJECT_VERSION})")

include(CPack)
