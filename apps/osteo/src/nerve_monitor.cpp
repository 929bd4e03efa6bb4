// osteo nerve-monitor: what a nerve monitor would have shown of a session.
#include <cmath>
#include <fstream>
#include <ostream>

#include "commands/nerve_monitor.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/nerve/blackrock.h"
#include "osteo/simulation/sound/wav.h"

namespace osteo {

cli::CommandInfo NerveMonitorCommand::info() {
  return {"nerve-monitor",
          "what a nerve monitor would have shown of a session, as files",
          "Runs the session again with a model of the nerves that its case lists: monitor.ns5 (30 kHz, all channels) "
          "and monitor.nev "
          "(spikes, stimuli) as Blackrock's recorders write them, events.csv, one channel as channel.wav, and the "
          "setup. The same to the bit "
          "as in the live session. With --stimulator-ma a what-if: the tip of a hand's tool stimulates all the time it "
          "touches. Illustrative, not "
          "clinical: docs/validation/monitor.md lists every constant and its source. Exit code 8 when ticks are "
          "missing: it goes "
          "up to there.",
          {{"session", "a session folder"}},
          "osteo nerve-monitor SESSION -o out"};
}

namespace {

// Events as lines, and counts of them.
class EventTable final : public MonitorSink {
 public:
  EventTable(const fs::path& path, const MonitorWiring& wiring) : out_(path), path_(path), wiring_(wiring) {
    out_ << "time_s,kind,channel,nerve,duration_ms,peak_uv,latency_ms,current_ma,cause,integrity,to_distal_mm\n";
  }
  void event(const MonitorEvent& e) override {
    ++counts[std::string(name_of(e.kind))];
    if (e.kind == MonitorEventKind::threshold) thresholds.push_back(e.ma);
    if (e.kind == MonitorEventKind::cause) ++causes[std::string(name_of(e.cause))];
    const auto number = [](bool there, double x) { return there ? format_number(x) : std::string(); };
    const bool cause = e.kind == MonitorEventKind::cause;
    out_ << format_number(static_cast<double>(e.sample) / MonitorSetup::kRateHz) << ',' << name_of(e.kind) << ','
         << (e.channel < 0 ? "" : quoted(wiring_.channels[static_cast<std::size_t>(e.channel)].electrode.name)) << ','
         << (e.nerve < 0 ? "" : quoted(wiring_.courses[static_cast<std::size_t>(e.nerve)].name)) << ','
         << number(e.seconds > 0, 1000 * e.seconds) << ',' << number(e.uv > 0, e.uv) << ',' << number(e.ms > 0, e.ms)
         << ',' << number(e.ma > 0 || e.kind == MonitorEventKind::stimulator, e.ma) << ',' << name_of(e.cause) << ','
         << number(cause, e.integrity) << ',' << number(cause, e.to_distal_mm) << '\n';
  }
  void close() {
    out_.close();
    if (!out_) throw Error(ExitCode::cannot_write, "'" + path_.filename().string() + "' cannot be written");
  }
  std::map<std::string, std::uint64_t> counts, causes;
  std::vector<double> thresholds;

