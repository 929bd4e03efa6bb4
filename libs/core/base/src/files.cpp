#include "osteo/core/base/files.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <set>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

constexpr std::size_t kHashedAtOnce = std::size_t{1} << 17;

// Temporaries in flight, so that a cancelled run can remove what it was writing.
std::mutex g_temporaries_mutex;
std::set<fs::path>& temporaries() {
  static std::set<fs::path> set;
  return set;
}

class Temporary {
 public:
  explicit Temporary(const fs::path& target) {
    static std::atomic<int> counter{0};
    const std::string suffix = target.filename().string();
    path_ = target.parent_path() /
            (".osteo-tmp-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + "-" + suffix);
    const std::lock_guard lock(g_temporaries_mutex);
    temporaries().insert(path_);
  }
  ~Temporary() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    const std::lock_guard lock(g_temporaries_mutex);
    temporaries().erase(path_);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

[[noreturn]] void throw_write_error(const fs::path& path, int error) {
  std::string advice;
  if (error == ENOSPC || error == EDQUOT) advice = "free some space, or write to another disk";
  if (error == EACCES || error == EPERM || error == EROFS) advice = "choose a folder that you may write to";
  if (error == ENOENT) advice = "create the folder first";
  throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + std::strerror(error), advice);
}

void sync_path(const fs::path& path, const fs::path& shown, int (*sync)(int) = ::fsync) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw_write_error(shown, errno);
  const int rc = sync(fd);
  const int error = errno;
  ::close(fd);
  // Some file systems cannot sync folders; that is no reason to lose a result.
  if (rc != 0 && error != EINVAL && error != ENOTSUP) throw_write_error(shown, error);
}

// Some libraries do not notice that a disk filled up under them. A file that ends exactly with the disk's last block is
// taken for cut: better a good file rejected than a cut one accepted.
void require_space_left(const fs::path& path) {
  std::error_code ec;
  const auto space = fs::space(path.has_parent_path() ? path.parent_path() : fs::path("."), ec);
  // Some file systems in user space tell of no blocks at all: that is no full disk.
  if (!ec && space.capacity > 0 && space.free == 0) throw_write_error(path, ENOSPC);
}

