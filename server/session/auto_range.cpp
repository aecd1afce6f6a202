#include "server/session/auto_range.h"

#include <algorithm>
#include <new>
#include <utility>

#include "server/scene/false_color.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"
#include "server/scene/shown_scene.h"

namespace gonio {

AutoRange::AutoRange(Loader& loader, std::function<void()> wake, Meter meter)
    : loader_(loader), wake_(std::move(wake)), meter_(std::move(meter)) {}

AutoRange::Subject AutoRange::subject_of(const Scene& scene) {
    Subject subject{std::max({scene.geometry_rev, scene.camera_rev, scene.lights_rev, scene.master_rev}), scene.view,
                    scene.view_only};
    for (const Light& light : scene.lights) subject.newest = std::max(subject.newest, newest_rev(light));
    return subject;
}

std::optional<double> AutoRange::tend(const Scene& scene, std::int64_t now_ns) {
    const auto answer = answers_->try_take();
    if (answer) asked_ = false;
    const bool wanted = is_false_color(scene.view) && false_color_of(scene, scene.view).range_auto &&
                        !shows_difference(scene, scene.view);
    if (!wanted) {
        metered_ = {};
        return std::nullopt;
    }
    const Subject subject = subject_of(scene);
    if (!(subject == seen_)) {
        const bool only_light = subject.view == seen_.view && subject.only == seen_.only;
        seen_ = subject;
        if (only_light) changed_ns_ = now_ns;
    }
    if (answer && answer->high && metered_ == subject && *answer->high != false_color_of(scene, scene.view).range_high)
        return answer->high;
    if (asked_ || metered_ == subject || now_ns - changed_ns_ < kRangeRest_ns) return std::nullopt;
    asked_ = loader_.submit(
        [scene = shown_scene(scene, scene.view).value_or(scene), meter = meter_, answers = answers_, wake = wake_] {
            Answer found;
            try {
                found.high = meter(scene, scene.view);
            } catch (const std::bad_alloc&) {  // then the range stays
            }
            answers->put(found);
            wake();
        });
    if (asked_) metered_ = subject;
    return std::nullopt;
}

}  // namespace gonio