 private:
  static std::string quoted(const std::string& s) {
    std::string q = "\"";
    for (const char c : s) q += c == '"' ? std::string("\"\"") : std::string(1, c);
    return q + "\"";
  }
  std::ofstream out_;
  fs::path path_;
  const MonitorWiring& wiring_;
};

// A channel of a file of samples that was just written.
void write_channel(const fs::path& ns5, std::size_t channel, std::size_t channels, const fs::path& wav) {
  std::ifstream in(ns5, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(314 + 66 * channels + 9));
  std::vector<std::int16_t> block(1024 * channels);
  write_wav(wav, MonitorSetup::kRateHz, [&](std::vector<float>& samples) {
    in.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(block.size() * 2));
    const std::size_t frames = static_cast<std::size_t>(in.gcount()) / 2 / channels;
    constexpr double kFullScaleUv = 1000;
    for (std::size_t f = 0; f < frames; ++f)
      samples.push_back(
          static_cast<float>(block[f * channels + channel] * MonitorSetup::kMicrovoltsPerBit / kFullScaleUv));
    return frames > 0;
  });
}

// A folder of an earlier monitor, and nothing else, may be replaced.
void require_ours(const fs::path& old, bool force) {
  if (!force) throw Error(ExitCode::cannot_write, "'" + old.string() + "' exists already", "--force replaces it");
  static const std::set<std::string> ours{"monitor.ns5", "monitor.nev", "events.csv", "channel.wav", "monitor.json"};
  for (const auto& entry : fs::directory_iterator(old)) {
    if (!ours.contains(entry.path().filename().string()))
      throw Error(ExitCode::cannot_write,
                  "'" + old.string() + "' holds '" + entry.path().filename().string() + "', which is not of a monitor",
                  "name another folder");
  }
}

std::string in_a_row(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

// By its label; empty: the first.
std::size_t channel_named(const std::string& name, const std::vector<std::string>& labels) {
  if (name.empty()) return 0;
  const auto at = std::find(labels.begin(), labels.end(), name);
  if (at == labels.end())
    throw Error(ExitCode::usage, "there is no channel '" + name + "'", "there are: " + in_a_row(labels));
  return static_cast<std::size_t>(at - labels.begin());
}

// As the flags say, or as it was set in the session.
void set_stimulator(MonitorReader& monitor, const NerveMonitorCommand::Params& p, const SessionReader& session,
                    const Context& context) {
  std::size_t unreadable = 0;
  if (p.stimulator_ma > 0) {
    monitor.stimulate_at(0,
                         {static_cast<std::uint32_t>(p.hand), p.stimulator_ma, p.pulses_per_s, p.width_ms, p.search});
  } else {
    for (const auto& [tick, setting] : stimulator_notes(session, unreadable)) monitor.stimulate_at(tick, setting);
  }
  if (unreadable > 0) context.warn(std::to_string(unreadable) + " settings of the stimulator cannot be read: left out");
}

Json nerves_json(const MonitorReader& monitor) {
  Json nerves = Json::list();
  const auto& courses = monitor.wiring().courses;
  for (std::size_t n = 0; n < courses.size(); ++n) {
    double whole = 1;
    for (std::size_t point = 0; point < courses[n].points.size(); ++point)
      whole = std::min(whole, monitor.model().integrity(n, point));
    nerves.push_back({{"nerve", courses[n].name},
                      {"length_mm", std::round(10 * (courses[n].points.front().to_distal_mm)) / 10},
                      {"least_integrity", whole}});
  }
  return nerves;
}

void report_monitor(const Json& j, const MonitorWiring& wiring, const std::string& folder, std::ostream& err) {
  const auto count = [&](const char* kind) {
    const Json* const n = j.find("events")->find(kind);
    return n == nullptr ? std::string("0") : n->dump();
  };
  err << count("burst") << " bursts, " << count("train") << " trains, " << count("stimulus") << " stimuli, "
      << count("response") << " of them answered: " << folder << '\n';
  for (const Json& n : j.find("nerves")->items())
    err << *n.find("nerve")->text() << ": " << std::lround(100 * n.find("least_integrity")->number().value_or(0))
        << " % whole\n";
  for (const std::string& name : wiring.left_out) err << "not in the case, so not heard: " << name << '\n';
  err << "illustrative, not clinical (docs/validation/monitor.md)\n";
}

}  // namespace

int NerveMonitorCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty())
    throw Error(ExitCode::usage, "osteo nerve-monitor needs a folder for what it writes", "add -o FOLDER");
  for (const char* const name : {"pulses_per_s", "width_ms", "hand", "search"}) {
    FieldRef field{{name, ""}, static_cast<bool*>(nullptr)};
    if (io.given.contains(name) && p.stimulator_ma <= 0)
      throw Error(ExitCode::usage, field.flag() + " has no effect without --stimulator-ma", "leave it out");
  }
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const Case the_case = load_case(folder.case_folder);
  HapticSetup haptics = outline.header.haptics;
  const Anatomy anatomy = anatomy_of(the_case, haptics, io.context);

  // As it was recorded with, where it was.
  const fs::path own = folder.folder / kMonitorFile;
  const fs::path from = !p.setup.empty() ? fs::path(p.setup) : fs::exists(own) ? own : fs::path();
  const std::string setup_json = from.empty() ? std::string(default_monitor_json()) : read_text(from);
  MonitorOptions options;
  options.setup = parse_monitor(setup_json, from.empty() ? "the built-in monitor" : from.string());
  options.heat = p.heat;
  MonitorReader monitor(options, anatomy.structures.get(), outline.header.rate_hz);
  const MonitorWiring& wiring = monitor.wiring();
  if (wiring.courses.empty())
    throw Error(ExitCode::usage,
                "the case lists none of the nerves that the monitor knows (" + in_a_row(wiring.left_out) + ")",
                "prepare it with --structures and --names, like '6=facial nerve'");
  const std::size_t channel = channel_named(p.channel, wiring.labels());
  set_stimulator(monitor, p, session, io.context);

  Json j;
  ReplayResult r;
  const auto may_replace = [&](const fs::path& old) { require_ours(old, io.common.force); };
  write_folder_atomically(p.out, may_replace, [&](const fs::path& to) {
    BlackrockFiles files(to, "monitor", wiring.labels(), options.setup.constants);
    EventTable table(to / "events.csv", wiring);
    monitor.add_sink(files);
    monitor.add_sink(table);
    Reader* const readers[] = {&monitor};
    r = replay(session, world_at_begin(folder, the_case, anatomy, io.context), anatomy, io.context, readers);
    monitor.end();
    files.close();
    table.close();
    write_channel(to / "monitor.ns5", channel, wiring.channels.size(), to / "channel.wav");
    write_file(to / "monitor.json", setup_json);
    j = Json{{"seconds", static_cast<double>(files.samples()) / MonitorSetup::kRateHz},
             {"samples", files.samples()},
             {"channels", wiring.labels()},
             {"left_out", wiring.left_out},
             {"spikes", files.spikes()},
             {"events", table.counts},
             {"causes", table.causes},
             {"thresholds_ma", table.thresholds},
             {"heat", p.heat},
             {"ticks", r.ticks_repeated},
             {"same_as_recorded", r.identical}};
    j["nerves"] = nerves_json(monitor);
  });
  io.end_progress();
  if (io.common.json) io.out << j.dump(2) << '\n';
  for (const std::string& line : r.losses) io.err << "session: " << line << '\n';
  if (!r.identical)
    io.err << "session: the replay differs from what was recorded (" << r.difference << "): neither may its monitor\n";
  if (!io.common.quiet) report_monitor(j, wiring, p.out, io.err);
  return static_cast<int>(!outline.gaps.empty() ? ExitCode::partial
                          : outline.damaged()   ? ExitCode::corrupt
                                                : ExitCode::ok);
}

}  // namespace osteo
