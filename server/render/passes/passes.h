// The passes themselves: each sets all GL state it needs, does one job and says what it drew. Render thread.
#pragma once

#include <functional>

#include "server/gl/objects.h"
#include "server/render/effort.h"
#include "server/render/gpu_scene.h"
#include "server/render/graph.h"
#include "server/render/light_gpu.h"
#include "server/render/programs.h"
#include "server/render/target.h"
#include "server/scene/scene.h"
#include "server/shade/clusters.h"
#include "server/shade/screen.h"

namespace gonio {

// What most passes need. References outlive the pass run only.
struct PassContext {
    Programs& programs;
    const GpuScene& geometry;
    const Scene& scene;
    const Target& target;
    const Eye& eye;
    const trace::Geometry& traced;
    const shade::Clusters& clusters;
    const shade::Looks& looks;
    shade::Pool& pool;
    bool occluded = true;
    bool layers_on_cpu = false;  // what the CPU shades stays there; run_layers takes it to the target's textures
    std::size_t effort = 0;      // index into kEfforts
};

// G-buffer of the target from its eye.
PassRun run_gbuffer(const PassContext& context);
// The G-buffer of a meter: one pixel that shows a white point one metre ahead, facing the eye.
PassRun run_meter_gbuffer(const PassContext& context);
// Depth of the given cube faces around the light.
PassRun run_shadow(const PassContext& context, const Light& light, LightGpu& gpu, unsigned faces);
// Reflective shadow map of the given cube faces around the light.
PassRun run_rsm(const PassContext& context, const Light& light, LightGpu& gpu, unsigned faces);
// IES light mask of the light's profile in its orientation; faces it does not reach are dark.
PassRun run_mask(const PassContext& context, const Light& light, LightGpu& gpu);
// Flux of every RSM texel, read back.
PassRun run_flux(const PassContext& context, LightGpu& gpu);
// Direct illuminance into a layer, by shader.
PassRun run_direct(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// The same with a ray to the luminaire from every pixel; and at the one point of a meter, in double precision.
PassRun run_direct_rays(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
PassRun run_direct_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// The indirect light of the default technique, on the CPU (server/shade).
// The G-buffer on the CPU, and the grid that the next passes work on.
PassRun run_raster(const PassContext& context);
// The same, read back from the target's textures.
PassRun run_grid(const PassContext& context);
// What the luminaire's rays meet: its VPLs.
PassRun run_vpl(const PassContext& context, const Light& light, LightGpu& gpu);
// Which share of the VPLs' light is blocked, and the light near contacts, on the grid's nodes.
PassRun run_occlusion(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// All of it at the target's pixels, into a layer.
PassRun run_gather(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// A still picture's layer, refined (server/shade/refine.h). Does a bounded part of the work; interrupted: asked now and
// then, whether to stop at once. Result: whether run_refine has something better to show than before.
bool continue_refinement(const PassContext& context, const Light& light, const LightGpu& gpu, int layer, int rounds,
                         const std::function<bool()>& interrupted);
// Puts it into the layer.
PassRun run_refine(const PassContext& context, int layer);
struct Refined {
    unsigned shown = 0;     // counts what run_refine was given since the layer was gathered
    bool finished = false;  // all `rounds` of it are shown
    int rounds = 0;         // that are complete
};
// Nothing is, if the layer was gathered of another state of the scene.
Refined refined(const Target& target, const Scene& scene, int layer, int rounds);
// The same at the one point of a meter.
PassRun run_gather_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// The seed paper's indirect pass into a layer.
PassRun run_gather_seed(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// The CPU's layers of one light -> the target's, for run_composite.
PassRun run_layers(const Target& target, int layer, shade::Pool& pool);
// All luminaires' VPLs and weights -> one list (server/shade/merged.h), and what follows from it for all at once.
PassRun run_merge(const PassContext& context, std::span<const LightGpu* const> lights);
PassRun run_direct_merged(const PassContext& context);
PassRun run_occlusion_merged(const PassContext& context, const LightGpu& any);
PassRun run_gather_merged(const PassContext& context, const LightGpu& any);
// All layers on the CPU -> NV12 on the CPU: the beauty, direct and indirect views. merged: what the list's passes made
// instead.
PassRun run_composite_cpu(const PassContext& context, View view, std::span<const LightGpu* const> lights, bool merged);
// Result: the illuminance in lux, rgb per pixel, rows from the bottom, that the CPU's layers hold, or the list's passes
// (merged). weights: by layer, cd.
std::vector<glm::vec3> cpu_illuminance(const Target& target, std::span<const glm::vec3> weights, float layer_unit_m2,
                                       bool merged, bool indirect, shade::Pool& pool);
// Result: the picture that run_composite_cpu has just made; null if shaders make it.
const std::vector<std::uint8_t>* made_nv12(const Target& target);
// Result: the picture that run_composite_cpu made since the last call; null if it did not run.
std::shared_ptr<const std::vector<std::uint8_t>> take_nv12(const Target& target);
// All layers -> display (raw 0), or values in the view's own unit into raw, an RGBA32F framebuffer of the target's
// size. shown: the light whose cube the mask and rsm views unfold; may be null.
PassRun run_composite(const PassContext& context, View view, const LightGpu* shown,
                      std::span<const LightGpu* const> lights, GLuint raw);
// The photometric solids as wireframe over the display.
PassRun run_solid(const PassContext& context, std::span<const LightGpu* const> lights);
// Display -> NV12.
PassRun run_nv12(const PassContext& context);

// world_from_light's inverse as the shaders take it.
glm::mat3 light_from_world(const Light& light);
// Projection × view of an eye without its translation: world axes, eye-relative -> clip (reversed, infinite depth).
glm::mat4 clip_from_local(const Eye& eye, float near_m);

}  // namespace gonio
