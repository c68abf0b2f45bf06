# cpack reads this file for each kind of package before it installs files into the package's tree.
if(CPACK_GENERATOR STREQUAL "DEB")
  # Debian packages use /etc and /usr instead of folders below one prefix.
  set(CPACK_SET_DESTDIR ON)
  set(CPACK_INSTALL_PREFIX /usr)
  unset(ENV{OBLIQUE_PREFIX})
  # Descriptions are set per package; the first line of each is its summary.
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
else()
  # The programs run in any folder, but systemd units need a fixed path.
  set(ENV{OBLIQUE_PREFIX} /opt/oblique)
endif()
