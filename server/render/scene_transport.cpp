// The transport of the scene that is shown, and when it is made anew.
#include <algorithm>
#include <deque>
#include <utility>

#include "server/lighting/clusters.h"
#include "server/render/pipeline.h"
#include "server/render/renderer.h"
#include "server/render/shown_bodies.h"

namespace gonio {
namespace {

// Transports outlive their renderer: one that is made after the GPU was lost goes on with them. Of the scene that is
// shown, and of those that captures and meters wait for. Render thread.
struct Known {
    std::shared_ptr<const SceneAsset> asset;
    transport::SurfelSettings surfels;
    unsigned links = 0;
    bool cells = false;
    std::vector<glm::vec3> seeds;
    std::shared_ptr<transport::Builder> builder;
};
// Of fixed ones so many at once; of the others those that light could not go to from there.
constexpr std::size_t kMostFirstSeeds = 32;
// One is shown, one captured and one metered; the oldest of more goes.
constexpr std::size_t kMostKnown = 3;

std::deque<Known>& known_transports() {
    static std::deque<Known> known;
    return known;
}

}  // namespace

void Renderer::prepare_geometry(const Scene& scene, bool live) {
    if (!geometry_ || &geometry_->asset() != scene.asset.get()) {
        geometry_ = std::make_unique<GpuScene>(scene.asset);
        bodies_.reset();
        traced_ = trace::geometry_of(scene);
        builder_.reset();
        transport_.reset();
        ++generation_;
        drawn_.reset();
        if (scene.drawn && scene.drawn->geometry == traced_) drawn_ = scene.drawn;
        if (live)
            std::erase_if(known_transports(), [&](const Known& one) {
                return one.asset != scene.asset && std::ranges::find(awaited_, one.asset.get()) == awaited_.end();
            });
    }
}

void Renderer::prepare_transport(const Scene& scene) {
    auto& known = known_transports();
    auto own = std::find_if(known.begin(), known.end(), [&](const Known& one) {
        return one.asset == scene.asset && one.surfels == surfels_ && one.links == links_ &&
               (one.cells || direct_by_rays_);
    });
    std::vector<glm::vec3> positions;
    for (const glm::dvec3& point : fixed_seeds_) positions.push_back(traced_->local(point));
    const bool fixed = !positions.empty();
    if (!fixed) {
        positions.push_back(traced_->local(scene.camera.eye));
        for (const Light& light : scene.lights)
            if (!light.sun) positions.push_back(traced_->local(light.position));
    }
    const auto begin = [&] {
        builder_ = std::make_shared<transport::Builder>(traced_, seeds_, surfels_,
                                                        std::min(links_, transport::kMostForwardLinks),
                                                        transport_beside_, !direct_by_rays_);
        if (transport_beside_) builder_->hold(!watched_);
        if (own != known.end()) known.erase(own);
        if (known.size() == kMostKnown) known.pop_front();
        known.push_back({scene.asset, surfels_, links_, !direct_by_rays_, seeds_, builder_});
        own = std::prev(known.end());
    };
    if (!builder_ && own != known.end()) {
        builder_ = own->builder;
        seeds_ = own->seeds;
        if (transport_beside_) builder_->hold(!watched_);
    } else if (!builder_) {
        seeds_ = positions;
        if (fixed && seeds_.size() > kMostFirstSeeds) seeds_.resize(kMostFirstSeeds);
        begin();
    }
    // Those for narrow beams are made where there is one.
    if (fixed && fixed_narrow_) builder_->want(links_);
    if (!fixed && links_ > transport::kMostForwardLinks &&
        std::any_of(scene.lights.begin(), scene.lights.end(), [&](const Light& light) {
            const auto gpu = lights_.find(light.id);
            return gpu != lights_.end() && gpu->second.irradiance.narrow > 0.0f;
        }))
        builder_->want(links_);
    if (!transport_beside_) builder_->wait();
    // A luminaire or an eye has come to where no light could go before.
    if (builder_->done() && builder_->newest() && seeded_rev_ != scene.scene_rev && !(fixed && seeded_rev_ != 0)) {
        seeded_rev_ = scene.scene_rev;
        const std::size_t before = seeds_.size();  // a point next to one of them has had its turn
        for (const glm::vec3& position : positions) {
            const bool new_here = std::none_of(seeds_.begin(), seeds_.end(), [&](const glm::vec3& seed) {
                return glm::distance(seed, position) < 0.02f * traced_->extent();
            });
            if (new_here && seeds_.size() < positions.size() + kMostLaterSeeds &&
                !transport::reaches(*builder_->newest(), position))
                seeds_.push_back(position);
        }
        if (seeds_.size() > before) {
            begin();
            if (fixed && fixed_narrow_) builder_->want(links_);
            if (!transport_beside_) builder_->wait();
        }
    }
    auto newest = builder_->newest();
    if (newest == transport_ || (!newest && transport_ && &transport_->surface->geometry->asset() == scene.asset.get()))
        return;
    transport_ = std::move(newest);
    ++generation_;
}

bool Renderer::met_narrow_beams() const {
    return std::any_of(lights_.begin(), lights_.end(),
                       [](const auto& one) { return one.second.irradiance.narrow > 0.0f; });
}

void Renderer::set_watched(bool watched) {
    watched_ = watched;
    if (builder_ && transport_beside_) builder_->hold(!watched);
}

bool Renderer::ready(const Scene& scene) {
    if (scene.technique != Technique::standard) return true;
    prepare(scene, false);
    builder_->hold(false);
    return builder_->done() && !newer_transport();
}

v1::TransportStats Renderer::transport_stats() {
    if (builder_) builder_->hold(false);
    v1::TransportStats stats;
    stats.set_ready(builder_ && builder_->done());
    if (const auto newest = builder_ && builder_->newest() ? builder_->newest() : transport_) {
        stats.set_surfels(static_cast<std::uint32_t>(newest->surface->surfels.count));
        stats.set_links_per_surfel(newest->links.per_surfel());
        stats.set_bytes(static_cast<double>(newest->bytes()));
        stats.set_seconds(newest->seconds);
    }
    if (live_screen_) {
        stats.set_bounces(live_screen_->solved.bounces);
        stats.set_residual(static_cast<double>(live_screen_->solved.residual));
        stats.set_unconverged(static_cast<double>(live_screen_->solved.error));
    }
    return stats;
}

}  // namespace gonio
