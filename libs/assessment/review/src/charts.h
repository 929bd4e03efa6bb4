// Charts of a review as drawings: the same on the page (where a script makes the timeline livelier) and on paper.
#pragma once
#include "osteo/assessment/review/review.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::review {

[[nodiscard]] sheet::Drawing timeline_chart(const Review& review);
[[nodiscard]] sheet::Drawing profile_chart(const ForceProfile& profile, bool reference);
/// One row: what it is, this session among the others, in words. Empty where nothing can be compared.
[[nodiscard]] sheet::Drawing comparison_chart(const Comparison& comparison);
/// In the language of the page; a review without such texts is shown as it is.
[[nodiscard]] ReviewTexts texts_of(const Review& review);
[[nodiscard]] const std::string& shown_caption(const ReviewPicture& picture);
/// "3:07", "1:02:03": the second that has begun.
[[nodiscard]] std::string clock(double seconds);
/// For people: "share of bone seen", and its value as they say it.
[[nodiscard]] std::string_view plain_name(std::string_view metric);
[[nodiscard]] std::string reported_value(const MetricRow& row, double value);

}  // namespace osteo::inline assessment::review
