// Which pipeline a series goes through, by rules that a person writes.
#pragma once
#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/files.h"

namespace osteo::inline hospital {

/// What rules look at.
struct SeriesFacts {
  std::string modality, description;
  double slice_mm = 0;      ///< SliceThickness; 0: not said
  std::size_t objects = 0;  ///< files that have come
  bool scan = false;        ///< of a class that bone is made from: CT, MR and their enhanced forms
  bool own = false;         ///< made by this program
};

/// All that is given must hold.
struct SeriesRule {
  std::string name;
  std::string modality;              ///< empty: any
  std::vector<std::string> any_of;   ///< the description has at least one of these, whatever its case; empty: any
  std::vector<std::string> none_of;  ///< and none of these
  double least_mm = 0,
         most_mm =
             std::numeric_limits<double>::infinity();  ///< slice thickness; a bound is not met by a thickness not said
  std::size_t least_objects = 1;
  bool ignore = false;                     ///< matching series are left alone
  fs::path pipeline;                       ///< empty: the built-in one
  std::map<std::string, std::string> set;  ///< variables of the pipeline
};

/// {"osteotome_rules": 1, "rules": [{"name", "modality", "any_of", "none_of", "slice_mm": [least, most],
/// "least_objects", "pipeline" or "ignore", "set"}, ...]}. Pipelines are resolved by the file's folder; that they are
/// there is not looked up. Error(usage) with file and line for what is not known, there twice, out of range, or a name
/// given twice.
[[nodiscard]] std::vector<SeriesRule> read_series_rules(std::string_view text, const fs::path& file);

struct RuleChoice {
  const SeriesRule* rule = nullptr;  ///< the first that matches; null: none
  std::string why;                   ///< of each rule before it, what does not hold; without values of the series
};
/// Our own objects, and what is no scan, match no rule.
[[nodiscard]] RuleChoice choose_rule(const std::vector<SeriesRule>& rules, const SeriesFacts& facts);

}  // namespace osteo::inline hospital
