# What Debian's packages say of themselves: a line, then what people read before they install one.
set(about
"oblique computes how a flexible robotic finger of three elastic links
strikes rough ground: contact forces, durations, intervals of stick and
slip, energies. It does so for one point (drop height, friction,
restitution) or for studies of any number of them: a server hands points to
workers on any number of machines and keeps the results in an SQLite
database.")
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "parameter studies of the oblique impact of a robotic finger
${about}
.
This is the command line. It computes single points by itself; to run a study
on this machine it starts a server and a worker, which are in the packages
oblique-server and oblique-worker.")
set(CPACK_COMPONENT_SERVER_DESCRIPTION "parameter studies of an oblique impact - server
${about}
.
This is the server, with its page of maps and points for a browser. Its
systemd unit is neither enabled nor started by the installation.")
set(CPACK_COMPONENT_WORKER_DESCRIPTION "parameter studies of an oblique impact - worker
${about}
.
This is the worker, all that a machine needs that only computes. Its systemd
unit is neither enabled nor started by the installation.")
set(about_library
"liboblique computes how a flexible robotic finger of three elastic links
strikes rough ground: contact forces, durations, intervals of stick and
slip, energies, histories in time. It solves one point (drop height,
friction, restitution) at a time, or many of them on all cores.")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "oblique impact of a flexible robotic finger - solver library
${about_library}
.
This is what programs that are linked with it run with. oblique's own
programs do not need it.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "oblique impact of a flexible robotic finger - development files
${about_library}
.
This is what programs in C++ that call it are built with: headers, files for
CMake (find_package) and pkg-config, and an example.")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "oblique impact of a flexible robotic finger - Python module
${about}
.
This is the module for Python: points solved on all cores with NumPy arrays
in and out, time histories, and databases asked as arrays or for pandas. It
needs none of the programs.")
