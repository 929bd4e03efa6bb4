// Whether a text that is kept tells who somebody is: by words of a name, a number, the day of birth, a telephone
// number, however they are written. Private to pacs.
#pragma once
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace osteo::inline hospital::pacs {

/// Texts as DICOM holds them: UTF-8, else one byte a letter as in ISO 8859-1.
class Telling {
 public:
  void add_name(std::string_view text);  ///< words of four letters and more
  void add_birth_date(std::string_view yyyymmdd);
  void add_telephone(std::string_view text);
  /// What it tells: "a word of a person's name or number", "a person's day of birth", "a person's telephone number";
  /// empty when nothing is found.
  [[nodiscard]] std::string_view found_in(std::string_view text) const;

 private:
  struct Day {
    int year, month, day;
  };
  std::set<std::string> words_;
  std::vector<Day> days_;
  std::vector<std::string> telephones_;
};

}  // namespace osteo::inline hospital::pacs
