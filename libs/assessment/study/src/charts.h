// Pictures of what the tables say. Private to libs/assessment/study.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "osteo/core/report/sheet.h"
#include "osteo/core/statistics/compare.h"

namespace osteo::inline assessment::study {

/// Each group's people as dots beside their box (quartiles, whiskers to the ends), and the mean with its t interval to
/// the right of it.
[[nodiscard]] sheet::Plot groups_chart(const std::string& id, const std::string& outcome,
                                       const std::vector<std::string>& groups,
                                       const std::vector<std::vector<double>>& people, double level);
/// A metric against the rating: a dot a session, the least-squares line with the interval of the mean where there are
/// five or more. `marked`: drawn full, the others hollow.
[[nodiscard]] sheet::Plot scatter_chart(const std::string& id, const std::string& metric, const std::string& rating,
                                        std::span<const double> x, std::span<const double> y,
                                        const std::vector<bool>& marked, double level);
[[nodiscard]] sheet::Plot roc_chart(const std::string& id, const std::string& outcome, const statistics::Roc& roc);
/// Of two raters: difference against mean, with mean difference and limits of agreement (Bland and Altman 1986). Equal
/// points are moved apart a little, so that they can be counted.
[[nodiscard]] sheet::Plot agreement_chart(const std::string& id, const std::string& title,
                                          std::span<const double> first, std::span<const double> second);

/// An axis around values, with ticks at round numbers: at least two.
[[nodiscard]] sheet::Plot::Axis axis_around(std::span<const double> values, const std::string& name);

/// Two plots a row.
[[nodiscard]] SheetBlocks in_rows(std::vector<sheet::Plot> plots);

}  // namespace osteo::inline assessment::study
