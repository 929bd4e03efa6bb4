// What a tagged PDF says beyond cairo's tags. Private to libs/core/report.
#pragma once
#include <string>
#include <vector>

namespace osteo::report {

/// Adds what cairo cannot be told to a PDF that it wrote (1.4, unpacked): the language, the scope of a table's heads,
/// and what each figure shows, in the order in which they were drawn. A file that is laid out otherwise stays as it is.
void describe(std::string& pdf, const std::vector<std::string>& shown);

}  // namespace osteo::report
