#include "server/session/meter_queue.h"

#include "server/session/meter_reply.h"

namespace gonio {

// Live frames wait no longer than this and one point.
static constexpr std::int64_t kSliceNs = 8'000'000;

void MeterQueue::add(const Work& work, const Scene& scene, MeterRequest request, Replies& replies) {
    wait({work, scene, std::move(request), {}, {}}, replies);
}

void MeterQueue::add(const Work& work, const Scene& scene, Picked picked, Replies& replies) {
    MeterRequest request;
    request.points.push_back(picked.point);
    wait({work, scene, std::move(request), {}, std::move(picked)}, replies);
}

void MeterQueue::wait(Metering metering, Replies& replies) {
    if (waiting_.size() >= kMaxMeters) return replies.busy(metering.work, "too many meters are waiting");
    waiting_.push_back(std::move(metering));
}

void MeterQueue::advance(GuardedRenderer& renderer, const Replies& replies) {
    const std::int64_t started_ns = monotonic_ns();
    if (!waiting_.empty() && !renderer.ready(waiting_.front().scene)) return;
    for (; !waiting_.empty(); waiting_.pop_front()) {
        auto& [work, scene, request, readings, picked] = waiting_.front();
        const auto quality =
            request.quality == Quality::rsm ? LiveRenderer::MeterQuality::rsm : LiveRenderer::MeterQuality::interactive;
        while (readings.size() < request.points.size()) {
            if (monotonic_ns() - started_ns > kSliceNs) return;
            const trace::MeterPoint& point = request.points[readings.size()];
            v1::MeterReading reading;
            const bool there = renderer.draws([&, &scene = scene, &request = request] {
                reading = renderer->meter(scene, point.position, point.normal, quality, request.settings.bounces);
            });
            if (!there) return;  // goes on with the next renderer
            readings.push_back(std::move(reading));
        }
        if (picked)
            replies.answer(work, message_of(&v1::ServerMessage::mutable_pick, with_reading(*picked, readings.front())));
        else
            replies.answer(work, meter_message(std::move(readings), request.grid));
    }
}

void MeterQueue::forget_session(std::uint32_t session) {
    std::erase_if(waiting_, [&](const Metering& metering) { return metering.work.session == session; });
}

bool MeterQueue::cancel(std::uint32_t session, std::uint32_t request_id) {
    return std::erase_if(waiting_, [&](const Metering& metering) {
               return metering.work.session == session && metering.work.message.request_id() == request_id;
           }) > 0;
}

}  // namespace gonio
