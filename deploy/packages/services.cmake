# Package scripts of the services, in debian/SERVICE/ of the build folder.
set(UNITS_OF_server oblique-server.service)
set(FIRST_OF_server "To start it now and at every boot:")
set(WAY_BACK_OF_server
"It refuses
  a database of another schema and does not change it: then use an older copy.")
set(KEPT_OF_server /var/lib/oblique)
set(WHAT_IS_KEPT_OF_server "databases and keys")
file(READ ${CMAKE_CURRENT_SOURCE_DIR}/debian/prepare_server PREPARATION_OF_server)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/debian/prepare_server)

set(UNITS_OF_worker "oblique-worker.service 'oblique-worker@*.service'")
set(FIRST_OF_worker "Name its server in /etc/oblique/worker.toml, then:")
set(WAY_BACK_OF_worker "Studies
  with results of a newer solver wait for a worker that has it.")
set(KEPT_OF_worker "/etc/oblique/*.key")
set(WHAT_IS_KEPT_OF_worker "a key")
set(PREPARATION_OF_worker "")

foreach(part server worker)
  set(PACKAGE oblique-${part})
  set(UNIT ${PACKAGE}.service)
  set(VERSION ${PROJECT_VERSION})
  foreach(variable UNITS FIRST WAY_BACK KEPT WHAT_IS_KEPT PREPARATION)
    set(${variable} "${${variable}_OF_${part}}")
  endforeach()
  foreach(script postinst prerm postrm)
    configure_file(debian/${script} debian/${part}/${script} @ONLY USE_SOURCE_PERMISSIONS)
  endforeach()
  file(CONFIGURE OUTPUT debian/${part}/conffiles CONTENT "/etc/oblique/${part}.toml\n")
endforeach()
