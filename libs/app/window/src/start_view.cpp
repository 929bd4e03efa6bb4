#include "start_view.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "gl_texture.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/bone/posture.h"
#include "settings_dialog.h"
#include "status_panel.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// Where it is there, or can be made.
std::filesystem::path offered_demo(const CaseMaker& maker) {
  const std::filesystem::path demo = CaseMaker::demo_case();
  std::error_code unknown;
  const bool there = !demo.empty() && std::filesystem::exists(demo / "manifest.json", unknown);
  return there || maker.can_make() ? demo : std::filesystem::path();
}

// The second of two buttons, where both have room.
void next_beside(const std::string& first, const std::string& second, float room) {
  const float half = (room - kGap * unit()) / 2;
  if (std::max(button_width(first), button_width(second)) <= half) ImGui::SameLine(0, kGap * unit());
}

}  // namespace

Previews::~Previews() {
  for (const auto& [file, texture] : made_) glDeleteTextures(1, &texture);
}

unsigned Previews::of(const std::filesystem::path& file) {
  if (file.empty()) return 0;
  if (const auto known = made_.find(file); known != made_.end()) return known->second;
  if (std::exchange(read_, true)) return 0;
  unsigned& texture = made_[file];
  try {
    const Picture picture = load_picture(file);
    texture = make_texture();
    put_pixels(texture, picture.width, picture.height, 3, picture.rgb.data());
  } catch (const Error&) {
    texture = 0;  // a card without a picture
  }
  return texture;
}

StartPage::StartPage(PersonSettings& person, const StartOptions& options)
    : person_(person),
      options_(options),
      maker_(options.osteo),
      list_(person.cases(), options.folder.empty() ? std::filesystem::current_path() : options.folder,
            offered_demo(maker_)) {
  list_.say(options.message);
}

void StartPage::poll() {
  if (list_.wants_demo()) list_.say(maker_.make_demo());
  if (const auto made = maker_.poll()) {
    if (!made->why.empty()) list_.say(filled(tr("no case could be made: {why}"), {{"why", made->why}}));
    cards_.erase(made->the_case);
    list_.refresh(made->the_case);
    follow = true;
  }
}

void StartPage::draw(float wide, float high) {
  previews_.begin();
  at_.clear();
  const float u = unit();
  // Beside each other where both have room, else one below the other.
  const bool beside = wide >= 860 * u;
  const float panel = beside ? std::min(400 * u, 0.32F * wide) : wide;
  begin_fixed("start", {0, 0, beside ? wide - panel : wide, high});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float room = ImGui::GetContentRegionAvail().x;
  draw_icon(draw, {at.x, at.y + 2 * u}, 28 * u, "bone", im_colour32(theme().text));
  fitted_text(draw, {at.x + 40 * u, at.y, room - 40 * u, 32 * u}, 1.5F * em(), theme().text, "Osteotome", false, true);
  ImGui::Dummy({0, 40 * u});
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
  ImGui::TextWrapped(
      "%s", tr("Choose a case with Up, Down and Enter, or drop one here. A folder with a CT is prepared here."));
  ImGui::PopStyleColor();
  if (!list_.message().empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
    ImGui::TextWrapped("! %s", list_.message().c_str());
    ImGui::PopStyleColor();
  }
  draw_entries();
  if (beside) {
    ImGui::End();
    begin_fixed("start panel", {wide - panel, 0, panel, high});
  } else {
    ImGui::Separator();
  }
  draw_panel();
  ImGui::End();
}

