"""The command `osteo` of a wheel: the program beside this file, with what came along for machines that lack it."""

import os
import pathlib
import sys

HERE = pathlib.Path(__file__).parent


def environment():
    """Letters for reports, beside the machine's own, and the names of DICOM's attributes; what is set already stays."""
    return {
        "FONTCONFIG_FILE": str(HERE / "data/fonts.conf"),
        "DCMDICTPATH": str(HERE / "data/dicom.dic"),
        **os.environ,
    }


def main():
    os.execve(HERE / "bin/osteo", ["osteo", *sys.argv[1:]], environment())
