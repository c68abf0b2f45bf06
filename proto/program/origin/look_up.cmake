# Writes origin.cpp with the commit. The commit comes from the file `commit` of a source archive,
# else from git; else it is empty. The file contains no build time, so that the same tree gives the
# same bytes.
set(COMMIT "")
set(COMMITTED_ON "")
set(WITH_CHANGES false)

# git_says(VARIABLE ARGUMENT...): sets VARIABLE to the output of git, or to an empty text if git
# fails. Ignores the variables of a git hook, because they would name another tree, and ignores who
# owns the folder.
function(git_says variable)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env --unset=GIT_DIR --unset=GIT_WORK_TREE --unset=GIT_INDEX_FILE
            git --no-optional-locks -c safe.directory=* -c log.showSignature=false ${ARGN}
    WORKING_DIRECTORY "${TREE}" OUTPUT_VARIABLE said ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE
    RESULT_VARIABLE failed)
  if(failed)
    set(said "")
  endif()
  set(${variable} "${said}" PARENT_SCOPE)
endfunction()

file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/commit" known LIMIT_COUNT 1)
set(commit_and_date "^([0-9a-f]+) ([0-9]+-[0-9]+-[0-9]+)$")
if(NOT known MATCHES "${commit_and_date}")
  # A source folder that is a part of another repository has no commit of its own.
  git_says(is_top rev-parse --is-inside-work-tree)
  git_says(above rev-parse --show-prefix)
  if(is_top STREQUAL "true" AND above STREQUAL "")
    git_says(known log -1 "--format=%H %cs")
    git_says(changes status --porcelain --untracked-files=no)
    if(NOT changes STREQUAL "")
      set(WITH_CHANGES true)
    endif()
  endif()
endif()
if(known MATCHES "${commit_and_date}")
  string(SUBSTRING "${CMAKE_MATCH_1}" 0 12 COMMIT)
  set(COMMITTED_ON "${CMAKE_MATCH_2}")
else()
  set(WITH_CHANGES false)
endif()
configure_file("${CMAKE_CURRENT_LIST_DIR}/origin.cpp.in" "${FILE}" @ONLY)
