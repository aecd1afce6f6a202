// Points on surfaces that light reaches: surfels are chosen from them, and the points around a surfel say what it
// looks like. Coordinates are local, m.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <utility>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"
#include "server/transport/reached.h"

namespace gonio::transport {

struct Candidate : trace::SurfacePoint {
    glm::vec3 albedo;
    glm::vec3 detailed;      // normal as the normal map has it
    float covered = 1.0f;    // how often a ray that comes there ends there
    double area_m2 = 0.0;    // that it stands for
    float near_m = 0.0f;     // distance to the nearest luminaire in sight; infinite if none is near
    float room_m = 0.0f;     // size of the small room that it is in; infinite if it is in none
    double lit = 0.0;        // by all near sources alike, in any unit
    float spacing_m = 0.0f;  // of surfels there
};
// Of a point of a triangle. area_m2: that it stands for. What is told by sources is left at 0.
Candidate candidate_at(const trace::Geometry& geometry, const trace::SurfaceHit& hit, float u, float v, double area_m2);

// All triangles by the area up to them, so that points are drawn evenly.
struct Areas {
    struct Triangle {
        int instance, triangle;
        float longest_m;  // side
        double area_m2;   // of one side of it
    };
    std::vector<Triangle> triangles;
    std::vector<double> running{0.0};  // m², as they are drawn: from running[i] to running[i + 1]

    // only: of these triangles alone (instance, triangle), in ascending order; empty: of all.
    explicit Areas(const trace::Geometry& geometry, std::span<const std::pair<int, int>> only = {});
    // From now on long faces that are narrower than this are drawn as if they were as wide. Otherwise a place on the
    // edge of a sheet would have no point near it. Where that would add more than a thirtieth to what is drawn, they
    // are drawn as if they were narrower, all alike.
    void widen(float width_m);
    // Result: the area that each of `count` points stands for on the i-th triangle, of both sides together, m².
    double each_m2(std::size_t i, std::size_t count) const {
        return 2.0 * triangles[i].area_m2 / (running[i + 1] - running[i]) * running.back() / static_cast<double>(count);
    }
    // Which of them is an instance's triangle; their number: none.
    std::size_t find(int instance, int triangle) const;
};

// One of `count` points drawn over both sides of all triangles. The area is cut into `count` equal shares, and each
// point comes from one of them.
struct Drawn {
    trace::SurfaceHit hit;
    float u, v;           // on its triangle
    std::uint32_t index;  // below count
    std::size_t of;       // index into Areas::triangles
};
// Calls job(point) for the points with indices from `first` to `first + size` - 1, except those that fall into a hole
// of a texture. seed: of the random numbers. Equal seeds give equal points.
void each_drawn(const trace::Geometry& geometry, const Areas& areas, std::size_t count, std::uint32_t seed,
                std::size_t first, std::size_t size, const std::function<void(const Drawn&)>& job);

// Draws `count` points. Result: those that light reaches. stopped: asked now and then. When it is true, some are left
// out.
std::vector<Candidate> candidates(const trace::Geometry& geometry, const Areas& areas, std::size_t count,
                                  std::uint32_t seed, const Reached& reached, Pool& pool,
                                  const std::function<bool()>& stopped);

}  // namespace gonio::transport
