#include "monitor_panel.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "monitor_screen.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// In heights of text.
constexpr float kMinLaneEm = 2.3F, kMinEm = 15, kMaxEm = 21, kSwitchesEm = 30, kWideEm = 54;

// In the same row, where it has room for something so wide.
void beside(float wide) {
  const float gap = kGap * unit(), right = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
  if (ImGui::GetItemRectMax().x + gap + wide <= right) ImGui::SameLine(0, gap);
}
float switch_width(const std::string& words) {
  return ImGui::CalcTextSize(words.c_str()).x + (48 + kGap) * unit();
}

// A lane of a channel: its name and gain at the left, where clicks change the gain.
ScreenBox lane_head(MonitorScreen& screen, std::size_t channel, const std::string& name, const ScreenBox& lane) {
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const float e = em(), wide = std::min(8.2F * e, 0.6F * lane.width), side = std::min(lane.height / 2, 1.5F * e);
  fitted_text(draw, {lane.x, lane.y, wide - 0.4F * e, std::min(lane.height / 2, 1.1F * e)}, e * kLabelEm, theme().text,
              name);
  const float y = lane.y + lane.height / 2;
  ImGui::PushID(static_cast<int>(channel));
  ImGui::SetCursorScreenPos({lane.x, y});
  if (tile("-", "minus", {false, false, true, tr("smaller in the picture")}, side)) screen.change_gain(channel, 1);
  ImGui::SetCursorScreenPos({lane.x + side, y});
  if (tile("+", "plus", {false, false, true, tr("larger in the picture")}, side)) screen.change_gain(channel, -1);
  ImGui::PopID();
  const float at = lane.x + 2 * side + e * 0.3F;
  fitted_text(draw, {at, y, lane.x + wide - at, std::min(lane.height / 2, 1.1F * e)}, e * kLabelEm, theme().quiet,
              std::to_string(screen.gain_uv(channel)) + " uV");
  return {lane.x + wide, lane.y, lane.width - wide, lane.height};
}

// A channel's part of the panel.
struct ChannelLane {
  std::size_t channel;
  bool last;  // the lowest
  ScreenBox box;
  float gain_uv;
  // Down from the top of the screen; what is beyond the gain at its edge.
  [[nodiscard]] float y_of(float uv) const {
    const float middle = box.y + box.height / 2, half = box.height / 2;
    return middle - std::clamp(uv / gain_uv, -1.0F, 1.0F) * half;
  }
};

// One below the other, each with its head and an empty screen, that draw(view, lane, list) fills.
template <typename Draw>
void draw_lanes(MonitorScreen& screen, float height, const Draw& draw) {
  const MonitorScreen::View view = screen.view();
  if (view.labels.empty()) return;
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float wide = ImGui::GetContentRegionAvail().x, lane_high = height / static_cast<float>(view.labels.size());
  for (std::size_t ch = 0; ch < view.labels.size(); ++ch) {
    const ScreenBox all{corner.x, corner.y + static_cast<float>(ch) * lane_high, wide, lane_high - 2};
    const ScreenBox box = lane_head(screen, ch, view.labels[ch], all);
    list->AddRectFilled({box.x, box.y}, {box.right(), box.bottom()}, im_colour32({0.02F, 0.03F, 0.03F}, 0.9F));
    draw(view, ChannelLane{ch, ch + 1 == view.labels.size(), box, static_cast<float>(screen.gain_uv(ch))}, list);
  }
  ImGui::SetCursorScreenPos({corner.x, corner.y + height});
  ImGui::Dummy({1, 1});
}

}  // namespace

void MonitorPanel::draw_sweep(MonitorController& controller, float height) {
  draw_lanes(
      controller.screen(), height, [](const MonitorScreen::View& view, const ChannelLane& lane, ImDrawList* draw) {
        const ScreenBox& box = lane.box;
        for (const float sign : {-1.0F, 1.0F}) {
          const auto uv = sign * static_cast<float>(view.event_uv);
          if (std::abs(uv) < lane.gain_uv)
            draw->AddLine({box.x, lane.y_of(uv)}, {box.right(), lane.y_of(uv)}, im_colour32(palette::kOrange, 0.5F));
        }
        // As wide as the screen has pixels: a column is all that falls into it, and reaches to the one before.
        const auto columns =
            static_cast<std::size_t>(std::max(1.0F, std::min(box.width, static_cast<float>(MonitorScreen::kBins))));
        float last_least = 0, last_most = 0;
        for (std::size_t c = 0; c < columns; ++c) {
          const std::size_t from = c * MonitorScreen::kBins / columns,
                            to = std::max(from + 1, (c + 1) * MonitorScreen::kBins / columns);
          float least = view.sweep[lane.channel][from].least_uv, most = view.sweep[lane.channel][from].most_uv;
          bool gap = false;
          for (std::size_t b = from; b < to; ++b) {
            least = std::min(least, view.sweep[lane.channel][b].least_uv);
            most = std::max(most, view.sweep[lane.channel][b].most_uv);
            // Behind the place that is written now lies the oldest: a gap between them.
            gap = gap || (b + MonitorScreen::kBins - view.at) % MonitorScreen::kBins < 8;
          }
          const bool over = most >= static_cast<float>(view.event_uv) || least <= -static_cast<float>(view.event_uv);
          const float x = box.x + (static_cast<float>(c) + 0.5F) * box.width / static_cast<float>(columns);
          const float joined_least = c > 0 ? std::min(least, last_most) : least,
                      joined_most = c > 0 ? std::max(most, last_least) : most;
          if (!gap)
            draw->AddLine({x, lane.y_of(joined_most)},
                          {x, std::max(lane.y_of(joined_least), lane.y_of(joined_most) + 1)},
                          im_colour32(over ? palette::kYellow : palette::kGreen),
                          std::max(1.0F, box.width / static_cast<float>(columns)));
          last_least = least;
          last_most = most;
        }
      });
}

