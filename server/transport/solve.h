// Irradiance at the surfels after every diffuse bounce: E = T(rho (E0 + E)), T the mean over a surfel's links.
// E0: direct illuminance. One thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "server/transport/links.h"

namespace gonio::transport {

// What links lead to, as gathers read it: half floats, 4 a surfel, and a black entry after the last; × `unit`.
struct Table {
    std::vector<std::uint16_t> halves;
    float unit = 0.0f;  // 0: all is black
};
// values: per surfel. Scaled so that the greatest is 1000: half floats hold the rest to 2^-24 of it.
void make_table(std::span<const glm::vec4> values, Table& table, Pool& pool);
// Of `size` surfels in a row `count` links each, a multiple of 4: ids[i × stride] … ids[i × stride + count − 1].
struct LinkRun {
    const std::uint16_t* ids;
    unsigned stride, count;
    std::size_t size;
};
// sums[i] += share × the sum of the table, in its unit, over the links of the run's surfel i.
void gather(const Table& table, const LinkRun& run, float share, glm::vec4* sums);
// Surfels further away than this many radii count nothing.
inline constexpr float kBlendRadii = 2.2f;
// weights: how much each of kNeighbours surfels counts at a point, of sum 1. It goes by distance, and by how far they
// and it lie off each other's plane and face the same way. If none counts, the first alone does.
void weigh(const Surfels& surfels, const std::uint16_t* ids, const glm::vec3& p, const glm::vec3& n, float* weights);
// out[i] = the weighted sum over ids[i × kNeighbours …] of the table, × its unit.
void blend(const Table& table, const std::uint16_t* const* ids, const float* weights, std::size_t size, glm::vec4* out);

// The links of a scene, as far as they are traced.
struct Links {
    std::vector<std::shared_ptr<const LinkSet>> sets;
    std::vector<std::shared_ptr<const ReverseLinks>> reversed;  // after these
    unsigned per_surfel() const { return sets.empty() ? 0 : sets.back()->first + sets.back()->count; }
};

// The light of one luminaire, or of several at once, in any one unit.
struct Irradiance {
    std::vector<glm::vec4> direct;    // E0 at each surfel, rgb
    std::vector<glm::vec4> indirect;  // E, rgb; empty: never solved
    std::vector<glm::vec4> haze;      // what of E the air scatters there, before any bounce; empty: there is none
    std::vector<glm::vec4> first;     // of it, what comes after one bounce
    float narrow = 0.0f;              // 0..1: how far E0 is all on few surfels, which few links meet
    bool converged = false;           // solved at rest
    // Its owner's: while better links come in, what E becomes over so many frames; and what it was solved with.
    std::vector<glm::vec4> becomes;
    unsigned frames_left = 0;
    std::array<std::size_t, 2> with{};
};

struct Accuracy {
    double change;         // the sum over all surfels may change by this much in a bounce more, of itself
    unsigned most;         // bounces computed in one call
    unsigned links = ~0u;  // of each surfel that are followed, at most
};
inline constexpr Accuracy kMoving{0.02, 6}, kAtRest{2e-4, 80};
// Solves from what `light.indirect` holds, the light of the frame before; at rest from the start. The values exact are
// the first bounce of a narrow light, found by other means; empty: by links. By surfel, seen tells whether the picture
// shows it; empty: all are shown. While light moves, surfels not shown follow fewer links. Result: bounces computed.
// Seven parameters: the two tables of the scene, two of the light, how far, and what it becomes.
unsigned solve(const Surfels& surfels, const Links& links, std::span<const glm::vec4> exact,
               std::span<const std::uint8_t> seen, const Accuracy& accuracy, Irradiance& light, Pool& pool);

// What reaches an eye or another surface from each surfel, pi × radiance: rho (share × E0 + E). indirect: empty: none.
void radiosity(const Surfels& surfels, float share, std::span<const glm::vec4> direct,
               std::span<const glm::vec4> indirect, std::vector<glm::vec4>& out, Pool& pool);

}  // namespace gonio::transport
