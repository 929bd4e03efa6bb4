#include "osteo/app/window/rehearsal_window.h"

#include <algorithm>
#include <utility>

#include "osteo/app/window/start_page.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/display/view/actors.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "rehearsal_parts.h"
#include "ui_kit.h"
#include "work_done.h"

namespace osteo::inline app {

RehearsalWindow::RehearsalWindow(WindowShell& shell, PersonSettings& person, const WindowOptions& options,
                                 const SparseGrid* hu, const WindowActions& actions, SoundOut& sound)
    : shell_(shell),
      main_view_(shell, person),
      control_(working(actions), options.tool, [this](Rehearsal& rehearsal) { show_bone(rehearsal); }),
      actions_(actions),
      sound_(sound),
      scan_(options.scan),
      approval_(options.approval),
      approval_ended_(options.approval_ended),
      planned_(options.regions),
      thinned_(options.thinned),
      uncertainty_(options.uncertainty),
      procedures_(options.procedures),
      state_file_(options.state_file),
      controller_(person, keyboard_),
      hints_(person),
      person_(person),
      device_name_(options.device),
      case_hash_(options.case_hash),
      end_page_(options.end_page),
      window_(shell.window()) {
  if (!state_file_.empty()) keep_places();
  cuts_.set_case(options.ct, hu, options.bone);
  control_.tools().plan(options.planned_cuts, options.planned_cuts_file);
  stereo_.params = options.stereo;
  open();
  painter_ = std::make_unique<ScenePainter>(render_window_, renderer_);
  painter_->quality().want(options.quality);
  make_scene();
  way_view_ = std::make_unique<PathView>(renderer_, options.way);
  scope_.overview(StandardView::left, scope_scene(), false);
  control_.look_from(view_axes());
  control_.begin(options.from_case, false);
  scope_.overview(StandardView::left, scope_scene(), false);
  if (options.view) scope_.control.jump(*options.view);
  if (options.review_only) end_session();
  if (options.camera_trial) trial_.begin(scope_.view(), middle_of_bone());
}

RehearsalWindow::~RehearsalWindow() {
  shell_.on_key = nullptr;
  shell_.on_letter = nullptr;
  shell_.on_pointer = nullptr;
  shell_.on_button = nullptr;
  shell_.on_wheel = nullptr;
  review_.end();
  if (actions_.rehearsal() != nullptr) hints_.leave();
  // The session is the caller's to save, and goes on until then.
  if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && work_)
    rehearsal->remove_counter(*work_);
  cuts_.release();
  structures_.reset();
  regions_.reset();
  stereo_.release();
  for (auto& hand : hands_) hand.reset();
  way_view_.reset();
  tools_.reset();
  before_view_.reset();
  world_view_.reset();
  render_window_->Finalize();
}

WindowEnd RehearsalWindow::run() {
  if (control_.failure()) throw Error(*control_.failure());  // nothing was begun
  while (!shell_.closing() && !quit_ && !actions_.stop()) frame();
  if (control_.failure()) throw Error(*control_.failure());
  if (control_.lost()) throw Error(*control_.lost());
  return end_;
}

// --- set-up -----------------------------------------------------------------------------------------------------
// A session is begun and saved in a thread of its own: meanwhile the window says so, and answers.
WindowActions RehearsalWindow::working(WindowActions actions) {
  actions.begin = [this, begin = actions.begin](bool from_case, const HandView& view) {
    HandGoal goal;
    shell_.while_working(from_case ? tr("the bone is made ready") : tr("the session is made ready"), {},
                         [&](const Context&) { goal = begin(from_case, view); });
    forget_mouse();
    return goal;
  };
  actions.save = [this, save = actions.save, rehearsal = actions.rehearsal] {
    if (rehearsal() != nullptr) shell_.while_working(tr("the session is saved"), {}, [&](const Context&) { save(); });
    forget_mouse();
  };
  if (actions.tune) actions.tune = [this, tune = actions.tune](const HandTuning& t) { tune(controller_.tuned(t)); };
  return actions;
}

