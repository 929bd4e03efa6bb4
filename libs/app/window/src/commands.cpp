#include "commands.h"

#include <algorithm>
#include <cctype>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/bone/burr_kind.h"
#include "osteo/simulation/bone/posture.h"
#include "palette.h"

namespace osteo::inline app {
namespace {

// Its texts are marked for the catalogues, and shown by shown_name() and the like. Synonyms of a translation are those
// of its language, not one for one.
struct Named {
  const char *name, *synonyms;
  std::optional<Command> command = {};
  int value = 0;
  const char* gesture = "";  // of the mouse, before the keys
  bool shift = false;
};

using enum Command;

constexpr Named kDrill[] = {
    {tr_later("Drill"), tr_later("burr run cut bone pedal"), {}, 0, tr_later("left button, held")},
    {tr_later("Drill on or off"), tr_later("burr run start stop latch motor"), drill},
    {tr_later("Move the drill"), tr_later("hand across view"), {}, 0, tr_later("mouse")},
    {tr_later("Approach: drill to the bone under the mouse"), tr_later("bring go there touch"), bring},
    {tr_later("Retract: drill out of the bone"), tr_later("lift away out up"), lift},
    {tr_later("Deeper"), tr_later("push press forward depth down"), deeper, 0, tr_later("Shift-wheel, Shift-drag")},
    {tr_later("Back"), tr_later("pull out depth up"), back, 0, tr_later("Shift-wheel, Shift-drag")},
    {tr_later("Ball burr"), tr_later("shape round rose"), ball},
    {tr_later("Cylinder burr"), tr_later("shape barrel"), cylinder},
    {tr_later("Taper burr"), tr_later("shape cone"), taper},
    {tr_later("Burr speed: slower"), tr_later("rpm motor"), burr_speed, -1},
    {tr_later("Burr speed: faster"), tr_later("rpm motor"), burr_speed, 1},
    {tr_later("Larger burr"), tr_later("next size diameter"), next_burr, 1},
    {tr_later("Smaller burr"), tr_later("next size diameter"), next_burr, -1},
    {tr_later("Other kind of burr"), tr_later("next cutting diamond"), other_burr},
    {tr_later("Tool wheel"), tr_later("choose instrument radial"), wheel},
    {tr_later("Undo: last stroke, cut, move or plate"), tr_later("take back revert"), undo},
    {tr_later("Compare with the bone at the start"), tr_later("before original as it was"), before},
    {tr_later("Pedal: drills while held"), tr_later("foot switch"), pedal},
};
constexpr Named kWater[] = {
    {tr_later("Suction"), tr_later("suck sucker dust aspirate"), suck},
    {tr_later("Irrigation on or off"), tr_later("water wash rinse"), irrigation},
    {tr_later("Irrigation while a pedal is held"), tr_later("water wash rinse"), wash},
    {tr_later("Second hand: suction, irrigation, probe, nothing"), tr_later("sucker irrigator instrument"),
     second_hand},
    {tr_later("Mouse moves the second hand"), tr_later("sucker"), second_mouse},
    {tr_later("Bone dust and irrigation on or off"), tr_later("water simulate slurry"), simulate,
     static_cast<int>(Simulated::dust)},
    {tr_later("Heat of drilling on or off"), tr_later("temperature warm simulate"), simulate,
     static_cast<int>(Simulated::heat)},
};
constexpr Named kTools[] = {
    {tr_later("Saw, at the bone under the mouse"), tr_later("osteotomy blade plane cut"), saw},
    {tr_later("Fragments: separate and move bone"), tr_later("pieces segments"), pieces},
    {tr_later("Plate: take one"), tr_later("plates screws fix osteosynthesis"), plates},
    {tr_later("Turn saw, fragment or plate to the left"), tr_later("rotate"), turn_left},
    {tr_later("Turn saw, fragment or plate to the right"), tr_later("rotate"), turn_right},
    {tr_later("Apply: cut, separate fragments, fix the plate"), tr_later("perform do enter"), perform},
    {tr_later("Put away: back to the drill"), tr_later("escape close cancel"), put_away},
    {tr_later("Move saw plane or fragment"), tr_later("drag shift"), {}, 0, tr_later("left drag")},
    {tr_later("Turn saw plane or fragment"), tr_later("drag rotate tilt"), {}, 0, tr_later("Shift-left drag")},
};
constexpr Named kView[] = {
    {tr_later("Zoom"), tr_later("magnify larger smaller"), {}, 0, tr_later("wheel")},
    {tr_later("Turn the view"), tr_later("orbit rotate camera"), {}, 0, tr_later("right drag")},
    {tr_later("Roll the view"), tr_later("rotate camera"), {}, 0, tr_later("Shift-right drag")},
    {tr_later("Shift the view"), tr_later("pan move camera"), {}, 0, tr_later("middle drag")},
    {tr_later("Focus deeper, back"), tr_later("sharp depth"), {}, 0, tr_later("Ctrl-Shift-wheel")},
    {tr_later("Whole bone, from the left"), tr_later("home overview reset view"), home},
    {tr_later("Magnification: next step"), tr_later("zoom in larger"), magnify, 1},
    {tr_later("Magnification: step before"), tr_later("zoom out smaller"), magnify, -1},
    {tr_later("Focus back"), tr_later("sharp depth"), focus, -1},
    {tr_later("Focus deeper"), tr_later("sharp depth"), focus, 1},
    {tr_later("Focus on the bone in the middle"), tr_later("autofocus sharp"), autofocus},
    {tr_later("Look at the bone under the mouse"), tr_later("centre there"), look_there},
    {tr_later("Look at the drill"), tr_later("burr centre"), look_at_drill},
    {tr_later("Look along the drill"), tr_later("burr axis"), look_at_drill, 0, "", true},
    {tr_later("Guide the camera by hand"), tr_later("microscope move"), guide_camera},
    {tr_later("View 1: go there"), tr_later("bookmark"), bookmark, 0},
    {tr_later("View 2: go there"), tr_later("bookmark"), bookmark, 1},
    {tr_later("View 3: go there"), tr_later("bookmark"), bookmark, 2},
    {tr_later("View 1: keep this view"), tr_later("bookmark save"), bookmark, 0, "", true},
    {tr_later("View 2: keep this view"), tr_later("bookmark save"), bookmark, 1, "", true},
    {tr_later("View 3: keep this view"), tr_later("bookmark save"), bookmark, 2, "", true},
    {tr_later("Camera: undo its last move"), tr_later("take back view"), camera_back},
    {tr_later("Turn the view to the left"), tr_later("orbit"), orbit_left},
    {tr_later("Turn the view to the right"), tr_later("orbit"), orbit_right},
    {tr_later("Turn the view up"), tr_later("orbit"), orbit_up},
    {tr_later("Turn the view down"), tr_later("orbit"), orbit_down},
    {tr_later("Picture quality: auto, plain, calm, deep"), tr_later("rendering fast fine"), quality},
};
constexpr Named kCuts[] = {
    {tr_later("Plan: regions to remove and keep"), tr_later("procedure green orange"), regions},
    {tr_later("Cut in the middle"), tr_later("slice enlarge"), cut_in_middle, 0, tr_later("double click")},
    {tr_later("Cuts along the tool or along the body"), tr_later("slices axial coronal sagittal oblique"),
     cuts_along_tool},
    {tr_later("Scroll a cut"), tr_later("slice"), {}, 0, tr_later("wheel")},
    {tr_later("Zoom a cut"), tr_later("slice larger"), {}, 0, tr_later("Ctrl-wheel")},
    {tr_later("Look there in all cuts"), tr_later("crosshair slice"), {}, 0, tr_later("click, Shift-move")},
    {tr_later("Measure in a cut"), tr_later("distance ruler slice"), {}, 0, tr_later("left drag")},
    {tr_later("Window and level of a cut"), tr_later("contrast brightness grey slice"), {}, 0, tr_later("right drag")},
};
constexpr Named kHand[] = {
    {tr_later("Tilt the handle to the left"), tr_later("angle lean"), tilt, 0, tr_later("Alt-right drag")},
    {tr_later("Tilt the handle to the right"), tr_later("angle lean"), tilt, 1, tr_later("Alt-right drag")},
    {tr_later("Tilt the handle up"), tr_later("angle lean"), tilt, 2, tr_later("Alt-right drag")},
    {tr_later("Tilt the handle down"), tr_later("angle lean"), tilt, 3, tr_later("Alt-right drag")},
    {tr_later("Roll the handle"), tr_later("twist"), roll, 1, tr_later("Alt-Shift-right drag")},
    {tr_later("Roll the handle back"), tr_later("twist"), roll, -1},
    {tr_later("Handle straight: as the view holds it"), tr_later("reset tilt"), straight},
    {tr_later("Clutch: mouse moves without the drill"), tr_later("lift mouse"), clutch, 0, tr_later("mouse 4")},
    {tr_later("Wrist rest: hand moves finely"), tr_later("precise slow"), wrist_rest, 0, tr_later("mouse 5")},
    {tr_later("Hand moves finer"), tr_later("motion scale precise"), motion, -1},
    {tr_later("Hand moves coarser"), tr_later("motion scale"), motion, 1},
    {tr_later("Controls: hand, pedals and buttons"), tr_later("settings assign device"), hand_page},
};
constexpr Named kSession[] = {
    {tr_later("End the session"), tr_later("quit finish close save"), quit},
    {tr_later("Save and continue"), tr_later("keep store"), save},
    {tr_later("Reset bone"), tr_later("begin again new restart"), reset},
    {tr_later("Picture: screenshot with its caption"), tr_later("photo image"), screenshot},
    {tr_later("Note on the bone, or a mark of this moment"), tr_later("annotate comment flag"), mark},
    {tr_later("Ruler: distance between two points"), tr_later("measure length"), ruler},
    {tr_later("Hints while drilling"), tr_later("help feedback"), hints},
    {tr_later("Guidance: your hand is led, or let go"), tr_later("lead tutor lesson"), lead},
    {tr_later("Nerve monitor"), tr_later("emg facial"), monitor},
    {tr_later("Sound of the nerve monitor"), tr_later("mute emg"), mute_monitor},
    {tr_later("Course of the session, after its end"), tr_later("timeline review history"), timeline},
    {tr_later("Earlier in the course"), tr_later("timeline back"), earlier},
    {tr_later("Later in the course"), tr_later("timeline on"), later},
};
// Without keys: found by name alone.
constexpr Named kPatient[] = {
    {tr_later("Patient position: supine"), tr_later("lies posture gravity back"), posture,
     static_cast<int>(Posture::supine)},
    {tr_later("Patient position: prone"), tr_later("lies posture gravity belly"), posture,
     static_cast<int>(Posture::prone)},
    {tr_later("Patient position: sitting"), tr_later("posture gravity"), posture, static_cast<int>(Posture::sitting)},
    {tr_later("Patient position: on the left side"), tr_later("lies posture gravity"), posture,
     static_cast<int>(Posture::left_side)},
    {tr_later("Patient position: on the right side"), tr_later("lies posture gravity"), posture,
     static_cast<int>(Posture::right_side)},
};
constexpr Named kWindow[] = {
    {tr_later("All commands"), tr_later("search palette find"), palette},
    {tr_later("Ten keys; again: all keys"), tr_later("help mouse list"), help},
    {tr_later("Operate or plan"), tr_later("layout four pictures cuts screens"), layout},
    {tr_later("Menu and settings"), tr_later("panel options theme colours light dark patient position haptics"),
     settings},
    {tr_later("Keys to the next part of the window"), tr_later("focus tab strip card"), focus_next},
    {tr_later("Full screen"), tr_later("window maximise"), full_screen},
    {tr_later("Sound on or off"), tr_later("mute volume noise"), sound},
    {tr_later("Colours: dark"), tr_later("theme night"), colours, static_cast<int>(ThemeName::dark)},
    {tr_later("Colours: light"), tr_later("theme day bright"), colours, static_cast<int>(ThemeName::light)},
    {tr_later("Colours: high contrast"), tr_later("theme black white"), colours,
     static_cast<int>(ThemeName::high_contrast)},
    {tr_later("Text larger"), tr_later("size scale letters"), {}, 0, "Ctrl +"},
    {tr_later("Text smaller"), tr_later("size scale letters"), {}, 0, "Ctrl -"},
    {tr_later("Text as the monitor has it"), tr_later("size scale letters"), {}, 0, "Ctrl 0"},
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
    rows.push_back({n.name, group, n.synonyms, n.gesture, keys_of(n), n.command, n.value, n.shift,
                    n.command.has_value() && by_holding(*n.command)});
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

void add_burrs(std::vector<CommandRow>& rows) {
  const EnglishHere names;
  const auto add_one = [&](const Named& n) {
    rows.push_back({"", "Drill", n.synonyms, "", keys_of(n), n.command, n.value});
    rows.back().name = shown_name(rows.back());
  };
  for (int d = 1; d <= 7; ++d) add_one({"", tr_later("diameter size"), Command::diameter, d});
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n)
    add_one({"", tr_later("kind material"), Command::burr_kind, static_cast<int>(n)});
}

// In small letters without accents, so that a search need not have them; Chinese as it is.
std::string plain_letter(char32_t code, const std::string& as_is) {
  // From U+00E0 on, and U+00C0 in capitals.
  static constexpr char kLatin[] = "aaaaaaaceeeeiiiidnooooo?ouuuuyty";
  if (code < 0x80) {
    const auto c = static_cast<unsigned char>(code);
    return std::isalnum(c) == 0 ? std::string() : std::string(1, static_cast<char>(std::tolower(c)));
  }
  if (code == 0xDF) return "ss";
  if (code == 0x152 || code == 0x153) return "oe";
  if (code >= 0xC0 && code <= 0xFF && code != 0xD7 && code != 0xF7) return {kLatin[(code - 0xC0) % 32]};
  const bool mark = code < 0x100 || (code >= 0x2000 && code < 0x2070) || (code >= 0x3000 && code < 0x3040) ||
                    (code >= 0xFF00 && code < 0xFF10) || (code >= 0xFF1A && code <= 0xFF20);
  return mark ? std::string() : as_is;
}

std::vector<std::string> words_of_text(const std::string& text) {
  std::vector<std::string> words(1);
  for (std::size_t n = 0; n < text.size();) {
    const auto first = static_cast<unsigned char>(text[n]);
    const std::size_t bytes = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    const std::string one = text.substr(n, bytes);
    n += bytes;
    char32_t code = bytes == 1 ? first : first & (0x7FU >> bytes);
    for (std::size_t k = 1; k < one.size(); ++k) code = code << 6 | (static_cast<unsigned char>(one[k]) & 0x3FU);
    const std::string letter = plain_letter(code, one);
    if (!letter.empty()) {
      words.back() += letter;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

// Chinese sets no blanks between words: there it may begin anywhere.
bool begins(const std::string& word, const std::string& of) {
  const bool chinese = !word.empty() && static_cast<unsigned char>(word[0]) >= 0xE3;
  return chinese ? of.find(word) != std::string::npos : of.starts_with(word);
}

bool begins_one(const std::string& word, const std::vector<std::string>& of) {
  return std::any_of(of.begin(), of.end(), [&](const std::string& w) { return begins(word, w); });
}

struct RowWords {
  std::vector<std::string> name, synonyms, group;
};

// How far a row is from what is asked for; none: it is not meant.
std::optional<int> distance(const RowWords& row, const std::vector<std::string>& asked) {
  int all = 0;
  for (std::size_t n = 0; n < asked.size(); ++n) {
    const std::string& word = asked[n];
    if (n < row.name.size() && row.name[n] == word) continue;
    if (n < row.name.size() && begins(word, row.name[n])) {
      all += 1;
    } else if (begins_one(word, row.name)) {
      all += 2;
    } else if (begins_one(word, row.synonyms)) {
      all += 3;
    } else if (begins_one(word, row.group)) {
      all += 4;
    } else {
      return std::nullopt;
    }
  }
  return all;
}

// By what it is called in English or in the language, whichever is nearer.
std::optional<int> distance(const CommandRow& row, const std::vector<std::string>& asked) {
  const auto english =
      distance({words_of_text(row.name), words_of_text(row.synonyms), words_of_text(row.group)}, asked);
  if (language() == Language::english) return english;
  const auto shown =
      distance({words_of_text(shown_name(row)), words_of_text(tr(row.synonyms)), words_of_text(tr(row.group))}, asked);
  return english && shown ? std::min(*english, *shown) : english ? english : shown;
}

}  // namespace

const std::vector<CommandRow>& command_rows() {
  static const std::vector<CommandRow> rows = [] {
    std::vector<CommandRow> all;
    add(all, tr_later("Drill"), kDrill);
    add_burrs(all);
    add(all, tr_later("Suction and irrigation"), kWater);
    add(all, tr_later("Saw, fragments, plates"), kTools);
    add(all, tr_later("View"), kView);
    add(all, tr_later("Cuts"), kCuts);
    add(all, tr_later("Hand"), kHand);
    add(all, tr_later("Session"), kSession);
    add(all, tr_later("Patient position"), kPatient);
    add(all, tr_later("Window"), kWindow);
    return all;
  }();
  return rows;
}

std::string shown_name(const CommandRow& row) {
  if (row.command == Command::diameter) return filled(tr("Burr of {mm} mm"), {{"mm", std::to_string(row.value)}});
  if (row.command == Command::burr_kind) {
    const std::string kind(kBurrKinds[static_cast<std::size_t>(row.value)].name);
    return capital(filled(tr("{kind} burr"), {{"kind", tr(kind)}}));
  }
  return tr(row.name);
}

std::string shown_keys(const CommandRow& row) {
  return row.gesture.empty() ? row.keys : tr(row.gesture) + row.keys.substr(row.gesture.size());
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
    const auto far = distance(row, asked);
    if (!far) continue;
    // One that is called so, and no more, comes before those whose names go on.
    const bool called = words_of_text(row.name) == asked || words_of_text(shown_name(row)) == asked;
    fitting.emplace_back(called ? -1 : *far, &row);
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
