#include "osteo/simulation/nerve/detail/monitor_setup.h"

#include <cmath>
#include <set>

#include "monitor_json.h"
#include "osteo/core/base/json.h"

namespace osteo::inline simulation {
namespace {

const std::vector<std::string> kConstantKeys{"value", "unit", "source"};
const std::vector<std::string> kNerveKeys{"structures", "distal", "source", "channels"};
const std::vector<std::string> kChannelKeys{"name", "evoked_uv", "latency_ms", "share"};

void need_source(const JsonFile& file, const JsonValue& object, const std::string& where) {
  const JsonValue& source = file.need(object, where, "source");
  if (file.text(source, "\"source\"").empty())
    throw file.wrong(source, where + " has no source", "say where the number comes from");
}

void read_constants(const JsonFile& file, const JsonValue& object, MonitorConstants& constants) {
  const std::vector<FieldRef> fields = fields_of<MonitorConstants>(constants);
  std::vector<std::string> names;
  for (const FieldRef& f : fields) names.emplace_back(f.doc.name);
  file.allow(object, "constants", names);
  for (const FieldRef& f : fields) {
    const std::string name(f.doc.name);
    const JsonValue& constant = file.need(object, "constants", name);
    file.allow(constant, name, kConstantKeys);
    need_source(file, constant, name);
    const JsonValue& unit = file.need(constant, name, "unit");
    if (file.text(unit, "\"unit\"") != f.doc.unit)
      throw file.wrong(unit, name + " is in " + std::string(f.doc.unit) + ", not in " + unit.text, "convert the value");
    *std::get<double*>(f.target) = file.number(file.need(constant, name, "value"), name, f.doc.lo, f.doc.hi);
  }
  const auto rising = [&](const char* least, double a, const char* most, double b) {
    if (a > b) throw file.wrong(object, std::string(least) + " is more than " + most);
  };
  const MonitorConstants& c = constants;
  rising("bare_ma", c.bare_ma, "soft_ma", c.soft_ma);
  rising("burst_least_s", c.burst_least_s, "burst_most_s", c.burst_most_s);
  rising("burst_least_hz", c.burst_least_hz, "burst_most_hz", c.burst_most_hz);
  rising("burst_least_uv", c.burst_least_uv, "burst_most_uv", c.burst_most_uv);
  rising("train_least_s", c.train_least_s, "train_most_s", c.train_most_s);
  rising("train_least_hz", c.train_least_hz, "train_most_hz", c.train_most_hz);
  rising("train_least_uv", c.train_least_uv, "train_most_uv", c.train_most_uv);
  if (c.dose_from_min >= c.dose_to_min) throw file.wrong(object, "dose_from_min is not below dose_to_min");
  if (c.response_from_ms >= c.response_to_ms) throw file.wrong(object, "response_from_ms is not below response_to_ms");
}

MonitoredNerve read_nerve(const JsonFile& file, const JsonValue& object, const std::string& where) {
  MonitoredNerve nerve;
  file.allow(object, where, kNerveKeys);
  need_source(file, object, where);
  for (const JsonValue& s : file.list(file.need(object, where, "structures"), "\"structures\""))
    nerve.structures.push_back(lower_case(file.text(s, "a structure")));
  if (nerve.structures.empty()) throw file.wrong(object, where + " names no structure");
  const auto& distal = file.list(file.need(object, where, "distal"), "\"distal\"", 3);
  for (std::size_t a = 0; a < 3; ++a) nerve.distal[a] = file.number(distal[a], "\"distal\"", -1, 1);
  if (length(nerve.distal) < 0.1) throw file.wrong(object, where + ": \"distal\" has no direction");
  nerve.distal = normalized(nerve.distal);
  for (const JsonValue& c : file.list(file.need(object, where, "channels"), "\"channels\"")) {
    MonitorChannel channel;
    file.allow(c, where, kChannelKeys);
    const JsonValue& name = file.need(c, where, "name");
    channel.name = file.text(name, "\"name\"");
    if (channel.name.empty() || channel.name.size() > 64)
      throw file.wrong(name, "a channel's name has 1 to 64 characters");
    channel.evoked_uv = file.number(file.need(c, channel.name, "evoked_uv"), "\"evoked_uv\"", 0, 8000);
    channel.latency_ms = file.number(file.need(c, channel.name, "latency_ms"), "\"latency_ms\"", 0.5, 30);
    channel.share = file.number(file.need(c, channel.name, "share"), "\"share\"", 0, 1);
    nerve.channels.push_back(channel);
  }
  if (nerve.channels.empty())
    throw file.wrong(object, where + " has no channels", "without one it cannot be heard: leave the nerve out");
  return nerve;
}

}  // namespace

MonitorSetup parse_monitor(std::string_view json, const std::string& name) {
  const JsonFile file(json, name);
  file.require_format("osteotome_monitor");
  const JsonValue& root = file.root();
  file.allow(root, "",
             std::vector<std::string>{"osteotome_monitor", "$schema", "about", "seed", "constants", "nerves"});
  MonitorSetup setup;
  if (const JsonValue* const seed = root.find("seed")) {
    const double value = file.number(*seed, "\"seed\"", 0, 9007199254740992.0);
    if (value != std::floor(value)) throw file.wrong(*seed, "\"seed\" is a whole number");
    setup.seed = static_cast<std::uint64_t>(value);
  }
  read_constants(file, file.need(root, "", "constants"), setup.constants);
  std::size_t channels = 0;
  std::set<std::string> names;
  for (const JsonValue& n : file.list(file.need(root, "", "nerves"), "\"nerves\"")) {
    setup.nerves.push_back(read_nerve(file, n, "nerve " + std::to_string(setup.nerves.size() + 1)));
    for (const MonitorChannel& c : setup.nerves.back().channels) {
      if (!names.insert(c.name).second) throw file.wrong(n, "two channels are called '" + c.name + "'");
    }
    channels += setup.nerves.back().channels.size();
    if (channels > MonitorSetup::kMaxChannels)
      throw file.wrong(n, "there are more than " + std::to_string(MonitorSetup::kMaxChannels) + " channels");
  }
  return setup;
}

std::string_view default_monitor_json() {
  return kMonitorJson;
}

}  // namespace osteo::inline simulation
