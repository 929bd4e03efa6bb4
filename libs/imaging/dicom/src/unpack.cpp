#include "unpack.h"

#include <archive.h>
#include <archive_entry.h>

#include <fstream>
#include <memory>

#include "osteo/core/base/error.h"

namespace osteo::inline imaging::dicom {

namespace fs = std::filesystem;

std::vector<Unpacked> unpack(const fs::path& path, const fs::path& to, const Context& context) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> in(archive_read_new(), &archive_read_free);
  archive_read_support_filter_all(in.get());
  archive_read_support_format_all(in.get());
  const auto fail = [&](const char* what) {
    const char* const why = archive_error_string(in.get());
    return Error(ExitCode::corrupt, "'" + path.string() + "' cannot be unpacked: " + (why != nullptr ? why : what),
                 "unpack it by hand and give the folder");
  };
  if (archive_read_open_filename(in.get(), path.c_str(), 1 << 16) != ARCHIVE_OK) throw fail("it is not an archive");
  std::vector<Unpacked> result;
  std::vector<char> buffer(1 << 20);
  archive_entry* entry = nullptr;
  std::uint64_t total = 0;
  std::error_code ec;
  const auto size = static_cast<double>(std::max<std::uintmax_t>(fs::file_size(path, ec), 1));
  for (;;) {
    const int status = archive_read_next_header(in.get(), &entry);
    if (status == ARCHIVE_EOF) break;
    if (status < ARCHIVE_WARN) throw fail("its index is damaged");
    if (archive_entry_filetype(entry) != AE_IFREG) continue;
    const char* const name = archive_entry_pathname(entry);
    Unpacked u{to / ("unpacked-" + std::to_string(result.size())),
               name != nullptr ? name : "file-" + std::to_string(result.size())};
    std::ofstream out(u.file, std::ios::binary);
    for (;;) {
      const la_ssize_t n = archive_read_data(in.get(), buffer.data(), buffer.size());
      if (n == 0) break;
      if (n < 0) throw fail("a file in it is damaged");
      total += static_cast<std::uint64_t>(n);
      // Whatever the archive claims, half a gigabyte stays free.
      const auto space = fs::space(to, ec);
      if (!ec && space.available < (std::uintmax_t{1} << 29)) {
        throw Error(ExitCode::resources,
                    "'" + path.string() + "' does not fit into the temporary folder after " +
                        std::to_string(total >> 20) + " MB",
                    "set TMPDIR to a folder with more room, or unpack it by hand");
      }
      out.write(buffer.data(), n);
      context.progress(std::min(0.99, static_cast<double>(archive_filter_bytes(in.get(), -1)) / size), "unpacking");
    }
    out.close();
    if (!out)
      throw Error(ExitCode::cannot_write, "cannot write '" + u.file.string() + "'",
                  "set TMPDIR to a folder with more room");
    result.push_back(std::move(u));
  }
  return result;
}

}  // namespace osteo::inline imaging::dicom