void prepare_parent(const fs::path& path) {
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ec;
  if (!fs::is_directory(parent, ec)) {
    if (ec && ec.value() != ENOENT) throw_write_error(path, ec.value());
    throw Error(ExitCode::cannot_write,
                "cannot write '" + path.string() + "': there is no folder '" + parent.string() + "'",
                "create the folder first");
  }
  if (::access(parent.c_str(), W_OK) != 0) throw_write_error(path, errno);
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::error_code ec;
  std::string pattern = (fs::temp_directory_path(ec) / "osteo-XXXXXX").string();
  if (ec || ::mkdtemp(pattern.data()) == nullptr) throw_write_error(pattern, ec ? ec.value() : errno);
  path_ = pattern;
  const std::lock_guard lock(g_temporaries_mutex);
  temporaries().insert(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  const std::lock_guard lock(g_temporaries_mutex);
  temporaries().erase(path_);
}

void require_readable(const fs::path& path) {
  std::error_code ec;
  const auto status = fs::status(path, ec);
  if (ec && ec.value() == EACCES) {
    throw Error(ExitCode::cannot_read, "cannot read '" + path.string() + "': permission denied");
  }
  if (!fs::exists(status)) throw Error(ExitCode::no_input, "there is no file or folder '" + path.string() + "'");
  const int mode = fs::is_directory(status) ? R_OK | X_OK : R_OK;
  // Root passes access() on files without any read bit. A file nobody may read is rejected for root as well: the
  // hospital server that runs as root should behave like the workstation where the case was tried.
  const bool no_read_bit =
      (status.permissions() & (fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read)) ==
      fs::perms::none;
  if (::access(path.c_str(), mode) != 0 || no_read_bit) {
    throw Error(ExitCode::cannot_read, "cannot read '" + path.string() + "': permission denied",
                "ask the owner for read permission");
  }
}

std::vector<std::byte> read_file(const fs::path& path) {
  require_readable(path);
  if (fs::is_directory(path)) throw Error(ExitCode::cannot_read, "'" + path.string() + "' is a folder, not a file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(ExitCode::cannot_read, "cannot read '" + path.string() + "': " + std::strerror(errno));
  if (!in.seekg(0, std::ios::end)) {
    // A pipe has no size: it is read until it ends.
    in.clear();
    std::vector<std::byte> bytes;
    std::array<char, 1 << 16> part{};
    while (in.read(part.data(), part.size()), in.gcount() > 0) {
      const auto* const first = reinterpret_cast<const std::byte*>(part.data());
      bytes.insert(bytes.end(), first, first + in.gcount());
    }
    if (in.bad()) throw Error(ExitCode::cannot_read, "cannot read '" + path.string() + "': " + std::strerror(errno));
    return bytes;
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(in.tellg()));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw Error(ExitCode::cannot_read, "cannot read '" + path.string() + "': " + std::strerror(errno));
  return bytes;
}

std::string read_text(const fs::path& path) {
  const auto bytes = read_file(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void write_atomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  prepare_parent(path);
  std::error_code ec;
  if (const auto status = fs::symlink_status(path, ec); fs::is_directory(fs::status(path, ec))) {
    throw Error(ExitCode::cannot_write, "'" + path.string() + "' is a folder, not a file", "give another name");
  } else if (fs::is_other(status)) {
    throw Error(ExitCode::cannot_write, "'" + path.string() + "' is a device or pipe, not a file", "give another name");
  }
  const Temporary temporary(path);
  write(temporary.path());
  sync_path(temporary.path(), path);
  require_space_left(path);
  if (::rename(temporary.path().c_str(), path.c_str()) != 0) throw_write_error(path, errno);
}

void write_file(const fs::path& path, std::string_view content) {
  write_atomically(path, [&](const fs::path& temporary) {
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) throw_write_error(path, errno);
    std::size_t done = 0;
    while (done < content.size()) {
      const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) {
        const int error = errno;
        ::close(fd);
        throw_write_error(path, error);
      }
      done += static_cast<std::size_t>(n);
    }
    if (::close(fd) != 0) throw_write_error(path, errno);
  });
}

fs::path output_folder(const fs::path& path) {
  std::error_code ec;
  fs::path target = path.lexically_normal();
  if (!target.has_filename() && target.has_parent_path() && target != target.root_path()) target = target.parent_path();
  if (!output_exists(target)) return target;
  if (!fs::is_directory(fs::status(target, ec))) {
    const bool nowhere = fs::is_symlink(target, ec) && !fs::exists(target, ec);
    throw Error(ExitCode::cannot_write,
                "'" + path.string() + "' is a " + (nowhere ? "link that leads nowhere" : "file") + ", not a folder",
                "give another name, or move it away");
  }
  target = fs::canonical(target, ec);
  if (ec) throw_write_error(path, ec.value());
  const fs::path here = fs::current_path(ec);
  const auto [end, unused] = std::mismatch(target.begin(), target.end(), here.begin(), here.end());
  if (end == target.end()) {
    throw Error(ExitCode::cannot_write,
                "'" + path.string() + "' is the folder you are in, or holds it: it cannot be replaced",
                "give the name of a new folder");
  }
  return target;
}

namespace {

// One step: at any moment both names are there. False where the file system cannot.
bool exchange(const fs::path& a, const fs::path& b) {
  return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
}

}  // namespace

void write_folder_atomically(const fs::path& path, const std::function<void(const fs::path&)>& may_replace,
                             const std::function<void(const fs::path&)>& fill) {
  const fs::path target = output_folder(path);
  prepare_parent(target);
  std::error_code ec;
  const auto ask = [&] {
    if (!output_exists(target) || fs::is_empty(target, ec)) return;
    if (!may_replace) {
      throw Error(ExitCode::cannot_write, "'" + path.string() + "' exists already",
                  "give another name, or --force to replace it");
    }
    may_replace(target);
  };
  ask();
  const Temporary temporary(target);
  fs::create_directory(temporary.path(), ec);
  if (ec) throw_write_error(target, ec.value());
  fill(temporary.path());
  sync_path(temporary.path(), target, ::syncfs);  // all of it at once, however many files
  require_space_left(target);
  ask();
  // An empty folder, and a name that is free, are taken by the plain rename.
  fs::rename(temporary.path(), target, ec);
  if (!ec || exchange(temporary.path(), target)) return;
  if (ec.value() != ENOTEMPTY && ec.value() != EEXIST) throw_write_error(target, ec.value());
  // Some file systems cannot exchange: the old folder steps aside under a name of its own, which no clean-up removes,
  // until the new one is there.
  const fs::path aside = target.string() + ".old-" + std::to_string(::getpid());
  fs::rename(target, aside, ec);
  if (ec) throw_write_error(target, ec.value());
  fs::rename(temporary.path(), target, ec);
  if (ec) {
    const int error = ec.value();
    fs::rename(aside, target, ec);
    throw_write_error(target, error);
  }
  fs::remove_all(aside, ec);
}

bool output_exists(const fs::path& path) {
  std::error_code ec;
  const auto status = fs::symlink_status(path, ec);
  if (ec && ec.value() != ENOENT && ec.value() != ENOTDIR) throw_write_error(path, ec.value());
  return fs::exists(status);
}

void make_output_folder(const fs::path& path) {
  std::error_code ec;
  if (output_exists(path) && !fs::is_directory(path, ec)) {
    if (ec) throw_write_error(path, ec.value());
    throw Error(ExitCode::cannot_write, "'" + path.string() + "' is a file, not a folder",
                "give another name, or move it away");
  }
  fs::create_directories(path, ec);
  if (ec) throw_write_error(path, ec.value());
}

Error error_of(const fs::filesystem_error& error) {
  // To open a folder takes memory too.
  if (error.code() == std::errc::not_enough_memory)
    return {ExitCode::resources, "out of memory", "use larger voxels or a smaller region"};
  std::error_code ec;
  const fs::path path = error.path2().empty() ? error.path1() : error.path2();
  const bool there = fs::exists(fs::symlink_status(path, ec));
  if (there && ::access(path.c_str(), fs::is_directory(path, ec) ? R_OK | X_OK : R_OK) != 0) {
    return {ExitCode::cannot_read, "cannot read '" + path.string() + "': " + error.code().message(),
            "ask the owner for permission"};
  }
  return {ExitCode::cannot_write, "cannot use '" + path.string() + "': " + error.code().message(),
          "choose a place that you may write to"};
}

void remove_temporaries() noexcept {
  const std::lock_guard lock(g_temporaries_mutex);
  for (const fs::path& path : temporaries()) {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
}

Hasher::Hasher() : state_(XXH3_createState()) {
  XXH3_128bits_reset(static_cast<XXH3_state_t*>(state_));
}
Hasher::~Hasher() {
  XXH3_freeState(static_cast<XXH3_state_t*>(state_));
}
void Hasher::add(const void* data, std::size_t bytes) {
  XXH3_128bits_update(static_cast<XXH3_state_t*>(state_), data, bytes);
}

std::string Hasher::hex() const {
  const XXH128_hash_t h = XXH3_128bits_digest(static_cast<const XXH3_state_t*>(state_));
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, h);
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : canonical.digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string hash_bytes(std::span<const std::byte> bytes) {
  Hasher h;
  h.add(bytes.data(), bytes.size());
  return h.hex();
}

std::string hash_text(std::string_view text) {
  return hash_bytes(std::as_bytes(std::span(text.data(), text.size())));
}

namespace {

// What cannot be read is as if it ended there: require_readable() has been asked.
std::string hash_plain_file(const fs::path& file) {
  // One for all files of a folder, small enough to stay in the processor's cache.
  thread_local const std::unique_ptr<std::byte[]> buffer(new std::byte[kHashedAtOnce]);
  Hasher h;
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return h.hex();
  for (;;) {
    const ssize_t n = ::read(fd, buffer.get(), kHashedAtOnce);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    h.add(buffer.get(), static_cast<std::size_t>(n));
  }
  ::close(fd);
  return h.hex();
}

}  // namespace

std::string hash_path(const fs::path& path) {
  require_readable(path);
  if (!fs::is_directory(path)) return hash_plain_file(path);
  std::vector<std::string> hashes;
  try {
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file()) hashes.push_back(hash_path(entry.path()));
    }
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
  std::sort(hashes.begin(), hashes.end());
  std::string all;
  for (const auto& h : hashes) all += h;
  return hash_text(all);
}

std::map<std::string, std::string> hash_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  try {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const bool plain = entry.is_regular_file() && !entry.is_symlink();
      if (!plain && entry.is_directory() && !entry.is_symlink()) continue;
      files[entry.path().lexically_relative(folder).string()] = plain ? hash_path(entry.path()) : std::string();
    }
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
  return files;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024.0 / 1e6;
}

}  // namespace osteo
