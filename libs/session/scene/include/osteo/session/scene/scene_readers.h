// The readers that a scene may list.
#pragma once
#include <memory>

#include "osteo/session/scene/detail/dust_reader.h"
#include "osteo/session/scene/detail/pieces_reader.h"
#include "osteo/session/scene/detail/surface_reader.h"
#include "osteo/session/scene/detail/tool_counts.h"
#include "osteo/session/scene/heat_reader.h"

namespace osteo::inline session {

struct ReaderList {
  bool surface = true;
  bool pieces = false;
  bool dust = false;
  bool heat = false;
  /// As World::simulates says, and as actions begin and end it (ActionKind::simulate); `dust` and `heat` mean nothing
  /// then.
  bool dust_by_action = false, heat_by_action = false;
};

/// What is not listed, or not simulated now, is null, and costs nothing.
struct SceneReaders {
  std::unique_ptr<SurfaceReader> surface;
  std::unique_ptr<PiecesReader> pieces;
  std::unique_ptr<DustReader> dust;
  std::unique_ptr<HeatReader> heat;
  ToolCounts tools;

  /// For this scene as it is. `structures` (null: none), of which heat tells, must outlive this.
  SceneReaders(const World& world, const ReaderList& list, double rate_hz, const Context& context,
               const StructureMap* structures = nullptr);
  ~SceneReaders();
  SceneReaders(const SceneReaders&) = delete;
  SceneReaders& operator=(const SceneReaders&) = delete;
  /// Dust and heat, for whoever tells the readers one by one: whether they are there now or not.
  [[nodiscard]] Reader& simulation();
  /// All of them, which are of the hub's scene as it is; counts to a hub of their own where there is one.
  void add_to(ReaderDispatcher& dispatcher, ReaderDispatcher* counts = nullptr);
  /// Empty where the surface is not listed.
  [[nodiscard]] std::string surface_hash() const { return surface ? surface->hash() : std::string(); }
  /// Empty where pieces are not listed.
  [[nodiscard]] std::vector<LiveComponents::Component> large_pieces() const;

 private:
  class Simulation;
  std::unique_ptr<Reader> simulation_;
};

}  // namespace osteo::inline session
