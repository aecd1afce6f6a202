#include "server/session/meter_queue.h"

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/gl/program.h"
#include "server/scene/scene.h"
#include "server/session/meter_reply.h"
#include "server/trace/cylinder.h"

namespace gonio {

// Live frames wait no longer than this and one point.
static constexpr std::int64_t kSliceNs = 8'000'000;

void MeterQueue::add(const Work& work, const Scene& scene, MeterRequest request, Replies& replies) {
    wait({.work = work, .scene = scene, .request = std::move(request)}, replies);
}

void MeterQueue::add(const Work& work, const Scene& scene, Picked picked, Replies& replies) {
    MeterRequest request;
    request.points.push_back(picked.point);
    wait({.work = work, .scene = scene, .request = std::move(request), .picked = std::move(picked)}, replies);
}

void MeterQueue::wait(Metering metering, Replies& replies) {
    if (waiting_.size() >= kMaxMeters) return replies.busy(metering.work, "too many meters are waiting");
    waiting_.push_back(std::move(metering));
}

// The mean over the point's planes. Of luminaires a cylinder has its own formula: they are no light that changes
// slowly.
void MeterQueue::finish_point(Metering& metering, const trace::MeterPoint& point) {
    v1::MeterReading reading = mean_reading(metering.around);
    metering.around.clear();
    if (point.by != trace::Receives::plane) {
        if (!metering.world) {
            auto world = std::make_shared<trace::World>();
            world->geometry = trace::geometry_of(metering.scene);
            world->luminaires = trace::luminaires_of(metering.scene, *world->geometry);
            metering.world = std::move(world);
        }
        glm::dvec3 missing_lx = trace::cylinder_direct(*metering.world, point);
        const glm::vec3 at = metering.world->geometry->local(point.position);
        for (const trace::MeterPoint& plane : trace::planes_of(point)) {
            const glm::vec3 normal(plane.normal);
            const trace::Receiver receiver = trace::receiver_of(*metering.world->geometry, {at, normal, normal});
            missing_lx -=
                glm::dvec3(trace::luminaires_direct(*metering.world, receiver, nullptr)) / double{trace::kAzimuths};
        }
        reading = with_direct(std::move(reading), missing_lx);
    }
    metering.readings.push_back(std::move(reading));
}

bool MeterQueue::advance(const Scene& now, GuardedRenderer& renderer, Replies& replies) {
    const std::int64_t until_ns = monotonic_ns() + kSliceNs;
    const SceneAsset* const asset = next_asset();  // of another one the renderer is told first: set_awaited()
    while (!waiting_.empty() && next_asset() == asset && monotonic_ns() < until_ns) {
        const Metering& metering = waiting_.front();
        const Readiness there = renderer.ready(metering.scene);
        const bool patient =
            metering.scene.asset == now.asset || monotonic_ns() - metering.asked_ns < patience_.count();
        if (there == Readiness::none || (there == Readiness::part && patient)) return false;
        if (advance_first(renderer, replies, until_ns)) waiting_.pop_front();
    }
    return !waiting_.empty();
}

// Reads points of the oldest meter until that time. Result: whether that meter is answered.
bool MeterQueue::advance_first(GuardedRenderer& renderer, Replies& replies, std::int64_t until_ns) {
    Metering& metering = waiting_.front();
    auto& [work, asked_ns, scene, request, readings, around, world, picked] = metering;
    const auto quality =
        request.quality == Quality::rsm ? LiveRenderer::MeterQuality::rsm : LiveRenderer::MeterQuality::interactive;
    while (readings.size() < request.points.size()) {
        if (monotonic_ns() > until_ns) return false;
        const trace::MeterPoint& point = request.points[readings.size()];
        const std::vector<trace::MeterPoint> planes = trace::planes_of(point);
        const trace::MeterPoint& plane = planes[around.size()];
        v1::MeterReading reading;
        std::string failure;
        const bool there = renderer.draws([&, &scene = scene, &request = request] {
            try {
                reading = renderer->meter(scene, plane.position, plane.normal, quality, request.settings.bounces);
            } catch (const gl::ProgramError& error) {
                failure = error.what();
            }
        });
        if (!there) return false;  // goes on with the next renderer
        if (!failure.empty()) {
            replies.refuse(work, {"unavailable", "meter", "", failure});
            return true;
        }
        around.push_back(std::move(reading));
        if (around.size() == planes.size()) finish_point(metering, point);
    }
    if (picked)
        replies.answer(work, message_of(&v1::ServerMessage::mutable_pick, with_reading(*picked, readings.front())));
    else
        replies.answer(work, request.answer ? request.answer(std::move(readings))
                                            : meter_message(std::move(readings), request.grid));
    return true;
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
