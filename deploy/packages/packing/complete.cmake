# cpack runs this file after installing files into a package's tree and before packing. It adds
# files that only this kind of package needs.
include(${CMAKE_CURRENT_LIST_DIR}/../../../proto/program/manual/compress_pages.cmake)
if(CPACK_GENERATOR STREQUAL "DEB")
  include(${CMAKE_CURRENT_LIST_DIR}/add_changelog.cmake)
  include(${CMAKE_CURRENT_LIST_DIR}/strip_programs.cmake)
  include(${CMAKE_CURRENT_LIST_DIR}/debian_library.cmake)
else()
  include(${CMAKE_CURRENT_LIST_DIR}/add_libraries.cmake)
endif()
