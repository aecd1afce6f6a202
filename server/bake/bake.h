// Baked irradiance: of each luminaire at level 1 its direct light and, bounce by bounce, what surfaces send each other,
// at every texel of an atlas. No files but those of parts. docs/lightmaps.md says what is computed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/bake/atlas.h"
#include "server/bake/fill.h"
#include "server/bake/parts.h"
#include "server/bake/work.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::bake {

inline constexpr std::size_t kMostSources = 64;  // luminaires of a bake: one more is refused, "too_many_lights"
inline constexpr std::size_t kNameBytes = 64;    // of a map's name
inline constexpr int kMostDirections = 1 << 16, kMostBounces = 64, kMostSteps = 1024;

struct BakeSettings {
    AtlasSettings atlas;
    int directions = 256;  // of a texel and bounce; rounded up to a multiple of 32
    int bounces = kMostBounces;
    double tolerance = 0.002;  // ends when further bounces can add less than this share of all, and to no sheet more
                               // than five times that
    bool openings = true;      // luminaires shine from their luminous openings
    double part = 0.25;        // DirectSettings::part
    int steps = 30;            // AirSettings, where the scene has haze
    bool even_steps = false, air_rays = false;
    std::uint32_t seed = 1;
    std::size_t memory_bytes = std::size_t{2} << 30;  // of texels, maps and pictures; more is refused: "too_large"
};

// One source of light: a luminaire at level 1, white, or all emissive surfaces together.
struct Source {
    std::string name;         // safe for a file: letters, digits, - and _; unlike all others
    std::string light;        // of the scene; empty: emissive surfaces
    glm::vec3 weight{1.0f};   // of its maps in the sum: level, colour, white and master
    std::string key;          // of its content
    int direct_channels = 1;  // emissive surfaces: 3
};

// Its maps. Values of all texels, lx.
struct SourceMaps {
    std::vector<float> direct;    // direct_channels each
    std::vector<float> indirect;  // three each: after one bounce or more, and once scattered by the air
    std::vector<float> error;     // one each: half the difference of two half-streams, and what further bounces can add
    double mean_direct_lx = 0.0;  // over area, luminance
    std::vector<double> mean_bounces_lx;
    double rest_lx = 0.0;  // that further bounces can add to the mean
    std::uint64_t rays = 0;
    double seconds = 0.0;
    int computed = 0, taken_over = 0;  // parts
};

// What is the same for all of a bake's maps.
struct Layout {
    Atlas atlas;
    FillPlan fill;
    double area_m2 = 0.0;         // of valid texels
    glm::vec3 mean_albedo{0.0f};  // over it
    double invalid_m2 = 0.0;
    std::string key;  // of surfaces, texture coordinates and albedo
};

struct BakeEvents {
    // A source is finished.
    std::function<Result<bool>(const Layout&, const Source&, const SourceMaps&)> finished;
    // Before a part: what comes, and which of how many.
    std::function<void(const std::string& what, int part, int parts)> begins;
};

// Result: memory that a bake takes at most with one source at a time, bytes, and for each more.
struct MemoryNeed {
    std::size_t fixed = 0, per_source = 0;
};
MemoryNeed memory_of(const AtlasSettings& settings);

// Result: the sources of a scene, in its order. Errors: "too_many_lights", "nothing_to_bake".
Result<std::vector<Source>> sources_of(const Scene& scene, const trace::Geometry& geometry,
                                       const BakeSettings& settings);

// Result: the layout. Errors: of make_atlas; "too_large" before anything is computed; "stopped".
Result<Layout> lay_out(const Scene& scene, const trace::Geometry& geometry, const BakeSettings& settings, Work& work);

// Result: true once every source is finished. Errors: "stopped": what was finished by then stays; "too_large"; of
// events.finished.
Result<bool> bake(const Scene& scene, const trace::Geometry& geometry, const Layout& layout,
                  const std::vector<Source>& sources, const BakeSettings& settings, const PartStore& store,
                  const BakeEvents& events, Work& work);

// Result: mean over area of values of all texels, luminance of three channels.
double mean_over_area(const Layout& layout, std::span<const float> values, int channels);

// Result: names for files: of each text its letters, digits, - and _, others become _; at most kNameBytes; no two are
// the same, whatever the case of their letters.
std::vector<std::string> file_names(const std::vector<std::string>& texts);

}  // namespace gonio::bake
