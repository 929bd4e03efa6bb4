// The window's end of live tutoring: as the host, whose session others join, or as one of those.
#pragma once
#include <memory>
#include <optional>
#include <string>

#include "osteo/app/window/tutor_now.h"
#include "osteo/network/tutor/live_past.h"
#include "osteo/network/tutor/live_seat.h"
#include "window_flags.h"

namespace osteo {

/// One for all sessions of a case, on one port and with one code. All functions but now() and guide() from one thread
/// at a time.
class LiveSessionRunner {
 public:
  /// Errors: usage, where flags have no effect on each other; a code that is none.
  explicit LiveSessionRunner(const WindowFlags& flags);

  // --- the host
  [[nodiscard]] bool hosts() const { return hosts_; }
  /// The trainee's hand, behind the only one there is; and the pull to it, where asked.
  void add_hand(std::vector<std::unique_ptr<Device>>& devices, RehearsalOptions& options);
  /// Before the rehearsal starts. `header` as it will be recorded. Where what `session` goes on from cannot be sent
  /// nobody can join, and now() says why.
  void open(Rehearsal& rehearsal, const SessionHeader& header, const SessionFolder& session);
  /// When it has stopped, before it goes: those who are there get the rest, within two seconds.
  void close(std::uint64_t ticks);

  // --- who joins
  [[nodiscard]] bool joins() const { return !join_.empty(); }
  [[nodiscard]] bool has_hand() const { return role_ == JoinRole::trainee; }
  [[nodiscard]] std::string words() const { return joined_text(role_); }
  /// What the session is, and what it goes on from; asks on first use.
  [[nodiscard]] std::pair<SessionHeader, Bytes> wait(const Context& context);
  std::shared_ptr<Rehearsal> begin(const SessionHeader& header, World world, const RehearsalOptions& options,
                                   std::unique_ptr<Device> own, const Context& context);
  /// Before the rehearsal is stopped.
  void leave();

  [[nodiscard]] TutorNow now(const Rehearsal* rehearsal) const;
  /// The own hand may be pulled.
  void guide(bool on);

 private:
  const bool hosts_, two_way_;
  const std::string listen_, join_;
  const JoinRole role_;
  int port_;
  bool pulls_ = true;
  std::string code_, host_name_, closed_;  // why nobody can join
  std::shared_ptr<FarDevice> far_;
  std::unique_ptr<LiveHost> host_;
  std::unique_ptr<HostThread> net_;
  std::unique_ptr<LiveSeat> seat_;
  int again_ = 0;  // the copy was made again
};

}  // namespace osteo
