// Which points lie where neither a light nor a viewer stands: inside a closed body, or outside of the room. Their
// illuminance says nothing of the room. The air decides, not the faces: light meets both sides of them, and files turn
// them as they like. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/trace/geometry.h"

namespace gonio::trace {

enum class Place : std::uint8_t { open, inside, outside };

inline constexpr std::size_t kMostWalked = 256;

// What tells the air of the scene's rooms from that of closed bodies. Local, m.
struct Landmarks {
    std::vector<glm::vec3> lights;  // where luminaires stand and shine, whatever their level
    std::vector<glm::vec3> eyes;    // the camera's and those of saved views
    bool sun = false;               // a light of the scene is a sun
};
Landmarks landmarks_of(const Scene& scene, const Geometry& geometry);

// Result: of each point where it lies. points: local, m, a step off their surfaces, `row` of them side by side, at
// least 1. A point that sees its neighbour lies where that does. Of any other 32 walks tell: eight random straight
// lines each, in a sphere around the scene. Costs two rays a point, and at most 800 where walks are needed: for
// kMostWalked of the points. Of more that do not see each other each lies where the one before it does.
//
// A point is open where two walks see a luminaire, or a surface that emits. It is outside where they end in the open,
// though there are luminaires; under a sun these must be indoors, else it is open. It is open too where walks see an
// eye, or where what is around the point is as large as a room and faces it. All else is inside.
std::vector<Place> places_of(const Geometry& geometry, const Landmarks& landmarks, std::span<const glm::vec3> points,
                             std::size_t row);

}  // namespace gonio::trace
