// The renderer, whose GPU may be lost in any call: what it made meanwhile is void. Render thread.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "server/render/live_renderer.h"

namespace gonio {

inline const Error kGpuLost{"unavailable", "", "", "the GPU was lost"};  // while there is no renderer

class GuardedRenderer {
public:
    GuardedRenderer(std::unique_ptr<LiveRenderer> renderer, std::function<bool()> gpu_lost)
        : renderer_(std::move(renderer)), gpu_lost_(std::move(gpu_lost)) {}

    GuardedRenderer& operator=(std::unique_ptr<LiveRenderer> renderer) {
        renderer_ = std::move(renderer);
        return *this;
    }
    explicit operator bool() const { return renderer_ != nullptr; }
    LiveRenderer* operator->() const { return renderer_.get(); }
    bool lost() const { return gpu_lost_(); }
    // Runs what needs the GPU. Result: whether it was there.
    template <typename Draw>
    bool draws(const Draw& draw) const {
        try {
            draw();
        } catch (const std::exception&) {  // a program that did not link, say
            if (!gpu_lost_()) throw;
            return false;
        }
        return !gpu_lost_();
    }
    // LiveRenderer::ready(). It says nothing of the GPU: what draws afterwards finds out.
    Readiness ready(const Scene& scene) {
        Readiness there = Readiness::none;
        draws([&] { there = renderer_->ready(scene); });
        return there;
    }

private:
    std::unique_ptr<LiveRenderer> renderer_;
    std::function<bool()> gpu_lost_;
};

}  // namespace gonio
