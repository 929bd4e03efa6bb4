#include "cuts_drawer.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace osteo::inline app {
namespace {

bool same_cut(const SliceView& a, const SliceView& b) {
  const SliceAxes x = a.axes(), y = b.axes();
  // The crosshair may move within a cut, which stays the same.
  return a.width == b.width && a.height == b.height && a.mm_per_pixel == b.mm_per_pixel && x.right == y.right &&
         x.down == y.down && length(a.world(0, 0) - b.world(0, 0)) < 1e-9;
}

// That a processor has given to this thread.
double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace

CutsDrawer::~CutsDrawer() {
  if (drawing_.valid()) drawing_.wait();
}

void CutsDrawer::show(std::shared_ptr<const CtValues> ct, std::vector<std::shared_ptr<const GridSampler>> before,
                      std::vector<CutStructure> structures, double least_mm_per_pixel) {
  if (drawing_.valid()) drawing_.wait();
  drawing_ = {};
  ct_ = std::move(ct);
  before_ = std::move(before);
  structures_ = std::move(structures);
  least_mm_ = least_mm_per_pixel;
  asked_ = {};
  not_before_ = {};
}

SliceView CutsDrawer::picture_of(const SliceView& view) const {
  SliceView coarse = view;
  if (view.mm_per_pixel >= least_mm_) return coarse;
  const double times = least_mm_ / view.mm_per_pixel;
  coarse.mm_per_pixel = least_mm_;
  coarse.width = static_cast<int>(std::ceil(view.width / times)) + 1;
  coarse.height = static_cast<int>(std::ceil(view.height / times)) + 1;
  return coarse;
}

std::vector<DrawnCut> CutsDrawer::next(const std::array<std::optional<SliceView>, 3>& views, const CutsScene& scene) {
  const auto now = std::chrono::steady_clock::now();
  std::vector<DrawnCut> drawn;
  if (drawing_.valid()) {
    if (drawing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return drawn;
    Done done = drawing_.get();
    last_ms_ = done.ms;
    drawn = std::move(done.cuts);
    constexpr double kMinPauseMs = 30, kPauses = 2;
    not_before_ = now + std::chrono::microseconds(static_cast<long>(1000 * std::max(kMinPauseMs, kPauses * done.ms)));
  }
  if (now < not_before_) return drawn;
  std::vector<std::pair<int, SliceView>> wanted;
  for (std::size_t c = 0; c < views.size(); ++c) {
    if (!views[c]) {
      asked_[c].reset();
      continue;
    }
    if (asked_[c] && same_cut(*asked_[c], *views[c]) && asked_scene_ == scene) continue;
    wanted.emplace_back(static_cast<int>(c), *views[c]);
    asked_[c] = views[c];
  }
  if (wanted.empty()) return drawn;
  asked_scene_ = scene;
  drawing_ = std::async(std::launch::async, [this, wanted = std::move(wanted), scene] {
    const double begin_ms = thread_ms();
    LiveCut cut;
    cut.parts = scene.parts;
    cut.ct = ct_.get();
    for (const auto& b : before_) cut.before.push_back(b.get());
    cut.hu = scene.hu;
    cut.tint_removed = scene.tint_removed;
    Done done;
    for (const auto& [number, view] : wanted) {
      DrawnCut& one = done.cuts.emplace_back();
      one.cut = number;
      one.view = picture_of(view);
      draw_live_cut(one.view, cut, one.rgba);
      for (const CutStructure& s : structures_)
        one.outlines.push_back({s.value, section_of(*s.surface, view.through_mm, view.normal())});
    }
    done.ms = thread_ms() - begin_ms;
    return done;
  });
  return drawn;
}

}  // namespace osteo::inline app
