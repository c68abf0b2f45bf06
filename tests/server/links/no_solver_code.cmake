# Fails if a program links a target of the solver or contains its symbols. The folder
# worker/solver/model/ does not count as part of the solver.
#   cmake -DPROGRAM=oblique-server -DTARGETS=a,b,c -DSOLVER_ARCHIVES=x.a,y.a -DNM=nm -P no_solver_code.cmake
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" TARGETS "${TARGETS}")
string(REPLACE "," ";" SOLVER_ARCHIVES "${SOLVER_ARCHIVES}")

foreach(target IN LISTS TARGETS)
  if(target MATCHES "^oblique_(chain|motion|contact|lanes|solver)$")
    message(FATAL_ERROR "${PROGRAM} is linked with ${target}")
  endif()
endforeach()

# functions_of(FILE KINDS VARIABLE): stores the mangled names of the oblique functions that FILE
# defines. KINDS are letters of nm: T for external linkage, t for functions made local by a linker.
function(functions_of file kinds variable)
  execute_process(COMMAND ${NM} --defined-only ${file} OUTPUT_VARIABLE symbols RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${NM} cannot read ${file}")
  endif()
  string(REGEX MATCHALL " [${kinds}] _Z[A-Z]*7oblique[^\n]*" found "${symbols}")
  list(TRANSFORM found REPLACE "^ . " "")
  if(NOT found)
    message(FATAL_ERROR "${file} defines no functions of ours; is it stripped?")
  endif()
  set(${variable} ${found} PARENT_SCOPE)
endfunction()

functions_of(${PROGRAM} "Tt" in_program)
foreach(archive IN LISTS SOLVER_ARCHIVES)
  functions_of(${archive} "T" of_solver)
  foreach(function IN LISTS of_solver)
    if(function IN_LIST in_program)
      message(FATAL_ERROR "${PROGRAM} holds solver code: ${function}, of ${archive}")
    endif()
  endforeach()
endforeach()
