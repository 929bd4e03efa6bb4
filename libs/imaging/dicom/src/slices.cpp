#include "slices.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>

#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::dicom {

void SliceReader::read(std::size_t begin, std::size_t end, const std::vector<std::int16_t*>& out,
                       const Context& context) {
  // Frames of one file are one job.
  std::map<std::size_t, Job> jobs;
  for (std::size_t k = begin; k < end; ++k) {
    Job& job = jobs[placement_.slices[k].header];
    job.targets.push_back({placement_.slices[k].frame, out[k]});
    job.slices.push_back(k);
  }
  std::vector<std::pair<std::size_t, Job>> list(jobs.begin(), jobs.end());
  std::vector<ValueCount> counts(list.size());
  std::optional<DamagedFile> damaged;
  std::mutex mutex;
  // A compressed file of many frames is decoded once, a frame a thread, before the files of single frames are shared
  // out.
  for (std::size_t f = 0; f < list.size() && !damaged; ++f) {
    const std::size_t index = list[f].first;
    const DicomHeader& h = headers_[index];
    if (!h.compressed || h.frames.size() < 2) continue;
    std::vector<std::int16_t>& all = decoded_[index];
    if (!all.empty()) continue;
    const std::size_t n = h.pixels_per_frame();
    std::vector<std::int16_t> pixels(n * h.frames.size());
    std::vector<FrameTarget> every;
    for (std::size_t k = 0; k < h.frames.size(); ++k) every.push_back({static_cast<int>(k), pixels.data() + k * n});
    try {
      read_frames_hu(h, every, counts[f], context.threads);
    } catch (const PixelError& e) {
      damaged = DamagedFile{index, e.what()};
    }
    all = std::move(pixels);
  }
  if (damaged) throw DamagedFile(*damaged);
  std::atomic<std::size_t> done{0};
  parallel_for(list.size(), 1, context.threads, [&](std::size_t first, std::size_t) {
    const auto& [index, job] = list[first];
    const DicomHeader& h = headers_[index];
    // The pixels are looked at as soon as they are there, while they are in the cache.
    const auto look = [&](std::size_t t) {
      figures_[job.slices[t]] = SliceFigure(job.targets[t].out, placement_.verdict.columns, placement_.verdict.rows);
    };
    try {
      if (h.compressed && h.frames.size() > 1) {
        const std::size_t n = h.pixels_per_frame();
        const std::vector<std::int16_t>& all = decoded_.at(index);
        for (std::size_t t = 0; t < job.targets.size(); ++t) {
          std::copy_n(all.data() + static_cast<std::size_t>(job.targets[t].frame) * n, n, job.targets[t].out);
          look(t);
        }
      } else {
        for (std::size_t t = 0; t < job.targets.size(); ++t) {
          read_frames_hu(h, {&job.targets[t], 1}, counts[first]);
          look(t);
        }
      }
    } catch (const PixelError& e) {
      const std::lock_guard lock(mutex);
      if (!damaged || index < damaged->header) damaged = DamagedFile{index, e.what()};
    }
    context.progress(static_cast<double>(++done) / static_cast<double>(list.size()), "reading slices");
  });
  if (damaged) throw DamagedFile(*damaged);
  for (const ValueCount& c : counts) count_.add(c);
}

SliceSampler::SliceSampler(const Placement& placement, int columns, int rows, const Frame& frame)
    : placement_(placement), columns_(columns), rows_(rows), frame_(frame) {
  const Vec3 d = frame.origin_mm - placement.origin_mm;
  along_first_ = dot(d, placement.normal);
  side_first_[0] = dot(d, placement.along_row);
  side_first_[1] = dot(d, placement.along_column);
  for (const PlacedSlice& s : placement.slices) {
    const auto key = std::llround(s.sideways_mm[0] * 1e7);
    AlongRow& table = tables_[key];
    if (table.taps.empty()) {
      table.begin = frame.dims[0];
      for (int x = 0; x < frame.dims[0]; ++x) {
        double i = (side_first_[0] + x * frame.spacing_mm.x - s.sideways_mm[0]) / placement.column_spacing_mm;
        if (std::abs(i - std::round(i)) < 1e-6) i = std::round(i);
        // Half a pixel beyond the outermost centres is still covered by the pixel.
        const bool covered = i >= -0.5 && i <= columns - 0.5;
        const double inside = std::clamp(i, 0.0, columns - 1.0);
        const int index = std::min(static_cast<int>(inside), std::max(0, columns - 2));
        table.taps.push_back({index, static_cast<float>(inside - index)});
        if (!covered) continue;
        table.begin = std::min(table.begin, x);
        table.end = x + 1;
      }
    }
    of_slice_.push_back(&table);
  }
}

