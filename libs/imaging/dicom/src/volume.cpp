#include "osteo/imaging/dicom/volume.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/vtk_data.h"
#include "slice_judge.h"
#include "slices.h"
#include "value_check.h"

namespace osteo::inline imaging {
namespace {

using dicom::DamagedFile;
using dicom::SliceReader;
using dicom::SliceSampler;

const Finding& first_error(const Verdict& v) {
  static const Finding none{"NOT_A_VOLUME", Severity::error, "it cannot be used", "", {}};
  for (const Finding& f : v.findings) {
    if (f.severity == Severity::error) return f;
  }
  return none;
}

std::string why(const Verdict& v) {
  std::string text =
      v.source == "DICOM" ? "series " + std::to_string(v.series) + " is rejected" : "the volume is rejected";
  for (const Finding& f : v.findings) {
    if (f.severity == Severity::error) text += ": " + f.message + " [" + f.code + "]";
  }
  for (const Finding& f : v.findings) {
    if (f.severity == Severity::warning) text += "; " + f.message + " [" + f.code + "]";
  }
  return text;
}

// What a series with these files left out looks like; throws Rejected.
Placement place_or_refuse(const DicomSeries& series, const PlaceOptions& options,
                          const std::vector<FileSetAside>& excluded) {
  Placement p = place_slices(series.headers, options, excluded, [&](std::size_t a, std::size_t b) {
    return dicom::same_stored_pixels(series.headers[a], series.headers[b]);
  });
  if (p.verdict.series == 0) p.verdict.series = series.number;
  if (p.verdict.modality.empty()) p.verdict.modality = series.modality;
  if (series.strays)
    p.verdict.set_aside.insert(p.verdict.set_aside.end(), series.strays->begin(), series.strays->end());
  if (!series.foreign.empty()) {
    p.verdict.add(code::several_scans, Severity::warning,
                  "the series also holds " + std::to_string(series.foreign.size()) +
                      " slices of another patient, study or frame of reference ('" + series.foreign.front() +
                      "', ...); they are left out",
                  "'osteo import --list FOLDER' shows which belong together", series.foreign);
    for (const std::string& f : series.foreign)
      p.verdict.set_aside.push_back(
          {f, std::string(code::several_scans), "it is of another patient, study or frame of reference"});
  }
  if (options.hu_offset != 0) {
    p.verdict.add(code::hu_offset, Severity::warning,
                  format_number(options.hu_offset) + " HU are added to all values, as asked for",
                  "look at the mask before you rely on a threshold");
  }
  p.verdict.why_chosen = series.recommended ? series.why : "asked for";
  if (p.verdict.refused()) throw Refused(p.verdict);
  return p;
}

// Runs `work(placement)`; a file that turns out damaged is left out, and it starts again.
template <class F>
void with_placement(const DicomSeries& series, const PlaceOptions& options, F&& work) {
  std::vector<FileSetAside> excluded(series.headers.size());
  for (;;) {
    Placement placement = place_or_refuse(series, options, excluded);
    try {
      return work(placement);
    } catch (const DamagedFile& damaged) {
      excluded[damaged.header] = {series.headers[damaged.header].name, std::string(code::pixels_damaged), damaged.why};
    }
  }
}

// Upright above all slices, whole pixels of margin to hold the lean; `h` is the spacing along rows, columns and the
// normal.
Frame lattice_of(const Placement& p, int columns, int rows, Vec3 h) {
  double lo[2] = {0, 0}, hi[2] = {0, 0};
  for (const PlacedSlice& s : p.slices) {
    for (int a = 0; a < 2; ++a) {
      lo[a] = std::min(lo[a], s.sideways_mm[a]);
      hi[a] = std::max(hi[a], s.sideways_mm[a]);
    }
  }
  const double pixel[2] = {p.column_spacing_mm, p.row_spacing_mm};
  const int n[2] = {columns, rows};
  Frame f;
  f.direction = {{p.along_row, p.along_column, p.normal}};
  f.spacing_mm = h;
  f.origin_mm = p.origin_mm;
  for (std::size_t a = 0; a < 2; ++a) {
    const int before = static_cast<int>(std::ceil(-lo[a] / h[a] - 1e-6));
    const double last = (n[a] - 1) * pixel[a] + hi[a];
    f.dims[a] = before + static_cast<int>(std::ceil(last / h[a] - 1e-6)) + 1;
    f.origin_mm -= f.direction.column[a] * (before * h[a]);
  }
  // As in the slice, half a voxel beyond the last centre is still covered.
  f.dims[2] = static_cast<int>(std::floor(p.slices.back().along_mm / h.z + 0.5)) + 1;
  return f;
}

// Layers lie on the slices where these are as far apart as ever, with or without holes: upright ones then stay as they
// are, leaning ones are interpolated in their own plane only.
double layer_distance(const Placement& p) {
  const double pitch = p.verdict.gap_min_mm, extent = p.slices.back().along_mm;
  const double wanted = std::max(std::min(pitch, 0.5), std::min(p.column_spacing_mm, p.row_spacing_mm));
  const bool regular = std::all_of(p.slices.begin(), p.slices.end(), [&](const PlacedSlice& s) {
    return std::abs(s.along_mm - std::round(s.along_mm / pitch) * pitch) <= kSamePlaceMm;
  });
  if (!regular) return wanted;
  const bool upright = std::all_of(p.slices.begin(), p.slices.end(), [](const PlacedSlice& s) {
    return std::hypot(s.sideways_mm[0], s.sideways_mm[1]) <= kSamePlaceMm;
  });
  const double each = upright ? 1 : std::max(1.0, std::round(pitch / wanted));
  return extent / (std::round(extent / pitch) * each);
}

void finish(Placement& p, const Frame& frame, const SliceReader& reader, const PlaceOptions& options) {
  Verdict& v = p.verdict;
  v.output = frame;
  for (std::size_t k = 0; k < v.slices.size(); ++k) {
    v.slices[k].output_index = v.resampled ? p.slices[k].along_mm / frame.spacing_mm.z : static_cast<double>(k);
  }
  dicom::check_values(v, reader.count(), p.column_spacing_mm * p.row_spacing_mm * p.verdict.gap_usual_mm,
                      options.any_modality);
  std::vector<dicom::JudgedSlice> slices;
  for (const SliceRecord& s : v.slices) {
    // Where all slices are of one file, it is the picture that tells them apart.
    const bool one_file = v.slices.size() > 1 && v.slices.front().file == v.slices.back().file;
    slices.push_back(
        {one_file || s.frame > 0 ? s.file + " (picture " + std::to_string(s.frame + 1) + ")" : s.file, s.along_mm});
  }
  dicom::judge_slices(v, slices, reader.figures(), v.columns * p.column_spacing_mm * v.rows * p.row_spacing_mm);
  if (v.refused()) throw Refused(v);
}

}  // namespace

Refused::Refused(const Verdict& verdict)
    : Error(ExitCode::corrupt, why(verdict), first_error(verdict).advice),
      verdict_(std::make_shared<const Verdict>(verdict)) {}

DicomVolume load_dicom_series(const DicomSeries& series, const PlaceOptions& options, const Context& context) {
  const QuietVtk quiet;
  DicomVolume result;
  with_placement(series, options, [&](Placement& p) {
    const int columns = p.verdict.columns, rows = p.verdict.rows;
    const std::size_t area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows),
                      count = p.slices.size();
    const auto pixels = make_voxels<std::int16_t>(area * count);
    std::vector<std::int16_t*> slice(count);
    for (std::size_t k = 0; k < count; ++k) slice[k] = pixels.get() + k * area;
    SliceReader reader(series.headers, p);
    reader.read(0, count, slice, context.sub(0, p.even ? 0.95 : 0.7));

    const double mean_gap = p.slices.back().along_mm / static_cast<double>(count - 1);
    if (p.even) {
      Frame frame;
      frame.dims = {columns, rows, static_cast<int>(count)};
      frame.spacing_mm = {p.column_spacing_mm, p.row_spacing_mm, mean_gap};
      frame.origin_mm = p.origin_mm;
      frame.direction = {{p.along_row, p.along_column, p.normal}};
      finish(p, frame, reader, options);
      if (p.verdict.values.padding_source != "none") {
        parallel_for(area * count, 1 << 18, context.threads, [&](std::size_t begin, std::size_t end) {
          // Written either way, so that many are replaced at once.
          for (std::size_t i = begin; i < end; ++i)
            pixels[i] = pixels[i] == dicom::kNoValue ? dicom::kAirHu : pixels[i];
        });
      }
      result.image = {frame, pixels};
    } else {
      const double dz = layer_distance(p);
      const Frame frame = lattice_of(p, columns, rows, {p.column_spacing_mm, p.row_spacing_mm, dz});
      finish(p, frame, reader, options);
      const SliceSampler sampler(p, columns, rows, frame);
      const auto out = make_voxels<std::int16_t>(frame.voxel_count());
      const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
      const std::vector<const std::int16_t*> in(slice.begin(), slice.end());
      parallel_for(static_cast<std::size_t>(frame.dims[2]), 1, context.threads, [&](std::size_t z, std::size_t) {
        context.check_cancelled();
        SliceSampler::Scratch scratch;
        for (std::size_t y = 0; y < ny; ++y) {
          std::int16_t* const row = out.get() + (z * ny + y) * nx;
          sampler.row(static_cast<int>(y), static_cast<int>(z), in, row, scratch);
          std::replace(row, row + nx, dicom::kNoValue, dicom::kAirHu);
        }
      });
      result.image = {frame, out};
    }
    result.verdict = p.verdict;
  });
  context.progress(1.0);
  return result;
}

