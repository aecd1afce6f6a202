#include "server/session/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/white.h"

namespace gonio {

namespace {

// Result: the newest revision of what is metered again where it changes. levels: they are too.
Revision newest_of(const Scene& scene, bool levels) {
    Revision newest = std::max({scene.geometry_rev, scene.camera_rev, scene.lights_rev});
    for (const Light& light : scene.lights)
        newest = std::max({newest, light.position_rev, light.aim_rev, light.profile_rev, levels ? light.level_rev : 0});
    return levels ? std::max(newest, scene.master_rev) : newest;
}

// Result: the scene with all strobes on.
Scene without_flashes(Scene scene) {
    for (Light& light : scene.lights) light.flash_off = false;
    return scene;
}

bool is_dark(const Scene& asked) {
    const Scene scene = without_flashes(asked);
    return std::all_of(scene.lights.begin(), scene.lights.end(),
                       [&](const Light& light) { return light_weight(scene, light) == glm::dvec3(0.0); });
}

}  // namespace

AutoExposure::AutoExposure(const Scene& metered, Loader& loader, std::function<void()> wake, Meter meter)
    : loader_(loader),
      wake_(std::move(wake)),
      meter_(std::move(meter)),
      automatic_(metered.exposure_auto),
      looked_rev_(metered.scene_rev),
      geometry_rev_(metered.geometry_rev),
      dark_(is_dark(metered)),
      newest_(newest_of(metered, dark_)),
      metered_(newest_) {}

void AutoExposure::tend(const Scene& scene, std::int64_t now_ns) {
    if (looked_rev_ != scene.scene_rev) {
        looked_rev_ = scene.scene_rev;
        automatic_ = scene.exposure_auto;
        if (!automatic_) {
            to_.reset();
            at_once_ = false;
        }
        if (const Revision newest = newest_of(scene, dark_); newest != newest_) {
            newest_ = newest;
            changed_ns_ = now_ns;
        }
        if (scene.geometry_rev != geometry_rev_) {
            geometry_rev_ = scene.geometry_rev;
            note_metered(scene);
            to_.reset();
            rise_.reset();
        }
    }
    take_answer(scene, now_ns);
    if (!automatic_ || asked_) return;
    if (!at_once_ && (newest_ == metered_ || now_ns - changed_ns_ < kMeteringRest_ns)) return;
    asked_ = loader_.submit([scene = without_flashes(scene), meter = meter_, answers = answers_, wake = wake_] {
        Answer answer{scene.geometry_rev, std::nullopt};
        try {
            answer.ev100 = meter(scene);
        } catch (const std::bad_alloc&) {  // then the exposure stays
        }
        answers->put(answer);
        wake();
    });
    if (asked_) note_metered(scene);
}

// Result: the flux of all luminaires as they are dimmed, lm; of suns their lux.
static double light_of(const Scene& scene) {
    double sum_lm = 0.0;
    for (const Light& light : scene.lights)
        sum_lm += luminance_of(light_weight(scene, light)) * (light.sun ? 1.0 : light.shining()->flux_lm);
    return sum_lm;
}

std::optional<double> AutoExposure::first_light(const Scene& scene, std::int64_t now_ns) {
    if (!scene.exposure_auto || scene.geometry_rev != geometry_rev_ || looked_rev_ == scene.scene_rev) return {};
    if (rise_ && now_ns - rise_->changed_ns > kMeteringRest_ns) rise_.reset();
    const Scene shining = without_flashes(scene);
    if (rise_) {
        const double light_lm = light_of(shining);
        if (!(light_lm > 0.0)) return rise_.reset(), std::nullopt;
        if (light_lm == rise_->light_lm) return {};
        rise_ = Rise{rise_->ev100 + std::log2(light_lm / rise_->light_lm), light_lm, now_ns};
        return rise_->ev100;
    }
    if (!dark_ || is_dark(scene)) return {};
    std::optional<double> ev100;
    try {
        ev100 = meter_(shining);
    } catch (const std::bad_alloc&) {  // then the exposure stays
    }
    note_metered(scene);
    to_.reset();
    if (ev100) rise_ = Rise{*ev100, light_of(shining), now_ns};
    return ev100;
}

void AutoExposure::note_metered(const Scene& scene) {
    dark_ = is_dark(scene);
    metered_ = newest_ = newest_of(scene, dark_);
}

void AutoExposure::take_answer(const Scene& scene, std::int64_t now_ns) {
    const auto answer = answers_->try_take();
    if (!answer) return;
    asked_ = false;
    if (answer->geometry_rev != geometry_rev_) return;  // of a scene that was replaced meanwhile
    const bool at_once = std::exchange(at_once_, false);
    // Of a scene that moved on meanwhile it is asked again.
    if (!automatic_ || metered_ != newest_ || !answer->ev100) return;
    if (!at_once && std::abs(*answer->ev100 - scene.exposure_ev100) < kExposureSlack_ev) return;
    from_ = scene.exposure_ev100;
    to_ = answer->ev100;
    began_ns_ = now_ns;
}

std::optional<double> AutoExposure::step(std::int64_t now_ns) {
    if (!to_) return std::nullopt;
    const double to = *to_, share = std::clamp(static_cast<double>(now_ns - began_ns_) / kExposureGlide_ns, 0.0, 1.0);
    if (share >= 1.0) to_.reset();
    return from_ + (to - from_) * share * share * (3.0 - 2.0 * share);
}

}  // namespace gonio
