// The automatic exposure: meters the scene again where its luminaires, their places or the camera changed and rest, and
// brings the picture there within a second. Levels are to be seen as they are ridden: they count only where all was out
// when it was metered. Render thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "server/base/queue.h"
#include "server/scene/light.h"
#include "server/session/loader.h"

namespace gonio {

struct Scene;

// Nothing of the light or the camera moved for so long: then it is metered.
inline constexpr std::int64_t kMeteringRest_ns = 1'000'000'000;
// Less than this off, the exposure stays: EV.
inline constexpr double kExposureSlack_ev = 2.0;
inline constexpr std::int64_t kExposureGlide_ns = 1'000'000'000;

class AutoExposure {
public:
    using Meter = std::function<std::optional<double>(const Scene&)>;

    // metered: its exposure suits it. The loader meters, in a value copy of the scene. wake: from its thread, when that
    // is done.
    AutoExposure(const Scene& metered, Loader& loader, std::function<void()> wake, Meter meter);

    // Once a turn: begins what is due. A scene that was loaded has been metered.
    void tend(const Scene& scene, std::int64_t now_ns);
    // With the next turn it is metered, and no difference is too small.
    void ask() { at_once_ = true; }
    bool gliding() const { return to_.has_value(); }
    // Before a frame. Where all was out when it was metered, and something shines now, that frame already has its
    // exposure: EV100, metered at once, which takes some 50 ms. As long as levels rise from there, the exposure follows
    // them.
    std::optional<double> first_light(const Scene& scene, std::int64_t now_ns);
    // Result: the exposure of now while it glides, EV100.
    std::optional<double> step(std::int64_t now_ns);

private:
    struct Answer {
        Revision geometry_rev = 0;  // of the scene that was metered
        std::optional<double> ev100;
    };
    void take_answer(const Scene& scene, std::int64_t now_ns);
    void note_metered(const Scene& scene);

    Loader& loader_;
    std::function<void()> wake_;
    Meter meter_;
    std::shared_ptr<Latest<Answer>> answers_ = std::make_shared<Latest<Answer>>();
    bool automatic_, asked_ = false, at_once_ = false;
    Revision looked_rev_, geometry_rev_;
    bool dark_;                  // all luminaires were out when it was metered
    Revision newest_, metered_;  // of the scene; of what is metered in it
    std::int64_t changed_ns_ = 0, began_ns_ = 0;
    double from_ = 0.0;
    std::optional<double> to_;
    // Since light came into the dark: what was metered, of how much light, and when that changed last.
    struct Rise {
        double ev100, light_lm;
        std::int64_t changed_ns;
    };
    std::optional<Rise> rise_;
};

}  // namespace gonio