void StartPage::write_state(std::uint64_t pictures, int em_pixels) const {
  const std::filesystem::path& file = options_.state_file;
  if (file.empty()) return;
  Json entries = Json::list(), at = Json::object();
  for (const StartEntry& e : list_.entries()) entries.push_back(e.words);
  for (const auto& [name, place] : at_) at[name] = Json{static_cast<double>(place.x), static_cast<double>(place.y)};
  const PersonValues& v = person_.values;
  const Json j{{"page", "start"},
               {"pictures", pictures},
               {"entries", entries},
               {"selected", list_.selected()},
               {"message", list_.message()},
               {"tick", 0},
               {"em_pixels", em_pixels},
               {"folder", list_.folder().string()},
               {"procedure", v.procedure},
               {"dust", v.dust},
               {"making", maker_.making().string()},
               {"at", at},
               {"cut_texts", Json(texts_cut())},
               {"language", enum_names(Language{})[static_cast<std::size_t>(language())]}};
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

void StartPage::note(const std::string& name) {
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
  at_[name] = {(lo.x + hi.x) / 2, (lo.y + hi.y) / 2};
}

const CaseCard& StartPage::card(const std::filesystem::path& folder) {
  const auto known = cards_.find(folder);
  return known != cards_.end() ? known->second : cards_.emplace(folder, card_of(folder)).first->second;
}

void StartPage::select(int n) {
  list_.select(n);
  open = open || ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
}

void StartPage::draw_entries() {
  const float u = unit();
  const auto& entries = list_.entries();
  const float room = ImGui::GetContentRegionAvail().x, gap = 2 * kGap * u;
  const int columns = std::max(1, static_cast<int>((room + gap) / (260 * u + gap)));
  const float wide =
      std::floor(std::min(360 * u, (room - gap * static_cast<float>(columns - 1)) / static_cast<float>(columns)));
  int column = 0;
  bool first = true;
  StartEntry::Group group{};
  for (int n = 0; n < static_cast<int>(entries.size()); ++n) {
    const StartEntry& e = entries[static_cast<std::size_t>(n)];
    if (first || e.group != group) {
      const char* const groups[] = {tr("Cases"), tr("Sessions"), tr("Folders in {folder}")};
      kit_heading(filled(groups[static_cast<int>(e.group)], {{"folder", list_.folder().string()}}));
      group = e.group;
      first = false;
    }
    ImGui::PushID(n);
    if (e.group == StartEntry::Group::recent) {
      if (column > 0) ImGui::SameLine(0, gap);
      column = (column + 1) % columns;
      draw_card_of(e, n, wide);
    } else {
      const std::string figures = e.kind == FolderKind::session ? figures_of(e.folder) : std::string();
      if (list_row(e.words == ".." ? tr("the folder above (Backspace)") : e.words, figures, n == list_.selected()))
        select(n);
    }
    if (n == list_.selected() && follow) ImGui::SetScrollHereY();
    ImGui::PopID();
  }
  follow = false;
}

const std::string& StartPage::figures_of(const std::filesystem::path& session) {
  const auto known = figures_.find(session);
  return known != figures_.end() ? known->second : figures_.emplace(session, session_figures(session)).first->second;
}

void StartPage::draw_card_of(const StartEntry& e, int n, float wide) {
  const float u = unit(), picture = std::floor(0.553F * wide), high = picture + 92 * u, inset = 12 * u;
  if (ImGui::InvisibleButton("card", {wide, high})) select(n);
  note("card " + std::to_string(n));
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
  const bool hovered = ImGui::IsItemHovered(), selected = n == list_.selected();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  draw->AddRectFilled(lo, hi, im_colour32(hovered ? t.raised : t.surface), kCardRound * u);
  const bool is_demo = e.folder == demo_, to_make = e.kind == FolderKind::demo;
  CaseCard to_come;
  if (to_make) {
    to_come.facts = tr("a phantom, of no patient");
    to_come.words = is_made(e.folder)
                        ? filled(tr("being made: {share} %"), {{"share", shown_number(100 * maker_.share(), 0)}})
                        : std::string(tr("make it, in half a minute"));
  }
  const CaseCard& shown = to_make ? to_come : card(e.folder);
  const ImVec2 from{lo.x + u, lo.y + u}, to{hi.x - u, lo.y + picture};
  // The view in 3D is the last of four; its upper edge holds words.
  if (const unsigned texture = previews_.of(shown.preview); texture != 0) {
    draw->AddImageRounded(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture)), from, to,
                          {0.503F, 0.58F}, {1, 0.965F}, IM_COL32_WHITE, kCardRound * u, ImDrawFlags_RoundCornersTop);
  } else {
    draw->AddRectFilled(from, to, im_colour32(t.ground), kCardRound * u, ImDrawFlags_RoundCornersTop);
    draw_icon(draw, {(lo.x + hi.x) / 2 - 20 * u, lo.y + picture / 2 - 20 * u}, 40 * u,
              shown.state == CaseCard::State::broken ? "alert-triangle" : "bone", im_colour32(t.quiet));
    if (is_made(e.folder))
      draw->AddRectFilled({from.x, to.y - 4 * u}, {from.x + (to.x - from.x) * static_cast<float>(maker_.share()), to.y},
                          im_colour32(t.text));
  }
  const float text = wide - 2 * inset;
  float y = lo.y + picture + 6 * u;
  fitted_text(draw, {lo.x + inset, y, text, 26 * u}, em(), t.text, is_demo ? std::string(tr("Demo ear")) : shown.name);
  fitted_text(draw, {lo.x + inset, y + 26 * u, text, 24 * u}, kLabelEm * em(), t.quiet, shown.facts);
  y += 52 * u;
  const bool approved = shown.state == CaseCard::State::approved;
  const Colour colour = approved ? palette::kGreen : palette::kOrange;
  const bool sign = shown.state != CaseCard::State::plain;
  if (sign) draw_sign(draw, {lo.x + inset + 8 * u, y + 13 * u}, 8 * u, approved ? 0 : 4, colour);
  fitted_text(draw, {lo.x + inset + (sign ? 24 * u : 0), y, text - (sign ? 24 * u : 0), 26 * u}, kLabelEm * em(),
              t.text, shown.words);
  draw->AddRect(lo, hi, im_colour32(selected ? t.accent : t.line, selected ? 1 : 0.6F), kCardRound * u, 0,
                selected ? 3 * u : std::max(1.0F, u));
}

