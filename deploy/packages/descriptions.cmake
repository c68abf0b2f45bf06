# Descriptions of Debian's packages: one line, then a text.
set(about
"oblique computes the impact of a flexible robotic finger of three elastic
links on rough ground: contact forces, durations, intervals of stick and
slip, energies. It solves single points (drop height, friction,
restitution) and studies of many points: a server distributes points to
workers on any number of machines and stores the results in an SQLite
database.")
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "parameter studies of the oblique impact of a robotic finger
${about}
.
This is the command line. It solves single points by itself. To run a study on
this machine it starts a server and a worker of the packages oblique-server
and oblique-worker.")
set(CPACK_COMPONENT_SERVER_DESCRIPTION "parameter studies of an oblique impact - server
${about}
.
This is the server, with its page of maps and points for a browser. Its
systemd unit is neither enabled nor started by the installation.")
set(CPACK_COMPONENT_WORKER_DESCRIPTION "parameter studies of an oblique impact - worker
${about}
.
This is the worker, for machines that only compute. Its systemd unit is
neither enabled nor started by the installation.")
set(about_library
"liboblique computes the impact of a flexible robotic finger of three elastic
links on rough ground: contact forces, durations, intervals of stick and
slip, energies, time histories. It solves single points (drop height,
friction, restitution), or many points on all cores.")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "oblique impact of a flexible robotic finger - solver library
${about_library}
.
This is the shared library, for programs that link it. oblique's own programs
do not need it.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "oblique impact of a flexible robotic finger - development files
${about_library}
.
This package has the files to build C++ programs with it: headers, files for
CMake (find_package) and pkg-config, and an example.")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "oblique impact of a flexible robotic finger - Python module
${about}
.
This is the Python module. It solves points on all cores with NumPy arrays for
parameters and results, returns time histories, and queries databases, also
for pandas. It needs none of the programs.")