std::pair<std::size_t, std::size_t> SliceSampler::slices_of(int z) const {
  const auto& s = placement_.slices;
  const double at = along(z);
  const auto it =
      std::lower_bound(s.begin(), s.end(), at + 1e-9, [](const PlacedSlice& p, double v) { return p.along_mm < v; });
  const auto above = std::clamp<std::ptrdiff_t>(it - s.begin(), 1, static_cast<std::ptrdiff_t>(s.size()) - 1);
  return {static_cast<std::size_t>(above - 1), static_cast<std::size_t>(above)};
}

void SliceSampler::row(int y, int z, const std::vector<const std::int16_t*>& slices, std::int16_t* out,
                       Scratch& scratch) const {
  const auto nx = static_cast<std::size_t>(frame_.dims[0]), columns = static_cast<std::size_t>(columns_);
  const auto [below, above] = slices_of(z);
  const double low = placement_.slices[below].along_mm, high = placement_.slices[above].along_mm;
  const double t = std::clamp((along(z) - low) / (high - low), 0.0, 1.0);
  scratch.sum.assign(nx, 0.0F);
  scratch.sum_weight.assign(nx, 0.0F);
  scratch.value.resize(columns + 1);
  scratch.weight.resize(columns + 1);
  for (int side = 0; side < 2; ++side) {
    const auto share = static_cast<float>(side == 0 ? 1 - t : t);
    if (share < 1e-6F) continue;
    const std::size_t k = side == 0 ? below : above;
    double j =
        (side_first_[1] + y * frame_.spacing_mm.y - placement_.slices[k].sideways_mm[1]) / placement_.row_spacing_mm;
    if (std::abs(j - std::round(j)) < 1e-6) j = std::round(j);
    if (j < -0.5 || j > rows_ - 0.5) continue;
    j = std::clamp(j, 0.0, rows_ - 1.0);
    const int j0 = std::min(static_cast<int>(j), std::max(0, rows_ - 2));
    const auto fy = static_cast<float>(j - j0);
    const std::int16_t* const p = slices[k] + static_cast<std::size_t>(j0) * columns;
    const std::int16_t* const q = fy > 0 ? p + columns : p;
    float* const value = scratch.value.data();
    float* const weight = scratch.weight.data();
    std::int16_t lowest = 0;
    for (std::size_t i = 0; i < columns; ++i) lowest = std::min({lowest, p[i], q[i]});
    const float wp = share * (1 - fy), wq = share * fy;
    const AlongRow& table = *of_slice_[k];
    const auto begin = static_cast<std::size_t>(table.begin),
               end = static_cast<std::size_t>(std::max(table.begin, table.end));
    if (lowest != kNoValue) {
      for (std::size_t i = 0; i < columns; ++i)
        value[i] = wp * static_cast<float>(p[i]) + wq * static_cast<float>(q[i]);
      value[columns] = value[columns - 1];
      for (std::size_t x = begin; x < end; ++x) {
        const Tap tap = table.taps[x];
        const float* const v = value + tap.index;
        scratch.sum[x] += v[0] + tap.fraction * (v[1] - v[0]);
        scratch.sum_weight[x] += share;
      }
      continue;
    }
    for (std::size_t i = 0; i < columns; ++i) {
      const float a = p[i] == kNoValue ? 0.0F : wp, b = q[i] == kNoValue ? 0.0F : wq;
      weight[i] = a + b;
      value[i] = a * static_cast<float>(p[i]) + b * static_cast<float>(q[i]);
    }
    value[columns] = value[columns - 1];
    weight[columns] = weight[columns - 1];
    for (std::size_t x = begin; x < end; ++x) {
      const Tap tap = table.taps[x];
      const float *const v = value + tap.index, *const w = weight + tap.index;
      scratch.sum[x] += v[0] + tap.fraction * (v[1] - v[0]);
      scratch.sum_weight[x] += w[0] + tap.fraction * (w[1] - w[0]);
    }
  }
  for (std::size_t x = 0; x < nx; ++x) {
    // Less than half measured: outside the scan.
    const float w = scratch.sum_weight[x];
    const float hu = scratch.sum[x] / std::max(w, 0.5F);
    out[x] = w < 0.5F ? kNoValue : static_cast<std::int16_t>(std::floor(hu + 0.5F));
  }
}

}  // namespace osteo::inline imaging::dicom
