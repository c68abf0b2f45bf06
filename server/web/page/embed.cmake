# Writes a C++ source with the files of the page, plain and gzipped: cmake -DOUT=FILE -DFOLDER=DIR
# -DNAMES=a,b -P embed.cmake. In our scripts, lines that contain only comments become empty, so that line
# numbers stay.
string(REPLACE "," ";" NAMES "${NAMES}")
set(entries "")
set(modules ${NAMES})
list(FILTER modules INCLUDE REGEX "js$")
list(FILTER modules EXCLUDE REGEX "^vendor|^main")
list(TRANSFORM modules REPLACE "(.+)" "<link rel=\"modulepreload\" href=\"\\1\">")
list(JOIN modules "\\n" modules)
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
  execute_process(COMMAND ${SED} -e "${comments}" -e "s,^<!-- modules.*,${modules}," ${FOLDER}/${name}
                  OUTPUT_FILE ${OUT}.plain COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${GZIP} -9 -n -c ${OUT}.plain OUTPUT_FILE ${OUT}.gzipped
                  COMMAND_ERROR_IS_FATAL ANY)
  file(SHA256 ${OUT}.plain hash)
  foreach(form plain gzipped)
    file(READ ${OUT}.${form} bytes HEX)
    file(REMOVE ${OUT}.${form})
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
    string(APPEND arrays "constexpr unsigned char k_${form}_${number}[] = {${bytes}};\n")
  endforeach()
  string(SUBSTRING ${hash} 0 16 hash)
  string(APPEND entries "    PageFile{\"/${name}\", \"${type_${extension}}\", \"W/\\\"${hash}\\\"\", k_plain_${number}, k_gzipped_${number}},\n")
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
