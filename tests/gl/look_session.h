// A scene as a viewer has it, at the default setting and the default size, and what the path tracer sees of it: exact
// direct light and every bounce at the centres of pixels, in windows of the picture that show each kind of place.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/scene.h"
#include "tests/gl/flip.h"

namespace gonio::test {

// Pixels, rows from the bottom; multiples of 16.
struct Window {
    int left, bottom, width, height;
};

// Arrays hold a value a pixel of the window, rows from the bottom.
struct Traced {
    Window window;
    std::vector<std::uint8_t> hit;  // whether there is a surface
    std::vector<glm::vec3> position, normal, albedo;
    std::vector<glm::vec3> direct_lx;
    std::vector<glm::vec3> half_lx[2];   // every bounce, of independent samples
    std::vector<glm::vec3> indirect_lx;  // mean of the halves
    std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * window.width + x); }
};

class LookSession {
public:
    explicit LookSession(const std::string& scene);  // cornell or atrium

    Scene home;
    // The camera turned about its target, the luminaire shifted.
    Scene moved(double turn_rad, double shift_m) const;

    // The whole picture, shown by a renderer that goes on from what was shown before.
    Picture live(const Scene& scene, View view);
    // Indirect light of the whole picture, lux, rows from the bottom.
    std::vector<glm::vec3> live_lx(const Scene& scene);

    // Of windows first to last.
    std::vector<Traced> traced(const Scene& scene, std::size_t first, std::size_t last) const;
    // Of `home`, all windows: made once for all tests.
    const std::vector<Traced>& traced_home() const;

private:
    Scene stamped(Scene scene, View view);

    std::string name_;
    std::vector<Window> windows_;
    Renderer renderer_;
    Revision revision_ = 1;
};

// Tests of a scene's look, in a process for each scene: what was traced and the links are made once.
struct Look : testing::TestWithParam<const char*> {
    Look() : session(GetParam()), truth(session.traced_home()) {}

    LookSession session;
    const std::vector<Traced>& truth;
};

// Result: what a display shows of a window, in view beauty or indirect, with this indirect light.
Picture shown_of(const Traced& traced, const std::vector<glm::vec3>& indirect_lx, const Scene& scene, View view);
// Result: a window of a picture whose rows come from the top.
Picture part_of(const Picture& whole, const Window& window);

}  // namespace gonio::test
