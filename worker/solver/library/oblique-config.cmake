# find_package(oblique) gives the target oblique::solver: the library and its headers. It needs no other package.
include(${CMAKE_CURRENT_LIST_DIR}/oblique-targets.cmake)
