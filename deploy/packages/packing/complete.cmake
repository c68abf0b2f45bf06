# Run by cpack when all is installed into a package's tree and before it is packed: adds what only this
# kind of package has.
include(${CMAKE_CURRENT_LIST_DIR}/../../../proto/program/manual/compress_pages.cmake)
if(CPACK_GENERATOR STREQUAL "DEB")
  include(${CMAKE_CURRENT_LIST_DIR}/add_changelog.cmake)
  include(${CMAKE_CURRENT_LIST_DIR}/strip_programs.cmake)
  include(${CMAKE_CURRENT_LIST_DIR}/debian_library.cmake)
else()
  include(${CMAKE_CURRENT_LIST_DIR}/add_libraries.cmake)
endif()
