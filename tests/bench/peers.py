# Peers from PyPI on what osteo_bench hands over. usage: peers.py FOLDER; prints one line a peer: name|seconds|values file
import sys, time, pathlib, importlib
import numpy as np

folder = pathlib.Path(sys.argv[1])
what = sys.argv[2]


def have(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def show(name, seconds, values):
    file = folder / (name.replace(" ", "_").replace(",", "") + ".f64")
    np.asarray(values, np.float64).tofile(file)
    print(f"{name}|{seconds:.6f}|{file}", flush=True)


if what in ("points", "scattered"):
    all_of_them = what == "scattered"
    V = np.fromfile(folder / "v.f64").reshape(-1, 3)
    F = np.fromfile(folder / "f.u32", np.uint32).reshape(-1, 3)
    P = np.fromfile(folder / "p.f64").reshape(-1, 3)
    if fcpw := have("fcpw"):
        t = time.process_time()
        scene = fcpw.scene_3D()
        scene.set_object_count(1)
        scene.set_object_vertices(np.asfortranarray(V.astype(np.float32)), 0)
        scene.set_object_triangles(np.asfortranarray(F.astype(np.int32)), 0)
        scene.build(fcpw.aggregate_type.bvh_surface_area, True)
        near = fcpw.interaction_3D_list()
        scene.find_closest_points(np.asfortranarray(P.astype(np.float32)), np.full(len(P), 3e38, np.float32), near)
        seconds = time.process_time() - t
        show("FCPW (wheel), CPU s of all threads", seconds, [i.d for i in near])
    if igl := have("igl"):
        n = P if all_of_them else P[:: max(1, len(P) // 50000)]
        t = time.process_time()
        r = igl.signed_distance(n, V, F.astype(np.int64), sign_type=igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)
        seconds = (time.process_time() - t) * len(P) / len(n)
        show(
            "libigl pseudonormal" + ("" if all_of_them else ", from a sample"),
            seconds,
            r[0] if all_of_them else np.abs(r[0]),
        )
    if o3 := have("open3d"):
        n = P if all_of_them else P[:: max(1, len(P) // 200000)]
        t = time.process_time()
        scene = o3.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(o3.core.Tensor(V.astype(np.float32)), o3.core.Tensor(F))
        d = scene.compute_signed_distance(o3.core.Tensor(n.astype(np.float32)), nthreads=1).numpy()
        seconds = (time.process_time() - t) * len(P) / len(n)
        show("Open3D signed" + ("" if all_of_them else ", from a sample"), seconds, d if all_of_them else np.abs(d))
else:  # masks: z, y, x order
    nx, ny, nz, sx, sy, sz = np.fromfile(folder / "shape.f64")
    M = np.fromfile(folder / "mask.u8", np.uint8).reshape(int(nz), int(ny), int(nx))
    if edt := have("edt"):
        for threads in (1, 2):
            t = time.perf_counter()
            d = edt.edt(1 - M, anisotropy=(sz, sy, sx), parallel=threads)
            print(f"edt (PyPI), {threads} thread(s)|{time.perf_counter() - t:.6f}|-", flush=True)
        d.astype(np.float32).tofile(folder / "edt.f32")
    if ndi := have("scipy.ndimage"):
        t = time.perf_counter()
        ndi.distance_transform_edt(1 - M, sampling=(sz, sy, sx))
        print(f"SciPy|{time.perf_counter() - t:.6f}|-", flush=True)
    if sitk := have("SimpleITK"):
        image = sitk.GetImageFromArray(M)
        image.SetSpacing((sx, sy, sz))
        for threads in (1, 2):
            sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(threads)
            t = time.perf_counter()
            sitk.SignedMaurerDistanceMap(image, squaredDistance=False, useImageSpacing=True)
            print(f"SimpleITK Maurer (signed), {threads} thread(s)|{time.perf_counter() - t:.6f}|-", flush=True)
