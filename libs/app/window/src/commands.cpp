#include "commands.h"

#include <algorithm>
#include <cctype>

#include "osteo/simulation/bone/burr_kind.h"
#include "osteo/simulation/bone/posture.h"
#include "palette.h"

namespace osteo::inline app {
namespace {

struct Named {
  const char *name, *synonyms;
  std::optional<Command> command = {};
  int value = 0;
  const char* gesture = "";  // of the mouse, before the keys
  bool shift = false;
};

using enum Command;

constexpr Named kDrill[] = {
    {"Drill", "burr run cut bone pedal", {}, 0, "left button, held"},
    {"Drill on or off", "burr run start stop latch motor", drill},
    {"Move the drill", "hand across view", {}, 0, "mouse"},
    {"Approach: drill to the bone under the mouse", "bring go there touch", bring},
    {"Retract: drill out of the bone", "lift away out up", lift},
    {"Deeper", "push press forward depth down", deeper, 0, "Shift-wheel, Shift-drag"},
    {"Back", "pull out depth up", back, 0, "Shift-wheel, Shift-drag"},
    {"Ball burr", "shape round rose", ball},
    {"Cylinder burr", "shape barrel", cylinder},
    {"Taper burr", "shape cone", taper},
    {"Burr speed: slower", "rpm motor", burr_speed, -1},
    {"Burr speed: faster", "rpm motor", burr_speed, 1},
    {"Larger burr", "next size diameter", next_burr, 1},
    {"Smaller burr", "next size diameter", next_burr, -1},
    {"Other kind of burr", "next cutting diamond", other_burr},
    {"Tool wheel", "choose instrument radial", wheel},
    {"Undo: last stroke, cut, move or plate", "take back revert", undo},
    {"Compare with the bone at the start", "before original as it was", before},
    {"Pedal: drills while held", "foot switch", pedal},
};
constexpr Named kWater[] = {
    {"Suction", "suck sucker dust aspirate", suck},
    {"Irrigation on or off", "water wash rinse", irrigation},
    {"Irrigation while a pedal is held", "water wash rinse", wash},
    {"Second hand: suction, irrigation, probe, nothing", "sucker irrigator instrument", second_hand},
    {"Mouse moves the second hand", "sucker", second_mouse},
};
constexpr Named kTools[] = {
    {"Saw, at the bone under the mouse", "osteotomy blade plane cut", saw},
    {"Fragments: separate and move bone", "pieces segments", pieces},
    {"Plate: take one", "plates screws fix osteosynthesis", plates},
    {"Turn saw, fragment or plate to the left", "rotate", turn_left},
    {"Turn saw, fragment or plate to the right", "rotate", turn_right},
    {"Apply: cut, separate fragments, fix the plate", "perform do enter", perform},
    {"Put away: back to the drill", "escape close cancel", put_away},
    {"Move saw plane or fragment", "drag shift", {}, 0, "left drag"},
    {"Turn saw plane or fragment", "drag rotate tilt", {}, 0, "Shift-left drag"},
};
constexpr Named kView[] = {
    {"Zoom", "magnify larger smaller", {}, 0, "wheel"},
    {"Turn the view", "orbit rotate camera", {}, 0, "right drag"},
    {"Roll the view", "rotate camera", {}, 0, "Shift-right drag"},
    {"Shift the view", "pan move camera", {}, 0, "middle drag"},
    {"Focus deeper, back", "sharp depth", {}, 0, "Ctrl-Shift-wheel"},
    {"Whole bone, from the left", "home overview reset view", home},
    {"Magnification: next step", "zoom in larger", magnify, 1},
    {"Magnification: step before", "zoom out smaller", magnify, -1},
    {"Focus back", "sharp depth", focus, -1},
    {"Focus deeper", "sharp depth", focus, 1},
    {"Focus on the bone in the middle", "autofocus sharp", autofocus},
    {"Look at the bone under the mouse", "centre there", look_there},
    {"Look at the drill", "burr centre", look_at_drill},
    {"Look along the drill", "burr axis", look_at_drill, 0, "", true},
    {"Guide the camera by hand", "microscope move", guide_camera},
    {"View 1: go there", "bookmark", bookmark, 0},
    {"View 2: go there", "bookmark", bookmark, 1},
    {"View 3: go there", "bookmark", bookmark, 2},
    {"View 1: keep this view", "bookmark save", bookmark, 0, "", true},
    {"View 2: keep this view", "bookmark save", bookmark, 1, "", true},
    {"View 3: keep this view", "bookmark save", bookmark, 2, "", true},
    {"Camera: undo its last move", "take back view", camera_back},
    {"Turn the view to the left", "orbit", orbit_left},
    {"Turn the view to the right", "orbit", orbit_right},
    {"Turn the view up", "orbit", orbit_up},
    {"Turn the view down", "orbit", orbit_down},
    {"Picture quality: auto, plain, calm, deep", "rendering fast fine", quality},
};
constexpr Named kCuts[] = {
    {"Plan: regions to remove and keep", "procedure green orange", regions},
    {"Cut in the middle", "slice enlarge", cut_in_middle, 0, "double click"},
    {"Cuts along the tool or along the body", "slices axial coronal sagittal oblique", cuts_along_tool},
    {"Scroll a cut", "slice", {}, 0, "wheel"},
    {"Zoom a cut", "slice larger", {}, 0, "Ctrl-wheel"},
    {"Look there in all cuts", "crosshair slice", {}, 0, "click, Shift-move"},
    {"Measure in a cut", "distance ruler slice", {}, 0, "left drag"},
    {"Window and level of a cut", "contrast brightness grey slice", {}, 0, "right drag"},
};
constexpr Named kHand[] = {
    {"Tilt the handle to the left", "angle lean", tilt, 0, "Alt-right drag"},
    {"Tilt the handle to the right", "angle lean", tilt, 1, "Alt-right drag"},
    {"Tilt the handle up", "angle lean", tilt, 2, "Alt-right drag"},
    {"Tilt the handle down", "angle lean", tilt, 3, "Alt-right drag"},
    {"Roll the handle", "twist", roll, 1, "Alt-Shift-right drag"},
    {"Roll the handle back", "twist", roll, -1},
    {"Handle straight: as the view holds it", "reset tilt", straight},
    {"Clutch: mouse moves without the drill", "lift mouse", clutch, 0, "mouse 4"},
    {"Wrist rest: hand moves finely", "precise slow", wrist_rest, 0, "mouse 5"},
    {"Hand moves finer", "motion scale precise", motion, -1},
    {"Hand moves coarser", "motion scale", motion, 1},
    {"Controls: hand, pedals and buttons", "settings assign device", hand_page},
};
constexpr Named kSession[] = {
    {"End the session", "quit finish close save", quit},
    {"Save and continue", "keep store", save},
    {"Reset bone", "begin again new restart", reset},
    {"Picture: screenshot with its caption", "photo image", screenshot},
    {"Note on the bone, or a mark of this moment", "annotate comment flag", mark},
    {"Ruler: distance between two points", "measure length", ruler},
    {"Hints while drilling", "help feedback", hints},
    {"Guidance: your hand is led, or let go", "lead tutor lesson", lead},
    {"Nerve monitor", "emg facial", monitor},
    {"Sound of the nerve monitor", "mute emg", mute_monitor},
    {"Course of the session, after its end", "timeline review history", timeline},
    {"Earlier in the course", "timeline back", earlier},
    {"Later in the course", "timeline on", later},
};
// Without keys: found by name alone.
constexpr Named kPatient[] = {
    {"Patient position: supine", "lies posture gravity back", posture, static_cast<int>(Posture::supine)},
    {"Patient position: prone", "lies posture gravity belly", posture, static_cast<int>(Posture::prone)},
    {"Patient position: sitting", "posture gravity", posture, static_cast<int>(Posture::sitting)},
    {"Patient position: on the left side", "lies posture gravity", posture, static_cast<int>(Posture::left_side)},
    {"Patient position: on the right side", "lies posture gravity", posture, static_cast<int>(Posture::right_side)},
};
constexpr Named kWindow[] = {
    {"All commands", "search palette find", palette},
    {"Ten keys; again: all keys", "help mouse list", help},
    {"Operate or plan", "layout four pictures cuts screens", layout},
    {"Menu and settings", "panel options theme colours light dark patient position haptics", panel_keys},
    {"Keys to the next part of the window", "focus tab strip card", focus_next},
    {"Full screen", "window maximise", full_screen},
    {"Sound on or off", "mute volume noise", sound},
    {"Colours: dark", "theme night", colours, static_cast<int>(ThemeName::dark)},
    {"Colours: light", "theme day bright", colours, static_cast<int>(ThemeName::light)},
    {"Colours: high contrast", "theme black white", colours, static_cast<int>(ThemeName::high_contrast)},
    {"Text larger", "size scale letters", {}, 0, "Ctrl +"},
    {"Text smaller", "size scale letters", {}, 0, "Ctrl -"},
    {"Text as the monitor has it", "size scale letters", {}, 0, "Ctrl 0"},
};

bool by_holding(Command command) {
  for (const Key& key : key_table()) {
    if (key.command == command) return key.when == Key::When::held;
  }
  return command == Command::pedal || command == Command::wash;  // of buttons alone
}

std::string keys_of(const Named& named) {
  std::string all = named.gesture;
  if (!named.command) return all;
  for (const Key& key : key_table()) {
    if (key.command != *named.command || key.value != named.value) continue;
    if (!all.empty()) all += ", ";
    all += std::string(key.with == kWithCtrl  ? "Ctrl-"
                       : key.with == kWithAlt ? "Alt-"
                                              : "") +
           (named.shift ? "Shift-" : "") + key_word(key.code);
  }
  return all;
}

template <std::size_t N>
void add(std::vector<CommandRow>& rows, const char* group, const Named (&all)[N]) {
  for (const Named& n : all)
    rows.push_back({n.name, group, n.synonyms, keys_of(n), n.command, n.value, n.shift,
                    n.command.has_value() && by_holding(*n.command)});
}

void add_burrs(std::vector<CommandRow>& rows) {
  for (int d = 1; d <= 7; ++d) {
    const Named size{"", "diameter size", Command::diameter, d};
    rows.push_back({"Burr of " + std::to_string(d) + " mm", "Drill", size.synonyms, keys_of(size), size.command, d});
  }
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n) {
    const Named kind{"", "kind material", Command::burr_kind, static_cast<int>(n)};
    std::string name(kBurrKinds[n].name);
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
    rows.push_back({name + " burr", "Drill", kind.synonyms, keys_of(kind), kind.command, kind.value});
  }
}

std::vector<std::string> words_of_text(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 128 && std::isalnum(byte) == 0) {
      if (!words.back().empty()) words.emplace_back();
    } else {
      words.back() += static_cast<char>(byte < 128 ? std::tolower(byte) : byte);
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

bool begins_one(const std::string& word, const std::vector<std::string>& of) {
  return std::any_of(of.begin(), of.end(), [&](const std::string& w) { return w.starts_with(word); });
}

// How far a row is from what is asked for; none: it is not meant.
std::optional<int> distance(const CommandRow& row, const std::vector<std::string>& asked) {
  const auto name = words_of_text(row.name), synonyms = words_of_text(row.synonyms), group = words_of_text(row.group);
  int all = 0;
  for (std::size_t n = 0; n < asked.size(); ++n) {
    const std::string& word = asked[n];
    if (n < name.size() && name[n] == word) continue;
    if (n < name.size() && name[n].starts_with(word)) {
      all += 1;
    } else if (begins_one(word, name)) {
      all += 2;
    } else if (begins_one(word, synonyms)) {
      all += 3;
    } else if (begins_one(word, group)) {
      all += 4;
    } else {
      return std::nullopt;
    }
  }
  return all;
}

}  // namespace

const std::vector<CommandRow>& command_rows() {
  static const std::vector<CommandRow> rows = [] {
    std::vector<CommandRow> all;
    add(all, "Drill", kDrill);
    add_burrs(all);
    add(all, "Suction and irrigation", kWater);
    add(all, "Saw, fragments, plates", kTools);
    add(all, "View", kView);
    add(all, "Cuts", kCuts);
    add(all, "Hand", kHand);
    add(all, "Session", kSession);
    add(all, "Patient position", kPatient);
    add(all, "Window", kWindow);
    return all;
  }();
  return rows;
}

const CommandRow* row_of(Command command, int value) {
  const auto& rows = command_rows();
  const auto at = std::find_if(rows.begin(), rows.end(),
                               [&](const CommandRow& r) { return r.command == command && r.value == value; });
  return at == rows.end() ? nullptr : &*at;
}

std::vector<const CommandRow*> find_commands(const std::string& text) {
  const std::vector<std::string> asked = words_of_text(text);
  std::vector<std::pair<int, const CommandRow*>> fitting;
  for (const CommandRow& row : command_rows()) {
    if (const auto far = distance(row, asked)) fitting.emplace_back(*far, &row);
  }
  std::stable_sort(fitting.begin(), fitting.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const CommandRow*> out;
  for (const auto& [far, row] : fitting) out.push_back(row);
  return out;
}

void CommandSearch::clear() {
  text_.clear();
  look();
}

void CommandSearch::type(char32_t letter) {
  if (letter < 0x20 || letter == 0x7F || text_.size() > 60) return;
  if (letter == U' ' && text_.empty()) return;
  const auto part = [&](unsigned bits) { text_ += static_cast<char>(bits); };
  const auto tail = [&](int from) { part(0x80U | (letter >> from & 0x3FU)); };
  if (letter < 0x80) {
    part(letter);
  } else if (letter < 0x800) {
    part(0xC0U | letter >> 6);
    tail(0);
  } else if (letter < 0x10000) {
    part(0xE0U | letter >> 12);
    tail(6);
    tail(0);
  } else {
    part(0xF0U | letter >> 18);
    tail(12);
    tail(6);
    tail(0);
  }
  look();
}

void CommandSearch::erase() {
  while (!text_.empty() && (static_cast<unsigned char>(text_.back()) & 0xC0U) == 0x80U) text_.pop_back();
  if (!text_.empty()) text_.pop_back();
  look();
}

void CommandSearch::move(int rows) {
  if (found_.empty()) return;
  const int last = static_cast<int>(found_.size()) - 1;
  chosen_ = static_cast<std::size_t>(std::clamp(static_cast<int>(chosen_) + rows, 0, last));
}

void CommandSearch::look() {
  found_ = find_commands(text_);
  chosen_ = 0;
}

}  // namespace osteo::inline app
