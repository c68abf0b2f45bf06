# The archive's programs bring the libraries that they are linked with, all but the C library's, in
# lib/oblique, so that they run on systems that have not installed these, without root.
set(tree "${CPACK_TEMPORARY_INSTALL_DIRECTORY}")
set(programs "${tree}/bin/oblique-server" "${tree}/bin/oblique-worker" "${tree}/bin/oblique")
# For people whose Python is of the same version.
file(GLOB module "${tree}/lib/python3/dist-packages/oblique/_core*.so")
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} MODULES ${module}
     RESOLVED_DEPENDENCIES_VAR libraries UNRESOLVED_DEPENDENCIES_VAR missing
     PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|dl|rt|pthread|resolv|anl|nsl|util)\\.so\\.")
if(missing)
  message(FATAL_ERROR "the programs are linked with libraries that are not here: ${missing}")
endif()
file(INSTALL DESTINATION "${tree}/lib/oblique" TYPE SHARED_LIBRARY FOLLOW_SYMLINK_CHAIN FILES ${libraries})

find_program(PATCHELF patchelf)
if(NOT PATCHELF)
  message(FATAL_ERROR "the archive needs patchelf, which tells programs where their libraries are")
endif()
# As RPATH, not RUNPATH: it holds for the libraries' libraries too.
execute_process(COMMAND ${PATCHELF} --force-rpath --set-rpath "$ORIGIN/../lib/oblique" ${programs}
                COMMAND_ERROR_IS_FATAL ANY)
if(module)
  execute_process(COMMAND ${PATCHELF} --force-rpath --set-rpath "$ORIGIN/../../../oblique" ${module}
                  COMMAND_ERROR_IS_FATAL ANY)
endif()

# The libraries' licences, from the packages that they are of.
find_program(DPKG_QUERY dpkg-query)
foreach(library IN LISTS libraries)
  file(REAL_PATH "${library}" file)
  set(candidates "${file}")
  # Debian's packages list files by where they were before /lib became a part of /usr.
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
    message(FATAL_ERROR "no package is known to hold ${library}, whose licence belongs into the archive")
  endif()
  configure_file("/usr/share/doc/${package}/copyright" "${tree}/share/doc/oblique/libraries/${package}" COPYONLY)
endforeach()
