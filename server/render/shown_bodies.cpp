#include "server/render/shown_bodies.h"

#include <bit>
#include <glm/gtc/matrix_transform.hpp>

namespace gonio {

ShownBodies::ShownBodies(std::shared_ptr<const Bodies> bodies, const lighting::PosedBodies& posed,
                         const GpuScene& within)
    : bodies_(std::move(bodies)),
      posed_(posed),
      gpu_(std::shared_ptr<const SceneAsset>(bodies_, &bodies_->shown), within),
      places_(bodies_->parts.size()),
      middles_(bodies_->parts.size()) {
    for (const Instance& part : bodies_->shown.instances) {
        const Bounds& box = bodies_->shown.meshes[static_cast<std::size_t>(part.mesh)].bounds;
        const glm::dvec3 middle(part.world_from_mesh * glm::dvec4(0.5 * (box.min + box.max), 1.0));
        double reach = 0.0;
        for (unsigned k = 0; k < 8; ++k) {
            const glm::dvec3 corner((k & 1 ? box.max : box.min).x, (k & 2 ? box.max : box.min).y,
                                    (k & 4 ? box.max : box.min).z);
            reach = std::max(reach, glm::distance(glm::dvec3(part.world_from_mesh * glm::dvec4(corner, 1.0)), middle));
        }
        at_home_.push_back({glm::vec3(middle), static_cast<float>(reach)});
    }
}

void ShownBodies::place(const Scene& scene, const glm::dvec3& origin) {
    const glm::dmat4 local_from_world = glm::translate(glm::dmat4(1.0), -origin);
    BodyPlaces now = body_places(scene);
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (now[i] == places_[i]) continue;
        if (!now[i]) {
            posed_.place(i, std::nullopt);
            gpu_.place(i, std::nullopt);
            middles_[i].reset();
            continue;
        }
        const glm::dmat4 local = local_from_world * *now[i];
        posed_.place(i, local);
        gpu_.place(i, *now[i] * bodies_->shown.instances[i].world_from_mesh);
        middles_[i] = {glm::vec3(local * glm::dvec4(glm::dvec3(at_home_[i].position), 1.0)), at_home_[i].reach_m};
    }
    places_ = std::move(now);
}

std::uint64_t ShownBodies::in_view(const Eye& eye) const {
    std::uint64_t stands = 0;
    const auto take = [&](std::uint64_t word) {  // splitmix64's finaliser
        stands += word + 0x9e3779b97f4a7c15ull;
        stands = (stands ^ stands >> 30) * 0xbf58476d1ce4e5b9ull;
        stands = (stands ^ stands >> 27) * 0x94d049bb133111ebull;
        stands ^= stands >> 31;
    };
    for (std::size_t i = 0; i < places_.size(); ++i) {
        if (!places_[i]) continue;
        const glm::dvec3 middle(*places_[i] * glm::dvec4(glm::dvec3(at_home_[i].position), 1.0));
        if (!may_see(eye, middle, static_cast<double>(at_home_[i].reach_m))) continue;
        take(i);
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 3; ++row) take(std::bit_cast<std::uint64_t>((*places_[i])[column][row]));
    }
    return stands;
}

}  // namespace gonio
