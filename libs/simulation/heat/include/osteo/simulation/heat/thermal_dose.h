// How much heat does to tissue.
#pragma once

namespace osteo::inline simulation {

/// Cumulative equivalent minutes at 43 C (Sapareto and Dewey 1984): minutes of dose a second at a temperature. R = 0.5
/// from 43 C on, 0.25 below, nothing below 39 C. Trusted to about 52 C only: above kCoagulatedC tissue is coagulated,
/// whatever the minutes.
[[nodiscard]] double cem43_per_s(double celsius) noexcept;
inline constexpr double kCoagulatedC = 57;
/// 47 C for a minute, the classic limit of bone (Eriksson and Albrektsson 1983), as such minutes.
inline constexpr double kBoneLimitCem43 = 16;

/// Of one place: what it has been through.
struct ThermalDose {
  double peak_c = 0;        ///< highest temperature
  double cem43_min = 0;     ///< dose
  bool coagulated = false;  ///< it was at kCoagulatedC or above
  void stay(double celsius, double seconds) noexcept;
};

}  // namespace osteo::inline simulation
