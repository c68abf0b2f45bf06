# Debian's packages say what changed; so far, that there is a first version.
find_program(GZIP gzip REQUIRED)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # that of SOURCE_DATE_EPOCH where it is set
foreach(part server worker client)
  string(TOUPPER ${part} PART)
  set(package ${CPACK_DEBIAN_${PART}_PACKAGE_NAME})
  set(file "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${part}/usr/share/doc/${package}/changelog")
  file(WRITE "${file}" "${package} (${CPACK_PACKAGE_VERSION}) stable; urgency=medium

  * Version ${CPACK_PACKAGE_VERSION}.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
  execute_process(COMMAND ${GZIP} -9nf "${file}" COMMAND_ERROR_IS_FATAL ANY)
endforeach()
