#!/usr/bin/env bash
# Starts the window under Xvfb, drives mouse and keys, drills, takes a screenshot, saves, closes; then checks what came of it.
# usage: drive_window.sh BIN_DIR WORK_DIR
set -euo pipefail
bin=$1 work=$2
rm -rf "$work" && mkdir -p "$work" && cd "$work"
export LIBGL_ALWAYS_SOFTWARE=1
"$bin/osteo" phantom ct.nrrd --region temporal --spacing-mm 1 --quiet
"$bin/osteo" prepare ct.nrrd -o case --lower 500 --spacing-mm 1 --quiet

display=
for n in $(seq 90 120); do
  [ -e /tmp/.X11-unix/X$n ] || { display=$n; break; }
done
Xvfb ":$display" -screen 0 1000x700x24 -nolisten tcp >xvfb.log 2>&1 &
xvfb=$!
trap 'kill $xvfb 2>/dev/null || true' EXIT
export DISPLAY=:$display
for _ in $(seq 100); do xdotool getdisplaygeometry >/dev/null 2>&1 && break; sleep 0.1; done

"$bin/osteo" rehearse case --diameter-mm 6 --dust -o session >window.log 2>&1 &
app=$!
id=
for _ in $(seq 200); do
  id=$(xdotool search --name '^Osteotome' 2>/dev/null | head -n 1 || true)
  [ -n "$id" ] && break
  kill -0 $app 2>/dev/null || { cat window.log; exit 1; }
  sleep 0.1
done
[ -n "$id" ] || { echo "no window came up"; cat window.log; exit 1; }
xdotool windowmove "$id" 0 0 windowsize "$id" 1000 700
sleep 2

xdotool mousemove 480 330; sleep 0.7
xdotool key 6; sleep 0.5
xdotool key f; sleep 1
# Drill: hold the button, go deeper with the wheel, move about.
xdotool mousedown 1; sleep 0.3
for step in $(seq 8); do
  xdotool click 4
  xdotool mousemove_relative -- $((step % 2 ? 12 : -12)) $((step % 3 ? 5 : -9))
  sleep 0.4
done
xdotool mouseup 1; sleep 0.4
xdotool keydown v; sleep 0.4; xdotool keyup v
# Turn the view with the right button, then a screenshot.
xdotool mousedown 3; sleep 0.3; xdotool mousemove_relative -- 30 12; sleep 0.4; xdotool mouseup 3; sleep 0.4
xdotool key s; sleep 1.5
# Saw, take apart, carry a piece, put a plate somewhere, take the last steps back.
xdotool mousemove 480 330; sleep 0.3
xdotool key x; sleep 0.5; xdotool key Return; sleep 1
xdotool key p; sleep 0.5; xdotool key Return; sleep 1.5
xdotool mousedown 1; sleep 0.3; xdotool mousemove_relative -- 40 -20; sleep 0.5; xdotool mouseup 1; sleep 0.4
xdotool key l; sleep 0.7; xdotool key f; sleep 0.7; xdotool click 4; xdotool click 4; sleep 0.7; xdotool key Return; sleep 0.7
xdotool key z; sleep 0.5; xdotool key Escape; sleep 0.3
xdotool key F5; sleep 2
xdotool key s; sleep 1.5
xdotool key q
for _ in $(seq 150); do kill -0 $app 2>/dev/null || break; sleep 0.1; done
kill -0 $app 2>/dev/null && { echo "the window did not close"; kill $app; cat window.log; exit 1; }
wait $app || { echo "exit code $?"; cat window.log; exit 1; }
cat window.log

# The first session drilled bone and replays bit for bit; the second goes on from it.
python3 - <<'PY'
import json
s = json.load(open("session/summary.json"))
assert s["removed_mm3"] > 1, s
assert s["ticks_lost_by_readers"] == 0, s
assert s["sawn_mm3"] > 10, s
PY
"$bin/osteo" replay session
second=case/sessions/1
grep -q resumed_from $second/session.json
"$bin/osteo" replay $second
test -s session/screenshot-1.png
# The screenshot shows bone (ivory) in the middle, the panel at the left, the cuts at the right.
"$bin/osteo" info session/screenshot-1.png | grep -q 'width: 1000'
