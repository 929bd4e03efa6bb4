# Run at each build: cmake -DSOURCE=... -DOUT=... -P version.cmake. Writes OUT only when it changes, so that only a new commit costs a compile.
set(commit "")
find_program(GIT git)
if(GIT)
  # Only when this is the top of a repository: a copy unpacked somewhere inside another one is not that commit.
  set(git ${GIT} -c safe.directory=* -C ${SOURCE})
  execute_process(COMMAND ${git} rev-parse --show-prefix OUTPUT_VARIABLE prefix RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed AND prefix STREQUAL "")
    execute_process(COMMAND ${git} rev-parse --short=12 HEAD OUTPUT_VARIABLE commit RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(failed)
      set(commit "")
    else()
      # What is built counts: a changed page of documentation does not make another program.
      execute_process(COMMAND ${git} --no-optional-locks status --porcelain -- libs apps pipelines CMakeLists.txt CMakePresets.json
        OUTPUT_VARIABLE changes ERROR_QUIET)
      if(NOT changes STREQUAL "")
        string(APPEND commit ", changed")
      endif()
    endif()
  endif()
endif()
if(commit STREQUAL "")
  # What 'git archive' leaves in a tarball.
  file(READ ${SOURCE}/libs/cmake/commit.txt archived)
  string(SUBSTRING "${archived}" 0 12 archived)
  if(archived MATCHES "^[0-9a-f]+$")
    set(commit ${archived})
  endif()
endif()
if(commit STREQUAL "")
  set(commit "unknown commit")
else()
  set(commit "commit ${commit}")
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT "namespace osteo::inline imaging {
extern const char* const kCommit;
const char* const kCommit = \"${commit}\";
}  // namespace osteo::imaging
")
