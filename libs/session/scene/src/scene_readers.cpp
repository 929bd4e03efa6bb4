#include "osteo/session/scene/scene_readers.h"

namespace osteo::inline session {

SceneReaders::SceneReaders(const World& world, const ReaderList& list, double rate_hz, const Context& context,
                           const StructureMap* structures) {
  if (list.surface) surface = std::make_unique<SurfaceReader>(world, context);
  if (list.pieces) pieces = std::make_unique<PiecesReader>(world);
  if (list.dust) dust = std::make_unique<DustReader>(world, rate_hz);
  if (list.heat) heat = std::make_unique<HeatReader>(world, structures, rate_hz);
}

void SceneReaders::add_to(ReaderDispatcher& dispatcher, ReaderDispatcher* counts) {
  for (Reader* const r : {static_cast<Reader*>(surface.get()), static_cast<Reader*>(pieces.get()),
                          static_cast<Reader*>(dust.get()), static_cast<Reader*>(heat.get())}) {
    if (r != nullptr) dispatcher.add(*r, false);
  }
  (counts != nullptr ? *counts : dispatcher).add(tools, false);
}

std::vector<LiveComponents::Component> SceneReaders::large_pieces() const {
  return pieces ? pieces->large_pieces() : std::vector<LiveComponents::Component>();
}

}  // namespace osteo::inline session
