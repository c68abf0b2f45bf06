# Read by cpack for each kind of package, before anything is installed into it.
if(CPACK_GENERATOR STREQUAL "DEB")
  # /etc and /usr, not folders below one prefix.
  set(CPACK_SET_DESTDIR ON)
  set(CPACK_INSTALL_PREFIX /usr)
  unset(ENV{OBLIQUE_PREFIX})
  # Each package has its own, in the first line of its description.
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
else()
  # Programs run wherever the archive is unpacked. Units must name a place.
  set(ENV{OBLIQUE_PREFIX} /opt/oblique)
endif()
