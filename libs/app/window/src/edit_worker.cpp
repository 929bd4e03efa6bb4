#include "edit_worker.h"

#include <utility>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline app {
namespace {

TriMesh surface_of(const CoarseMask& coarse_mask, const Context& context) {
  const auto& d = coarse_mask.frame.dims;
  const auto value = [&](int i, int j, int k) {
    return coarse_mask
        .filled[(static_cast<std::size_t>(k) * static_cast<std::size_t>(d[1]) + static_cast<std::size_t>(j)) *
                    static_cast<std::size_t>(d[0]) +
                static_cast<std::size_t>(i)];
  };
  std::vector<Ijk> bricks;
  for (int bk = 0; bk * 8 < d[2]; ++bk) {
    for (int bj = 0; bj * 8 < d[1]; ++bj) {
      for (int bi = 0; bi * 8 < d[0]; ++bi) {
        bool any = false;
        for (int k = bk * 8; k < std::min(d[2], bk * 8 + 8) && !any; ++k) {
          for (int j = bj * 8; j < std::min(d[1], bj * 8 + 8) && !any; ++j) {
            for (int i = bi * 8; i < std::min(d[0], bi * 8 + 8) && !any; ++i) any = value(i, j, k) > 0;
          }
        }
        if (any) bricks.push_back({bi, bj, bk});
      }
    }
  }
  if (bricks.empty()) return {};
  BrickGrid grid(coarse_mask.frame, bricks);
  for (const Ijk& b : bricks) {
    for (int k = b.k * 8; k < std::min(d[2], b.k * 8 + 8); ++k) {
      for (int j = b.j * 8; j < std::min(d[1], b.j * 8 + 8); ++j) {
        for (int i = b.i * 8; i < std::min(d[0], b.i * 8 + 8); ++i) grid.set(grid.find(i, j, k), value(i, j, k));
      }
    }
  }
  context.check_cancelled();
  return surface_nets(grid, 0.4F, context).mesh;
}

}  // namespace

Preview make_preview(const PreviewRequest& request, const Context& context) {
  Preview p;
  if (request.live) {
    p.bone = surface_of(
        coarse(request.ct, request.live->lower_hu, request.live->upper_hu, request.most_voxels, context.threads),
        context);
  } else if (request.bone) {
    p.bone = surface_of(coarse(*request.bone, request.ct.frame, request.most_voxels, context.threads), context);
  }
  for (const PreviewRequest::Part& part : request.structures) {
    context.check_cancelled();
    p.structures.push_back(
        {part.rgb, surface_of(coarse(part.voxels, part.frame, request.most_voxels / 4, context.threads), context)});
  }
  return p;
}

EditWorker::EditWorker() : planner_([this] { plan_loop(); }), previewer_([this] { preview_loop(); }) {}

EditWorker::~EditWorker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    cancel_plan_ = cancel_preview_ = true;
  }
  wake_.notify_all();
  planner_.join();
  previewer_.join();
}

bool EditWorker::plan(const EditDocument& document, std::vector<EditOperation> operations) {
  return begin({&document, std::move(operations), nullptr});
}

bool EditWorker::find(std::function<EditFound(const Context&)> work) {
  return begin({nullptr, {}, std::move(work)});
}

bool EditWorker::begin(Job job) {
  if (planning_) return false;
  planning_ = true;
  {
    const std::lock_guard lock(mutex_);
    cancel_plan_ = false;
    progress_ = 0;
    job_ = std::move(job);
  }
  wake_.notify_all();
  return true;
}

std::optional<EditWorker::Planned> EditWorker::take_plan() {
  const std::lock_guard lock(mutex_);
  if (!planned_) return std::nullopt;
  planning_ = false;
  return std::exchange(planned_, std::nullopt);
}

void EditWorker::preview(PreviewRequest request) {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = std::move(request);
    cancel_preview_ = true;
  }
  wake_.notify_all();
}

bool EditWorker::previewing() const {
  const std::lock_guard lock(mutex_);
  return making_ || wanted_.has_value();
}

std::optional<Preview> EditWorker::take_preview() {
  const std::lock_guard lock(mutex_);
  return std::exchange(made_, std::nullopt);
}

void EditWorker::plan_loop() {
  Context context;
  context.set_cancel_flag(&cancel_plan_);
  context.on_progress([this](double fraction, std::string_view) { progress_ = fraction; });
  for (;;) {
    std::optional<Job> job;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return ending_ || job_; });
      if (ending_) return;
      job = std::exchange(job_, std::nullopt);
    }
    Planned done;
    static_cast<void>(context.take_report());  // of a run that was stopped
    try {
      if (job->find)
        done.found = job->find(context);
      else
        done.plan = job->document->plan(std::move(job->operations), context);
    } catch (const Error& e) {
      done.error = e;
    } catch (const std::exception& e) {
      done.error = Error(ExitCode::resources, std::string("it could not be worked out: ") + e.what());
    }
    const std::lock_guard lock(mutex_);
    planned_ = std::move(done);
  }
}

void EditWorker::preview_loop() {
  Context context;
  context.set_cancel_flag(&cancel_preview_);
  for (;;) {
    std::optional<PreviewRequest> request;
    {
      std::unique_lock lock(mutex_);
      making_ = false;
      wake_.wait(lock, [&] { return ending_ || wanted_; });
      if (ending_) return;
      request = std::exchange(wanted_, std::nullopt);
      making_ = true;
      cancel_preview_ = false;
    }
    try {
      Preview made = make_preview(*request, context);
      const std::lock_guard lock(mutex_);
      made_ = std::move(made);
    } catch (const std::exception&) {
      // Given up for a newer one; or no memory for a picture, which is no reason to stop.
    }
  }
}

}  // namespace osteo::inline app
