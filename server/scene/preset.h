// Presets: what the lights of a scene look like, under a name; and the way from one look to another over time. Pure:
// time is a parameter.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/light.h"
#include "server/scene/light_values.h"

namespace gonio {

struct Scene;

inline constexpr double kMaxFade_s = 3600.0;

// Result: the lights as they are.
Preset preset_of(const Scene& scene);

// Result: the numbers of a property on their way: ratio 0 is `from`, 1 is `to`. Between a colour temperature and none
// they go by way of the white that none means.
Numbers between(const LightRow& light_row, const Numbers& from, const Numbers& to, double ratio);

// A recall that takes time. What another hand moves meanwhile (it is not where the fade left it) leaves the fade.
class Fade {
public:
    Fade() = default;
    // Begins at now_ns with the scene as it is; `to` is recalled after fade_s (> 0).
    Fade(const Scene& scene, const Preset& to, double fade_s, std::int64_t now_ns);

    bool running() const { return !parts_.empty(); }
    // Result: the commands that bring the scene to where it shall be at now_ns; after the end none is left to come.
    std::vector<v1::Command> step(const Scene& scene, std::int64_t now_ns);
    // The light has another name now.
    void follow(const std::string& name, const std::string& new_name);

private:
    // One property of one light.
    struct Part {
        std::string light;
        const LightRow* light_row;
        Numbers from, to, said;
    };
    std::vector<Part> parts_;  // in the order of the lights
    std::int64_t began_ns_ = 0;
    double fade_s_ = 0;
};

}  // namespace gonio
