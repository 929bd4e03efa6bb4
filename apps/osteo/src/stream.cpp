// osteo stream: a finished session over the network, in real time.
#include <ostream>
#include <thread>

#include "commands/stream.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/rt/loop.h"
#include "osteo/network/wire/rehearsal_stream.h"
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

cli::CommandInfo StreamCommand::info() {
  return {
      "stream",
      "a finished session over the network, as it went",
      "Runs the session again, in real time, and sends to listeners: tools, camera, forces and the signal of a "
      "nerve monitor "
      "(OpenIGTLink, Cerebus packets, Lab Streaming Layer). Listens on this machine alone unless --to names an "
      "address. No date, name "
      "or file leaves: docs/how-to/network.md says what does. Exit code 8 when messages were dropped, since a listener "
      "did not keep up, or "
      "ticks of the session are missing.",
      {{"session", "a session folder"}},
      "osteo stream SESSION --to igtl:18944"};
}

namespace {

// Holds the replay back to the clock.
class HeldToClock final : public Reader {
 public:
  HeldToClock(double rate_hz, double speed, const Context& context) : rate_hz_(rate_hz * speed), context_(context) {}
  void tick(const TickRecord& record, std::span<const VoxelChange>) override {
    if (record.hand != 0) return;
    if (!begun_) {
      begun_ = true;
      first_ = record.tick;
      begin_ns_ = monotonic_ns();
    }
    const auto due_ns =
        begin_ns_ + static_cast<std::int64_t>(static_cast<double>(record.tick - first_) / rate_hz_ * 1e9);
    const std::int64_t early_ns = due_ns - monotonic_ns();
    late_ms = std::max(late_ms, -static_cast<double>(early_ns) / 1e6);
    if (early_ns < 1000000) return;
    std::this_thread::sleep_for(std::chrono::nanoseconds(early_ns));
    context_.check_cancelled();
  }
  double late_ms = 0;

 private:
  double rate_hz_;
  const Context& context_;
  bool begun_ = false;
  std::uint64_t first_ = 0;
  std::int64_t begin_ns_ = 0;
};

// Cameras of the session, at their ticks.
class CameraNotesOfSession final : public Reader {
 public:
  CameraNotesOfSession(const SessionReader& session, StreamFeed& feed) : feed_(feed) {
    auto parts = session.parts();
    while (const SessionPart* const part = parts.next()) {
      for (const Note& n : part->notes) {
        if (n.kind == "camera") all_.push_back(n);
      }
    }
  }
  void tick(const TickRecord& record, std::span<const VoxelChange>) override {
    for (; at_ < all_.size() && all_[at_].tick <= record.tick; ++at_) feed_.note(all_[at_].kind, all_[at_].json);
  }

 private:
  StreamFeed& feed_;
  std::vector<Note> all_;
  std::size_t at_ = 0;
};

}  // namespace

int StreamCommand::run(const Params& p, cli::Invocation& io) {
  const std::vector<StreamTarget> targets = stream_targets(p.to);
  if (targets.empty()) throw Error(ExitCode::usage, "--to names no place to stream to", "igtl:18944");
  for (const StreamTarget& t : targets) {
    if (t.stimulator)
      throw Error(ExitCode::usage, "nothing can be stimulated in a session that is over",
                  "leave /stimulator out; 'osteo rehearse' has it");
  }
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const Case the_case = load_case(folder.case_folder);
  HapticSetup haptics = outline.header.haptics;
  const Anatomy anatomy = anatomy_of(the_case, haptics, io.context);
  const fs::path own = folder.folder / kMonitorFile;
  MonitorReader monitor(monitor_options_of(!p.setup.empty()  ? p.setup
                                           : fs::exists(own) ? own.string()
                                                             : std::string()),
                        anatomy.structures.get(), outline.header.rate_hz);
  std::size_t unreadable = 0;
  for (const auto& [tick, setting] : stimulator_notes(session, unreadable)) monitor.stimulate_at(tick, setting);
  if (unreadable > 0)
    io.context.warn(std::to_string(unreadable) + " settings of the stimulator cannot be read: left out");
  StreamFeed feed(targets, outline.header.rate_hz, 1 + outline.header.haptics.more_devices.size(), &monitor);
  monitor.add_sink(feed);
  World world = world_at_begin(folder, the_case, anatomy, io.context);
  if (!io.common.quiet) {
    for (const std::string& line : feed.reported()) io.err << line << '\n';
    if (monitor.wiring().channels.empty())
      io.err << "the case lists none of the nerves that the monitor knows: no signal\n";
    if (p.listeners > 0)
      io.err << "waiting for " << p.listeners << (p.listeners == 1 ? " listener" : " listeners") << std::endl;
  }
  if (p.listeners > 0 &&
      !feed.wait_for(static_cast<std::size_t>(p.listeners), p.wait_s, [&] { return io.context.cancelled(); })) {
    io.context.check_cancelled();
    throw Error(ExitCode::failed, "nobody has come to listen", "--listeners 0 does not wait; --wait-s waits longer");
  }
  HeldToClock pace(outline.header.rate_hz, p.speed, io.context);
  CameraNotesOfSession notes(session, feed);
  Reader* const readers[] = {&pace, &notes, &monitor, &feed};
  const ReplayResult r = replay(session, std::move(world), anatomy, io.context, readers);
  monitor.end();
  feed.end();
  io.end_progress();
  const StreamFeed::Counts& c = feed.counts();
  if (io.common.json)
    io.out << Json{{"samples", c.samples},
                   {"channels", monitor.wiring().labels()},
                   {"tools", c.tools},
                   {"cameras", c.cameras},
                   {"events", c.events},
                   {"spikes", c.spikes},
                   {"dropped", feed.dropped()},
                   {"late_ms", pace.late_ms},
                   {"same_as_recorded", r.identical}}
                  .dump(2)
           << '\n';
  if (!io.common.quiet) {
    for (const std::string& line : feed.reported()) io.err << line << '\n';
    io.err << c.samples << " samples of " << monitor.wiring().channels.size() << " channels, " << c.tools << " poses, "
           << c.events << " events; at most " << std::lround(pace.late_ms) << " ms late\n";
  }
  for (const std::string& line : r.losses) io.err << "session: " << line << '\n';
  if (!r.identical) io.err << "session: the replay differs from what was recorded (" << r.difference << ")\n";
  return static_cast<int>(feed.dropped() > 0 || !outline.gaps.empty() ? ExitCode::partial
                          : outline.damaged()                         ? ExitCode::corrupt
                                                                      : ExitCode::ok);
}

}  // namespace osteo
