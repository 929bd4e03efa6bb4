# Sourced by what runs single tests. CI has to end by a time (OSTEO_TESTS_UNTIL, seconds since 1970): a test that would begin later is skipped,
# and ctest lists it among those that did not run. Nothing else sets it.
if [ "$(date +%s)" -ge "${OSTEO_TESTS_UNTIL:-9999999999}" ]; then
  echo "not begun: the time for tests is over (OSTEO_TESTS_UNTIL)"
  exit 77
fi