void RehearsalWindow::open() {
  render_window_ = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
  render_window_->SetOwnContext(0);
  render_window_->SetIsCurrent(true);
  render_window_->SetReadyForRendering(true);
  render_window_->SetMultiSamples(0);
  render_window_->OpenGLInitContext();
  render_window_->AddRenderer(renderer_);
  shell_.on_key = [this](int key, int action, int modifiers) {
    if (controller_.key(key, action)) return;
    if (action != 0) main_view_.key(key, modifiers, action == 2);
    keyboard_.on(key, static_cast<Keyboard::Event>(action), modifiers);
  };
  shell_.on_letter = [this](char32_t letter) { main_view_.letter(letter); };
  double x = 0, y = 0;  // where it is before it moves
  glfwGetCursorPos(shell_.window(), &x, &y);
  trail_.move(x, y, 0);
  shell_.on_pointer = [this](double x, double y, int modifiers) { trail_.move(x, y, modifiers); };
  shell_.on_button = [this](int which, bool down, int modifiers) { trail_.button(which, down, modifiers); };
  shell_.on_wheel = [this](double steps, int modifiers) { trail_.wheel(steps, modifiers); };
  cuts_.create();
}

void RehearsalWindow::make_scene() {
  set_up_scene(renderer_);
  for (auto& hand : hands_) hand = std::make_unique<InstrumentView>(renderer_);
}

// A rehearsal has begun, perhaps with another bone.
void RehearsalWindow::show_bone(Rehearsal& rehearsal) {
  world_view_ = std::make_unique<WorldView>(renderer_, rehearsal.structures());
  rehearsal.look([&](const World& world, SceneReaders& readers) { world_view_->update(world, readers); });
  tools_ = std::make_unique<SceneTools>(renderer_);
  if (!structures_ && rehearsal.structures() != nullptr) {  // the same in all sessions
    structures_ = std::make_unique<StructuresView>(renderer_, *rehearsal.structures());
    rehearsal.look([&](const World& world, SceneReaders&) {
      structures_->fade_at_border(world.bodies().front().body->bone.frame());
    });
    if (uncertainty_ && !uncertainty_->structures.empty())
      structures_->hatch(*uncertainty_, uncertainty_->structures.back().value);
  }
  plan_and_looks(rehearsal);
  cuts_.begin(rehearsal, structures_.get(), regions_.get());
  before_view_.reset();
  main_view_.renew();
  work_ = std::make_unique<WorkDone>();  // the session that the last one followed is over
  rehearsal.add_counter(*work_);
  hints_.follow(rehearsal);
  switches_ = switches_now();
  simulation_.begin({rehearsal.simulates(Simulated::dust), rehearsal.simulates(Simulated::heat)});
  ended_.reset();
}

// --- one frame --------------------------------------------------------------------------------------------------
// With the first session: what the procedure plans, and how things looked in the session that is gone on from.
void RehearsalWindow::plan_and_looks(const Rehearsal& rehearsal) {
  if (std::exchange(has_plan_, true)) return;
  if (!planned_.empty()) {
    if (rehearsal.structures() == nullptr) {
      control_.say([&] { return tr("the case knows no structures: the procedure's regions are not shown"); });
    } else {
      regions_ = std::make_unique<RegionsView>(renderer_, *rehearsal.structures(), planned_);
      for (const std::string& name : regions_->missing())
        control_.say([&] { return filled(tr("the case lacks the structure of region '{name}'"), {{"name", name}}); });
    }
  }
  show_spaces(rehearsal);
  if (!actions_.notes_before) return;
  const Looks looks = looks_of(actions_.notes_before());
  if (looks.unreadable > 0)
    control_.say([&] {
      return filled(tr("{n} notes of the session before could not be read"), {{"n", std::to_string(looks.unreadable)}});
    });
  if (structures_) {
    for (std::size_t s = 0; s < structures_->all().size(); ++s) {
      if (const auto look = looks.structures.find(structures_->all()[s].value); look != looks.structures.end())
        structures_->show(s, look->second);
    }
  }
  if (looks.cuts) {
    cuts_.take(*looks.cuts);
    if (regions_) regions_->show(looks.cuts->regions);
  }
}

