// Luminaires as haze sees them, for tests.
#pragma once

#include <numbers>
#include <vector>

#include "server/lighting/airlight.h"
#include "server/scene/light_tables.h"
#include "server/scene/web_buffer.h"

namespace gonio::lighting {

// The web of a luminaire that is alike all around. candela: at each of the angles from its photometric zero.
inline ies::PhotometricWeb web_of_rings(const std::vector<double>& angles_deg, const std::vector<float>& candela) {
    ies::PhotometricWeb web;
    for (const double angle : angles_deg) web.v_rad.push_back(angle * std::numbers::pi / 180);
    web.h_rad = {0.0, 2 * std::numbers::pi};
    for (int h = 0; h < 2; ++h) web.candela.insert(web.candela.end(), candela.begin(), candela.end());
    return web;
}

// A luminaire at `position` that shines down, 1 cd at its peak.
struct Lamp {
    std::vector<std::uint32_t> words;
    AirlightSource source;
    Lamp(const ies::PhotometricWeb& web, const glm::vec3& position, double extinction, double g)
        : words(pack_web(web, 1.0)) {
        source.light = {position, glm::mat3(glm::vec3(1, 0, 0), glm::vec3(0, 0, 1), glm::vec3(0, -1, 0)),
                        gonio::web_of(words.data()), 1.0f};
        source.light.air = {static_cast<float>(extinction), 1.0f, static_cast<float>(g)};
        source.distances = nullptr;
        source.core_cos = core_cosine(web, 1.0);
    }
};
inline Lamp bulb(const glm::vec3& position, double extinction, double g = 0.0) {
    return {web_of_rings({0, 90, 180}, {1, 1, 1}), position, extinction, g};
}

}  // namespace gonio::lighting
