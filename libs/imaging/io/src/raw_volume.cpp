#include "raw_volume.h"

#include "seg_notes.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"

namespace osteo::inline imaging::io {

std::size_t size_of(Scalar type) {
  switch (type) {
    case Scalar::u8:
    case Scalar::i8:
      return 1;
    case Scalar::u16:
    case Scalar::i16:
      return 2;
    case Scalar::u32:
    case Scalar::i32:
    case Scalar::f32:
      return 4;
    case Scalar::f64:
      return 8;
  }
  return 0;
}

void convert_lengths(RawVolume& raw, double mm, const std::string& unit) {
  if (mm == 1) return;
  raw.frame.spacing_mm = raw.frame.spacing_mm * mm;
  raw.frame.origin_mm = raw.frame.origin_mm * mm;
  const auto text = [](double v) { return format_number(std::round(v * 1e6) / 1e6); };
  const Vec3 s = raw.frame.spacing_mm;
  raw.findings.push_back({VolumeFinding::What::lengths_converted, "the file's lengths are in " + unit +
                                                                      " and were converted: voxels of " + text(s.x) +
                                                                      " x " + text(s.y) + " x " + text(s.z) + " mm"});
}

void require_room(const std::filesystem::path& path, double voxels, double bytes_each, double there, bool packed) {
  constexpr double kMaxInflation = 1032, kHeader = 1024;
  if (voxels * bytes_each <= (packed ? (there + kHeader) * kMaxInflation : there + kHeader)) return;
  throw Error(ExitCode::corrupt,
              "'" + path.string() + "': its header states " + format_number(voxels) + " voxels, which " +
                  format_number(there) + " bytes cannot hold",
              "the header is wrong or the file was cut short; copy it again from its source");
}

void write_parts(const std::filesystem::path& path, std::string_view header, std::string_view voxels) {
  write_atomically(path, [&](const fs::path& temporary) {
    const auto failed = [&](int error) {
      return Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + std::strerror(error),
                   error == ENOSPC || error == EDQUOT ? "free some space, or write to another disk" : "");
    };
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) throw failed(errno);
    for (std::string_view rest : {header, voxels}) {
      while (!rest.empty()) {
        const ssize_t n = ::write(fd, rest.data(), rest.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
          const int error = errno;
          ::close(fd);
          throw failed(error);
        }
        rest.remove_prefix(static_cast<std::size_t>(n));
      }
    }
    if (::close(fd) != 0) throw failed(errno);
  });
}

Image image_from(const RawVolume& raw, const Context& context) {
  require_valid(raw.frame);
  if (raw.layers != 1) throw Error(ExitCode::corrupt, "it holds several layers: a label map, not a CT");
  const std::size_t n = raw.frame.voxel_count();
  if (raw.type == Scalar::i16) {
    auto shared = std::static_pointer_cast<const std::int16_t>(raw.data);
    return {raw.frame, std::shared_ptr<const std::int16_t[]>(shared, shared.get())};
  }
  const auto out = make_voxels<std::int16_t>(n);
  double lo = 1e300, hi = -1e300;
  std::size_t clipped = 0;
  visit_scalars(raw, [&](const auto* p) {
    for (std::size_t i = 0; i < n; ++i) {
      const double v = static_cast<double>(p[i]);
      if (!std::isfinite(v)) {
        throw Error(ExitCode::corrupt, "voxel " + std::to_string(i) + " is not a finite number (NaN or infinite)",
                    "programs that resample or mask mark what lies outside so: write air there, -1024, and save the "
                    "volume again");
      }
      lo = std::min(lo, v);
      hi = std::max(hi, v);
      clipped += v < -32768 || v > 32767 ? 1 : 0;
      out[i] = static_cast<std::int16_t>(std::clamp(std::floor(v + 0.5), -32768.0, 32767.0));
    }
  });
  if (hi - lo < 16) {
    throw Error(ExitCode::corrupt,
                "the values run only from " + format_number(lo) + " to " + format_number(hi) + ": this is not CT in HU",
                "rescale the image to Hounsfield units, or load it as labels");
  }
  if (clipped > 0) context.warn(std::to_string(clipped) + " voxels beyond the range of 16 bits were clipped");
  return {raw.frame, out};
}

namespace {

// Segments of several layers get values of their own; where they overlap, the later one stays.
Labels merge_layers(const RawVolume& raw, const std::vector<SegmentNote>& segments, const Context& context) {
  if (segments.empty()) throw Error(ExitCode::corrupt, "it holds several layers but names no segments");
  if (segments.size() > 255)
    throw Error(ExitCode::corrupt,
                "it holds " + std::to_string(segments.size()) + " segments; up to 255 are supported");
  const std::size_t n = raw.frame.voxel_count(), layers = static_cast<std::size_t>(raw.layers);
  const auto out = make_voxels<std::uint8_t>(n);
  std::fill_n(out.get(), n, std::uint8_t{0});
  std::vector<Structure> structures;
  std::size_t overlap = 0;
  visit_scalars(raw, [&](const auto* p) {
    for (std::size_t s = 0; s < segments.size(); ++s) {
      const auto layer = static_cast<std::size_t>(segments[s].layer);
      if (segments[s].layer < 0 || layer >= layers)
        throw Error(ExitCode::corrupt, "segment '" + segments[s].structure.name + "' is in a layer that is not there");
      Structure named = segments[s].structure;
      for (std::size_t i = 0; i < n; ++i) {
        if (static_cast<double>(p[i * layers + layer]) != segments[s].value) continue;
        overlap += out[i] != 0 ? 1 : 0;
        out[i] = static_cast<std::uint8_t>(s + 1);
      }
      named.value = static_cast<std::uint8_t>(s + 1);
      structures.push_back(std::move(named));
    }
  });
  if (overlap > 0)
    context.warn(std::to_string(overlap) + " voxels belong to several segments; the last one keeps them");
  return {{raw.frame, out}, structures};
}

}  // namespace

Labels labels_from(const RawVolume& raw, const Context& context) {
  require_valid(raw.frame);
  const auto segments = segments_from(raw.notes);
  if (raw.layers != 1) return merge_layers(raw, segments, context);
  std::vector<Structure> structures;
  for (const SegmentNote& s : segments) {
    if (s.value >= 1 && s.value <= 255) structures.push_back(s.structure);
  }
  std::stable_sort(structures.begin(), structures.end(),
                   [](const auto& a, const auto& b) { return a.value < b.value; });
  const std::size_t n = raw.frame.voxel_count();
  if (raw.type == Scalar::u8) {
    auto shared = std::static_pointer_cast<const std::uint8_t>(raw.data);
    return {{raw.frame, std::shared_ptr<const std::uint8_t[]>(shared, shared.get())}, structures};
  }
  const auto out = make_voxels<std::uint8_t>(n);
  visit_scalars(raw, [&](const auto* p) {
    for (std::size_t i = 0; i < n; ++i) {
      const double v = static_cast<double>(p[i]);
      if (!(v >= 0 && v <= 255 && v == std::floor(v))) {
        throw Error(ExitCode::corrupt, "the value " + format_number(v) + " is not a label from 0 to 255",
                    "this looks like a CT, not like a mask or label map");
      }
      out[i] = static_cast<std::uint8_t>(v);
    }
  });
  return {{raw.frame, out}, structures};
}

}  // namespace osteo::inline imaging::io
