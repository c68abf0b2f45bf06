# Copies the libraries of the programs, except the C library's, to lib/oblique in the archive, so
# that it runs without installed libraries and without root.
set(tree "${CPACK_TEMPORARY_INSTALL_DIRECTORY}")
set(programs "${tree}/bin/oblique-server" "${tree}/bin/oblique-worker" "${tree}/bin/oblique")
# The Python module in the archive works only with the same version of Python.
file(GLOB module "${tree}/lib/python3/dist-packages/oblique/_core*.so")
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} MODULES ${module}
     RESOLVED_DEPENDENCIES_VAR libraries UNRESOLVED_DEPENDENCIES_VAR missing
     PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|dl|rt|pthread|resolv|anl|nsl|util)\\.so\\.")
if(missing)
  message(FATAL_ERROR "libraries of the programs are missing: ${missing}")
endif()
file(INSTALL DESTINATION "${tree}/lib/oblique" TYPE SHARED_LIBRARY FOLLOW_SYMLINK_CHAIN FILES ${libraries})

find_program(PATCHELF patchelf)
if(NOT PATCHELF)
  message(FATAL_ERROR "the archive needs patchelf, which sets the programs' library path")
endif()
# Sets RPATH instead of RUNPATH, because RPATH also applies to the libraries that libraries need.
execute_process(COMMAND ${PATCHELF} --force-rpath --set-rpath "$ORIGIN/../lib/oblique" ${programs}
                COMMAND_ERROR_IS_FATAL ANY)
if(module)
  execute_process(COMMAND ${PATCHELF} --force-rpath --set-rpath "$ORIGIN/../../../oblique" ${module}
                  COMMAND_ERROR_IS_FATAL ANY)
endif()

# Copies the licences of the libraries from their packages.
find_program(DPKG_QUERY dpkg-query)
foreach(library IN LISTS libraries)
  file(REAL_PATH "${library}" file)
  set(candidates "${file}")
  # Debian's packages still list files under /lib, which is now a part of /usr.
  string(REGEX REPLACE "^/usr" "" without_usr "${file}")
  set(package "")
  foreach(candidate "${file}" "${without_usr}" "/usr${file}")
    execute_process(COMMAND ${DPKG_QUERY} --search "${candidate}" OUTPUT_VARIABLE found ERROR_QUIET
                    RESULT_VARIABLE failed)
    if(NOT failed)
      string(REGEX REPLACE "[:,].*" "" package "${found}")
      break()
    endif()
  endforeach()
  if(NOT package)
    message(FATAL_ERROR "no installed package contains ${library}, so its licence for the archive is unknown")
  endif()
  configure_file("/usr/share/doc/${package}/copyright" "${tree}/share/doc/oblique/libraries/${package}" COPYONLY)
endforeach()
