// What the experiments share in making tables.
#pragma once
#include <string>

#include "osteo/assessment/ground_truth/experiments.h"

namespace osteo::inline assessment::truth {

/// With so many digits after the point.
[[nodiscard]] std::string fixed(double v, int digits);
/// With so many that count, without an exponent where that is readable.
[[nodiscard]] std::string digits(double v, int count);
/// Axis from `lo` to `hi` in steps that people read.
[[nodiscard]] sheet::Plot::Axis axis(double lo, double hi, const std::string& name);

struct RunAll {
  const GroundTruthOptions& options;
  const Context& context;
  GroundTruthResult& result;
};
/// The kinds of renderer that "solids" ranks and the special experiments take.
void run_friction(const RunAll& run);
void run_ridges(const RunAll& run);
void run_units(const RunAll& run);
void run_rates(const RunAll& run);
void run_smoothness(const RunAll& run);
void run_receding(const RunAll& run);
void run_layers(const RunAll& run);
void run_delay(const RunAll& run);
void run_vibration(const RunAll& run);
void run_texture(const RunAll& run);

}  // namespace osteo::inline assessment::truth
