#include "hint_controller.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"

namespace osteo::inline app {
namespace {

std::vector<std::string> names_in(const std::string& off) {
  std::vector<std::string> names;
  std::istringstream in(off);
  for (std::string name; std::getline(in, name, ',');) {
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

bool is_off(const std::string& off, const std::string& id) {
  const auto names = names_in(off);
  return std::find(names.begin(), names.end(), id) != names.end();
}

// What is noted is the rule's own; what is shown is in the language.
std::string shown_hint(const Hint& hint) {
  for (const HintRule& r : usual_hints()) {
    if (r.id == hint.id) return filled(tr(r.words), {{"structure", tr(hint.structure)}});
  }
  return hint.words;
}

}  // namespace

std::vector<HintRule> hints_left(const std::vector<HintRule>& rules, const std::string& off) {
  std::vector<HintRule> left;
  for (const HintRule& r : rules) {
    if (!is_off(off, r.id)) left.push_back(r);
  }
  return left;
}

std::string with_hint(const std::string& off, const std::string& id, bool on) {
  std::vector<std::string> names = names_in(off);
  std::erase(names, id);
  if (!on) names.push_back(id);
  std::string text;
  for (const std::string& n : names) text += (text.empty() ? "" : ",") + n;
  return text;
}

std::string hint_note(const Hint& hint) {
  Json j{{"id", hint.id}, {"words", hint.words}};
  if (!hint.structure.empty()) j["structure"] = hint.structure;
  return j.dump();
}

void HintController::follow(Rehearsal& rehearsal) {
  reader_.reset();  // of the one that is over
  rehearsal_ = &rehearsal;
  words_.clear();
  if (on()) join();
}

void HintController::join() {
  bool water = false;
  rehearsal_->look([&](const World&, SceneReaders& readers) { water = readers.dust != nullptr; });
  joined_off_ = person_.values.hints_off;
  reader_ = std::make_unique<HintReader>(hints_left(usual_hints(), person_.values.hints_off), rehearsal_->rate_hz(),
                                         rehearsal_->structures(), water);
  rehearsal_->add_reader(*reader_);
}

void HintController::leave() {
  if (reader_ && rehearsal_ != nullptr) rehearsal_->remove_reader(*reader_);
  reader_.reset();
  rehearsal_ = nullptr;
}

void HintController::turn(bool on) {
  person_.values.hints = on;
  words_.clear();
  if (rehearsal_ == nullptr) return;
  if (reader_) rehearsal_->remove_reader(*reader_);
  reader_.reset();
  if (on) join();
}

void HintController::frame(Vec3 eye_mm, double now_s) {
  if (rehearsal_ == nullptr) return;
  if (on() != (reader_ != nullptr) || (reader_ && joined_off_ != person_.values.hints_off)) turn(on());
  if (!reader_) return;
  reader_->look_from(eye_mm);
  if (const auto hint = reader_->take()) {
    words_ = shown_hint(*hint);
    until_s_ = now_s + kShownS;
    rehearsal_->note("hint", hint_note(*hint));
  }
  if (now_s > until_s_) words_.clear();
}

void HintController::draw(const ScreenBox& room) const {
  if (words_.empty()) return;
  const float u = unit(), most = room.width - 32 * u;
  if (most < 64 * u) return;
  const float wide = std::min(chip_width(words_), most);
  draw_chip(ImGui::GetBackgroundDrawList(),
            {room.x + std::floor((room.width - wide) / 2), room.y + 8 * u, wide, chip_height(words_, wide)}, words_,
            {palette::kYellow, 4, false});
}

}  // namespace osteo::inline app
