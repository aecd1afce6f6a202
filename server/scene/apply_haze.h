// Of apply() alone: the air. Refusals leave as Refused (apply_checks.h).
#pragma once

#include "protocol/schema/messages.h"
#include "server/scene/haze.h"

namespace gonio {

struct Scene;

void set_haze(Scene& scene, const v1::SetHaze& set);
void put_haze(const HazeValues& haze, v1::Haze& out);

}  // namespace gonio
