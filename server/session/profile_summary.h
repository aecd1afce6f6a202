// What clients are told of a profile: figures, diagnostics, curves. Pure functions, any thread; each takes some
// milliseconds of a large web at most.
#pragma once

#include <string>

#include "protocol/schema/messages.h"
#include "server/scene/light.h"

namespace gonio {

// Result: the figures of the photometric file, and what was odd about it: at most 32 diagnostics.
v1::PhotometrySummary summary_of(const Profile& profile);
// Result: LibraryRow.curve.
std::string curve_of(const Profile& profile);
// Result: the intensities of a light in four half-planes, every 2°, and the summary of its profile.
v1::ProfileReply profile_reply(const Light& light);

}  // namespace gonio
