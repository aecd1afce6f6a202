#include "tests/bench/cpu_picture.h"

#include "server/render/quality.h"
#include "server/render/web_buffer.h"

namespace gonio::bench {
namespace {

glm::dmat3 turn_of(const Light& light) {
    return glm::dmat3(glm::mat3_cast(light.world_from_light));
}

}  // namespace

CpuPicture::CpuPicture(const Scene& scene)
    : geometry(scene.asset),
      looks(shade::make_looks(geometry)),
      clusters(shade::make_clusters(geometry)),
      light(scene.lights.at(0)),
      web_words(pack_web(light.profile->photometry.web)),
      rays(light.profile, scene.samples),
      vpls(shade::cast(rays, geometry, light.position - geometry.origin(), turn_of(light), pool)) {
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const float near_m = 2e-5f * geometry.extent();  // as GpuScene has it
    shade::look_through(eye, geometry, near_m, scene.width_px, scene.height_px, surfaces);
    shade::draw_surfaces(clusters, looks, false, surfaces, raster, pool);
    shade::make_grid(surfaces, kLive, grid, pool);

    const shade::DirectLight direct{geometry.local(light.position), glm::mat3(glm::transpose(turn_of(light))),
                                    shade::web_of(web_words.data()), 1.0f};
    lux_per_cd.resize(surfaces.depth.size());
    for (std::vector<float>& array : from) array.resize(surfaces.depth.size());
    pool.run(surfaces.height, [&](int y) {
        const std::size_t at = static_cast<std::size_t>(y) * surfaces.row_length;
        shade::direct_row(direct, y, static_cast<int>(surfaces.row_length), surfaces.rays,
                          4.0f * geometry.step_off(direct.position), 0.02f * surfaces.depth_per_pixel,
                          surfaces.depth.data() + at, surfaces.normal.data() + at, lux_per_cd.data() + at,
                          from[0].data() + at, from[1].data() + at, from[2].data() + at);
    });
}

shade::LightView CpuPicture::light_view() const {
    return {geometry, rays, vpls, light.position - geometry.origin(), turn_of(light), shade::web_of(web_words.data()),
            looks};
}

}  // namespace gonio::bench
