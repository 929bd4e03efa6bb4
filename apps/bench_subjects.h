// What osteo_bench measures: one table, for it and for the help of 'osteo bench'.
#pragma once
#include <array>
#include <string>
#include <string_view>

namespace osteo {

struct BenchSubject {
  std::string_view name;
  std::string_view help;
  bool in_all = true;
};

/// In the order in which "all" runs them. Import first: it measures in processes of its own, which must start before
/// any thread does.
inline constexpr std::array kBenchSubjects{
    BenchSubject{"import", "DICOM to a volume"},
    BenchSubject{"bone", "resampling and surface"},
    BenchSubject{"haptics", "contact, removal, god-object, stability, real time"},
    BenchSubject{"operation", "scenes that are operated on: latency, split, plates, regions"},
    BenchSubject{"tissue", "finite elements, the fast model, its calibration"},
    BenchSubject{"haptics-fuzz", "random poses through the whole renderer; not part of all", false},
    BenchSubject{"haptics-hands", "what a tick of 1, 2 and 4 hands costs; not part of all", false},
    BenchSubject{"ground-truth", "renderers against known solids; writes out/ground-truth; not part of all", false},
    BenchSubject{"removal", "what is removed against what the burr swept"},
    BenchSubject{"slices", "bone from thick slices, against exact bodies"},
    BenchSubject{"registration", "a second scan onto the first, against known motions and SimpleITK"},
    BenchSubject{"tutoring", "a hand that leads another: bad networks, playback, a flood; not part of all", false},
    BenchSubject{"network",
                 "what the servo feels of listeners that are flooded, and of all that is listed; not part of all",
                 false},
    BenchSubject{"geometry", "distances, voxels, tetrahedra, curves, masks, skins"},
};

/// "all, import, bone, ... or geometry"
[[nodiscard]] inline std::string bench_subject_names() {
  std::string text = "all";
  for (const BenchSubject& s : kBenchSubjects) text.append(&s == &kBenchSubjects.back() ? " or " : ", ").append(s.name);
  return text;
}

}  // namespace osteo
