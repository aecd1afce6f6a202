// The automatic range of a false-colour view: its upper end is metered again where the light, the camera or what is
// shown changed and rests. Render thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/base/queue.h"
#include "server/scene/light.h"
#include "server/scene/view.h"
#include "server/session/loader.h"

namespace gonio {

struct Scene;

// Nothing changed for so long: then it is metered.
inline constexpr std::int64_t kRangeRest_ns = 500'000'000;

class AutoRange {
public:
    using Meter = std::function<std::optional<double>(const Scene&, View)>;

    // The loader meters, in a value copy of the scene. wake: from its thread, when that is done.
    AutoRange(Loader& loader, std::function<void()> wake, Meter meter);

    // Once a turn: begins what is due. Result: the upper end of the range of the scene's view, where it is another one
    // than the scene's; lx or cd/m².
    std::optional<double> tend(const Scene& scene, std::int64_t now_ns);

private:
    // What is metered.
    struct Subject {
        Revision newest = 0;
        View view = View::beauty;
        std::string only;
        bool operator==(const Subject&) const = default;
    };
    struct Answer {
        std::optional<double> high;
    };
    static Subject subject_of(const Scene& scene);

    Loader& loader_;
    std::function<void()> wake_;
    Meter meter_;
    std::shared_ptr<Latest<Answer>> answers_ = std::make_shared<Latest<Answer>>();
    bool asked_ = false;
    Subject seen_, metered_;
    std::int64_t changed_ns_ = 0;
};

}  // namespace gonio
