# SimpleITK's rigid registration with the optimizer that does best here, on what osteo_bench hands over. usage: peers_registration.py FOLDER NAME
# Prints a row of osteo_bench's table, started from the moments of both.
import pathlib, sys, time
import numpy as np
import SimpleITK as sitk

folder, name = pathlib.Path(sys.argv[1]), sys.argv[2]
sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(2)
first = sitk.ReadImage(str(folder / "first.nrrd"), sitk.sitkFloat32)
second = sitk.ReadImage(str(folder / "second.nrrd"), sitk.sitkFloat32)
truth = sitk.ReadTransform(str(folder / "truth.tfm"))
targets = [(60.0 * x, 60.0 * y, 60.0 * z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]

for who, start in (("moments", sitk.CenteredTransformInitializerFilter.MOMENTS),):
    begin = time.time()
    initial = sitk.CenteredTransformInitializer(first, second, sitk.Euler3DTransform(), start)
    r = sitk.ImageRegistrationMethod()
    r.SetMetricAsMattesMutualInformation(numberOfHistogramBins=50)
    r.SetMetricSamplingStrategy(r.RANDOM)
    r.SetMetricSamplingPercentage(0.1, 1)
    r.SetInterpolator(sitk.sitkLinear)
    # Plain gradient descent, as in most examples, stops by its convergence window millimetres off.
    r.SetOptimizerAsRegularStepGradientDescent(
        learningRate=2.0, minStep=1e-3, numberOfIterations=300, gradientMagnitudeTolerance=1e-8
    )
    r.SetOptimizerScalesFromPhysicalShift()
    r.SetShrinkFactorsPerLevel([4, 2, 1])
    r.SetSmoothingSigmasPerLevel([2, 1, 0])
    r.SmoothingSigmasAreSpecifiedInPhysicalUnitsOn()
    r.SetInitialTransform(initial, inPlace=False)
    found = r.Execute(first, second)
    seconds = time.time() - begin
    off = np.mean([np.linalg.norm(np.subtract(truth.TransformPoint(t), found.TransformPoint(t))) for t in targets])
    print(f"| {name} | SimpleITK, from {who} | {off:.3f} | | | {seconds:.1f} |", flush=True)
