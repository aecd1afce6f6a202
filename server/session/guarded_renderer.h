// The renderer, whose GPU may be lost in any call: what it made meanwhile is void. Render thread.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "server/render/live_renderer.h"

namespace gonio {

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
    // Whether captures and meters of this scene can be made; what they need is being made else.
    bool ready(const Scene& scene) {
        bool there = false;
        draws([&] { there = renderer_->ready(scene); });
        waits_ = !there;
        return there;
    }
    // Whether ready() was false when it was asked last, since forget_waiting().
    bool waits() const { return waits_; }
    void forget_waiting() { waits_ = false; }

private:
    std::unique_ptr<LiveRenderer> renderer_;
    std::function<bool()> gpu_lost_;
    bool waits_ = false;
};

}  // namespace gonio
