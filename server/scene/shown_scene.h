// What the picture shows of a scene where it is not the scene itself: one light alone, or how it differs from a preset.
#pragma once

#include <array>
#include <optional>

#include "server/scene/view.h"

namespace gonio {

struct Scene;

// Result: a scene to render in place of this one, or nothing where the view shows it as it is. Its lights' colours are
// what they differ by from the preset, negative where it has more of them, and of one light alone the others are out.
// Emissive surfaces, which no preset holds, are hidden. A light that the preset has at another place, turned another
// way or with another profile, or that is gone, is among them as a further one, negative. Ids and revisions of lights
// that are there stay: light that was rendered stands. Any thread.
std::optional<Scene> shown_scene(const Scene& scene, View view);

// shown: of shown_scene(). Result: the scene with what its lights bring, and the one with what they take away, both
// positive: the picture is the first one's less the second one's.
std::array<Scene, 2> signed_parts(const Scene& shown);

}  // namespace gonio
