# Run by cpack when all is installed into a package's tree and before it is packed: adds what only this
# kind of package has.
if(CPACK_GENERATOR STREQUAL "DEB")
  include(${CMAKE_CURRENT_LIST_DIR}/add_changelog.cmake)
else()
  include(${CMAKE_CURRENT_LIST_DIR}/add_libraries.cmake)
endif()
