// A renderer for tests; a scene's live picture to the end, and what a frame of it took.
#pragma once

#include <set>
#include <string>

#include "server/render/renderer.h"

namespace gonio::test {

// For what does not depend on how many surfels and links there are, which passes run and direct light, and for bounds
// that hold with few of them.
inline void make_coarse(Renderer& renderer) {
    renderer.set_surfels({0.06, 1000, 4000});
    renderer.set_links(128);
}

// Renders live frames of a scene until the picture is all there is to come: of several luminaires more than one.
inline void show(Renderer& renderer, const Scene& scene) {
    do {
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    } while (!renderer.settled());
}

// Result: names of the passes that ran in a frame.
inline std::set<std::string> passes_run(const v1::FrameReport& report) {
    std::set<std::string> ran;
    for (const v1::PassReport& row : report.passes()) {
        if (row.state() == "ran") ran.insert(row.name());
    }
    return ran;
}

}  // namespace gonio::test
