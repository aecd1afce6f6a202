#include "server/lighting/body_sides.h"

#include <algorithm>
#include <numbers>

namespace gonio::lighting {
namespace {

using Surface = transport::Transport::Surface;

glm::vec3 axis_of(unsigned side) {
    glm::vec3 axis(0.0f);
    axis[static_cast<int>(side / 2)] = side % 2 == 0 ? 1.0f : -1.0f;
    return axis;
}

// ids: of as many links. Result: what comes straight from emissive surfaces, lux.
glm::vec3 follow_links(const Surface& surface, const glm::vec3& from, const glm::vec3& axis,
                       std::span<std::uint16_t> ids) {
    const trace::Geometry& geometry = *surface.geometry;
    glm::vec3 emitted(0.0f);
    trace::HitPacket hits;
    for (unsigned k = 0; k < ids.size(); k += trace::kPacket) {
        const transport::Fan fan = transport::make_fan(from, axis, axis, transport::fan_directions(2, k));
        const unsigned met = transport::follow(fan, geometry, surface.surfels, *surface.cells, hits, ids.data() + k);
        if (surface.emitters.emitters.empty()) continue;
        for (int i = 0; i < trace::kPacket; ++i)
            if ((met >> i & 1u) != 0 && glm::dot(hits.normal(i), fan.rays.along(i)) < 0.0f)
                emitted += geometry.emission_at(static_cast<int>(hits.instance[i]), static_cast<int>(hits.triangle[i]),
                                                hits.u[i], hits.v[i]);
    }
    return emitted * (std::numbers::pi_v<float> / static_cast<float>(ids.size()));
}

}  // namespace

void BodySides::update(const std::shared_ptr<const Surface>& surface,
                       const std::vector<std::optional<BodyMiddle>>& middles, Pool& pool) {
    const bool all = surface != surface_ || middles.size() != middles_.size();
    const std::size_t first = surface->surfels.count + 1;
    if (all) {
        surface_ = surface;
        middles_.assign(middles.size(), std::nullopt);
        around_.clear();
        const std::size_t fit = first < 65535 ? (65535 - first) / kSides : 0;  // ids have 16 bits
        for (std::size_t part = 0; part < middles.size(); ++part) {
            auto& around = around_.emplace_back();
            around.fill(static_cast<std::uint16_t>(surface->surfels.count));
            for (unsigned side = 0; side < kSides && part < fit; ++side)
                around[side] = static_cast<std::uint16_t>(first + part * kSides + side);
        }
        links_ = kMostSideLinks;
        while (links_ > kLeastSideLinks && middles.size() * kSides * links_ > kMostBodyLinks) links_ /= 4;
        ids_.assign(middles.size() * kSides * links_, static_cast<std::uint16_t>(surface->surfels.count));
        emitted_lx_.assign(middles.size() * kSides, glm::vec4(0.0f));
    }
    std::vector<std::size_t> moved;
    for (std::size_t part = 0; part < middles.size(); ++part)
        if (middles[part] && middles[part] != middles_[part]) moved.push_back(part);
    middles_ = middles;
    pool.run(static_cast<int>(moved.size()), [&](int job) {
        const std::size_t part = moved[static_cast<std::size_t>(job)];
        for (unsigned side = 0; side < kSides; ++side) {
            const std::size_t at = part * kSides + side;
            const std::span<std::uint16_t> ids(ids_.data() + at * links_, links_);
            emitted_lx_[at] = glm::vec4(follow_links(*surface_, middles_[part]->position, axis_of(side), ids), 0.0f);
        }
    });
}

void BodySides::weigh(const glm::vec3& n, float* weights) {
    std::fill_n(weights, transport::kNeighbours, 0.0f);
    for (int k = 0; k < 3; ++k) weights[2 * k + (n[k] < 0.0f ? 1 : 0)] = n[k] * n[k];
}

std::size_t BodySides::part_at(const glm::vec3& p) const {
    std::size_t best = middles_.size();
    float nearest = 1.01f;  // of its reach
    for (std::size_t part = 0; part < middles_.size(); ++part) {
        if (!middles_[part]) continue;
        const float far = glm::distance(p, middles_[part]->position) / std::max(middles_[part]->reach_m, 1e-6f);
        if (far < nearest) nearest = far, best = part;
    }
    return best;
}

std::vector<glm::vec4> BodySides::before_sides(std::span<const glm::vec4> values) const {
    std::vector<glm::vec4> all(values.begin(), values.end());
    all.resize(surface_->surfels.count + 1, glm::vec4(0.0f));
    return all;
}

std::vector<glm::vec4> BodySides::with_sides(std::span<const glm::vec4> values, std::span<const glm::vec4> sent) const {
    std::vector<glm::vec4> all = before_sides(values);
    for (std::size_t at = 0; at < emitted_lx_.size(); ++at) {
        glm::vec4 sum(0.0f);
        for (std::size_t k = at * links_; k < (at + 1) * links_ && !sent.empty(); ++k)
            if (ids_[k] < sent.size()) sum += sent[ids_[k]];
        all.push_back(sum / static_cast<float>(links_));
    }
    return all;
}

std::vector<glm::vec4> BodySides::with_emitted(std::span<const glm::vec4> values) const {
    std::vector<glm::vec4> all = before_sides(values);
    all.insert(all.end(), emitted_lx_.begin(), emitted_lx_.end());
    return all;
}

}  // namespace gonio::lighting
