// The reference quality: illuminance and pictures by path tracing. It has the same scene and the same photometric webs
// as the interactive pipeline, without its approximations. Visibility is exact, there are any number of diffuse bounces
// and no virtual point lights. Its estimator is derived in docs/rendering.md. Results depend on the scene, the settings
// and the seed alone, never on the number of threads or their timing. No GL.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::trace {

inline constexpr int kAllBounces = -1;  // until the path dies of absorption: unbiased (Russian roulette)

struct Settings {
    int bounces = kAllBounces;  // diffuse bounces before the receiver: 0 none, 1 the interactive model with occlusion
    double noise = 0.01;        // stops when the estimated relative standard error is below: of total_lx for meters, of
                                // the root mean square over the pixels relative to their mean for pictures
    std::uint32_t min_passes = 8;         // of a picture, a multiple of 8: its noise is not asked before
    std::uint32_t max_passes = 1u << 20;  // samples per receiver at most; what is reached by then is reported
    double max_seconds = 0.0;  // ends with what it has before it would take a twentieth longer, with 64 samples a
                               // stream or a pass at least; 0: no bound
    std::uint32_t seed = 1;
    int threads = 0;    // 0: thread_count()
    bool idle = false;  // threads yield to everything else on the machine (SCHED_IDLE): beside live frames
};

// What one scene revision looks like to rays: acceleration structure, luminaires with their weights, emitters.
// Immutable and thread-safe; meshes and webs are shared with the scene it was made from.
struct World;
// Any thread. previous: may be null; a World whose acceleration structure and luminaire tables are taken over where
// asset and profile are the same. So a level change costs nothing.
std::shared_ptr<const World> make_world(const Scene& scene, const World* previous = nullptr);

// What a point receives light by: a plane, a small upright cylinder, or the half of one.
enum class Receives : std::uint8_t { plane, cylinder, half_cylinder };

struct MeterPoint {
    glm::dvec3 position{0.0};    // world, m
    glm::dvec3 normal{0, 1, 0};  // unit, world; of a half cylinder its axis, horizontal
    Receives by = Receives::plane;
};

// Illuminance in lux per channel, luminaires at their level, colour and master. direct: from luminaires and emissive
// surfaces; indirect: after at least one diffuse bounce.
struct Reading {
    glm::dvec3 direct_lx{0.0}, indirect_lx{0.0};
    double direct_error_lx = 0.0, indirect_error_lx = 0.0;  // standard error of the luminance, 0 where computed exactly
    std::uint32_t samples = 0;
    bool noise_reached = true;  // the noise that was asked for; else max_passes or max_seconds came first
};

// Result: one reading per point; on a stop request those reached so far. Blocks; runs settings.threads threads.
std::vector<Reading> measure(const World& world, std::span<const MeterPoint> points, const Settings& settings,
                             std::stop_token stop = {});

struct DenoisePlanes;

// What a picture's pixels hold.
enum class Quantity : std::uint8_t {
    irradiance_direct,    // lux, rgb
    irradiance_indirect,  // lux, rgb
    irradiance,           // lux, rgb
    radiance_direct,      // albedo · E / pi, cd/m², rgb
    radiance_indirect,
    radiance,  // all of it and the surface's own emission
};

struct PictureRequest {
    Camera camera;
    int width_px = 0, height_px = 0;
    Quantity quantity = Quantity::radiance;
    bool antialias = false;  // a box filter over the pixel; else rays through pixel centres, as the interactive picture
    bool planes = false;     // planes() is asked for; of radiance only
    bool openings = true;    // luminaires' luminous openings are seen; of radiance only
    bool bodies = true;      // so are their bodies
};

inline constexpr std::uint32_t kLeastPassesOfNoise = 8;  // fewer do not tell it

struct Progress {
    std::uint32_t passes = 0;  // samples of each pixel so far
    double noise = 1.0;        // estimated, as Settings::noise defines it; 1 before kLeastPassesOfNoise
    bool complete = false;     // noise, max_passes or max_seconds reached
    bool noise_reached = false;
    std::optional<double> seconds_left;  // estimated, of refine(), as noise falls with 1 / sqrt(passes)
};

// A picture that gets better with every pass. One thread calls; settings.threads work inside a call.
class Picture {
public:
    Picture(std::shared_ptr<const World> world, const PictureRequest& request, const Settings& settings);
    ~Picture();

    // Renders passes for about this long, at least one; returns early when complete or stopped (a pass that a stop
    // cuts short does not count).
    Progress refine(double seconds, std::stop_token stop = {});
    // Result: width·height·4 floats, rows from the top: the mean so far and 1 where there is a surface.
    std::vector<float> values() const;
    // Result: width·height·3 floats likewise: of it what haze scatters to the eye, cd/m²; empty where there is no haze,
    // and of other quantities than radiance.
    std::vector<float> haze() const;
    // Result: what denoise() filters (denoise.h): odd and even samples apart, light that is sampled apart from light
    // that is computed. One sample counts as both halves. Only of a request for planes.
    DenoisePlanes planes() const;

private:
    struct Data;
    std::unique_ptr<Data> data_;
};

}  // namespace gonio::trace
