// Profiles that the scene has no more, though undo, the library and kept scenes still name them.
#pragma once

#include <memory>
#include <vector>

#include "server/scene/profile.h"

namespace gonio {

struct Scene;

// They give up what lighting has made of them (light_tables.h), a megabyte and more each; it is made again where one
// comes back. `after` came from `before`. others: that may have come for nothing. Takes a look at each light, and one
// at presets and cues where a profile has left a light.
void forget_left_profiles(const Scene& before, const Scene& after,
                          const std::vector<std::shared_ptr<const Profile>>& others = {});

}  // namespace gonio
