# The points of an .obj in another unit. usage: scaled.py IN FACTOR OUT
import sys

source, factor, target = sys.argv[1:]
with open(source) as f, open(target, "w") as out:
    for line in f:
        words = line.split()
        print(*("v", *(float(w) * float(factor) for w in words[1:])) if words[0] == "v" else words, file=out)