void StartPage::draw_procedure() {
  PersonValues& v = person_.values;
  choose_procedure(tr("Procedure"), v.procedure, options_.procedures);
  note("procedure");
  // Entries of the list, while it is open.
  for (const StartProcedure& p : options_.procedures) {
    if (const auto at = kept_places().find(tr(p.name)); at != kept_places().end())
      at_[p.id] = {at->second[0], at->second[1]};
  }
  if (!v.procedure.empty()) toggle("mirror", tr("For the other side, mirrored"), v.mirror_procedure);
}

void StartPage::draw_position() {
  PersonValues& v = person_.values;
  static constexpr const char* kNames[] = {tr_later("Supine"), tr_later("Prone"), tr_later("Sitting"),
                                           tr_later("On the left side"), tr_later("On the right side")};
  constexpr auto kIds = enum_names(Posture{});
  const auto* const at = std::find(kIds.begin(), kIds.end(), v.position);
  std::vector<std::string> names;
  for (const char* const name : kNames) names.emplace_back(tr(name));
  if (const int chosen =
          kit_list(tr("Patient position"), names, at == kIds.end() ? 0 : static_cast<int>(at - kIds.begin()));
      chosen >= 0)
    v.position = kIds[static_cast<std::size_t>(chosen)];
  note("position");
}

void StartPage::toggle(const char* name, const char* words, bool& on) {
  static_cast<void>(kit_switch(words, on));
  note(name);
}

void StartPage::draw_prepare(const std::filesystem::path& scan, float room) {
  if (!maker_.making().empty()) {
    ImGui::TextWrapped(
        "%s", filled(tr("{case} is being made: {share} %"),
                     {{"case", maker_.making().filename().string()}, {"share", shown_number(100 * maker_.share(), 0)}})
                  .c_str());
  } else if (maker_.can_make()) {
    std::string& network = person_.values.network;
    if (!network.empty()) {
      bool use = true;
      const std::string name = std::filesystem::path(network).filename().string();
      toggle("use network", filled(tr("Find structures by {network}"), {{"network", name}}).c_str(), use);
      if (!use) network.clear();
    }
    if (kit_button(tr("Prepare a case"), ButtonLook::main, room))
      list_.say(maker_.make(scan, CaseMaker::case_beside(scan), network));
  }
  note("prepare");
  if (kit_button(tr("Look into it"), ButtonLook::usual, room)) open = true;
}

void StartPage::draw_network(const std::filesystem::path& folder, float room) {
  std::string& chosen = person_.values.network;
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
  ImGui::TextWrapped("%s", tr("It proposes structures in a CT of which a case is prepared. Look at them before use."));
  ImGui::PopStyleColor();
  const bool is = chosen == folder.string();
  if (kit_button(is ? tr("Not for new cases") : tr("Use for new cases"), ButtonLook::main, room))
    chosen = is ? std::string() : folder.string();
  note("network");
  if (kit_button(tr("Look into it"), ButtonLook::usual, room)) open = true;
}