void MonitorPanel::draw_answers(MonitorController& controller, float height) {
  draw_lanes(
      controller.screen(), height, [](const MonitorScreen::View& view, const ChannelLane& lane, ImDrawList* draw) {
        const ScreenBox& box = lane.box;
        for (int ms = 5; ms < 20; ms += 5) {
          const float x = box.x + box.width * static_cast<float>(ms) / 20;
          draw->AddLine({x, box.y}, {x, box.bottom()}, im_colour32(theme().raised));
          if (lane.last)
            fitted_text(draw, {x + 2, box.bottom() - em(), 4 * em(), em()}, em() * kLabelEm, theme().quiet,
                        std::to_string(ms) + " ms");
        }
        const auto& traces = view.traces[lane.channel];
        for (std::size_t t = 0; t < traces.size(); ++t) {
          std::vector<ImVec2> line;
          for (std::size_t i = 0; i < traces[t].uv.size(); ++i)
            line.push_back(
                {box.x + box.width * static_cast<float>(i) / MonitorScreen::kTraceSamples, lane.y_of(traces[t].uv[i])});
          const bool newest = t + 1 == traces.size();
          draw->AddPolyline(line.data(), static_cast<int>(line.size()),
                            im_colour32(traces[t].answered ? palette::kYellow : palette::kSkyBlue, newest ? 1 : 0.35F),
                            ImDrawFlags_None, newest ? 1.6F : 1);
        }
      });
}

void MonitorPanel::draw_stimulator(MonitorController& controller) {
  const StimulatorSetting now = controller.stimulator();
  bool on = now.current_ma > 0;
  // By its logarithm: small currents have as much of the track as large ones.
  const double least = std::log(StimulatorSetting::kMinMa), most = std::log(StimulatorSetting::kMaxMa);
  double current = std::log(wanted_.current_ma);
  const bool moved = kit_slider(tr("Stimulator"), shown_number(wanted_.current_ma, 2) + " mA", current, least, most,
                                (most - least) / 100);
  if (moved) wanted_.current_ma = std::clamp(std::exp(current), StimulatorSetting::kMinMa, StimulatorSetting::kMaxMa);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip(tr("current of the stimulator: the tip of the tool is its electrode"));
  const std::string turn = on ? tr("stimulator on") : tr("stimulator off");
  const bool turned =
      kit_switch(turn + "##stimulator", on, std::min(switch_width(turn), ImGui::GetContentRegionAvail().x));
  const std::string look = now.search ? tr("looking ...") : tr("find threshold");
  beside(button_width(look));
  const bool search = kit_button(look + "##search");
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(tr("twice, half and between, three pulses each, while the tip touches"));
  if (controller.hands() > 1) {
    beside(switch_width(tr("second hand")));
    bool second = wanted_.hand == 1;
    if (kit_switch(tr("second hand"), second, switch_width(tr("second hand")))) wanted_.hand = second ? 1 : 0;
  }
  if (const auto found = controller.screen().threshold_ma())
    kit_text(filled(tr("threshold {ma} mA"), {{"ma", shown_number(*found, 2)}}), theme().text);
  if (search) {
    find_threshold(controller);
  } else if (turned) {
    switch_stimulator(controller);
  } else if (moved && now.current_ma > 0 && !now.search) {
    controller.stimulate(wanted_);
  }
}

void MonitorPanel::switch_stimulator(MonitorController& controller) const {
  if (!controller.stimulates()) return;
  StimulatorSetting next = wanted_;
  if (controller.stimulator().current_ma > 0) next.current_ma = 0;
  controller.stimulate(next);
}

void MonitorPanel::find_threshold(MonitorController& controller) const {
  if (!controller.stimulates()) return;
  StimulatorSetting next = wanted_;
  next.search = true;
  next.pulses_per_s = 10;
  controller.stimulate(next);
}

