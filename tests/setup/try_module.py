# The module for Python where it was installed: it computes by itself, opens what the program made, and draws without a
# display. Read from standard input, with a case and a session of it as arguments.
import sys
import numpy as np
import osteo

ct, labels = osteo.phantom(region="temporal", spacing_mm=2.0)
surface = osteo.surface(osteo.resample(ct, osteo.threshold(ct, lower=500), spacing_mm=2.0, lower=500)[0])
assert len(surface.triangles) > 1000, len(surface.triangles)
assert osteo.Session(sys.argv[2]).ticks["force_n"].any()
with osteo.Rehearsal(sys.argv[1]) as r:
    assert len(r.run(osteo.goals(np.zeros((10, 3)), tool="cutting 4 mm"))) == 10
assert osteo.snapshot(surface).max() > 0
print("module for Python:", len(surface.triangles), "triangles")
