// The passes themselves: each sets all GL state it needs, does one job and says what it drew. Render thread.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <span>

#include "server/gl/objects.h"
#include "server/lighting/clusters.h"
#include "server/lighting/haze_light.h"
#include "server/render/gpu_scene.h"
#include "server/render/graph.h"
#include "server/render/light_gpu.h"
#include "server/render/passes/screen_light.h"
#include "server/render/programs.h"
#include "server/render/quality_level.h"
#include "server/render/shown_bodies.h"
#include "server/render/target.h"
#include "server/scene/haze.h"
#include "server/scene/light.h"
#include "server/scene/view.h"
#include "server/trace/reference.h"
#include "server/transport/transport.h"

namespace gonio {

struct Scene;

// What most passes need. References outlive the pass run only.
struct PassContext {
    Programs& programs;
    const GpuScene& geometry;
    const Scene& scene;
    const Target& target;
    const Eye& eye;
    const trace::Geometry& traced;
    const lighting::Clusters& clusters;
    const lighting::MaterialTable& material_table;
    Pool& pool;
    Scratch& scratch;
    PassCache& pass_cache;
    const transport::Transport* transport = nullptr;  // null: not made yet, there is no indirect light
    int bounces = trace::kAllBounces;                 // or 1, or 0: of captures and meters
    bool rests = false;                               // nothing it lights moves: solve to the end
    bool each_pixel = false;                          // its direct light has a shadow ray from each pixel
    unsigned samples_per_pixel = 1;                   // of edges; 1: none are found
    bool layers_on_cpu = false;     // what the CPU shades stays there; run_layers takes it to the target's textures
    bool gathers = false;           // shaders gather the indirect light of the live picture
    bool merged = false;            // it is of all luminaires at once
    bool besides = false;           // Target::besides is a part of the picture
    bool openings = false;          // so is PixelLight::openings
    std::size_t quality_level = 0;  // index into kQualityLevels
    std::span<const int> layers;    // by light: where its own light is kept; -1: it is summed with others
    // By id of a light with a layer: its weight in the sum, which it is still in, though its level has changed since.
    // Null: none is.
    const std::map<std::uint32_t, glm::dvec3>* in_sum = nullptr;
    ShownBodies* bodies = nullptr;                // that may be in view; null: none are
    std::uint64_t bodies_stand = 0;               // a number that tells where; 0: none are
    Haze haze;                                    // local coordinates; of the seed technique none
    lighting::Probes* probes = nullptr;           // of all targets
    lighting::HazePoints* haze_points = nullptr;  // likewise
    const lighting::PosedBodies* posed_bodies() const { return bodies != nullptr ? &bodies->posed() : nullptr; }
    // Whether there are surfels to gather light from.
    bool has_surfels() const { return transport != nullptr && transport->surface->surfels.count > 0; }
    // Result: the weight of its layer; and in the sum, which the master dims as a whole.
    glm::dvec3 layer_weight(const Light& light) const;
    glm::dvec3 weight_in_sum(const Light& light, int layer) const;
};

// SlotRef::light of what luminaires that are summed share.
inline constexpr std::uint32_t kSummed = ~std::uint32_t{0};
// Likewise of emissive surfaces: of Slot::glow.
inline constexpr std::uint32_t kEmitted = kSummed - 1;

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
// The same by rays to the luminaire, from each pixel or as few as do while it moves (lighting::direct_light); and at
// the one point of a meter, in double precision.
PassRun run_direct_rays(const PassContext& context, const Light& light, const LightGpu& gpu, int layer,
                        const Surfaces& surfaces, Layers& layers);
PassRun run_direct_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer,
                         MeterLight& meter);
// The indirect light of the default technique, on the CPU (server/lighting).
// The G-buffer on the CPU, and the grid that the next passes work on.
PassRun run_raster(const PassContext& context, Surfaces& surfaces);
// The same, read back from the target's textures.
PassRun run_grid(const PassContext& context, Surfaces& surfaces);
// Direct light of a luminaire at the transport's surfels; every bounce among them.
// out: of a luminaire at a transport's surfels, as LightGpu::surfel_direct.
void light_surfels(const PassContext& context, const Light& light, const LightGpu& gpu,
                   const transport::Transport& transport, std::vector<float>& out);
PassRun run_surfels(const PassContext& context, const Light& light, LightGpu& gpu);
PassRun run_solve(const PassContext& context, LightGpu& gpu, const lighting::GridWeights& weights);
// Whether the grid's points, or the pixels where shaders gather, show bodies.
bool shows_bodies(const PassContext& context);
// Result: the values by surfel, and of the sides of bodies what the light brings them after one bounce, or after all.
std::vector<glm::vec4> at_bodies(const PassContext& context, std::span<const glm::vec4> surfels,
                                 const transport::Irradiance& light, bool bounced);
