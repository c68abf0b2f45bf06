# Removes the compiler's version from Debian's programs, so that builds can be compared.
find_program(STRIP strip REQUIRED)
file(GLOB programs "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/*/usr/bin/oblique*"
     "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/library/usr/*/lib*.so.*.*.*"
     "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/python/usr/lib/python3/dist-packages/oblique/*.so")
execute_process(COMMAND ${STRIP} --remove-section=.comment --remove-section=.note ${programs}
                COMMAND_ERROR_IS_FATAL ANY)
