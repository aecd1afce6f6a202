// Scenes to bake and what comes of it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/bake/bake.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {

inline void add_room(Mesh& mesh, const glm::dvec3& low, const glm::dvec3& high) {
    const auto add = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
        const Mesh one = quad(a, b, c, d);
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.insert(mesh.vertices.end(), one.vertices.begin(), one.vertices.end());
        for (const std::uint32_t index : one.indices) mesh.indices.push_back(first + index);
    };
    const auto p = [&](int x, int y, int z) {
        return glm::dvec3(x != 0 ? high.x : low.x, y != 0 ? high.y : low.y, z != 0 ? high.z : low.z);
    };
    add(p(0, 0, 1), p(1, 0, 1), p(1, 0, 0), p(0, 0, 0));  // floor
    add(p(0, 1, 0), p(1, 1, 0), p(1, 1, 1), p(0, 1, 1));
    add(p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0));
    add(p(1, 0, 1), p(0, 0, 1), p(0, 1, 1), p(1, 1, 1));
    add(p(0, 0, 1), p(0, 0, 0), p(0, 1, 0), p(0, 1, 1));
    add(p(1, 0, 0), p(1, 0, 1), p(1, 1, 1), p(1, 1, 0));
}
// The inside of a box: fronts inwards.
inline Mesh room(const glm::dvec3& low, const glm::dvec3& high) {
    Mesh mesh;
    add_room(mesh, low, high);
    return mesh;
}
// The outside of a box.
inline Mesh block(const glm::dvec3& low, const glm::dvec3& high) {
    Mesh mesh = room(low, high);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
    for (Vertex& vertex : mesh.vertices) vertex.normal = -vertex.normal;
    return mesh;
}

struct Baked {
    std::shared_ptr<const trace::Geometry> geometry;
    bake::Layout layout;
    std::vector<bake::Source> sources;
    std::vector<bake::SourceMaps> maps;
    std::uint64_t rays = 0;

    // Result: all that arrives, means over area, lx.
    double mean_direct(std::size_t source = 0) const { return maps[source].mean_direct_lx; }
    double mean_all(std::size_t source = 0) const {
        double sum = maps[source].mean_direct_lx;
        for (const double lx : maps[source].mean_bounces_lx) sum += lx;
        return sum;
    }
};

inline bake::BakeSettings small_bake(int side = 64, int directions = 128) {
    bake::BakeSettings settings;
    settings.atlas.width = settings.atlas.height = side;
    settings.directions = directions;
    return settings;
}

inline Baked bake_scene(const Scene& scene, const bake::BakeSettings& settings,
                        const bake::PartStore& store = bake::PartStore()) {
    Baked baked;
    baked.geometry = std::make_shared<trace::Geometry>(scene.asset);
    bake::Work work;
    auto layout = bake::lay_out(scene, *baked.geometry, settings, work);
    if (!layout) {
        ADD_FAILURE() << layout.error().text();
        return baked;
    }
    baked.layout = std::move(*layout);
    auto sources = bake::sources_of(scene, *baked.geometry, settings);
    if (!sources) {
        ADD_FAILURE() << sources.error().text();
        return baked;
    }
    baked.sources = std::move(*sources);
    bake::BakeEvents events;
    events.finished = [&](const bake::Layout&, const bake::Source&, const bake::SourceMaps& maps) -> Result<bool> {
        baked.maps.push_back(maps);
        return true;
    };
    const auto done = bake::bake(scene, *baked.geometry, baked.layout, baked.sources, settings, store, events, work);
    if (!done) ADD_FAILURE() << done.error().text();
    baked.rays = work.rays;
    return baked;
}

}  // namespace gonio::test
