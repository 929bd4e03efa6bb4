// The subjects of osteo_bench. Each prints tables in Markdown.
#pragma once
#include "osteo/core/base/context.h"

namespace osteo {

void bench_bone(const Context& context);      ///< resampling, surface
void bench_geometry(const Context& context);  ///< distances, voxels, tetrahedra, curves, masks, skins
void bench_haptics(const Context& context);   ///< contact, removal, god-object, stability, real time
void bench_haptics_hands(const Context& context);
void bench_haptics_fuzz(const Context& context);
void bench_ground_truth(const Context& context);  ///< renderers against known solids; writes files too
void bench_removal(const Context& context);       ///< what is removed against what the burr swept
void bench_operation(const Context& context);     ///< scenes that are operated on: latency, split, plates, regions
void bench_tissue(const Context& context);        ///< finite elements, the fast model, its calibration
void bench_network(const Context& context);       ///< listeners of a session that is told to the network, flooded
void bench_tutoring(const Context& context);  ///< a hand that leads another, over a bad network and from a recording
void bench_slices(const Context& context);    ///< bone from thick slices
void bench_registration(const Context& context);  ///< a second scan onto the first
void bench_import(const Context& context);        ///< DICOM to a volume

}  // namespace osteo
