#include "osteo/session/recording/recorder.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

#include "backlog.h"

namespace osteo::inline session {
Recorder::Recorder(StreamReader& reader, std::unique_ptr<SessionSink> sink, const SessionHeader& header,
                   std::size_t most_waiting_bytes)
    : reader_(reader),
      backlog_(new Backlog(std::move(sink))),
      writer_(std::unique_ptr<SessionSink>(backlog_), header),
      most_waiting_(most_waiting_bytes),
      frame_ticks_(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(kFrameS * header.rate_hz)))),
      ticks_buffer_(20 * 12),  // whole ticks, whether of 1, 2, 3 or 4 hands
      changes_buffer_(1 << 20) {}

Recorder::~Recorder() {
  stop();
}

// Whatever goes wrong ends the recording, not the rehearsal.
template <class F>
void Recorder::guarded(F&& f) {
  if (failed()) return;
  try {
    f();
  } catch (const Error& e) {
    fail(e);
  } catch (const std::bad_alloc&) {
    fail(Error(ExitCode::resources, "out of memory while recording", "what was recorded before can be replayed"));
  } catch (const std::exception& e) {
    fail(Error(ExitCode::unspecified, std::string("the recording has ended: ") + e.what()));
  }
}

void Recorder::fail(const Error& error) {
  const std::lock_guard lock(failure_mutex_);
  if (!failure_) failure_ = error;
  failed_ = true;
}

