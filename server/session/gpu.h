// The GL context and the renderer in it, made and, when the GPU loses them, made anew. Render thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "server/gl/context.h"
#include "server/render/live_renderer.h"

namespace gonio {

inline constexpr std::size_t kMostFailedRebuilds = 3;             // within kRebuildWindowNs; then the program ends
inline constexpr std::int64_t kRebuildWindowNs = 60'000'000'000;  // 1 min

// What tests let go wrong (`goniod --inject`).
struct GpuFaults {
    unsigned loss_after = 0;     // the context is lost once, after so many pictures; 0: never
    unsigned loss_every = 0;     // again and again, after so many pictures each time
    unsigned rebuild_fails = 0;  // so many attempts to make another one fail
};
// spec: "gl-loss-after=N", "gl-loss-every=N" or "gl-rebuild-fails=N". Throws std::invalid_argument.
void add_fault(GpuFaults& faults, const std::string& spec);

class Gpu {
public:
    struct Made {
        std::unique_ptr<gl::Context> context;  // null: the renderer needs none
        std::unique_ptr<LiveRenderer> renderer;
    };
    // make throws std::runtime_error where there is no GPU; so does this.
    explicit Gpu(std::function<Made()> make, const GpuFaults& faults = {});

    const gl::Context* context() const { return made_.context.get(); }
    std::unique_ptr<LiveRenderer> take_renderer() { return std::move(made_.renderer); }
    // Result: whether the context is lost: what its renderer gives is void.
    bool lost() const;
    // A picture of the renderer is in memory: the context works.
    void picture_done();
    // Makes another context; the old renderer is gone by now. pause: lets a second pass between two attempts; false: to
    // be given up. Result: the new renderer; null where it was given up. Throws std::runtime_error after
    // kMostFailedRebuilds failures in the window; a context that is lost before its first picture is one.
    // lost: else the context was good, and is no failure.
    std::unique_ptr<LiveRenderer> rebuild(const std::function<bool()>& pause, bool lost = true);

private:
    void note_failure(const std::string& why);

    std::function<Made()> make_;
    GpuFaults faults_;
    Made made_;
    unsigned pictures_ = 0;  // of this context
    bool rebuilt_ = false;
    std::deque<std::int64_t> failures_ns_;
};

}  // namespace gonio
