#include "sound.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace osteo::inline imaging::dicom {
namespace {

constexpr std::uint32_t kUndefinedLength = 0xFFFFFFFFU;
constexpr std::uint32_t kItem = 0xFFFEE000U, kItemEnd = 0xFFFEE00DU, kSequenceEnd = 0xFFFEE0DDU, kPixels = 0x7FE00010U;

class Walker {
 public:
  explicit Walker(const std::filesystem::path& file) : fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_ >= 0) size_ = static_cast<std::uint64_t>(::lseek(fd_, 0, SEEK_END));
  }
  ~Walker() {
    if (fd_ >= 0) ::close(fd_);
  }
  Walker(const Walker&) = delete;
  Walker& operator=(const Walker&) = delete;

  bool sound() {
    if (fd_ < 0 || size_ < 8) return false;
    std::array<char, 4> magic{};
    std::uint64_t at = 0;
    if (size_ >= 132 && copy(128, magic.data(), 4) && std::memcmp(magic.data(), "DICM", 4) == 0) {
      at = 132;
      if (!meta(at)) return false;
    } else {
      // Without meta header: an element of group 2 or 8, in either byte order.
      std::array<std::uint8_t, 6> head{};
      copy(0, head.data(), head.size());
      big_ = head[0] == 0;
      if (head[big_ ? 1 : 0] == 2 && !big_ && !meta(at)) return false;
    }
    if (!syntax_known_ && !guess(at)) return false;
    return elements(at, size_, false, 0);
  }

 private:
  bool copy(std::uint64_t at, void* to, std::size_t n) {
    if (at + n > size_) return false;
    if (at < window_at_ || at + n > window_at_ + window_.size()) {
      window_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(1 << 15, size_ - at)));
      if (::pread(fd_, window_.data(), window_.size(), static_cast<off_t>(at)) !=
          static_cast<ssize_t>(window_.size())) {
        window_.clear();
        return false;
      }
      window_at_ = at;
    }
    std::memcpy(to, window_.data() + (at - window_at_), n);
    return true;
  }
  bool u16(std::uint64_t at, std::uint32_t& v) {
    std::uint8_t b[2];
    if (!copy(at, b, 2)) return false;
    v = big_ ? static_cast<std::uint32_t>(b[0] << 8 | b[1]) : static_cast<std::uint32_t>(b[1] << 8 | b[0]);
    return true;
  }
  bool u32(std::uint64_t at, std::uint32_t& v) {
    std::uint32_t a = 0, b = 0;
    if (!u16(at, a) || !u16(at + 2, b)) return false;
    v = big_ ? a << 16 | b : b << 16 | a;
    return true;
  }

  struct Element {
    std::uint32_t tag = 0, length = 0;
    std::uint64_t value_at = 0;
    bool sequence = false, unknown = false;
  };
  bool read(std::uint64_t at, Element& e) {
    std::uint32_t group = 0, element = 0;
    if (!u16(at, group) || !u16(at + 2, element)) return false;
    e = {group << 16 | element, 0, at + 8, false, false};
    if (group == 0xFFFE || !explicit_) return u32(at + 4, e.length);
    char vr[2];
    if (!copy(at + 4, vr, 2)) return false;
    if (vr[0] < 'A' || vr[0] > 'Z' || vr[1] < 'A' || vr[1] > 'Z') return false;
    const std::string_view name(vr, 2);
    e.sequence = name == "SQ";
    e.unknown = name == "UN";
    const bool wide = e.sequence || e.unknown || name == "OB" || name == "OW" || name == "OF" || name == "OD" ||
                      name == "OL" || name == "OV" || name == "UT" || name == "UC" || name == "UR" || name == "SV" ||
                      name == "UV";
    if (!wide) return u16(at + 6, e.length);
    e.value_at = at + 12;
    return u32(at + 8, e.length);
  }

  // Group 2 is explicit little endian, whatever follows.
  bool meta(std::uint64_t& at) {
    explicit_ = true;
    big_ = false;
    for (int n = 0; n < 100; ++n) {
      std::uint32_t group = 0;
      if (!u16(at, group)) return at == size_;
      if (group != 2) return true;
      Element e;
      if (!read(at, e) || e.length == kUndefinedLength || e.value_at + e.length > size_) return false;
      if (e.tag == 0x00020010U && e.length > 0 && e.length < 65) {
        std::string uid(e.length, '\0');
        copy(e.value_at, uid.data(), uid.size());
        while (!uid.empty() && (uid.back() == '\0' || uid.back() == ' ')) uid.pop_back();
        syntax_known_ = true;
        implicit_next_ = uid == "1.2.840.10008.1.2";
        big_next_ = uid == "1.2.840.10008.1.2.2";
        // Deflated: what follows is no elements.
        if (uid == "1.2.840.10008.1.2.1.99") return false;
      }
      at = e.value_at + e.length;
    }
    return false;
  }

  bool guess(std::uint64_t at) {
    char vr[2] = {0, 0};
    copy(at + 4, vr, 2);
    implicit_next_ = !(vr[0] >= 'A' && vr[0] <= 'Z' && vr[1] >= 'A' && vr[1] <= 'Z');
    big_next_ = big_;
    return true;
  }

  // Elements from `at` to `end`; inside an item of undefined length they end with its delimiter, and `at` is left
  // behind it.
  bool elements(std::uint64_t& at, std::uint64_t end, bool delimited, int depth) {
    if (depth == 0) {
      explicit_ = !implicit_next_;
      big_ = big_next_;
    }
    if (depth > 32) return false;
    while (at + 8 <= end) {
      Element e;
      if (!read(at, e)) return false;
      if (e.tag == kItemEnd) {
        at += 8;
        return delimited;
      }
      if (depth == 0 && e.tag == kPixels) return e.length == kUndefinedLength || e.value_at <= size_;
      at = e.value_at;
      if (e.length == kUndefinedLength) {
        // Only sequences may be open; unknown ones are implicit little endian inside (PS3.5 6.2.2).
        const bool was_explicit = explicit_;
        if (explicit_ && !e.sequence && !e.unknown) return false;
        if (e.unknown) explicit_ = false;
        if (!items(at, end, true, depth)) return false;
        explicit_ = was_explicit;
      } else {
        if (at + e.length > end) return false;
        std::uint64_t inside = at;
        if (e.sequence && !items(inside, at + e.length, false, depth)) return false;
        at += e.length;
      }
    }
    return !delimited;
  }

  bool items(std::uint64_t& at, std::uint64_t end, bool delimited, int depth) {
    while (at + 8 <= end) {
      Element e;
      if (!read(at, e)) return false;
      at += 8;
      if (e.tag == kSequenceEnd) return delimited;
      if (e.tag != kItem) return false;
      if (e.length == kUndefinedLength) {
        if (!elements(at, end, true, depth + 1)) return false;
      } else {
        if (at + e.length > end) return false;
        std::uint64_t inside = at;
        if (!elements(inside, at + e.length, false, depth + 1)) return false;
        at += e.length;
      }
    }
    return !delimited;
  }

  int fd_;
  std::uint64_t size_ = 0, window_at_ = 0;
  std::vector<char> window_;
  bool explicit_ = true, big_ = false, syntax_known_ = false, implicit_next_ = false, big_next_ = false;
};

}  // namespace

bool header_is_sound(const std::filesystem::path& file) {
  return Walker(file).sound();
}

}  // namespace osteo::inline imaging::dicom
