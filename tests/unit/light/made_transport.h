// Transports of small scenes, for tests.
#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/scene.h"
#include "server/transport/transport.h"
#include "tests/scenes/placed.h"
#include "tests/scenes/scenes.h"

namespace gonio::transport {

// Enough where detail proves nothing.
inline const SurfelSettings kFew{.least = 1000, .most = 4000};

// A scene's transport with all links but the reversed ones, and direct light of an isotropic source of 1 cd.
struct Made {
    explicit Made(const Scene& scene, const SurfelSettings& settings = {}, std::span<const glm::dvec3> eyes = {})
        : geometry(std::make_shared<const trace::Geometry>(scene.asset)),
          light(geometry->local(scene.lights.at(0).position)),
          builder(geometry, seeds_of(scene, eyes), settings, kMostForwardLinks, false, false) {
        builder.wait();
        transport = builder.newest();
        irradiance.direct = direct_of(light);
        Pool pool;
        solve_to_the_end(irradiance, pool);
    }
    void solve_to_the_end(Irradiance& lit, Pool& pool) const {
        do {
            solve(surfels(), transport->links, {}, {}, kAtRest, lit, pool);
        } while (lit.resumes);
    }
    std::vector<glm::vec3> seeds_of(const Scene& scene, std::span<const glm::dvec3> eyes) const {
        std::vector<glm::vec3> seeds;
        for (const Light& one : scene.lights) seeds.push_back(geometry->local(one.position));
        for (const glm::dvec3& eye : eyes) seeds.push_back(geometry->local(eye));
        return seeds;
    }
    // Direct light of an isotropic source of 1 cd, lx.
    std::vector<glm::vec4> direct_of(const glm::vec3& source) const {
        const Surfels& s = surfels();
        std::vector<glm::vec4> direct(s.count, glm::vec4(0.0f));
        for (std::size_t i = 0; i < s.count; ++i) direct[i] = lux_at(s.position(i), i, source);
        for (const auto& [i, points] : s.all_crowded) {
            direct[i] = glm::vec4(0.0f);
            for (std::size_t k = 0; k < kCellPoints; ++k)
                direct[i] += points.share[k] * lux_at(points.at[k], i, source);
        }
        return direct;
    }
    // The same at a point of the surface of surfel i.
    glm::vec4 lux_at(const glm::vec3& p, std::size_t i, const glm::vec3& source) const {
        const Surfels& s = surfels();
        const glm::vec3 to = source - p;
        const float d2 = glm::dot(to, to), cosine = glm::dot(to, s.normal(i)) / std::sqrt(d2);
        if (cosine <= 0.0f || glm::dot(to, s.geometric[i]) <= 0.0f) return glm::vec4(0.0f);
        if (geometry->occluded(p + s.geometric[i] * (4.0f * geometry->step_off(p)), source)) return glm::vec4(0.0f);
        return glm::vec4(glm::vec3(cosine / d2), 0.0f);
    }
    const Surfels& surfels() const { return transport->surface->surfels; }
    // Mean over the surfels' areas, of one channel.
    double mean(const std::vector<glm::vec4>& values) const {
        double sum = 0.0, area = 0.0;
        for (std::size_t i = 0; i < surfels().count; ++i) {
            sum += static_cast<double>(surfels().area_m2[i]) * static_cast<double>(values[i].g);
            area += static_cast<double>(surfels().area_m2[i]);
        }
        return sum / area;
    }

    std::shared_ptr<const trace::Geometry> geometry;
    glm::vec3 light;
    Builder builder;
    std::shared_ptr<const Transport> transport;
    Irradiance irradiance;
};

// A closed room of one reflectance from the origin to `size`.
inline Scene room(const glm::dvec3& size, float reflectance, const glm::dvec3& light) {
    const double x = size.x, y = size.y, z = size.z;
    const Mesh faces[] = {
        test::quad({0, 0, z}, {x, 0, z}, {x, 0, 0}, {0, 0, 0}), test::quad({0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}),
        test::quad({0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}), test::quad({x, 0, z}, {0, 0, z}, {0, y, z}, {x, y, z}),
        test::quad({0, 0, z}, {0, 0, 0}, {0, y, 0}, {0, y, z}), test::quad({x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0})};
    std::vector<test::Piece> pieces;
    for (const Mesh& mesh : faces) pieces.push_back({mesh, glm::vec3(reflectance)});
    return test::scene_with(pieces, test::isotropic(1.0), light);
}

}  // namespace gonio::transport
