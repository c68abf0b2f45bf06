# Sorts the files of an archive by name. cpack would use the order on the disk, which varies.
if(NOT CPACK_GENERATOR STREQUAL "TGZ")
  return()
endif()
find_program(TAR tar REQUIRED)
find_program(GZIP gzip REQUIRED)
foreach(archive IN LISTS CPACK_PACKAGE_FILES)
  set(tree "${archive}.tree")
  file(ARCHIVE_EXTRACT INPUT "${archive}" DESTINATION "${tree}")
  set(times "")
  if(DEFINED ENV{SOURCE_DATE_EPOCH})
    set(times "--mtime=@$ENV{SOURCE_DATE_EPOCH}")
  endif()
  execute_process(
    COMMAND ${TAR} --create --sort=name --format=gnu --owner=root:0 --group=root:0 ${times} --directory "${tree}"
            ${CPACK_PACKAGE_FILE_NAME}
    COMMAND ${GZIP} -9n OUTPUT_FILE "${archive}" COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE "${tree}")
endforeach()
