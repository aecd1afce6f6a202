// The first picture of a scene whose file has no camera: where somebody would stand in it, and what is wrong with what
// they see. Any thread. No GL.
#pragma once

#include <string>

#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::trace {

// Rays that first_view() and reversed_hint() together take at most, whatever the scene: some milliseconds.
inline constexpr unsigned kMostFirstViewRays = 1000;

struct FirstView {
    Camera camera;
    bool inside = false;  // of a room; else the scene is seen whole, from outside
};

// Finds the first camera of a scene: it reads the asset, its bounds and the lights, never the scene's own camera. A
// room is free space of at least 1.8 m between floor and ceiling, or without a ceiling, that surfaces surround in at
// least 70 % of all directions. There the eye stands 1.6 m above the floor, or at 65 % of a lower room's height. It has
// its back to a wall, and looks where it sees most of the room, of what is lit in it and of what stands in it.
// Solids are no rooms: their faces show their backs inside. A room whose faces are turned over is one where a luminaire
// stands in it. Every other scene is framed whole, as framing() has it, from the side that shows most. The same scene
// has the same view.
FirstView first_view(const Scene& scene);

// Returns a hint where the camera mostly faces backs of one-sided surfaces, which viewers leave out, so that the
// picture is empty. Elsewhere the text is empty. inside: as FirstView says. A room's own walls should face the eye,
// while from outside it is common to look through them.
std::string reversed_hint(const Scene& scene, const Camera& camera, bool inside);

// Gives a scene that was just made of its asset the first view, where the file has no camera. Returns the hint of
// reversed_hint().
std::string take_first_view(Scene& scene);

}  // namespace gonio::trace
