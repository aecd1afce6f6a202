// Irradiance at the surfels after every diffuse bounce: E = T(rho (E0 + E)), T the mean over a surfel's links and E0
// the direct illuminance. One thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/transport/bounces.h"

namespace gonio::transport {

// How far a solve has come.
struct Solved {
    unsigned bounces = 0;   // computed, in all calls of a solve that resumes
    float residual = 0.0f;  // max |S + T(rho E) - E| over max E, both over surfels and channels, before the last bounce
    float error = 0.0f;     // estimate of what has not converged, over E: of the worst surfel, except that light below
                            // 1 % of the mean counts as 1 %
    float rate = 0.0f;      // estimate of what a bounce leaves of the residual, 0 to rho_max
};

// The light of one luminaire, or of several at once, in any one unit.
struct Irradiance {
    std::vector<glm::vec4> direct;    // E0 at each surfel, rgb
    std::vector<glm::vec4> indirect;  // E, rgb; empty: never solved
    std::vector<glm::vec4> haze;      // the part of E that the air scatters to it, before any bounce; empty: no haze
    std::vector<glm::vec4> first;     // the part of E that comes after one bounce
    std::vector<Irradiance>
        parts;            // of a difference of two lights: its positive part, and its negative one. Else empty
    float narrow = 0.0f;  // 0 … 1: how far E0 is all on few surfels, which few links meet
    Solved solved;
    bool converged = false;  // solved at rest
    bool resumes = false;    // a solve at rest has reached the limit of bounces in one call; the next call goes on
    // For the owner: while better links come in, what E becomes over so many frames; and what it was solved with.
    std::vector<glm::vec4> becomes;
    unsigned frames_left = 0;
    std::array<std::size_t, 2> with{};
};

struct Accuracy {
    bool rests;            // solved from the start, until Solved::error is estimated to be below `least`; else until a
    float least;           // bounce changes the sum of E over all surfels by less than this part of it
    unsigned most;         // bounces in one call
    unsigned links = ~0u;  // of each surfel that are followed, at most
};
// While light moves, a frame has time for a few bounces and starts from the light of the frame before. At rest one call
// takes as long as 64 bounces at most, some 100 ms for 32,000 surfels on two cores; what is left goes on in the next.
inline constexpr Accuracy kMoving{false, 0.02f, 6}, kAtRest{true, 1e-3f, 64};
// A solve at rest ends after so many bounces, whatever is left: Solved::error says how much that is. Light between
// surfaces of 0.99 takes some 200.
inline constexpr unsigned kMostBounces = 1024;

// Solves from what `light.indirect` holds. At rest it starts anew. The first bounce of narrow light is `exact`, as
// other means found it; where that is empty, links find it. The picture shows the surfels of `seen`; where that is
// empty, all. While light moves, the others follow fewer links. Direct light may be negative, as in a difference of two
// lights. Then both parts are solved apart. Light that is not finite becomes black, with an infinite Solved::error.
// Seven parameters: the two tables of the scene, two of the light, how far, and what it becomes.
void solve(const Surfels& surfels, const Links& links, std::span<const glm::vec4> exact,
           std::span<const std::uint8_t> seen, const Accuracy& accuracy, Irradiance& light, Pool& pool);

// Likewise at rest by links alone, in as many calls as it takes. stopped: asked after each.
void solve_to_the_end(
    const Surfels& surfels, const Links& links, Irradiance& light, Pool& pool,
    const std::function<bool()>& stopped = [] { return false; });

}  // namespace gonio::transport
