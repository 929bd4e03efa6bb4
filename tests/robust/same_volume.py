#!/usr/bin/env python3
"""Whether two NRRD files hold the same header and the same values, whichever library packed them.

usage: same_volume.py ONE.nrrd OTHER.nrrd
"""

import gzip, pathlib, sys


def parts(path):
    header, _, data = pathlib.Path(path).read_bytes().partition(b'\n\n')
    return header, gzip.decompress(data) if b'encoding: gzip' in header else data


one, other = (parts(a) for a in sys.argv[1:3])
for what, a, b in zip(('header', 'values'), one, other):
    if a != b:
        sys.exit(f'{sys.argv[1]} and {sys.argv[2]}: another {what}')
