// The figures of the isolux lines that the live picture shows. Render thread.
#pragma once

#include "server/scene/light.h"
#include "server/session/guarded_renderer.h"
#include "server/session/loader.h"
#include "server/session/replies.h"

namespace gonio {

struct Scene;

// Answers an IsoluxQuery, from the loader: with no figures where the picture shows no lines, or was rendered of another
// revision than the scene's. rendered: that of the last begin_frame(). Errors: "busy".
void answer_isolux(const Work& work, const Scene& scene, Revision rendered, GuardedRenderer& renderer, Loader& loader,
                   Replies& replies);

}  // namespace gonio
