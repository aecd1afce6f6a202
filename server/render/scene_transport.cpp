// The transport of the scene that is shown, and when it is made anew.
#include <algorithm>
#include <deque>
#include <utility>

#include "server/lighting/clusters.h"
#include "server/render/pipeline.h"
#include "server/render/renderer.h"
#include "server/render/shown_bodies.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Of fixed ones so many at once; of the others those that light could not go to from there.
constexpr std::size_t kMostFirstSeeds = 32;

// Transports outlive their renderer: one that is made after the GPU was lost goes on with them. Of the scene that is
// shown, and of those that captures and meters wait for. Render thread.
std::deque<std::shared_ptr<SceneTransport>>& known_transports() {
    static std::deque<std::shared_ptr<SceneTransport>> known;
    return known;
}

}  // namespace

void Renderer::prepare_geometry(const Scene& scene, bool live) {
    if (live) shown_ = scene.asset.get();
    if (!geometry_ || &geometry_->asset() != scene.asset.get()) {
        geometry_ = std::make_unique<GpuScene>(scene.asset);
        bodies_.reset();
        traced_ = trace::geometry_of(scene);
        own_.reset();
        transport_.reset(), made_.reset();
        ++generation_;
        drawn_.reset();
        if (scene.drawn && scene.drawn->geometry == traced_) drawn_ = scene.drawn;
        if (live) std::erase_if(known_transports(), [&](const auto& one) { return !is_wanted(*one); });
    }
}

bool Renderer::is_wanted(const SceneTransport& made) const {
    return made.asset.get() == shown_ || std::ranges::find(awaited_, made.asset.get()) != awaited_.end();
}

void Renderer::begin_transport(SceneTransport& made) const {
    made.builder = std::make_shared<transport::Builder>(made.traced, made.seeds, made.surfels,
                                                        std::min(made.links, transport::kMostForwardLinks),
                                                        transport_beside_, made.cells);
    if (transport_beside_)
        made.builder->hold(!watched_);
    else
        made.builder->wait();
}

// Result: the scene's transport as far as it is made; null if nobody has asked for it yet.
std::shared_ptr<SceneTransport> Renderer::known_transport(const Scene& scene) const {
    if (own_ && own_->asset == scene.asset) return own_;
    const auto& known = known_transports();
    const auto found = std::ranges::find_if(known, [&](const auto& one) {
        return one->asset == scene.asset && one->surfels == surfels_ && one->links == links_ &&
               (one->cells || direct_by_rays_);
    });
    return found == known.end() ? nullptr : *found;
}

// Result: whether this revision of the scene was asked about before. With fixed seeds, any revision counts.
bool Renderer::looked_at(const Scene& scene) {
    const std::pair<const SceneAsset*, Revision> one(scene.asset.get(), scene.scene_rev);
    for (const auto& [asset, rev] : looked_)
        if (asset == one.first && (rev == one.second || !fixed_seeds_.empty())) return true;
    std::rotate(looked_.begin(), looked_.begin() + 1, looked_.end());
    looked_.back() = one;
    return false;
}

