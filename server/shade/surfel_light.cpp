#include "server/shade/surfel_light.h"

namespace gonio::shade {

void direct_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const DirectLight& light,
                       std::vector<float>& out, Pool& pool) {
    constexpr std::size_t kChunk = 512;
    static_assert(kChunk % kLanes == 0 && kLanes == transport::kPadding);
    // A luminaire on a surface does not light what it is mounted on, nor is it hidden by it.
    constexpr float kStart = 1e-5f;
    out.resize(surfels.place[0].size());
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t count) {
        const std::vector<float>* at = surfels.place;
        direct_points(light,
                      {at[0].data() + first, at[1].data() + first, at[2].data() + first, at[3].data() + first,
                       at[4].data() + first, at[5].data() + first},
                      (count + kLanes - 1) / kLanes * kLanes, out.data() + first);
        trace::RayPacket rays;
        std::size_t asked[trace::kPacket];
        int waiting = 0;
        const auto send = [&] {
            const unsigned hidden = waiting > 0 ? geometry.occluded(rays, (1u << waiting) - 1u) : 0u;
            for (int i = 0; i < waiting; ++i) {
                if ((hidden >> i & 1u) != 0) out[asked[i]] = 0.0f;
            }
            waiting = 0;
        };
        for (std::size_t i = first; i < first + count; ++i) {
            if (!(out[i] > 0.0f)) continue;
            const glm::vec3 p = surfels.position(i), to = light.position - p;
            if (glm::dot(to, surfels.geometric[i]) <= 0.0f) {
                out[i] = 0.0f;
                continue;
            }
            const glm::vec3 along = p + surfels.geometric[i] * (4.0f * geometry.step_off(p)) - light.position,
                            from = light.position + along * kStart;
            rays.from_x[waiting] = from.x, rays.from_y[waiting] = from.y, rays.from_z[waiting] = from.z;
            rays.along_x[waiting] = along.x, rays.along_y[waiting] = along.y, rays.along_z[waiting] = along.z;
            rays.far[waiting] = 1.0f - 2.0f * kStart;
            asked[waiting++] = i;
            if (waiting == trace::kPacket) send();
        }
        send();
    });
}

}  // namespace gonio::shade
