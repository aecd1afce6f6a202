// The bounces of a solve, along links: the first one, which narrow light also reaches surfels by along reversed links
// or by VPLs, and those after it. One thread at a time.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/transport/links.h"
#include "server/transport/table.h"

namespace gonio::transport {

// Links of each surfel that a solve follows: every bounce the first `near`; the first bounce those up to `all`, because
// later bounces are smooth.
struct Followed {
    unsigned near, all;
};

// out = rho (share × direct + indirect), pi × radiance: what each surfel sends, to another surface times Links::passed.
// passed: empty: 1, as into the air. indirect: empty: none. Seven parameters: of what, how much, and of which light.
void radiosity(const Surfels& surfels, std::span<const float> passed, float share, std::span<const glm::vec4> direct,
               std::span<const glm::vec4> indirect, std::vector<glm::vec4>& out, Pool& pool);

struct BounceSettings {
    unsigned links;                      // of each surfel that are followed at most
    bool rests;                          // all links of all surfels are followed
    std::span<const std::uint8_t> seen;  // by surfel: whether the picture shows it; empty: all. The others follow fewer
                                         // links while light moves
};

// E -> S + T(rho E) of one light; in air that absorbs rho is times Links::passed. S is the first bounce of its direct
// light, and what haze scatters; T is the mean over the `near` links of each surfel.
class Bounces {
public:
    // direct: E0. exact: the first bounce of narrow light as other means found it; empty: links find it. haze: added to
    // S; empty: none. All are referred to.
    Bounces(const Surfels& surfels, const Links& links, std::span<const glm::vec4> direct,
            std::span<const glm::vec4> exact, std::span<const glm::vec4> haze, const BounceSettings& settings,
            Pool& pool);
    // out = S + T(rho e). e: empty: 0.
    void bounce(std::span<const glm::vec4> e, std::vector<glm::vec4>& out);
    // 0 … 1: how far the direct light is all on few surfels, which few links meet.
    float narrow() const { return narrow_; }

private:
    void send(float share, std::span<const glm::vec4> indirect);
    void take_crowded(bool rests, std::vector<glm::vec4>& out);
    template <typename Job>
    void for_all(const Job& job) const;

    const Surfels& surfels_;
    const Links& links_;
    std::span<const glm::vec4> direct_;
    std::vector<glm::vec4> uncrowded_;  // E0 without that of crowded surfels which rest_ has all of
    std::span<const std::uint8_t> seen_;
    Pool& pool_;
    Followed shown_, unseen_;
    float narrow_ = 0.0f;
    float carried_ = 1.0f;         // of E0, what every bounce carries along with E; the rest is in rest_
    std::vector<glm::vec4> rest_;  // of S, what `near` links do not find
    std::vector<glm::vec4> sent_;
    Table table_;
};

}  // namespace gonio::transport
