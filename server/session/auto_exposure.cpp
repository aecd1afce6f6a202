#include "server/session/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

namespace gonio {

// Result: the newest revision of what a meter sees.
static Revision newest_of(const Scene& scene) {
    Revision newest = std::max({scene.geometry_rev, scene.camera_rev, scene.lights_rev, scene.master_rev});
    for (const Light& light : scene.lights)
        newest = std::max({newest, light.position_rev, light.aim_rev, light.profile_rev, light.level_rev});
    return newest;
}

AutoExposure::AutoExposure(const Scene& metered, Loader& loader, std::function<void()> wake, Meter meter)
    : loader_(loader),
      wake_(std::move(wake)),
      meter_(std::move(meter)),
      automatic_(metered.exposure_auto),
      looked_rev_(metered.scene_rev),
      geometry_rev_(metered.geometry_rev),
      newest_(newest_of(metered)),
      metered_(newest_) {}

void AutoExposure::tend(const Scene& scene, std::int64_t now_ns) {
    if (looked_rev_ != scene.scene_rev) {
        looked_rev_ = scene.scene_rev;
        automatic_ = scene.exposure_auto;
        if (!automatic_) {
            to_.reset();
            at_once_ = false;
        }
        if (const Revision newest = newest_of(scene); newest != newest_) {
            newest_ = newest;
            changed_ns_ = now_ns;
        }
        if (scene.geometry_rev != geometry_rev_) {
            geometry_rev_ = scene.geometry_rev;
            metered_ = newest_;
            to_.reset();
        }
    }
    take_answer(scene, now_ns);
    if (!automatic_ || asked_) return;
    if (!at_once_ && (newest_ == metered_ || now_ns - changed_ns_ < kMeteringRest_ns)) return;
    asked_ = loader_.submit([scene, meter = meter_, answers = answers_, wake = wake_] {
        Answer answer;
        try {
            answer.ev100 = meter(scene);
        } catch (const std::bad_alloc&) {  // then the exposure stays
        }
        answers->put(answer);
        wake();
    });
    if (asked_) metered_ = newest_;
}

void AutoExposure::take_answer(const Scene& scene, std::int64_t now_ns) {
    const auto answer = answers_->try_take();
    if (!answer) return;
    asked_ = false;
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
