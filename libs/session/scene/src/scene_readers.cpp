#include "osteo/session/scene/scene_readers.h"

#include <deque>
#include <map>
#include <utility>

namespace osteo::inline session {

// Dust and heat, which may come and go: what begins is made of the scene that its action is told with, and waits for
// that action's tick, so that it has seen the same ticks live and in a replay.
class SceneReaders::Simulation final : public Reader {
 public:
  Simulation(SceneReaders& readers, const ReaderList& list, double rate_hz, const StructureMap* structures)
      : readers_(readers), list_(list), rate_hz_(rate_hz), structures_(structures) {}

  void resync(const World& world) override {
    // Of actions that were lost nothing will be told; what waits for its own is begun early.
    for (const Simulated what : {Simulated::dust, Simulated::heat}) {
      if (by_action(what)) turn(what, world.simulates(what), world);
    }
    waiting_.clear();
    each([&](Reader& r) { r.resync(world); });
  }
  void scene_changed(const World& world, const World::Effect& effect) override {
    each([&](Reader& r) { r.scene_changed(world, effect); });
    for (const Waiting& w : waiting_) {
      if (w.dust) w.dust->scene_changed(world, effect);
      if (w.heat) w.heat->scene_changed(world, effect);
    }
  }
  void begins(const World& world, const SceneAction& action) override {
    const auto what = static_cast<Simulated>(action.item);
    if (!action.is(ActionKind::simulate) || !by_action(what)) return;
    Waiting w{what, action.values[0] > 0, nullptr, nullptr};
    if (w.on && !will_be_on(what)) make(what, world, w.dust, w.heat);
    waiting_.push_back(std::move(w));
  }
  void action(const SceneAction& action) override {
    if (row_of(action).moves_dust) standing_[action.kind] = action;
    each([&](Reader& r) { r.action(action); });
    if (!action.is(ActionKind::simulate) || waiting_.empty()) return;
    // One that was begun early is told all the same.
    Waiting& w = waiting_.front();
    if (w.what != static_cast<Simulated>(action.item) || w.on != (action.values[0] > 0)) return;
    if (!w.on) end(w.what);
    if (w.dust) begin(readers_.dust, std::move(w.dust));
    if (w.heat) begin(readers_.heat, std::move(w.heat));
    waiting_.pop_front();
  }
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override {
    each([&](Reader& r) { r.tick(record, changes); });
  }
  void update() override {
    each([](Reader& r) { r.update(); });
  }

 private:
  struct Waiting {
    Simulated what;
    bool on;
    std::unique_ptr<DustReader> dust;
    std::unique_ptr<HeatReader> heat;
  };
  [[nodiscard]] bool by_action(Simulated what) const {
    return what == Simulated::dust ? list_.dust_by_action : list_.heat_by_action;
  }
  [[nodiscard]] bool is_on(Simulated what) const {
    return what == Simulated::dust ? readers_.dust != nullptr : readers_.heat != nullptr;
  }
  [[nodiscard]] bool will_be_on(Simulated what) const {
    bool on = is_on(what);
    for (const Waiting& w : waiting_) on = w.what == what ? w.on : on;
    return on;
  }
  void make(Simulated what, const World& world, std::unique_ptr<DustReader>& dust, std::unique_ptr<HeatReader>& heat) {
    if (what == Simulated::dust) dust = std::make_unique<DustReader>(world, rate_hz_);
    if (what == Simulated::heat) heat = std::make_unique<HeatReader>(world, structures_, rate_hz_);
  }
  template <class R>
  void begin(std::unique_ptr<R>& reader, std::unique_ptr<R> made) {
    reader = std::move(made);
    for (const auto& [kind, action] : standing_) reader->action(action);
  }
  void end(Simulated what) {
    if (what == Simulated::dust) readers_.dust.reset();
    if (what == Simulated::heat) readers_.heat.reset();
  }
  void turn(Simulated what, bool on, const World& world) {
    if (on == is_on(what)) return;
    end(what);
    if (!on) return;
    std::unique_ptr<DustReader> dust;
    std::unique_ptr<HeatReader> heat;
    make(what, world, dust, heat);
    if (dust) begin(readers_.dust, std::move(dust));
    if (heat) begin(readers_.heat, std::move(heat));
  }
  template <class F>
  void each(F&& f) {
    if (readers_.dust) f(*readers_.dust);
    if (readers_.heat) f(*readers_.heat);
  }

  SceneReaders& readers_;
  const ReaderList list_;
  const double rate_hz_;
  const StructureMap* structures_;
  std::map<std::uint32_t, SceneAction> standing_;  // by kind: what goes on until the next of its kind
  std::deque<Waiting> waiting_;                    // whose action was not told yet
};

SceneReaders::SceneReaders(const World& world, const ReaderList& list, double rate_hz, const Context& context,
                           const StructureMap* structures) {
  if (list.surface) surface = std::make_unique<SurfaceReader>(world, context);
  if (list.pieces) pieces = std::make_unique<PiecesReader>(world);
  if (list.dust_by_action ? world.simulates(Simulated::dust) : list.dust)
    dust = std::make_unique<DustReader>(world, rate_hz);
  if (list.heat_by_action ? world.simulates(Simulated::heat) : list.heat)
    heat = std::make_unique<HeatReader>(world, structures, rate_hz);
  simulation_ = std::make_unique<Simulation>(*this, list, rate_hz, structures);
}

SceneReaders::~SceneReaders() = default;

Reader& SceneReaders::simulation() {
  return *simulation_;
}

void SceneReaders::add_to(ReaderDispatcher& dispatcher, ReaderDispatcher* counts) {
  for (Reader* const r : {static_cast<Reader*>(surface.get()), static_cast<Reader*>(pieces.get()), simulation_.get()}) {
    if (r != nullptr) dispatcher.add(*r, false);
  }
  (counts != nullptr ? *counts : dispatcher).add(tools, false);
}

std::vector<LiveComponents::Component> SceneReaders::large_pieces() const {
  return pieces ? pieces->large_pieces() : std::vector<LiveComponents::Component>();
}

}  // namespace osteo::inline session
