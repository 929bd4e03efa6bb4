// What a person chose, kept between sessions: XDG_CONFIG_HOME/osteotome/settings.json (else ~/.config). Nothing of a
// patient but the paths of cases that were opened, and those only while `remember_cases` is true.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/app/window/hand_buttons.h"
#include "osteo/core/base/param.h"

namespace osteo {
class JsonFile;
struct JsonValue;
}  // namespace osteo

namespace osteo::inline app {

struct PersonValues {
  using Params = PersonValues;
  double scale = 1;  ///< of text and panels, times the monitor's
  std::string layout = "operate", theme = "dark", language = "auto";
  bool full_screen = false, sound = true, alarms = false, remember_cases = true, first_steps = true;
  bool hints = false;
  std::string hints_off;
  bool dust = false, heat = false, monitor = false, mirror_procedure = false;
  std::string procedure, position = "supine", network, lessons_at = "127.0.0.1";
  double volume = 0.7;
  double motion_one_to = 1, wrist_rest = 0.2, burr_share = 1;
  bool left_handed = false, mirror_mouse = false;
  static void describe(PersonValues& p, auto& visit) {
    visit({"scale", "size of text and panels, times the monitor's", "", 0.6, 2.5}, p.scale);
    visit({"layout", "layout of the window: operate or plan"}, p.layout);
    visit({"theme", "colours of the window: dark, light or high_contrast"}, p.theme);
    visit({"language", "language of the window: auto (that of the system), en, de, es, fr or zh_CN"}, p.language);
    visit({"full_screen", "the window fills the screen"}, p.full_screen);
    visit({"sound", "what drilling sounds like"}, p.sound);
    visit({"volume", "volume of the sound", "", 0, 1}, p.volume);
    visit({"alarms", "a beep on contact with a critical structure"}, p.alarms);
    visit({"remember_cases", "the start page lists the cases opened last"}, p.remember_cases);
    visit({"first_steps", "the first steps are shown, one at a time"}, p.first_steps);
    visit({"motion_one_to", "mm of the hand for a mm of the tool: 1, 2, 4 or 8", "", 1, 8}, p.motion_one_to);
    visit({"wrist_rest", "share of that motion while the wrist rests", "", 0.05, 1}, p.wrist_rest);
    visit({"burr_share", "share of the burr's full speed when the pedal is all the way down", "", 0.25, 1},
          p.burr_share);
    visit({"left_handed", "the drill is held from the left, the second hand comes from the right"}, p.left_handed);
    visit({"mirror_mouse", "the mouse's right and left button change places"}, p.mirror_mouse);
    visit({"hints", "words while one drills: not seen, press less, ..."}, p.hints);
    visit({"procedure", "procedure of the cases that the start page opens: a name or a file; empty: none"},
          p.procedure);
    visit({"network", "folder of the trained network that finds structures in new cases; empty: none"}, p.network);
    visit({"mirror_procedure", "it is for the other side of the body"}, p.mirror_procedure);
    visit({"dust", "bone dust and irrigation, from the start page"}, p.dust);
    visit({"heat", "how warm drilling makes bone, from the start page"}, p.heat);
    visit({"monitor", "the nerve monitor, from the start page"}, p.monitor);
    visit({"position", "how the patient lies: supine, prone, sitting, left_side or right_side"}, p.position);
    visit({"lessons_at",
           "address where lessons begun on the start page can be joined: 127.0.0.1 (from this machine "
           "alone), 0.0.0.0 (from all that reach it) or one of its own"},
          p.lessons_at);
    visit({"hints_off", "those that are never said, by name, with commas between them"}, p.hints_off);
  }
  friend bool operator==(const PersonValues&, const PersonValues&) = default;
};

class PersonSettings {
 public:
  static constexpr std::size_t kMaxCases = 12;
  /// Reads the file where there is one. Never throws: what is wrong with it is told in complaints(), and the rest is
  /// taken.
  explicit PersonSettings(std::filesystem::path file);
  /// Where this user's are; empty where neither XDG_CONFIG_HOME nor HOME is set.
  [[nodiscard]] static std::filesystem::path usual_file();

  PersonValues values;
  /// What buttons, pedals and keys have been given to do; in the file as "buttons": {"pedal 1": "drill", "key F13":
  /// "nothing"}, where "nothing" takes away what it usually does.
  HandButtons buttons = HandButtons::usual();
  /// Absolute paths, the last opened first; only those that are to be remembered.
  [[nodiscard]] const std::vector<std::filesystem::path>& cases() const { return cases_; }
  void opened(const std::filesystem::path& the_case);  ///< no-op unless values.remember_cases
  void forget_cases() { cases_.clear(); }
  /// For people, with file and line.
  [[nodiscard]] const std::vector<std::string>& complaints() const { return complaints_; }
  /// Writes when something has changed since it was read; keys that it does not know stay as they are. A file that
  /// could not be read whole is left alone. Empty, or why it was not written.
  std::string save();

 private:
  [[nodiscard]] std::string text() const;
  std::filesystem::path file_;
  std::string was_;  // the file's text
  void read_buttons(const JsonFile& json, const JsonValue& value);
  PersonValues read_;
  HandButtons read_buttons_ = HandButtons::usual();
  std::vector<std::filesystem::path> cases_, read_cases_;
  std::vector<std::string> complaints_;
  bool leave_alone_ = false;
};

}  // namespace osteo::inline app
