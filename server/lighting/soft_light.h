// Luminaires with a size: an opening is lit by its parts, and seen as a share that rays to a fixed set of its points
// tell.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "ies/photometry.h"
#include "server/base/pool.h"
#include "server/lighting/screen.h"

namespace gonio::lighting {

struct DirectLight;
struct Lattice;

inline constexpr unsigned kFewPoints = 16, kManyPoints = 64;  // of an opening that rays go to: of what moves; at rest

// An opening, from the luminaire's position along the scene's axes, m.
struct SoftParts {
    struct Level {
        float size_m;
        std::vector<glm::vec3> at;
    };
    std::vector<Level> levels;         // the first is a point in its middle; 64 parts, or 256 of a fine one, at most
    glm::vec3 half_m{0.0f};            // a box around it in the luminaire's frame
    float radius_m = 0.0f;             // a sphere around it
    float least_d2 = 0.0f;             // m²: a part is no nearer
    std::vector<glm::vec3> few, many;  // kFewPoints and kManyPoints where rays end, off what it is mounted on
};
// Result: null of a point. fine: for pictures at rest.
std::shared_ptr<const SoftParts> soft_parts(const ies::Opening& opening, const glm::mat3& light_from_world, bool fine);

// Which of kFewPoints a ray from (x, y) of a grid or a picture goes to: another of all 4 × 4 neighbours; of every other
// point and row too.
inline unsigned first_point(int x, int y) {
    const auto bits = [](int a, int b) { return static_cast<unsigned>((b & 1) * 2 + (a & 1)); };
    const unsigned turn = bits(x, y), fine = bits(x >> 1, y >> 1), coarse = bits(x >> 2, y >> 2);
    return fine * 4 + ((coarse + turn) & 3u);
}

// Result: where the first ray of a point of a surface ends, local, m: at first_point()'s, or where that is beneath the
// surface's horizon, at another that is not.
glm::vec3 first_target(const DirectLight& light, unsigned first_point, const glm::vec3& position,
                       const glm::vec3& normal);

// What of a luminaire sixteen points of a picture see, of `active` (bit i: point i): 0 … 1. A ray goes to each of
// kManyPoints of its opening, or to half of kFewPoints, and counts by the light that this would bring; n: which. Of a
// point luminaire: one ray. depth: along the view axis, m. Eight parameters: unhidden()'s, and n. Any
// thread.
void visible_share(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                   const Points& points, const float* depth, unsigned active, unsigned n, float* share);

// The same of up to sixteen pixels that lie beside each other in a list, with four rays each: quarter: which of the
// four quarters of kFewPoints. Pixels of one surface, a few pixels apart, take the sum of their rays; lone ones send
// eight.
void visible_among(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                   const Points& points, const float* depth, int count, const unsigned* quarter, float* share);

// By pixel of a picture, or of a grid: what the first ray says.
enum class FirstRay : std::uint8_t { none, hidden, seen, dimmed };
// Result: the same for all around it that have one, two to each side; else dimmed. Rows of row_length pixels.
FirstRay around_first(const std::vector<std::uint8_t>& first, std::size_t row_length, int height, int x, int y);

// Result: what the four points of a grid around a pixel see of an opening: all or nothing; else dimmed. through: of
// soften_grid().
FirstRay around_grid(const Grid& grid, const std::vector<float>& through, int x, int y);

// The lattice's `ratio` and `through` of one luminaire with an opening. Before, `through` is what the first rays of a
// grid's points say, negative where there is none; after, what the points see. Where first rays do not agree with those
// around kFewPoints follow. pool: of the render thread; null: any thread.
void soften_grid(const GBuffer& gbuffer, const Grid& grid, const trace::Geometry& geometry, const DirectLight& light,
                 std::vector<float>& ratio, std::vector<float>& through, Pool* pool);

}  // namespace gonio::lighting
