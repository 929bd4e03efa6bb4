#!/usr/bin/env python3
"""A renderer of its own for 'process:': the sphere that fits the corners of the mesh. What docs/validation/ground-truth.md shows as an example."""

import math
import sys
import time

stiffness, radius = 1.0, 0.0
for line in sys.stdin:
    words = line.split()
    if words[0] == "mesh":
        with open(line.split(maxsplit=1)[1].strip()) as off:
            off.readline()
            corners = int(off.readline().split()[0])
            for _ in range(corners):
                radius += math.dist((0, 0, 0), [float(v) for v in off.readline().split()]) / corners
    elif words[0] == "stiffness":
        stiffness = float(words[1])
    elif words[0] == "ready?":
        print("ready sphere", flush=True)
    elif words[0] == "at":
        began = time.perf_counter_ns()
        at = [float(v) for v in words[1:4]]
        far = math.dist((0, 0, 0), at)
        depth = max(0.0, radius - far)
        push = [v / far * depth * stiffness for v in at]
        touch = [v / far * max(far, radius) for v in at]
        took = time.perf_counter_ns() - began
        print("force", *push, "contact", int(depth > 0), *touch, "ns", took, flush=True)
