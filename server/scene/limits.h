// How much a scene may hold, and by which code a command that would put in more is refused.
#pragma once

#include <cstddef>

namespace gonio {

inline constexpr double kMostMultiplier = 1e9;
inline constexpr std::size_t kMaxLights = 1024;                         // one more is refused: "too_many_lights"
inline constexpr std::size_t kMaxGroups = 64;                           // likewise "too_many_groups"
inline constexpr std::size_t kMaxPresets = 256;                         // likewise "too_many_presets"
inline constexpr std::size_t kMaxCues = 1000;                           // likewise "too_many_cues"
inline constexpr std::size_t kMaxCueLights = kMaxPresets * kMaxLights;  // that all cues keep: "too_large"
inline constexpr std::size_t kMaxSavedViews = 64;                       // likewise "too_many_views"
inline constexpr std::size_t kMaxGrids = 64;                            // likewise "too_many_grids"
inline constexpr std::size_t kMaxObservers = 16;                        // likewise "too_many_observers"
inline constexpr std::size_t kMaxNameBytes = 128;
// Lights of which a picture keeps each one's irradiance apart. The seed technique does of all, in 20 bytes a pixel: a
// size or light that would take more than this in all is refused: "too_large".
inline constexpr std::size_t kMostLayers = 64;
inline constexpr std::size_t kLayerBytesPerPixel = 20;
inline constexpr std::size_t kMaxLayerBytes = std::size_t{4} << 30;

}  // namespace gonio
