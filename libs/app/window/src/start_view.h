// What the page that a case is chosen on shows, and what is pressed there. Private to libs/app/window; ImGui, and GL
// where a case has a picture.
#pragma once
#include <imgui.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "case_card.h"
#include "case_maker.h"
#include "file_dialog.h"
#include "osteo/app/window/start_page.h"
#include "start_list.h"

namespace osteo::inline app {

/// Previews of cases as textures; one is read a picture.
class Previews {
 public:
  Previews() = default;
  ~Previews();
  Previews(const Previews&) = delete;
  Previews& operator=(const Previews&) = delete;
  void begin() { read_ = false; }
  /// 0: there is none, or not yet.
  [[nodiscard]] unsigned of(const std::filesystem::path& file);

 private:
  std::map<std::filesystem::path, unsigned> made_;
  bool read_ = false;
};

class StartPage {
 public:
  /// Both must outlive it.
  StartPage(PersonSettings& person, const StartOptions& options);

  [[nodiscard]] StartList& list() { return list_; }
  const bool dialogs = FileDialog::there();  ///< asked once: it looks through PATH
  /// What was pressed, or a key did: for who runs the page.
  bool follow = true, open = false, close = false, ask = false, teach = false;

  void poll();
  /// Between ImGui::NewFrame and Render.
  void draw(float wide, float high);
  void write_state(std::uint64_t pictures, int em_pixels) const;

 private:
  // Where the middle of the last item is, for who drives the page.
  void note(const std::string& name);
  [[nodiscard]] bool is_made(const std::filesystem::path& the_case) const { return maker_.making() == the_case; }
  const CaseCard& card(const std::filesystem::path& folder);
  void select(int n);
  void draw_entries();
  const std::string& figures_of(const std::filesystem::path& session);
  void draw_card_of(const StartEntry& e, int n, float wide);
  void draw_procedure();
  void draw_position();
  void toggle(const char* name, const char* words, bool& on);
  // Of a scan: a case of it, beside it, as 'osteo prepare' makes them by itself.
  void draw_prepare(const std::filesystem::path& scan, float room);
  // Of a trained network: whether it finds the structures of the cases that are prepared here.
  void draw_network(const std::filesystem::path& folder, float room);
  void draw_panel();
  void open_in(const char* layout, bool teaches = false);

  PersonSettings& person_;
  const StartOptions& options_;
  CaseMaker maker_;
  std::filesystem::path demo_ = CaseMaker::demo_case();
  StartList list_;
  Previews previews_;
  std::map<std::filesystem::path, CaseCard> cards_;
  std::map<std::filesystem::path, std::string> figures_;
  std::map<std::string, ImVec2> at_;
};

}  // namespace osteo::inline app
