// What a session's records do to a scene: one stepping for whoever follows one, from its file or while it runs.
#pragma once
#include <optional>

#include "osteo/session/recording/session_reader.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// Does what the scene's owner did; of what the servo did by itself only the scene's strokes are told (its changes of
/// bone are records).
World::Effect apply_action(const SceneAction& action, World& world);

/// Gives a voxel its recorded density, and tells the change with the density before. Nothing where the bone has no such
/// voxel.
std::optional<VoxelChange> apply_change(const VoxelChange& change, World& world);

/// A part of a session file, in order. The last density of a voxel before each action that parts changes
/// (parts_changes) is enough: strokes end there, and what was before is in the bone. Error(corrupt) where it changes a
/// voxel that the bone does not have.
void apply_part(const SessionPart& part, World& world);

}  // namespace osteo::inline session
