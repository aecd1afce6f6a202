// Surfels: oriented discs spread over all surfaces that light can reach, each side of a triangle on its own
// (Lehtinen et al. 2008, "A Meshless Hierarchical Representation for Light Transport"). Irradiance is solved at them.
// Made once per scene; immutable, any thread. Coordinates are local (server/trace/geometry.h), m.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"
#include "server/transport/cell_points.h"

namespace gonio::transport {

inline constexpr std::size_t kMostSurfels = 65'535;  // ids have 16 bits
inline constexpr std::size_t kNeighbours = 16;
inline constexpr std::size_t kSurfelsAJob = 1024;  // of loops that take little for each
inline constexpr float kDartRadius = 0.74f;        // spacing, of the square root of a surfel's share of the area
inline constexpr std::size_t kPadding = 16;        // arrays that kernels read end on whole vectors

struct Surfels {  // NOLINT(bugprone-reserved-identifier): in the copy that the compiler writes
    std::size_t count = 0;
    float radius_m = 0.0f;                     // surfels of like normals are no nearer to each other, but near sources
    std::vector<float> spacing_m;              // how near to this one; radius_m away from sources
    std::vector<float> points[6];              // x y z of the centre, x y z of the shading normal; padded
    std::vector<float> facing[3];              // mean of the normals around as normal maps have them, at most 1 long:
                                               // direct light falls on it, and links start about it; padded
    bool detailed = false;                     // any normal map: else `facing` is the shading normal
    std::vector<glm::vec3> geometric, albedo;  // means of the surface around; albedo 0..1 per channel
    std::vector<float> drawn;                  // points that area_m2 is expected to be counted from
    std::vector<float> area_m2;  // of the surface that each stands for; of a pane as much as it stops light
    // A surfel near a source, and where direct light falls on the surface that it stands for. On all other surfels it
    // falls on the centre.
    struct Crowded {
        std::uint16_t id;
        CellPoints points;
    };
    std::vector<Crowded> all_crowded;  // by id
    // By surfel: those near it that it sees, itself first; `count`: none.
    std::vector<std::array<std::uint16_t, kNeighbours>> neighbours;

    glm::vec3 position(std::size_t i) const { return {points[0][i], points[1][i], points[2][i]}; }
    glm::vec3 normal(std::size_t i) const { return {points[3][i], points[4][i], points[5][i]}; }
    glm::vec3 detailed_normal(std::size_t i) const { return {facing[0][i], facing[1][i], facing[2][i]}; }
    bool crowded(std::size_t i) const { return spacing_m[i] < radius_m; }
    // Result: area_m2 of a surfel that has neighbours at its spacing on all sides, on the mean.
    float full_m2(std::size_t i) const { return spacing_m[i] * spacing_m[i] / (kDartRadius * kDartRadius); }
    trace::SurfacePoint at(std::size_t i) const { return {position(i), normal(i), geometric[i]}; }

    // Result: the ids of those within so many radii whose normals agree within 60 degrees, else within 90, the nearest
    // first. The order is by distance², four times that off the plane, and the normals' difference. At most `most`.
    std::size_t near(const trace::SurfacePoint& from, float radii, std::span<std::uint16_t> found) const;
    // Result: the first of them that the point sees; `count`: none.
    std::uint16_t visible_from(const trace::Geometry& geometry, const trace::SurfacePoint& from) const;
    // Whether a short ray meets the surfel, or a path half a radius above the surface: on a rounded one rays between
    // its points pass below it.
    bool sees(const trace::Geometry& geometry, const trace::SurfacePoint& from, std::size_t id) const;

private:
    friend struct Placement;
    // A hashed grid of cells of one side: the ids of bucket c are ids_[first_[c]] … ids_[first_[c + 1]] − 1.
    std::vector<std::uint32_t> first_;
    std::vector<std::uint16_t> ids_;
    std::uint32_t cell_of(const glm::ivec3& cell) const;
};

struct SurfelSettings {
    double spacing_m = 0.06;  // wanted; the counts win
    std::size_t least = 16'000, most = 40'000;
    // Of surfels, cells (a quarter of it) and links; each triangle takes 16 bytes and there are 1,000 surfels though it
    // were exceeded.
    std::size_t bytes = std::size_t{256} << 20;
    bool operator==(const SurfelSettings&) const = default;
};
// seeds: points that light comes from or is looked at from, local. Walks from them decide which surfaces are reached.
// sources: so many of the seeds, the first ones, are luminaires. Surfels lie closer together around them, because light
// changes there over short distances. stopped: asked now and then. When it is true, the result is empty.
Surfels place_surfels(const trace::Geometry& geometry, std::span<const glm::vec3> seeds, std::size_t sources,
                      const SurfelSettings& settings, Pool& pool, const std::function<bool()>& stopped);

}  // namespace gonio::transport
