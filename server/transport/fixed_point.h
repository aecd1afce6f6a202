// Solves E = S + T(rho E) by bounces that cannot diverge, however light travels: through slits, into niches, late.
//
// T is a mean over links and rho < 1, so a bounce F(E) = S + T(rho E) is a contraction. In the maximum norm over
// surfels and channels it shrinks the residual R(E) = F(E) - E by rho_max at least. Between bounces, Anderson
// acceleration looks for the affine combination of the latest iterates with the smallest residual (Walker and Ni 2011,
// "Anderson Acceleration for Fixed-Point Iterations"). F is affine, so the residual of a combination is the same
// combination of residuals, and no bounce is needed to know it. A combination takes the place of the iterate that is
// bounced only if its residual is smaller. No value in it leaves [0, bound]. So each step shrinks the residual by
// rho_max at least, accelerated or not, up to the rounding of F.
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/base/pool.h"

namespace gonio::transport {

// out = F(E); resized as needed.
using Bounce = std::function<void(std::span<const glm::vec4> e, std::vector<glm::vec4>& out)>;

// What one step found out about the E that it began with. Channels that are black do not count.
struct StepReport {
    glm::vec3 residual{0.0f};    // max |R| over the surfels, by channel, in the unit of E
    glm::vec3 greatest{0.0f};    // max F(E) likewise
    float change = 0.0f;         // the sum of |R| over that of F(E), over all surfels and channels
    glm::vec3 by_channel{0.0f};  // max |R| / (E + 1 % of the channel's mean E) over the surfels
    float relative = 0.0f;       // the same over all channels; NaN where any light is
    bool accelerated = false;    // in any channel
};

class FixedPoint {
public:
    // e: where it starts, not negative. Every step writes to it. bound: what E never exceeds, by channel, or infinity.
    // columns: earlier iterates that a combination may use. With 0 there are plain bounces alone.
    FixedPoint(std::vector<glm::vec4>& e, const glm::vec3& bound, unsigned columns, Pool& pool);
    // One bounce, and E becomes F(E) or what replaces it.
    StepReport step(const Bounce& bounce);
    // The largest factor, of the latest three steps, by which a bounce has shrunk the relative residual, at most 1: how
    // fast the slowest part of what is left converges. 1 before the second step.
    float contraction() const;

private:
    struct Column {
        std::vector<glm::vec4> f, r;  // differences of F(E) and of R(E) between two successive iterates
    };
    bool combine(StepReport& report);

    std::vector<glm::vec4>& e_;
    const glm::vec3 bound_;
    const unsigned most_columns_;
    Pool& pool_;
    std::vector<glm::vec4> f_, r_;            // of the current E
    std::vector<glm::vec4> last_f_, last_r_;  // of the E before; empty: there is none
    std::vector<Column> columns_;             // the newest first
    glm::vec3 mean_{0.0f};                    // of E over the surfels
    float expected_ = 0.0f;                   // relative residual of the combination that the current E is a bounce of
    std::array<float, 3> ratios_{};           // of residuals to those expected, of the latest steps
    unsigned steps_ = 0;
};

}  // namespace gonio::transport