void MonitorPanel::draw_switches(MonitorController& controller) {
  const float e = em();
  MonitorScreen& screen = controller.screen();
  bool frozen = screen.frozen(), muted = controller.sound().muted();
  // First what has to be seen: it stays in its place.
  const bool alarm = screen.alarm();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  draw_sign(ImGui::GetWindowDrawList(), {at.x + e * 0.6F, at.y + e * 0.5F}, e * 0.45F, alarm ? 8 : 0,
            alarm ? ink_of(palette::kVermillion) : theme().quiet);
  ImGui::Dummy({e * 1.2F, 1});
  ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(alarm ? ink_of(palette::kVermillion) : theme().quiet));
  ImGui::TextUnformatted(alarm ? tr("activity") : tr("quiet"));
  ImGui::PopStyleColor();
  const float title = 8 * e;
  if (title + ImGui::CalcTextSize(tr("nerve monitor, for practice")).x <= ImGui::GetWindowContentRegionMax().x)
    ImGui::SameLine(title);
  kit_text(tr("nerve monitor, for practice"), theme().quiet);
  const std::string views[] = {tr("free run"), tr("by stimulus")};
  if (const int view = choice("view", views, answers_ ? 1 : 0); view >= 0) answers_ = view == 1;
  const auto in_row = [&](const std::string& words, bool& is) {
    beside(switch_width(words));
    return kit_switch(words, is, std::min(switch_width(words), ImGui::GetContentRegionAvail().x));
  };
  if (in_row(tr("freeze"), frozen)) screen.freeze(frozen);
  if (in_row(own_window_ ? tr("mute (M)") : tr("mute (Ctrl-M)"), muted)) controller.sound().mute(muted);
  if (!own_window_) {
    beside(button_width(tr("hide (Ctrl-N)")));
    if (kit_button(tr("hide (Ctrl-N)"))) shown_ = false;
  }
  if (controller.stimulates()) draw_stimulator(controller);
  if (!controller.invitation().empty()) kit_text(controller.invitation(), theme().text);
}

void MonitorPanel::lay_out(ViewLayout& layout, float em_pixels, bool there) {
  box_ = {};
  if (there && shown_)
    box_ = take_strip(layout, std::clamp(layout.view.height * 0.28F, kMinEm * em_pixels, kMaxEm * em_pixels));
}

void MonitorPanel::draw(MonitorController& controller) {
  if (box_.empty()) return;
  const float e = em();
  begin_fixed("monitor", box_, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  if (controller.wiring().channels.empty()) {
    ImGui::TextWrapped(
        "%s",
        tr("The case lists none of the nerves that the monitor knows: prepare it with --structures and --names."));
    ImGui::End();
    return;
  }
  const auto log = [&](float high) {
    // Below switches that scroll it has a height of its own.
    const float least = 5 * e;
    ImGui::BeginChild("log", {0, high > 0 ? high : std::max(least, ImGui::GetContentRegionAvail().y)});
    const std::vector<MonitorScreen::Line> lines = controller.screen().log();
    for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
      if (line->alarm) ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kVermillion)));
      ImGui::TextWrapped("%s s  %s", shown_number(line->at_s, 2).c_str(), line->words.c_str());
      if (line->alarm) ImGui::PopStyleColor();
    }
    ImGui::EndChild();
  };
  const auto lanes = [&](float high) {
    if (answers_) {
      draw_answers(controller, high);
    } else {
      draw_sweep(controller, high);
    }
  };
  // Where it is wide enough the curves have all its height; in a low strip as well, and the switches scroll.
  const float needs = kMinLaneEm * e * static_cast<float>(controller.wiring().channels.size()) + 12 * e;
  const bool columns = box_.width >= kWideEm * e || ImGui::GetContentRegionAvail().y < needs;
  if (columns) {
    ImGui::BeginChild("switches", {std::min(kSwitchesEm * e, 0.5F * ImGui::GetContentRegionAvail().x), 0});
    draw_switches(controller);
    log(0);
    ImGui::EndChild();
    ImGui::SameLine();
    ImGui::BeginChild("curves", {0, 0}, false, ImGuiWindowFlags_NoScrollbar);
    lanes(ImGui::GetContentRegionAvail().y);
    ImGui::EndChild();
  } else {
    draw_switches(controller);
    const float left = ImGui::GetContentRegionAvail().y,
                least = kMinLaneEm * e * static_cast<float>(controller.wiring().channels.size());
    const float log_high = std::min(left - least, 5 * e);
    const bool reported = log_high > 1.2F * e;
    lanes(reported ? left - log_high - ImGui::GetStyle().ItemSpacing.y : left);
    if (reported) log(0);
  }
  ImGui::End();
}

}  // namespace osteo::inline app
