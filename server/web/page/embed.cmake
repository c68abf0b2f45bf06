# Writes a C++ source with the gzipped files of the page: cmake -DOUT=FILE -DFOLDER=DIR -DNAMES=a,b
# -P embed.cmake. In our scripts, lines that contain only comments become empty, so that line
# numbers stay.
string(REPLACE "," ";" NAMES "${NAMES}")
set(entries "")
set(arrays "")
set(number 0)
find_program(GZIP gzip REQUIRED)
find_program(SED sed REQUIRED)
set(type_html "text/html; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_svg "image/svg+xml")
foreach(name IN LISTS NAMES)
  get_filename_component(extension ${name} LAST_EXT)
  string(SUBSTRING ${extension} 1 -1 extension)
  set(comments "")
  if(extension STREQUAL "js" AND NOT name MATCHES "^vendor/")
    set(comments [[s,^ *//.*,,; s,^ */\*\* .*\*/$,,; \,^ */\*\*$,,\,^ *\*/$, s,.*,,]])
  endif()
  execute_process(COMMAND ${SED} -e "${comments}" ${FOLDER}/${name} COMMAND ${GZIP} -9 -n -c
                  OUTPUT_FILE ${OUT}.gz COMMAND_ERROR_IS_FATAL ANY)
  file(READ ${OUT}.gz bytes HEX)
  file(REMOVE ${OUT}.gz)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  file(SHA256 ${FOLDER}/${name} hash)
  string(SUBSTRING ${hash} 0 16 hash)
  string(APPEND arrays "constexpr unsigned char kFile${number}[] = {${bytes}};\n")
  string(APPEND entries "    PageFile{\"/${name}\", \"${type_${extension}}\", \"\\\"${hash}\\\"\", kFile${number}},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OUT} "// Made by embed.cmake.
#include \"server/web/page/page.h\"

namespace oblique::server {
namespace {

${arrays}
constexpr PageFile kFiles[] = {
${entries}};

}  // namespace

std::span<const PageFile> page_files() {
  return kFiles;
}

}  // namespace oblique::server
")