// What the operation opens would fill the cavity, drawn as a solid body; what it thins hides what lies behind.
void RehearsalWindow::show_spaces(const Rehearsal& rehearsal) {
  if (!structures_) return;
  const StructureMap& map = *rehearsal.structures();
  std::string hidden;
  for (std::size_t s = 0; s < structures_->all().size(); ++s) {
    const std::string name = map.name_of(structures_->all()[s].value);
    if (map.opened(s)) {
      structures_->show(s, StructureLook::hidden);
      hidden += (hidden.empty() ? "" : ", ") + tr(name);
    } else if (std::find(thinned_.begin(), thinned_.end(), name) != thinned_.end()) {
      structures_->show(s, StructureLook::clear);
    }
  }
  if (!hidden.empty())
    control_.say([hidden] { return filled(tr("hidden, to be opened: {names}"), {{"names", hidden}}); });
}

void RehearsalWindow::frame() {
  const bool seen = shell_.poll();
  width_ = shell_.width();
  height_ = shell_.height();
  take_dropped();
  control_.watch();
  look_at_tutor();
  if (tutor_.begin_again && !control_.failure() && !ended_) control_.begin(true, true);
  control_.look_from(view_axes());
  if (!seen) {  // put away
    write_state();
    return;
  }
  lay_out();
  shell_.new_frame();
  ImGuiIO& io = ImGui::GetIO();  // what a key is held for begins with its press
  io.DeltaTime = std::max(0.001F, io.DeltaTime - static_cast<float>(painter_->take_slept_s()));
  if (control_.failure()) {
    report_failure();
    forget_mouse();
  } else if (ended_) {
    show_end();
  } else {
    mouse_and_keys();
    if (!control_.failure() && !ended_) show();
  }
  end_picture();
  ++pictures_;
  write_state();
}

// A case or a session: this one is saved, and that is opened. Anything else ends nothing.
void RehearsalWindow::take_dropped() {
  const std::vector<std::filesystem::path> dropped = shell_.take_dropped();
  if (dropped.empty()) return;
  std::string why;
  if (const auto choice = choice_of(dropped, why)) {
    end_ = {true, choice->resume.empty() ? choice->case_folder : choice->resume};
    quit_ = true;
  } else {
    control_.notify(why);
  }
}

void RehearsalWindow::lay_out() {
  ViewLayout layout = main_view_.lay_out(ended_.has_value(), cuts_.wished_width());
  review_.lay_out(layout, static_cast<float>(shell_.em_pixels()));
  monitor_.lay_out(layout, static_cast<float>(shell_.em_pixels()), !ended_ && monitor_controller() != nullptr);
  // Settings are in front where both have no room.
  tutor_panel_.lay_out(layout, tutor_, main_view_.in_settings() ? SettingsDialog::box_in(layout).right() : 0);
  cuts_.lay_out(layout);
  main_view_.take_layout(layout);
  const ScreenBox& scene = cuts_.scene();
  scope_.area = {static_cast<double>(scene.x), static_cast<double>(scene.y),
                 std::max(1.0, static_cast<double>(scene.width)), std::max(1.0, static_cast<double>(scene.height))};
}