// How the grid's points see the surfels; how the pixels do, by shader.
PassRun run_gather_weights(const PassContext& context, const Surfaces& surfaces, lighting::GridWeights& weights);
PassRun run_gather_weights_gl(const PassContext& context, OnGpu& on_gpu);
// Irradiance at the target's pixels, into a layer; the same by shader.
PassRun run_gather(const PassContext& context, const LightGpu& gpu, int layer, const Surfaces& surfaces,
                   const lighting::GridWeights& weights, Layers& layers);
PassRun run_gather_gl(const PassContext& context, const LightGpu& gpu, int layer, const OnGpu& on_gpu);
// The same, and that of emissive surfaces, by a final gather (server/lighting/final_gather.h) of all luminaires at
// once: of captures.
PassRun run_final_gather(const PassContext& context, std::span<LightGpu* const> lights, const Surfaces& surfaces,
                         const lighting::GridWeights& weights, PixelLight& light);
// Of the live picture while nothing moves: until a pass of it can be shown (result: true), or `interrupted`, asked
// every few milliseconds, says so.
bool continue_final_gather(const PassContext& context, std::span<LightGpu* const> lights, ScreenLight& screen,
                           const std::function<bool()>& interrupted);
// Result: passes that every luminaire of the live picture has had.
unsigned final_gather_passes(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light);
bool final_gather_left(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light);
// While nothing moves: the first bounce of a narrow light, by VPLs that each surfel sends a ray to. Result: whether it
// is there for run_solve.
bool continue_first_bounce(const PassContext& context, const Light& light, LightGpu& gpu,
                           const std::function<bool()>& interrupted);
bool first_bounce_left(const PassContext& context, const LightGpu& gpu);
// Pixels of several surfaces (server/lighting/antialias.h), of samples_per_pixel samples. Of one sample there are none,
// nor where the CPU does not draw the scene. Of a capture at once. Of the live picture while nothing moves, until they
// can be shown (result: true), or `interrupted`, asked after each sample, says so.
PassRun run_antialias(const PassContext& context, ScreenLight& screen);
bool continue_antialias(const PassContext& context, ScreenLight& screen, const std::function<bool()>& interrupted);
bool finds_edges(const PassContext& context);
bool edges_left(const PassContext& context);
// Whether the picture has them.
bool shows_edges(const PassContext& context);
// Whether it has none yet, so that its edges are filtered (server/lighting/edge_filter.h): a live picture of light, no
// false colours.
bool filters_edges(const PassContext& context, View view);
// The same at the one point of a meter.
PassRun run_gather_point(const PassContext& context, const Light& light, LightGpu& gpu, int layer, MeterLight& meter);
// Light of emissive surfaces at the target's pixels or the point of a meter: direct, and after bounces.
PassRun run_gather_emitted(const PassContext& context, const Surfaces& surfaces, const lighting::GridWeights& weights,
                           Besides& emitted);
PassRun run_gather_emitted_point(const PassContext& context, MeterLight& meter);
// The same of luminaires that are summed.
PassRun run_direct_point_summed(const PassContext& context, std::span<const LightGpu* const> lights, PointLight& found);
PassRun run_gather_point_summed(const PassContext& context, const Merged& merged, MeterLight& meter);
// The seed paper's indirect pass into a layer.
PassRun run_gather_seed(const PassContext& context, const Light& light, const LightGpu& gpu, int layer);
// The CPU's layers of one light -> the target's, for run_composite.
PassRun run_layers(const PassContext& context, int layer, const Surfaces& surfaces, Layers& layers);
// Whether a view shows what is between the eye and the surfaces.
inline bool shows_air(View view) {
    return view == View::beauty || view == View::luminance;
}
// Haze (server/lighting/airlight.h, server/lighting/glow.h). How far a luminaire's light goes, and what of it the air
// scatters onto surfels. Which surfels points in the air see. What is scattered to the eye: along the picture's rays of
// a luminaire or of those that are summed. Also at the points of the light of surfaces, with emission of emissive ones.
PassRun run_distances(const PassContext& context, const Light& light, LightGpu& gpu);
PassRun run_haze_surfels(const PassContext& context, const Light& light, LightGpu& gpu);
PassRun run_haze_points(const PassContext& context, lighting::HazePoints& points);
PassRun run_probes(const PassContext& context, lighting::Probes& probes);
lighting::AirBox air_box_of(const PassContext& context);  // that the probes fill
PassRun run_air_view(const PassContext& context, const Surfaces& surfaces, lighting::AirView& view);
PassRun run_seen_probes(const PassContext& context, std::vector<std::uint8_t>& seen);
PassRun run_airlight(const PassContext& context, const Light& light, const LightGpu& gpu, const Surfaces& surfaces,
                     const lighting::AirView& view, lighting::Beam& out);
PassRun run_airlight_summed(const PassContext& context, std::span<const LightGpu* const> lights,
                            const Surfaces& surfaces, ScreenAir& air);
