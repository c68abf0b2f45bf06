# Installs the pages in `pages` to `man_folder`, with the date of today, or of SOURCE_DATE_EPOCH where that
# is set.
string(TIMESTAMP date "%Y-%m-%d" UTC)
cmake_path(ABSOLUTE_PATH man_folder BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}")
file(GLOB found "${pages}/*.1")
foreach(page IN LISTS found)
  cmake_path(GET page FILENAME name)
  message(STATUS "Installing: $ENV{DESTDIR}${man_folder}/${name}")
  file(READ "${page}" text)
  string(REPLACE "@DATE@" "${date}" text "${text}")
  file(WRITE "$ENV{DESTDIR}${man_folder}/${name}" "${text}")
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${man_folder}/${name}")
endforeach()
