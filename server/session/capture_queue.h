// Captures that are rendered one after the other, and those that wait for their revision. Render thread.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "server/session/guarded_renderer.h"
#include "server/session/late_work.h"
#include "server/session/loader.h"
#include "server/session/query.h"
#include "server/session/replies.h"

namespace gonio {

inline constexpr std::size_t kMaxCaptures = 8;       // default of set_most()
inline constexpr std::size_t kMaxLateCaptures = 64;  // that wait for their revision; beyond it: "busy"
inline constexpr std::chrono::seconds kMaxWait{30};  // of a capture for its revision; then: "timeout"

class CaptureQueue {
public:
    // The loader encodes the pictures and sends them: its thread.
    CaptureQueue(Loader& loader, Replies::Send send) : loader_(loader), send_(std::move(send)) {}

    // Beyond so many: "busy".
    void set_most(std::size_t most) { most_ = most; }
    // The capture is of the scene as it is now. warning: goes with the answer; empty: none.
    void add(const Work& work, const Scene& scene, const CaptureRequest& request, const GuardedRenderer& renderer,
             Replies& replies, std::string warning = {});
    // The capture asks for a later revision: take_due() gives it back when that is there. Who waited too long is
    // refused by refuse_overdue().
    void add_late(const Work& work, Replies& replies);
    std::optional<Work> take_due(Revision now) { return late_.take_due(now); }
    void refuse_overdue(Replies& replies);
    // All begin anew.
    void restart(const GuardedRenderer& renderer);
    // Renders one tile of the oldest, and tells those who wait how far it is: every half second. Result: whether there
    // is more to do at once; else none waits, or the oldest waits for light that other threads make.
    bool advance(GuardedRenderer& renderer, Replies& replies);
    void forget_session(std::uint32_t session);
    // Result: whether there was such a capture, which is given up; its answer is the caller's.
    bool cancel(std::uint32_t session, std::uint32_t request_id);
    bool empty() const { return waiting_.empty(); }
    // Result: the asset of the scene that is captured next; null: none is.
    const SceneAsset* next_asset() const { return empty() ? nullptr : waiting_.front().job->scene.asset.get(); }
    std::uint32_t rendered() const { return rendered_; }

private:
    struct Capturing {
        Work work;
        std::string format;
        bool legend;
        std::string warning;
        std::unique_ptr<CaptureJob> job;
    };
    void answer(Replies& replies);
    void tell_progress();
    Loader& loader_;
    Replies::Send send_;
    std::size_t most_ = kMaxCaptures;
    std::uint32_t rendered_ = 0;
    std::deque<Capturing> waiting_;
    std::int64_t began_ns_ = 0, tell_ns_ = 0;  // the oldest is being rendered since; when to tell
    LateWork<Work> late_{kMaxLateCaptures, kMaxWait};
};

}  // namespace gonio
