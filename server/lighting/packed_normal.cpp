#include "server/lighting/packed_normal.h"

#include <algorithm>
#include <cmath>

#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {

std::uint32_t pack_normal(const glm::vec3& n) {
    const glm::vec2 e = glsl::octahedral_encode(n);
    const auto part = [](float x) {
        return static_cast<std::uint32_t>(static_cast<std::uint16_t>(std::lround(x * 32767.0f)));
    };
    return part(e.x) | part(e.y) << 16;
}

glm::vec3 unpack_normal(std::uint32_t bits) {
    const auto part = [](std::uint32_t half) {
        return std::max(static_cast<float>(static_cast<std::int16_t>(half)) / 32767.0f, -1.0f);
    };
    return glsl::octahedral_decode({part(bits & 0xffffu), part(bits >> 16)});
}

}  // namespace gonio::lighting
