#!/usr/bin/env bash
# cmake --install into a fresh prefix, and an outside project that builds and runs against it. usage: check_install.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source=$1 build=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-install-XXXXXX")
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >"$work/said" || { tail -20 "$work/said"; exit 1; }
p=$work/prefix
for f in bin/osteo share/osteo/pipelines/temporal-bone.json share/man/man1/osteo.1 share/man/man1/osteo-prepare.1 share/bash-completion/completions/osteo \
  share/zsh/site-functions/_osteo share/fish/vendor_completions.d/osteo.fish share/osteo/slicer/OsteoThreshold share/osteo/slicer/OsteoThreshold.xml \
  share/icons/hicolor/scalable/apps/osteo.svg share/mime/packages/osteo.xml lib/udev/rules.d/70-osteotome.rules lib/systemd/system/osteo-receive.service \
  lib/systemd/system/osteo-watch.service lib/systemd/system/osteo-watch-orthanc@.service share/osteo/pipelines/rules.json include/osteo/core/data/tri_mesh.h; do
  [ -s "$p/$f" ] || { echo "not installed: $f"; exit 1; }
done
"$p/bin/osteo" --version >/dev/null
# What reads cameras is found where it was installed: a folder without a picture is told from a program without eyes.
mkdir "$work/no-pictures"
! "$p/bin/osteo" calibrate-camera "$work/no-pictures" 2>"$work/said" || { echo "an empty folder calibrates a camera"; exit 1; }
grep -q "holds no picture" "$work/said" || { cat "$work/said"; exit 1; }
# Slicer starts a module alone, from anywhere: XML on standard output and nothing beside it.
(cd / && "$p/share/osteo/slicer/OsteoThreshold" --xml >"$work/t.xml" 2>"$work/t.err") && [ ! -s "$work/t.err" ] && head -c 5 "$work/t.xml" | grep -q '<?xml' && cmp "$work/t.xml" "$p/share/osteo/slicer/OsteoThreshold.xml"
bash -n "$p/share/bash-completion/completions/osteo"
! command -v man >/dev/null || { man --warnings=w -l "$p/share/man/man1/osteo-threshold.1" 2>&1 >/dev/null | grep . && exit 1 || true; }
! command -v zsh >/dev/null || zsh -n "$p/share/zsh/site-functions/_osteo"
! command -v fish >/dev/null || fish -n "$p/share/fish/vendor_completions.d/osteo.fish"
! command -v desktop-file-validate >/dev/null || desktop-file-validate "$p/share/applications/osteo.desktop"
! command -v xmllint >/dev/null || xmllint --noout "$p/share/mime/packages/osteo.xml" "$p"/share/osteo/slicer/*.xml
# No path of the source or build tree in what others read.
! grep -rlF -e "$source/libs" -e "$build" "$p"/lib*/cmake "$p"/lib/*/cmake 2>/dev/null || { echo "the installation names the tree it was built in"; exit 1; }
outside() { cmake -S "$source/tests/setup/outside" -B "$work/outside" -DCMAKE_PREFIX_PATH="$p" -DCMAKE_BUILD_TYPE=Release "$@" >"$work/said" 2>&1; }
! outside -DEXAMPLES="imaging;hearing" || { echo "a component that does not exist was found"; exit 1; }
tr -s ' \n' ' ' <"$work/said" | grep -q "osteo has no component 'hearing'. This installation has: base .* geometry" || { tail -30 "$work/said"; exit 1; }
outside -DEXAMPLES="imaging;geometry;haptics;tissue;session;assessment;display" || { tail -30 "$work/said"; exit 1; }
cmake --build "$work/outside" >"$work/said" 2>&1 || { tail -30 "$work/said"; exit 1; }
# Each component's example knows what must come out.
ctest --test-dir "$work/outside" --output-on-failure >"$work/said" 2>&1 || { tail -60 "$work/said"; exit 1; }
grep -q '100% tests passed, 0 tests failed out of 8' "$work/said" || { tail -20 "$work/said"; exit 1; }
cd "$work" && "$work/outside/outside" | grep -q '4 triangles, watertight: yes, 36.000 mm3'
echo "installed, found from outside and run"
