# After a test program is built: one ctest for each of its suites, called LIBRARY.SUITE. One process a suite: what its tests share is made once.
# cmake -DPROGRAM=... -DLIBRARY=... -DSECONDS=... -DOUT=... -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE lines COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\.[ \n]" suites "${lines}")
if(NOT suites)
  message(FATAL_ERROR "${PROGRAM} lists no tests")
endif()
set(tests "")
foreach(suite ${suites})
  string(REGEX REPLACE "[. \n]" "" suite "${suite}")
  string(APPEND tests "add_test([[${LIBRARY}.${suite}]] [[${CMAKE_CURRENT_LIST_DIR}/run_suite.sh]] [[${PROGRAM}]] [[${suite}]])\n"
    "set_tests_properties([[${LIBRARY}.${suite}]] PROPERTIES LABELS unit TIMEOUT ${SECONDS} SKIP_RETURN_CODE 77)\n")
endforeach()
file(WRITE ${OUT} "${tests}")
