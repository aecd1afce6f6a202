// A scene's live picture to the end.
#pragma once

#include "server/render/renderer.h"

namespace gonio::test {

// Renders live frames of a scene until the picture is all there is to come: of several luminaires more than one.
inline void show(Renderer& renderer, const Scene& scene) {
    do {
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    } while (!renderer.settled());
}

}  // namespace gonio::test
