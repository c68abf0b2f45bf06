# Moves the library to the folder of its architecture, as Debian's Multi-Arch requires, and updates
# the development files. Also writes the information for dpkg-shlibdeps and the trigger of ldconfig,
# because the scripts that cpack generates would call ldconfig.
set(lib usr/${CPACK_OBLIQUE_LIBDIR})
set(multiarch usr/lib/${CPACK_OBLIQUE_MULTIARCH})

# change(FILE WHAT INTO): replaces every WHAT in FILE by INTO. Fails if FILE does not contain WHAT.
function(change file what into)
  file(READ "${file}" text)
  string(FIND "${text}" "${what}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "${file} does not contain \"${what}\", which must be changed for Debian")
  endif()
  string(REPLACE "${what}" "${into}" text "${text}")
  file(WRITE "${file}" "${text}")
endfunction()

set(library "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/library")
set(development "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/development")
if(NOT lib STREQUAL multiarch)
  foreach(part library development)
    file(GLOB found "${${part}}/${lib}/*")
    file(MAKE_DIRECTORY "${${part}}/${multiarch}")
    file(COPY ${found} DESTINATION "${${part}}/${multiarch}")
    file(REMOVE_RECURSE ${found})
  endforeach()
  file(GLOB targets "${development}/${multiarch}/cmake/oblique/oblique-targets-*.cmake")
  change("${targets}" "\${_IMPORT_PREFIX}/${CPACK_OBLIQUE_LIBDIR}/" "\${_IMPORT_PREFIX}/lib/${CPACK_OBLIQUE_MULTIARCH}/")
  # The CMake files are now one folder deeper, so the prefix is one more folder above them.
  set(up "get_filename_component(_IMPORT_PREFIX \"\${_IMPORT_PREFIX}\" PATH)\nif(")
  change("${development}/${multiarch}/cmake/oblique/oblique-targets.cmake" "${up}"
         "get_filename_component(_IMPORT_PREFIX \"\${_IMPORT_PREFIX}\" PATH)\n${up}")
  set(pc "${development}/${multiarch}/pkgconfig/oblique.pc")
  change("${pc}" "prefix=\${pcfiledir}/" "prefix=\${pcfiledir}/../")
  change("${pc}" "libdir=\${prefix}/${CPACK_OBLIQUE_LIBDIR}" "libdir=\${prefix}/lib/${CPACK_OBLIQUE_MULTIARCH}")
endif()

file(GLOB object "${library}/${multiarch}/liboblique.so.*.*.*")
file(MAKE_DIRECTORY "${library}/debian")
file(WRITE "${library}/debian/control" "")
find_program(SHLIBDEPS dpkg-shlibdeps REQUIRED)
execute_process(COMMAND ${SHLIBDEPS} -O "${object}" WORKING_DIRECTORY "${library}" OUTPUT_VARIABLE depends
                OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE "${library}/debian")
string(REGEX REPLACE "^.*Depends=" "" CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "${depends}")
