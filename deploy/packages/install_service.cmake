# Installs units, account and configuration of a service; `part` is server or worker. cmake
# --install and cpack include this file and set CMAKE_INSTALL_PREFIX and DESTDIR. The environment
# variable OBLIQUE_PREFIX gives the final folder if it is not CMAKE_INSTALL_PREFIX.
set(prefix "${CMAKE_INSTALL_PREFIX}")
if(DEFINED ENV{OBLIQUE_PREFIX})
  set(prefix "$ENV{OBLIQUE_PREFIX}")
endif()
cmake_path(ABSOLUTE_PATH bin_folder BASE_DIRECTORY "${prefix}" OUTPUT_VARIABLE OBLIQUE_BIN)
# An installation in /usr has its configuration in /etc; any other has it below its prefix.
set(configuration "${CMAKE_INSTALL_PREFIX}/etc/oblique")
set(OBLIQUE_ETC "${prefix}/etc/oblique")
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(configuration /etc/oblique)
  set(OBLIQUE_ETC /etc/oblique)
endif()

set(systemd "${CMAKE_CURRENT_LIST_DIR}/../systemd")
# fill_in(TEMPLATE FOLDER NAME): installs a template as FOLDER/NAME, with the variables filled in.
function(fill_in template folder name)
  message(STATUS "Installing: $ENV{DESTDIR}${folder}/${name}")
  configure_file("${template}" "$ENV{DESTDIR}${folder}/${name}" @ONLY NO_SOURCE_PERMISSIONS NEWLINE_STYLE LF)
endfunction()

# install_filled_in(TEMPLATE FOLDER NAME): like fill_in, and adds the file to the manifest.
macro(install_filled_in template folder name)
  fill_in("${template}" "${folder}" "${name}")
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${folder}/${name}")
endmacro()

set(units "${CMAKE_INSTALL_PREFIX}/lib/systemd/system")
set(INSTANCE ${part})
set(OF_INSTANCE "")
install_filled_in("${systemd}/oblique-${part}.service.in" "${units}" oblique-${part}.service)
if(part STREQUAL worker)
  set(INSTANCE %i)
  set(OF_INSTANCE " for %i")
  install_filled_in("${systemd}/oblique-worker.service.in" "${units}" oblique-worker@.service)
else()
  install_filled_in("${systemd}/oblique-server.sysusers" "${CMAKE_INSTALL_PREFIX}/lib/sysusers.d"
                    oblique-server.conf)
endif()

# An existing configuration is not overwritten. The manifest does not contain the configuration, so
# removing the files of the manifest keeps it, too.
if(NOT EXISTS "$ENV{DESTDIR}${configuration}/${part}.toml")
  fill_in("${systemd}/${part}.toml" "${configuration}" ${part}.toml)
endif()
