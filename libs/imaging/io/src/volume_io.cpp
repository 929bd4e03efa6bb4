#include "osteo/imaging/io/volume_io.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/segments.h"
#include "raw_volume.h"
#include "seg_notes.h"

namespace osteo::inline imaging {
namespace {

struct Format {
  std::string_view suffix;
  io::RawVolume (*read)(const fs::path&);
  void (*write)(const io::RawVolume&, const fs::path&);
};

constexpr std::array<Format, 7> kFormats{{
    {".nrrd", io::read_nrrd, io::write_nrrd},
    {".nhdr", io::read_nrrd, nullptr},
    {".nii", io::read_nifti, io::write_nifti},
    {".nii.gz", io::read_nifti, io::write_nifti},
    {".mha", io::read_meta, io::write_meta},
    {".mhd", io::read_meta, nullptr},
    {".vti", io::read_vti, io::write_vti},
}};

const Format* format_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  for (const Format& f : kFormats) {
    if (name.size() > f.suffix.size() && name.ends_with(f.suffix)) return &f;
  }
  return nullptr;
}

io::RawVolume load_raw(const fs::path& path, const Context& context, std::vector<VolumeFinding>* findings = nullptr) {
  require_readable(path);
  const Format* const format = format_of(path);
  if (format == nullptr) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' is not a volume file by its name",
                "volumes are .nrrd, .nii, .nii.gz, .mha, .mhd, .vti, or a folder of DICOM files through 'import'");
  }
  io::RawVolume raw = format->read(path);
  if (findings != nullptr) {
    *findings = raw.findings;
  } else {
    for (const VolumeFinding& f : raw.findings) context.warn("'" + path.filename().string() + "': " + f.text);
  }
  return raw;
}

// Errors of a conversion name the file.
template <class F>
auto in_file(const fs::path& path, F&& convert) {
  try {
    return convert();
  } catch (const Error& e) {
    throw e.in("'" + path.string() + "'");
  }
}

template <class T>
void save_volume(const Volume<T>& volume, io::Scalar type, const fs::path& path,
                 std::map<std::string, std::string> notes = {}) {
  const Format* const format = format_of(path);
  if (format == nullptr || format->write == nullptr) {
    throw Error(ExitCode::usage, "cannot write a volume as '" + path.filename().string() + "'",
                "name it .nrrd, .nii.gz, .mha or .vti");
  }
  io::RawVolume raw;
  raw.frame = volume.frame;
  raw.type = type;
  raw.data = std::shared_ptr<const void>(volume.voxels, volume.voxels.get());
  raw.notes = std::move(notes);
  format->write(raw, path);
}

}  // namespace

bool is_volume_file(const fs::path& path) {
  return format_of(path) != nullptr;
}
Image load_image(const fs::path& path, const Context& context, std::vector<VolumeFinding>* findings) {
  return in_file(path, [&, raw = load_raw(path, context, findings)] { return io::image_from(raw, context); });
}
Labels load_labels(const fs::path& path, const Context& context) {
  return in_file(path, [&, raw = load_raw(path, context)] { return io::labels_from(raw, context); });
}
std::variant<Image, Labels> load_volume(const fs::path& path, const Context& context) {
  return in_file(path, [&, raw = load_raw(path, context)]() -> std::variant<Image, Labels> {
    if (raw.type == io::Scalar::u8 || raw.layers > 1) return io::labels_from(raw, context);
    return io::image_from(raw, context);
  });
}
void save_image(const Image& image, const fs::path& path) {
  save_volume(image, io::Scalar::i16, path);
}
void read_certainty(const std::map<std::string, std::string>& tags, Structure& structure) {
  if (const auto within = tags.find(std::string(kWithinTag)); within != tags.end()) {
    const std::string& text = within->second;
    double mm = text == "inf" ? std::numeric_limits<double>::infinity() : 0;
    if (text != "inf") std::from_chars(text.data(), text.data() + text.size(), mm);
    structure.within_mm = mm > 0 ? mm : 0;
  }
  if (const auto doubt = tags.find(std::string(kDoubtTag)); doubt != tags.end()) structure.doubt = doubt->second;
}

std::string tag_value(std::string text) {
  std::replace(text.begin(), text.end(), '|', '/');
  return text;
}

void save_segments(const Labels& labels, const fs::path& path, const std::map<std::string, std::string>& tags) {
  if (!path.filename().string().ends_with(".seg.nrrd"))
    throw Error(ExitCode::usage, "'" + path.filename().string() + "': segments are written as .seg.nrrd");
  save_volume(labels, io::Scalar::u8, path, io::notes_from(labels, tags));
}

std::vector<Segment> load_segments(const fs::path& path, const Context& context) {
  return in_file(path, [&, raw = load_raw(path, context)] { return io::segments_of(raw); });
}

void save_labels(const Labels& labels, const fs::path& path) {
  const bool named = !labels.structures.empty() || path.filename().string().ends_with(".seg.nrrd");
  save_volume(labels, io::Scalar::u8, path, named ? io::notes_from(labels) : std::map<std::string, std::string>{});
}

}  // namespace osteo::inline imaging
