#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/oflog/oflog.h>

#include <cstdio>
#include <mutex>

#include "dcmtk_tools.h"

namespace osteo::dicom {

void quiet_dcmtk() {
  static std::once_flag once;
  std::call_once(once, [] { OFLog::configure(OFLogger::OFF_LOG_LEVEL); });
}

std::string uid_of(const std::string& hex) {
  // Long division of a 128-bit number in base 16 by 10.
  std::string digits;
  std::string number = hex.substr(0, 32);
  while (!number.empty()) {
    int remainder = 0;
    std::string quotient;
    for (const char c : number) {
      const int value = remainder * 16 + (c <= '9' ? c - '0' : c - 'a' + 10);
      const int q = value / 10;
      remainder = value % 10;
      if (!quotient.empty() || q > 0) quotient += "0123456789abcdef"[q];
    }
    digits.insert(digits.begin(), static_cast<char>('0' + remainder));
    number = quotient;
  }
  return "2.25." + digits;
}

void require(const OFCondition& condition, const fs::path& path) {
  if (condition.good()) return;
  throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + condition.text(),
              "see that the disk has room and the folder may be written");
}

std::string decimal(double value) {
  char text[40];
  for (int precision = 15; precision > 0; --precision) {
    std::snprintf(text, sizeof text, "%.*g", precision, value == 0 ? 0.0 : value);
    if (std::char_traits<char>::length(text) <= 16) break;
  }
  return text;
}

}  // namespace osteo::dicom
