// The parts of the export of MVR shows.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/exchange/gdtf_write.h"
#include "server/scene/asset.h"
#include "server/scene/light.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::v1 {
class PatchRow;
}  // namespace gonio::v1

namespace gonio::exchange {

// Result: a UUID of RFC 9562, version 8, that follows from the text alone: the same each time.
std::string uuid_of(std::string_view text);

// Instances that one GLB of a show holds. in_world: where they stand, of one object; else one of them, in its mesh's
// axes, for an object each.
struct GeometryGroup {
    std::vector<std::size_t> instances;
    bool in_world = false;
};
// Result: a group for each mesh, but one for all that share a picture, so that none is there twice; one for all where
// there would be too many files.
std::vector<GeometryGroup> geometry_groups(const SceneAsset& asset);

// A universe where a fixture's channels begin.
struct BreakStart {
    unsigned universe = 1, address = 1;
};
// What the patch has of one light: its channels, and where each break of theirs begins, the first as break 1.
struct LightPatch {
    std::vector<gdtf::WrittenChannel> channels;
    std::vector<BreakStart> breaks;
    std::vector<const v1::PatchRow*> rows;  // of the scene's patch, that have a channel
    bool swings = false;                    // pan or tilt is among them
};
// Result: of a light without rows a dimmer that is not patched. Where pan or tilt swings it both are there.
LightPatch patch_of(const Scene& scene, const Light& light);

}  // namespace gonio::exchange
