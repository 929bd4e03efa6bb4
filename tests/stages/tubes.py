# A half ring and a rod, as a jaw and a fibula of which the plan is plain: jaw.obj, fibula.obj.
import math


def tube(name, place, n):
    o = open(name, "w")
    for k in range(n + 1):
        c, u, v = place(k / n)
        for a in range(24):
            x, y = 6 * math.cos(math.pi * a / 12), 6 * math.sin(math.pi * a / 12)
            print("v", *(c[i] + x * u[i] + y * v[i] for i in range(3)), file=o)
    for k in range(n):
        for a in range(24):
            b, p, q = (a + 1) % 24, 24 * k + 1, 24 * k + 25
            print("f", p + a, q + b, p + b, file=o)
            print("f", p + a, q + a, q + b, file=o)
    for a in range(1, 23):
        e = 24 * n + 1
        print("f", 1, a + 1, a + 2, file=o)
        print("f", e, e + a + 1, e + a, file=o)


tube(
    "jaw.obj",
    lambda t: (
        (45 * math.cos(math.pi * t), 45 * math.sin(math.pi * t), 0),
        (math.cos(math.pi * t), math.sin(math.pi * t), 0),
        (0, 0, 1),
    ),
    90,
)
tube("fibula.obj", lambda t: ((0, 0, -300 * t), (1, 0, 0), (0, 1, 0)), 100)