void StartPage::draw_panel() {
  const float u = unit();
  PersonValues& v = person_.values;
  const auto& entries = list_.entries();
  const StartEntry* const e = list_.selected() < static_cast<int>(entries.size())
                                  ? &entries[static_cast<std::size_t>(list_.selected())]
                                  : nullptr;
  const bool can_open = e != nullptr && (e->kind == FolderKind::the_case || e->kind == FolderKind::session);
  ImGui::Dummy({0, 4 * u});
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float room = ImGui::GetContentRegionAvail().x, half = std::floor((room - kGap * u) / 2);
  if (e != nullptr && e->kind == FolderKind::the_case) {
    const CaseCard& shown = card(e->folder);
    const bool is_demo = e->folder == demo_;
    fitted_text(ImGui::GetWindowDrawList(), {at.x, at.y, room, 30 * u}, 1.25F * em(), theme().text,
                is_demo ? std::string(tr("Demo ear")) : shown.name, false, true);
    ImGui::Dummy({0, 30 * u});
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
    if (!shown.structures.empty()) ImGui::TextWrapped("%s", shown.structures.c_str());
    ImGui::TextWrapped("%s", (shown.why.empty() ? shown.words : shown.why).c_str());
    ImGui::PopStyleColor();
    draw_scan(shown.scan);
  } else {
    fitted_text(ImGui::GetWindowDrawList(), {at.x, at.y, room, 30 * u}, 1.25F * em(), theme().text,
                e == nullptr ? std::string() : e->words, false, true);
    ImGui::Dummy({0, 30 * u});
  }
  ImGui::Dummy({0, kGap * u});
  draw_procedure();
  toggle("dust", tr("Bone dust and irrigation"), v.dust);
  toggle("sound", tr("Sound"), v.sound);
  toggle("heat", tr("Heat"), v.heat);
  toggle("monitor", tr("Nerve monitor"), v.monitor);
  toggle("hints", tr("Hints"), v.hints);
  draw_position();
  ImGui::Dummy({0, 2 * kGap * u});
  if (can_open) {
    // The layout of the last time is what Enter opens.
    const bool plan = v.layout == "plan";
    if (kit_button(tr("Operate"), plan ? ButtonLook::usual : ButtonLook::main, half)) open_in("operate");
    note("operate");
    next_beside(tr("Operate"), tr("Plan"), room);
    if (kit_button(tr("Plan"), plan ? ButtonLook::main : ButtonLook::usual, half)) open_in("plan");
    note("plan");
    if (kit_button(tr("Teach"), ButtonLook::usual, room)) open_in("operate", true);
    note("teach");
  } else if (e != nullptr && e->kind == FolderKind::demo) {
    if (maker_.making().empty() && kit_button(tr("Make the demo ear"), ButtonLook::main, room)) open = true;
    note("make demo");
  } else if (e != nullptr && e->kind == FolderKind::scan) {
    draw_prepare(e->folder, room);
  } else if (e != nullptr && e->kind == FolderKind::network) {
    draw_network(e->folder, room);
  } else if (e != nullptr && e->kind == FolderKind::folder) {
    if (kit_button(tr("Look into it"), ButtonLook::main, room)) open = true;
  }
  ImGui::Dummy({0, kGap * u});
  if (dialogs && kit_button(tr("Choose a folder (O)"), ButtonLook::usual, room)) ask = true;
  toggle("remember", tr("Remember cases"), v.remember_cases);
  if (!person_.cases().empty()) {
    if (kit_button(tr("Forget them"), ButtonLook::usual, half)) {
      person_.forget_cases();
      list_.forget_recent();
    }
    next_beside(tr("Forget them"), tr("Close (Q)"), room);
  }
  if (kit_button(tr("Close (Q)"), ButtonLook::usual, half)) close = true;
}

void StartPage::open_in(const char* layout, bool teaches) {
  person_.values.layout = layout;
  open = true;
  teach = teaches;
}

}  // namespace osteo::inline app