PassRun run_glow(const PassContext& context, const lighting::Probes& probes, const transport::Irradiance& light,
                 bool emission, lighting::Glow& out);
// Of the composite: all luminaires' at their weights, where they or the surfaces are new. Result: null: there is none.
const lighting::AirPicture* air_picture(const PassContext& context, View view, std::span<const LightGpu* const> lights,
                                        const Surfaces& surfaces, const PixelLight& light, ScreenAir& air);
// Result: rgb of each pixel, rows from the bottom, cd/m²: of the haze in a live picture what luminaires light in it.
// For measuring.
std::vector<glm::vec3> shown_beams(const PassContext& context, std::span<const LightGpu* const> lights,
                                   const Surfaces& surfaces, const PixelLight& light, const ScreenAir& air);
// Result: indirect illuminance that the air scatters onto a meter per candela of peak, 1/m².
double haze_at_point(const PassContext& context, const Light& light, const LightGpu& gpu);
// Luminaires at their weights as one (docs/rendering.md), and what follows from it for all at once. They are those with
// layers, while their layers are old, or those that are summed. The argument summed is what these fill, else null.
enum class Together : std::uint8_t { layered, summed };
PassRun run_merge(const PassContext& context, std::span<const LightGpu* const> lights, Together which, Merged& merged);
PassRun run_direct_merged(const PassContext& context, const Surfaces& surfaces, Merged& merged, Besides* summed);
PassRun run_solve_merged(const PassContext& context, Merged& merged, const lighting::GridWeights& weights);
PassRun run_gather_merged(const PassContext& context, const Surfaces& surfaces, const lighting::GridWeights& weights,
                          Merged& merged, Besides* summed);
// Light without a layer, and where shaders gather that of all luminaires at once -> the target's texture, for
// run_composite. gbuffer: its shape. units_lx: of its two layers.
PassRun run_besides(const PassContext& context, const lighting::GBuffer& gbuffer, const PixelLight& light,
                    const OnGpu& on_gpu, std::array<float, 2>& units_lx);
// Luminaires' luminous openings, seen lit: whether a view shows them, and a luminaire of the picture has one.
inline bool shows_openings(View view) {
    return view == View::beauty || view == View::luminance;
}
bool has_opening(const Light& light);
bool openings_in_view(const Scene& scene, const Eye& eye);
PassRun run_openings(const PassContext& context, const Surfaces& surfaces, std::vector<lighting::OpeningPixel>& seen);
// Result: at the luminaires' weights; of another view none.
std::vector<lighting::ShiningPixel> shown_openings(const PassContext& context, View view, const PixelLight& light);
// The work light (needs_work_light): whether the target's beauty view shows it, which values never do. Also the
// display-linear value that it gives to a white surface that faces the camera, at every exposure.
bool shows_work_light(const PassContext& context);
inline constexpr double kWorkLightShown = 0.7;
// All light on the CPU -> NV12 on the CPU: the beauty, direct and indirect views.
PassRun run_composite_cpu(const PassContext& context, View view, std::span<const LightGpu* const> lights,
                          ScreenLight& screen);
// Result: the illuminance in lux, rgb per pixel, rows from the bottom, that the CPU's layers hold, or what was merged.
// weights: by layer, cd.
std::vector<glm::vec3> cpu_illuminance(const PassContext& context, std::span<const glm::vec3> weights, bool indirect,
                                       const Surfaces& surfaces, PixelLight& light);
// All layers -> display. The argument raw is 0, or an RGBA32F framebuffer of the target's size, which gets values in
// the view's own unit. The argument shown is the light whose cube the mask and rsm views unfold; it may be null.
PassRun run_composite(const PassContext& context, View view, const LightGpu* shown,
                      std::span<const LightGpu* const> lights, ScreenLight& screen, GLuint raw);
// The photometric solids as wireframe over the display.
PassRun run_solid(const PassContext& context, std::span<const LightGpu* const> lights);
// Display -> NV12.
PassRun run_nv12(const PassContext& context, View view);

// Result: what a luminaire's light is measured per in layers, cd of its peak. Of a sun (server/scene/sun.h) it is such
// that half floats hold the cosine of its light.
double peak_of(const PassContext& context, const Light& light, const LightGpu& gpu);
// fine: for every pixel of a picture at rest.
lighting::DirectLight direct_light_of(const PassContext& context, const Light& light, const LightGpu& gpu,
                                      bool fine = false);
// values: of the G-buffer's shape, rows of row_length pixels.
void upload(const gl::Texture& array, const lighting::GBuffer& gbuffer, int layer, GLenum format, GLenum type,
            const void* values);

// world_from_light's inverse as the shaders take it.
glm::mat3 light_from_world(const Light& light);
// Projection × view of an eye without its translation: world axes, eye-relative -> clip (reversed, infinite depth).
glm::mat4 clip_from_local(const Eye& eye, float near_m);

}  // namespace gonio