// Result: the scene's transport. Begins it if there is none, and again if a luminaire or the eye has come to where its
// light does not reach.
std::shared_ptr<SceneTransport> Renderer::transport_of(const Scene& scene) {
    std::shared_ptr<SceneTransport> made = known_transport(scene);
    const bool fixed = !fixed_seeds_.empty(), begins = !made,
               is_here = geometry_ && &geometry_->asset() == scene.asset.get();
    if (begins)
        made = std::make_shared<SceneTransport>(SceneTransport{.asset = scene.asset,
                                                               .traced = is_here ? traced_ : trace::geometry_of(scene),
                                                               .surfels = surfels_,
                                                               .links = links_,
                                                               .cells = !direct_by_rays_});
    std::vector<glm::vec3> positions;
    for (const glm::dvec3& point : fixed_seeds_) positions.push_back(made->traced->local(point));
    if (!fixed) {
        positions.push_back(made->traced->local(scene.camera.eye));
        for (const Light& light : scene.lights)
            if (!light.sun) positions.push_back(made->traced->local(light.position));
    }
    if (begins) {
        made->seeds = positions;
        if (fixed && made->seeds.size() > kMostFirstSeeds) made->seeds.resize(kMostFirstSeeds);
        begin_transport(*made);
        auto& known = known_transports();
        if (known.size() == kMostKnownTransports) {
            const auto needless = std::ranges::find_if(known, [&](const auto& one) { return !is_wanted(*one); });
            known.erase(needless == known.end() ? known.begin() : needless);
        }
        known.push_back(made);
    }
    if (!made->builder->done() || !made->builder->newest() || looked_at(scene)) return made;
    const std::size_t before = made->seeds.size();  // a point next to one of them has had its turn
    for (const glm::vec3& position : positions) {
        const bool new_here = std::none_of(made->seeds.begin(), made->seeds.end(), [&](const glm::vec3& seed) {
            return glm::distance(seed, position) < 0.02f * made->traced->extent();
        });
        if (new_here && made->seeds.size() < positions.size() + kMostLaterSeeds &&
            !transport::reaches(*made->builder->newest(), position))
            made->seeds.push_back(position);
    }
    if (made->seeds.size() > before) begin_transport(*made);
    return made;
}

void Renderer::prepare_transport(const Scene& scene) {
    const bool first = !own_;
    own_ = transport_of(scene);
    if (first && transport_beside_) own_->builder->hold(!watched_);
    // The last generations of links only help narrow beams, so they are traced only for scenes that have one.
    const auto is_narrow = [&](const Light& light) {
        const auto gpu = lights_.find(light.id);
        return gpu != lights_.end() && gpu->second.irradiance.narrow > 0.0f;
    };
    if (fixed_seeds_.empty() ? std::ranges::any_of(scene.lights, is_narrow) : fixed_narrow_) {
        own_->builder->want(own_->links);
        if (!transport_beside_) own_->builder->wait();
    }
    auto newest = own_->builder->newest();
    if (!newest && transport_ && &transport_->surface->geometry->asset() == scene.asset.get()) return;
    const Haze absorption = absorption_of(haze_of(scene, own_->traced->origin()));
    const std::array<double, 2> air = {absorption.extinction_per_m, absorption ? absorption.layer_height_m : 0.0};
    if (newest == made_ && air == made_in_) return;
    made_ = newest, made_in_ = air;
    transport_ = newest && absorption
                     ? std::make_shared<const transport::Transport>(transport::in_air(*newest, absorption, pool_))
                     : std::move(newest);
    ++generation_;
}

bool Renderer::met_narrow_beams() const {
    return std::any_of(lights_.begin(), lights_.end(),
                       [](const auto& one) { return one.second.irradiance.narrow > 0.0f; });
}

void Renderer::set_watched(bool watched) {
    watched_ = watched;
    if (own_ && transport_beside_) own_->builder->hold(!watched);
}

Readiness Renderer::ready(const Scene& scene) {
    if (scene.technique != Technique::standard) return Readiness::all;
    // If another scene is in place it stays there. Putting this one in its place would light that one anew afterwards.
    const bool in_place = own_ && own_->asset == scene.asset;
    if (in_place) prepare_transport(scene);
    const std::shared_ptr<SceneTransport> made = in_place ? own_ : transport_of(scene);
    made->builder->hold(false);
    if (made->builder->done()) return Readiness::all;
    return made->builder->newest() ? Readiness::part : Readiness::none;
}

v1::TransportStats Renderer::transport_stats() {
    if (own_) own_->builder->hold(false);
    v1::TransportStats stats;
    stats.set_ready(own_ && own_->builder->done());
    if (const auto newest = own_ && own_->builder->newest() ? own_->builder->newest() : transport_) {
        stats.set_surfels(static_cast<std::uint32_t>(newest->surface->surfels.count));
        stats.set_links_per_surfel(newest->links.per_surfel());
        stats.set_bytes(static_cast<double>(newest->bytes()));
        stats.set_seconds(newest->seconds);
    }
    stats.set_bounces(solved_.bounces);
    stats.set_residual(static_cast<double>(solved_.residual));
    stats.set_unconverged(static_cast<double>(solved_.error));
    return stats;
}

}  // namespace gonio
