#!/bin/sh
# The hard cases beside dcm2niix, vtk-dicom, SimpleITK and GDCM, in one run: scoreboard.sh [OSTEO [NUMBER...]]
# The readers come from PyPI into build/peers; vtk-dicom's from Debian (vtk-dicom-tools).
set -eu
root=$(cd "$(dirname "$0")/../../.." && pwd)
osteo=${1:-$root/build/release/bin/osteo}
[ $# -gt 0 ] && shift
peers=$root/build/peers
[ -x "$peers/bin/python" ] || python3 -m venv "$peers"
"$peers/bin/python" -c 'import SimpleITK, gdcm, dcm2niix, nibabel, pydicom, pylibjpeg, openjpeg, jpeg_ls, imagecodecs' 2>/dev/null ||
  "$peers/bin/pip" -q install SimpleITK python-gdcm dcm2niix nibabel 'pydicom>=3' numpy pylibjpeg pylibjpeg-openjpeg pyjpegls imagecodecs
command -v dicomtonifti >/dev/null || { echo "vtk-dicom's dicomtonifti is missing: apt-get install vtk-dicom-tools" >&2; exit 1; }
exec "$peers/bin/python" "$root/tests/bench/import/scoreboard.py" "$osteo" "${OSTEO_SHARED_DATA:-$root/../shared/data}" "$@"
