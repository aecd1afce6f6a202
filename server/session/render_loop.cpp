#include "server/session/render_loop.h"

#include <algorithm>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio {

HttpServer::Callbacks Inbox::callbacks() {
    return {
        [this](SessionId session, v1::ClientMessage message) {
            return queue.push({.session = session, .message = std::move(message)});
        },
        [this](Demand newest) {
            demands.put(std::move(newest));
            queue.wake(Queue<Work>::Wake::soon);
        },
        [this](SessionId session) {
            if (queue.push({.session = session, .closed = true})) return;
            left.merge([&](std::set<SessionId>& sessions) { sessions.insert(session); });
            queue.wake();
        },
        [this](SessionId session, v1::Identify identify) {
            Work work{.session = session};
            *work.message.mutable_identify() = std::move(identify);
            return queue.push(std::move(work));
        },
    };
}

RenderLoop::Plan RenderLoop::plan(std::int64_t now_ns) {
    Plan plan;
    plan.viewer = feed_.wanted();
    const bool moves = surface_input_.waiting() || render_session_.fading();
    // Somebody must be able to take a picture: a viewer with credit, or a report that is waited for.
    plan.due = ((render_session_.frame_wanted() || moves) && plan.viewer) || render_session_.report_wanted();
    plan.wait_ns = plan.due ? std::max<std::int64_t>(0, last_begin_ns_ + frame_ns_ - now_ns) : 0;
    render_session_.set_watched(feed_.watched());
    plan.refining = render_session_.refinable() && render_session_.rests() && plan.viewer && !plan.due &&
                    !render_session_.fading() && !consoles_.anything_waits();
    return plan;
}

std::optional<Work> RenderLoop::wait(const Plan& plan, std::int64_t now_ns) {
    if ((plan.due && plan.wait_ns == 0) || render_session_.busy()) return inbox_.queue.try_pop();
    if (render_session_.waits()) return inbox_.queue.pop_for(std::chrono::milliseconds(2));
    if (plan.refining) return inbox_.queue.pop_for(std::chrono::nanoseconds(0));
    if (render_session_.frames_in_flight()) return inbox_.queue.pop_for(std::chrono::milliseconds(1));
    const std::int64_t frame_ns = plan.due ? plan.wait_ns
                                  : render_session_.fading()
                                      ? std::clamp<std::int64_t>(last_moved_ns_ + frame_ns_ - now_ns, 0, frame_ns_)
                                      : std::int64_t{250'000'000};
    return inbox_.queue.pop_for(std::chrono::nanoseconds(
        std::min({frame_ns, std::max<std::int64_t>(render_session_.fade_in_ns(now_ns), 1'000'000),
                  consoles_.sleep_ns(now_ns), plan.due ? plan.wait_ns : surface_input_.sleep_ns(now_ns),
                  feed_.rest_in_ns(now_ns), std::max<std::int64_t>(render_session_.rest_in_ns(), 1'000'000)})));
}

// Ends before the queue is empty where that takes long: a frame that is due comes first then.
void RenderLoop::drain(std::optional<Work> first) {
    constexpr std::int64_t kDrainNs = 10'000'000;
    const std::int64_t began_ns = monotonic_ns();
    const auto left = inbox_.left.try_take();  // before what they said is drained
    for (std::optional<Work> work = std::move(first); work; work = inbox_.queue.try_pop()) {
        render_session_.take(std::move(*work));
        if (monotonic_ns() - began_ns <= kDrainNs) continue;
        if (left)
            inbox_.left.merge([&](std::set<SessionId>& sessions) { sessions.insert(left->begin(), left->end()); });
        return;
    }
    for (const SessionId session : left.value_or(std::set<SessionId>()))
        render_session_.take({.session = session, .closed = true});
}

void RenderLoop::turn() {
    const std::int64_t now_ns = monotonic_ns();
    const Plan plan = this->plan(now_ns);
    std::optional<Work> work = wait(plan, now_ns);
    const std::int64_t drained_ns = monotonic_ns();
    drain(std::move(work));
    consoles_.serve(render_session_, drained_ns);
    // Hands and fades move the scene right before a frame, so that it holds the newest; without one as often.
    const bool starts = plan.due && plan.wait_ns == 0;
    if (starts || (!plan.due && drained_ns - last_moved_ns_ >= frame_ns_)) {
        last_moved_ns_ = drained_ns;
        render_session_.advance_fade(drained_ns);
        surface_input_.serve(render_session_, drained_ns);
    }
    if (auto demand = inbox_.demands.try_take()) {
        inbox_.demand = std::move(*demand);
        feed_.want(inbox_.demand.lanes, inbox_.demand.jpeg, inbox_.demand.jpeg_clients);
    }
    if (starts && (render_session_.frame_wanted() || render_session_.report_wanted())) {
        last_begin_ns_ = drained_ns;
        render_session_.begin_frame(drained_ns);
    }
    const bool more = render_session_.frame_wanted() && plan.viewer;
    render_session_.finish_frames(!more && render_session_.frames_in_flight());
    // A viewer that joined or fell behind is served from the newest picture, as a key frame.
    feed_.serve(monotonic_ns(), more, render_session_.complete());
    render_session_.continue_work();
    if (plan.refining && render_session_.refinable() && !render_session_.busy())
        render_session_.refine();  // what was drained may have changed it
}

}  // namespace gonio
