// Files of control surfaces (TOML, docs/faders.md): what a surface has (a profile), and what its controls drive (a
// map). Pure; toml++ stays in the .cpp file.
#pragma once

#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/surface/surface_profile.h"

namespace gonio {

inline constexpr std::size_t kMaxSurfaceFileBytes = 1u << 20;  // more is refused: "too_large"

// Result: the profile. Errors: "bad_surface" with "line L column C" as place and the offending value; "too_large".
Result<SurfaceProfile> read_surface_profile(std::string_view text);

// Result: the map, its rows checked. Errors: likewise.
Result<v1::SetSurfaces> read_surfaces_toml(std::string_view text);

}  // namespace gonio
