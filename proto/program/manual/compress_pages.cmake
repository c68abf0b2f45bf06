# Compresses manual pages when cpack runs it. The results contain no times or names.
find_program(GZIP gzip REQUIRED)
file(GLOB found "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/share/man/man1/*.1"
     "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/*/usr/share/man/man1/*.1")
foreach(page IN LISTS found)
  execute_process(COMMAND ${GZIP} -9nf "${page}" COMMAND_ERROR_IS_FATAL ANY)
endforeach()