void Recorder::start() {
  backlog_->start();
  thread_ = std::thread([this] {
    ::pthread_setname_np(::pthread_self(), "osteo-recorder");
    while (!stop_) {
      drain();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
}

std::size_t Recorder::drain() {
  std::size_t total = 0;
  for (;;) {
    // Ticks first: the changes of a tick are in the ring before its record.
    const std::size_t n = reader_.ticks.pop(ticks_buffer_);
    if (n == 0) return total;
    std::size_t wanted = 0, got = 0;
    for (std::size_t t = 0; t < n; ++t) wanted += ticks_buffer_[t].voxels_changed;
    guarded([&] {
      if (wanted > changes_buffer_.size()) changes_buffer_.resize(wanted);
    });
    for (std::size_t left = wanted; left > 0;) {  // also after a failure, so that the servo's ring does not fill
      const std::size_t some =
          reader_.changes.pop({changes_buffer_.data() + (failed() ? 0 : got), std::min(left, changes_buffer_.size())});
      if (some == 0) break;
      got += some;
      left -= some;
    }
    for (SceneAction a; reader_.actions.pop({&a, 1}) == 1;) guarded([&] { actions_.push_back(a); });
    total += n;
    guarded([&] { take(n, got); });
  }
}

void Recorder::take(std::size_t n, std::size_t got) {
  std::size_t begin = 0, changes_begin = 0, changes_end = 0;
  const auto put_up_to = [&](std::size_t end) {
    if (end > begin) put(begin, end, {changes_buffer_.data() + changes_begin, changes_end - changes_begin});
    begin = end;
    changes_begin = changes_end;
  };
  for (std::size_t t = 0; t < n; ++t) {
    const TickRecord& r = ticks_buffer_[t];
    if (frame_of(r.tick) != frame_of(next_tick_ == 0 ? 0 : next_tick_ - 1)) {
      put_up_to(t);
      end_frame();
    }
    // What the ring had no room for.
    if (r.tick > next_tick_) {
      put_up_to(t);
      lose(next_tick_, r.tick - next_tick_, true);
    }
    if (const std::uint64_t dropped = reader_.actions_dropped.load(std::memory_order_relaxed);
        r.hand == 0 && dropped > actions_dropped_) {
      put_up_to(t);
      lose(r.tick, 0, true);
      actions_dropped_ = dropped;
    }
    // An action stands before its tick, whose record may not be here yet.
    for (; !actions_.empty() && actions_.front().tick <= r.tick; actions_.pop_front()) {
      put_up_to(t);
      put(actions_.front());
    }
    changes_end = std::min(changes_end + r.voxels_changed, got);
    next_tick_ = r.tick + 1;
  }
  put_up_to(n);
}

void Recorder::put(std::size_t begin, std::size_t end, std::span<const VoxelChange> changes) {
  const std::size_t waiting = backlog_->waiting_bytes();
  if (gap_ && waiting <= most_waiting_ / 2) close_gap();
  if (!gap_ && waiting <= most_waiting_) {
    frame_.ticks.insert(frame_.ticks.end(), ticks_buffer_.begin() + static_cast<std::ptrdiff_t>(begin),
                        ticks_buffer_.begin() + static_cast<std::ptrdiff_t>(end));
    frame_.changes.insert(frame_.changes.end(), changes.begin(), changes.end());
    return;
  }
  lose(ticks_buffer_[begin].tick, ticks_buffer_[end - 1].tick + 1 - ticks_buffer_[begin].tick, false);
  Meanwhile& now = meanwhile();
  for (const VoxelChange& c : changes) now.changes[c.voxel] = c.density;
}

void Recorder::put(const SceneAction& action) {
  if (!gap_) {
    // A frame keeps the last change of each voxel, and its actions before all of them.
    if (parts_changes(row_of(action)) && !frame_.changes.empty()) end_frame();
    frame_.actions.push_back(action);
    return;
  }
  Meanwhile& now = meanwhile();
  now.actions.push_back(action);
  now.ends = parts_changes(row_of(action));  // all others may as well find the densities of a little later
}

void Recorder::end_frame() {
  if (gap_) {  // nothing is in the frame; notes wait
    taken_ = next_tick_;
    return;
  }
  {
    const std::lock_guard lock(notes_mutex_);
    frame_.notes.swap(notes_);
  }
  writer_.append(frame_);
  frame_.actions.clear();
  frame_.ticks.clear();
  frame_.changes.clear();
  frame_.notes.clear();
  taken_ = next_tick_;
}

void Recorder::note(Note note) {
  const std::lock_guard lock(notes_mutex_);
  if (notes_.size() >= kMaxNotes || note.json.size() > kLongestNote || stopped_notes_) {
    ++notes_lost_;
  } else {
    notes_.push_back(std::move(note));
  }
}

// What comes now belongs behind an action that parts changes.
Recorder::Meanwhile& Recorder::meanwhile() {
  if (meanwhile_.empty() || meanwhile_.back().ends) meanwhile_.emplace_back();
  return meanwhile_.back();
}

void Recorder::lose(std::uint64_t first_tick, std::uint64_t ticks, bool bone) {
  if (!gap_) {
    end_frame();
    gap_ = RecordingGap{first_tick, 0, false};
  }
  gap_->ticks += ticks;
  gap_->bone_lost |= bone;
  ticks_lost_ += ticks;
}

void Recorder::close_gap() {
  writer_.append(*gap_);
  gaps_.push_back(*gap_);
  gap_.reset();
  for (Meanwhile& m : std::exchange(meanwhile_, {})) {
    SessionBatch before;
    for (const auto& [voxel, density] : m.changes) before.changes.push_back({voxel, density});
    writer_.append(before);
    SessionBatch then;
    then.actions = std::move(m.actions);
    writer_.append(then);
  }
}

void Recorder::stop() {
  if (stopped_) return;
  stopped_ = true;
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  drain();
  guarded([&] {
    // What was done after the last tick.
    for (SceneAction a; reader_.actions.pop({&a, 1}) == 1;) actions_.push_back(a);
    for (; !actions_.empty(); actions_.pop_front()) put(actions_.front());
    if (gap_) close_gap();
    {
      const std::lock_guard lock(notes_mutex_);
      stopped_notes_ = true;
    }
    end_frame();
  });
}

void Recorder::finish(const SessionEnd& given, const std::function<void(std::vector<VoxelChange>&)>& bone) {
  stop();
  if (finished_) return;
  finished_ = true;
  guarded([&] {
    if (given.ticks > next_tick_) {
      lose(next_tick_, given.ticks - next_tick_, true);
      close_gap();
    }
    const bool lost = std::any_of(gaps_.begin(), gaps_.end(), [](const RecordingGap& g) { return g.bone_lost; });
    if (lost && bone) {
      SessionBatch all;
      bone(all.changes);
      writer_.append(all);
    }
    SessionEnd end = given;
    end.ticks_lost = ticks_lost_;
    end.notes_lost = notes_lost_;
    writer_.finish(end);
  });
}

Recorder::Status Recorder::status() const {
  Status s;
  s.ticks = taken_;  // first: what it says is waiting, or written
  s.ticks_lost = ticks_lost_;
  s.notes_lost = notes_lost_;
  s.behind_s = backlog_->behind_s();
  s.waiting_bytes = backlog_->waiting_bytes();
  s.failure = backlog_->failure();
  const std::lock_guard lock(failure_mutex_);
  if (failure_) s.failure = failure_;
  return s;
}

}  // namespace osteo::inline session
