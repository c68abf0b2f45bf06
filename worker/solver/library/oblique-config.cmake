# find_package(oblique) defines the target oblique::solver, the library with its headers.
include(${CMAKE_CURRENT_LIST_DIR}/oblique-targets.cmake)