struct DicomSlabs::Impl {
  const DicomSeries& series;
  PlaceOptions options;
  double spacing_mm;
  Frame frame;
  Verdict verdict;
};

DicomSlabs::DicomSlabs(const DicomSeries& series, const PlaceOptions& options, double spacing_mm)
    : impl_(new Impl{series, options, spacing_mm, {}, {}}) {
  const Placement p = place_or_refuse(series, options, {});
  impl_->frame = lattice_of(p, p.verdict.columns, p.verdict.rows, {spacing_mm, spacing_mm, spacing_mm});
  impl_->verdict = p.verdict;
}

DicomSlabs::~DicomSlabs() = default;
const Frame& DicomSlabs::frame() const {
  return impl_->frame;
}
const Verdict& DicomSlabs::verdict() const {
  return impl_->verdict;
}

void DicomSlabs::run(int layers_each, const Context& context,
                     const std::function<void(int, int, const std::int16_t*)>& take) {
  const QuietVtk quiet;
  with_placement(impl_->series, impl_->options, [&](Placement& p) {
    const int columns = p.verdict.columns, rows = p.verdict.rows;
    const std::size_t area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    p.verdict.resampled = true;
    const Frame frame = lattice_of(p, columns, rows, {impl_->spacing_mm, impl_->spacing_mm, impl_->spacing_mm});
    impl_->frame = frame;
    SliceReader reader(impl_->series.headers, p);
    const SliceSampler sampler(p, columns, rows, frame);
    std::vector<std::int16_t*> slice(p.slices.size());
    std::vector<std::unique_ptr<std::int16_t[]>> window(p.slices.size()), spare;
    std::size_t have = 0, freed = 0;
    const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
    std::vector<std::int16_t> slab(nx * ny * static_cast<std::size_t>(layers_each));
    for (int z0 = 0; z0 < frame.dims[2]; z0 += layers_each) {
      const int layers = std::min(layers_each, frame.dims[2] - z0);
      const std::size_t first = sampler.slices_of(z0).first, last = sampler.slices_of(z0 + layers - 1).second + 1;
      for (; freed < std::min(first, have); ++freed) spare.push_back(std::move(window[freed]));
      for (std::size_t k = have; k < last; ++k) {
        if (spare.empty()) spare.emplace_back(new std::int16_t[area]);
        window[k] = std::move(spare.back());
        spare.pop_back();
        slice[k] = window[k].get();
      }
      const double share = 1.0 / frame.dims[2];
      if (last > have) reader.read(have, last, slice, context.sub(z0 * share, (z0 + 0.5 * layers) * share));
      have = std::max(have, last);
      const std::vector<const std::int16_t*> in(slice.begin(), slice.end());
      parallel_for(static_cast<std::size_t>(layers) * ny, ny, context.threads, [&](std::size_t begin, std::size_t end) {
        context.check_cancelled();
        SliceSampler::Scratch scratch;
        for (std::size_t r = begin; r < end; ++r) {
          sampler.row(static_cast<int>(r % ny), z0 + static_cast<int>(r / ny), in, slab.data() + r * nx, scratch);
        }
      });
      take(z0, layers, slab.data());
      context.progress((z0 + layers) * share, "resampling");
    }
    finish(p, frame, reader, impl_->options);
    impl_->verdict = p.verdict;
  });
}

}  // namespace osteo::inline imaging
