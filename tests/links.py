#!/usr/bin/env python3
"""What makes force and writes sessions is linked without DICOM and VTK; what reads cameras (and loads codecs under the GPL) is in no program:
read from the commands that link."""

import re, subprocess, sys

build = sys.argv[1]
programs = ["test_bone", "test_haptics", "test_devices", "test_recording", "no_alloc"]
unwanted = re.compile(
    r"(?:lib|-l)(dcm\w*|ofstd|oflog|gdcm\w*|vtk\w*|archive|osteo_(?:dicom|io|stage|stages|pipeline))\b"
)
witness = "osteo"  # links them all: if its commands show none, this test looks for the wrong names


def linked(target):
    commands = subprocess.run(
        ["ninja", "-C", build, "-t", "commands", "-s", f"bin/{target}"], check=True, capture_output=True, text=True
    ).stdout
    link = [c for c in commands.splitlines() if f"-o bin/{target} " in c]
    if len(link) != 1:
        sys.exit(f"{target}: no command that links it")
    return sorted(set(unwanted.findall(link[0])))


bad = [f"{p} links {' '.join(found)}" for p in programs if (found := linked(p))]
seen = linked(witness)
for name in ("dcmdata", "vtkDICOM", "osteo_io"):
    if not any(s.startswith(name) for s in seen):
        bad.append(f"{witness} links no {name}: are the names still right? It links {' '.join(seen)}")
cameras = re.compile(r"opencv_(?:imgcodecs|videoio|highgui)\b")
for p in ("bin/osteo", "bin/osteo-rehearse"):
    commands = subprocess.run(["ninja", "-C", build, "-t", "commands", "-s", p], capture_output=True, text=True).stdout
    if found := sorted(set(cameras.findall(commands.splitlines()[-1] if commands else ""))):
        bad.append(f"{p} links {' '.join(found)}, which belong into osteo-camera.so alone")
if not cameras.search(
    subprocess.run(
        ["ninja", "-C", build, "-t", "commands", "-s", "lib/osteo/osteo-camera.so"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
):
    bad.append("osteo-camera.so links no part of OpenCV for cameras: are the names still right?")
print("\n".join(bad) or f"{' '.join(programs)}: without DICOM and VTK")
sys.exit(bool(bad))