// The bone as it was: made when it is first asked for, kept while the session runs. Between two frames.
void RehearsalWindow::show_before(bool on) {
  main_view_.set_before(on);
  if (!on || before_view_) return;
  if (!actions_.world_at_begin) {
    main_view_.set_before(false);
    control_.say([&] { return tr("how the bone was is not known"); });
    return;
  }
  try {
    TriMesh mesh;
    shell_.while_working(tr("rebuilding the bone at the start"), {},
                         [&](const Context& context) { mesh = surface_of(actions_.world_at_begin(context), context); });
    forget_mouse();
    before_view_ = std::make_unique<BeforeView>(render_window_, mesh);
  } catch (const Error& e) {
    main_view_.set_before(false);
    control_.say(LocalText::untranslated(e.what()));
  }
}

// The session is saved; what was done is shown beside the bone as it was left.
void RehearsalWindow::end_session() {
  if (!end_page_ || !actions_.facts) {
    quit_ = true;
    return;
  }
  main_view_.set_before(false);
  if (!control_.end()) return;
  ended_ = end_facts(actions_.facts(), *work_);
  main_view_.session_ended();
  if (actions_.review) review_.begin(actions_.review);
}

void RehearsalWindow::show_end() {
  camera_by_mouse();
  EndChoice choice =
      main_view_.draw_end(*ended_, {[this] { review_.draw_findings(); }, [this] { review_.draw_all_findings(); },
                                    [this] { review_.draw_switch(); }, review_.found_serious()});
  for (const Keyboard::Press& press : keyboard_.frame(ImGui::GetIO().WantTextInput)) {
    if (review_.key(press)) continue;
    if (choice == EndChoice::none) choice = MainView::end_choice(press.command);
    if (press.command == Command::screenshot) screenshot_wanted_ = true;
    if (press.command == Command::full_screen) shell_.toggle_full_screen();
  }
  if (ended_->past && (choice == EndChoice::again || choice == EndChoice::resume)) choice = EndChoice::none;
  if (choice == EndChoice::another) end_.another = true;
  if (choice == EndChoice::close || choice == EndChoice::another) quit_ = true;
  if (choice == EndChoice::again || choice == EndChoice::resume) return begin_again(choice == EndChoice::again);
  review_.show(renderer_, world_view_, hands_, scope_, static_cast<double>(ImGui::GetIO().DeltaTime));
}

// ImGui's frame is put aside meanwhile: what shows that it works needs one of its own.
void RehearsalWindow::begin_again(bool from_case) {
  review_.end();
  ImGui::EndFrame();
  const bool begun = control_.begin(from_case, false);
  ended_.reset();  // failure() speaks for itself
  if (begun)
    control_.say([&] { return from_case ? tr("bone reset") : tr("a new session continues from what was recorded"); });
  shell_.new_frame();
}

// What failed, what is kept, and what can be done now. Nothing runs.
void RehearsalWindow::report_failure() {
  const auto folder = actions_.folder();
  const std::string texts[] = {control_.failure()->what(), control_.failure()->advice(),
                               folder.empty() ? std::string() : kept_text(folder)};
  const std::string answers[] = {tr("Go on from there (F5)"), tr("Begin again from the case (R)"), tr("Close (Q)")};
  const int pressed = kit_dialog({0, 0, static_cast<float>(width_), static_cast<float>(height_)}, tr("No session runs"),
                                 texts, answers);
  bool go_on = pressed == 0, anew = pressed == 1;
  if (pressed == 2) quit_ = true;
  for (const Keyboard::Press& press : keyboard_.frame(ImGui::GetIO().WantTextInput)) {
    go_on = go_on || press.command == Command::save;
    anew = anew || press.command == Command::reset;
    quit_ = quit_ || press.command == Command::quit;
    screenshot_wanted_ = screenshot_wanted_ || press.command == Command::screenshot;
  }
  if (go_on || anew) begin_again(anew);
}

WindowEnd run_rehearsal_window(WindowShell& shell, PersonSettings& person, const WindowOptions& options,
                               const SparseGrid* hu, const WindowActions& actions, SoundOut& sound) {
  return RehearsalWindow(shell, person, options, hu, actions, sound).run();
}

}  // namespace osteo::inline app
