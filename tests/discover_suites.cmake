# Writes a file of ctest's with a test for each suite of a test binary: cmake -D BINARY=FILE -D PREFIX=NAME
# -D SLOW=REGEX -D CTEST_FILE=FILE -P this. A process for each test of 2,000 would load the binary and a
# sanitizer as often.
execute_process(COMMAND ${BINARY} --gtest_list_tests OUTPUT_VARIABLE listing COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[^ \n]+[.]" suites "${listing}")
set(content "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "^\n|[.]$" "" suite "${suite}")
  string(APPEND content "add_test([=[${PREFIX}.${suite}]=] [=[${BINARY}]=] [=[--gtest_filter=${suite}.*]=])\n")
  if(suite MATCHES "^(.*/)?(${SLOW})(/.*)?$")
    string(APPEND content "set_tests_properties([=[${PREFIX}.${suite}]=] PROPERTIES LABELS slow COST 10)\n")
  endif()
endforeach()
file(WRITE ${CTEST_FILE} "${content}")
