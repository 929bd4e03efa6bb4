# Dice of labels found against true ones on the same grid, by structure; ends with 1 where one is below its bar.
# usage: dice.py FOUND TRUTH FOUND_VALUE=TRUE_VALUE[+TRUE_VALUE...]:BAR...
import collections
import gzip
import sys


def read(path):
    head, _, body = open(path, "rb").read().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line)
    assert fields["type"] in ("uchar", "uint8", "unsigned char"), fields
    return fields["sizes"], gzip.decompress(body) if fields["encoding"] in ("gzip", "gz") else body


(found_size, found), (true_size, truth) = read(sys.argv[1]), read(sys.argv[2])
assert found_size == true_size and len(found) == len(truth), (found_size, true_size)
met = collections.Counter(zip(found, truth))
below = []
for row in sys.argv[3:]:
    values, bar = row.split(":")
    value, wanted = values.split("=")
    value, wanted = int(value), {int(v) for v in wanted.split("+")}
    both = sum(n for (f, t), n in met.items() if f == value and t in wanted)
    total = sum(n for (f, t), n in met.items() if f == value) + sum(n for (f, t), n in met.items() if t in wanted)
    dice = 2 * both / total if total else 0
    print(f"{values} {dice:.3f} of at least {bar}")
    below += [row] * (dice < float(bar))
assert not below, below
