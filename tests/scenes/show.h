// A scene's live picture to the end, and what a frame of it took.
#pragma once

#include <set>
#include <string>

#include "server/render/renderer.h"

namespace gonio::test {

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
