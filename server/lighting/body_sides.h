// Indirect light on bodies of luminaires, which have no surfels. Planes in the middle of a part that face along the six
// axes receive it, each by links of its own. A point of the part takes the three that its normal faces, weighted by its
// components squared (an ambient cube: Mitchell, McTaggart and Green 2006, "Shading in Valve's Source Engine").
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/transport/transport.h"

namespace gonio::lighting {

inline constexpr unsigned kSides = 6;
// Links of each side: of so many parts as fit into kMostBodyLinks in all, of more a quarter, and again.
inline constexpr unsigned kMostSideLinks = 256, kLeastSideLinks = 16;
inline constexpr std::size_t kMostBodyLinks = std::size_t{1} << 19;

// The middle of a part of a body and how far it reaches from there, local, m.
struct BodyMiddle {
    glm::vec3 position{0.0f};
    float reach_m = 0.0f;
    bool operator==(const BodyMiddle&) const = default;
};

class BodySides {
public:
    // by part; nothing: it is not there. Links are followed of those that have moved, and of all on other surfels.
    void update(const std::shared_ptr<const transport::Transport::Surface>& surface,
                const std::vector<std::optional<BodyMiddle>>& middles, Pool& pool);
    bool empty() const { return around_.empty(); }
    // Result: what a point of part `index` is blended from, like Surfels::neighbours: indices into with_sides().
    const std::array<std::uint16_t, transport::kNeighbours>& around(std::size_t index) const { return around_[index]; }
    std::size_t parts() const { return around_.size(); }
    // weights: of these, kNeighbours, of sum 1. n: unit.
    static void weigh(const glm::vec3& n, float* weights);
    // Result: the part that a point is of, by where it is; none of them: parts().
    std::size_t part_at(const glm::vec3& p) const;

    // Result: the values by surfel, one of none, and those of all sides: the mean over their links of what surfels
    // send.
    std::vector<glm::vec4> with_sides(std::span<const glm::vec4> values, std::span<const glm::vec4> sent) const;
    // The same of light that comes straight from emissive surfaces, lux.
    std::vector<glm::vec4> with_emitted(std::span<const glm::vec4> values) const;

private:
    std::vector<glm::vec4> before_sides(std::span<const glm::vec4> values) const;

    std::shared_ptr<const transport::Transport::Surface> surface_;
    std::vector<std::optional<BodyMiddle>> middles_;
    std::vector<std::array<std::uint16_t, transport::kNeighbours>> around_;
    unsigned links_ = kMostSideLinks;    // of each side
    std::vector<std::uint16_t> ids_;     // of the surfels that they meet, by part, side and link
    std::vector<glm::vec4> emitted_lx_;  // by part and side
};

}  // namespace gonio::lighting
